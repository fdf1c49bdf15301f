"""Speed of several vehicles in one run, by machine code: ``python benchmarks/fleet.py``.

Prints, for each set of vehicles with controllers and guides of their own, the processor time until
the first steps are made and the simulated time by the processor time of the steps after that. A
figure of one is real time on one core.
"""

from __future__ import annotations

import argparse
import time

from seals.run import build_world
from seals.run.build import run_settings

APART = 3.0
"""Distance of the robots from each other [m]."""
FIRST = 60
"""Steps in which all forms of a step have occurred."""
SETS = {"hexacopter": ("hexacopter",), "rov": ("rov",), "mixed": ("aam", "rov")}
"""Robots by turns, by the name of the set."""
DEEP = ("rov",)
"""Those that are under water."""
GUIDES = {
    "hover": "guide: hover",
    "waypoints": "guide: {{guide: waypoints, places: [[{x}, 1, {z}], [{x}, -1, {z}]]}}",
}
"""Guides by name: one whose aim leads to a place, and one that is asked at every step."""


def measured(engine: str, kind: str, guide: str, robots: int, steps: int) -> tuple[float, float]:
    """Return the processor time of the start [s], and simulated over processor time after it [1].

    Args:
        engine: name of the backend.
        kind: of `SETS`.
        guide: of `GUIDES`.
        robots: how many.
        steps: that are timed, after the first ones.
    """
    begin = time.process_time()
    words = [f"backend={engine}", "backend.compiled=true", "water=fossen"]
    for k in range(robots):
        robot = SETS[kind][k % len(SETS[kind])]
        x, z = APART * k, -2 if robot in DEEP else 2
        drives = "" if robot in DEEP else ", drives: carrying"
        place = f"initial: {{position: [{x}, 0, {z}]{drives}}}"
        words.append(f"robots.h{k}={{robot: {robot}, {GUIDES[guide].format(x=x, z=z)}, {place}}}")
    run = run_settings(words)
    world = build_world(run)
    world.advance(FIRST)
    ready = time.process_time()
    world.advance(steps)
    spent = time.process_time() - ready
    world.close()
    return ready - begin, steps * run.time.step / spent


def main() -> None:
    """Measure all sets and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--sets", nargs="+", choices=SETS, default=list(SETS))
    parser.add_argument("--guides", nargs="+", choices=GUIDES, default=list(GUIDES))
    parser.add_argument("--engines", nargs="+", default=["mujoco"])
    given = parser.parse_args()
    print("engine, set, guide, robots, processor time of the start [s], times real time")
    for engine in given.engines:
        for kind in given.sets:
            for guide in given.guides:
                start, share = measured(engine, kind, guide, given.robots, given.steps)
                row = f"{engine}, {kind}, {guide}, {given.robots}, {start:.1f}, {share:.2f}"
                print(row, flush=True)


if __name__ == "__main__":
    main()
