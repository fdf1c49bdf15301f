"""Speed of several hovering hexacopters in one run: ``python benchmarks/fleet.py``.

Prints, for each engine, the processor time until the first steps are made and the simulated time
by the processor time of the steps after that. A figure of one is real time on one core.
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


def measured(engine: str, robots: int, steps: int) -> tuple[float, float]:
    """Return the processor time of the start [s], and simulated over processor time after it [1].

    Args:
        engine: name of the backend.
        robots: how many.
        steps: that are timed, after the first ones.
    """
    begin = time.process_time()
    words = [f"backend={engine}", "backend.compiled=true"]
    for k in range(robots):
        place = f"initial: {{position: [{APART * k}, 0, 2], drives: carrying}}"
        words.append(f"robots.h{k}={{robot: hexacopter, guide: hover, {place}}}")
    run = run_settings(words)
    world = build_world(run)
    world.advance(FIRST)
    ready = time.process_time()
    world.advance(steps)
    spent = time.process_time() - ready
    world.close()
    return ready - begin, steps * run.time.step / spent


def main() -> None:
    """Measure both engines and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--engines", nargs="+", default=["mujoco", "pybullet"])
    given = parser.parse_args()
    print("engine, robots, processor time of the start [s], times real time")
    for engine in given.engines:
        start, share = measured(engine, given.robots, given.steps)
        print(f"{engine}, {given.robots}, {start:.1f}, {share:.2f}", flush=True)


if __name__ == "__main__":
    main()
