"""Speed of a robot in its window of particle water: ``python benchmarks/window.py``.

Runs what ``seals run`` would with the same words, without files and pictures, and prints where a
step spends its time. The first steps, in which kernels are compiled, are left out.

    python benchmarks/window.py robot=aam water=window wave=sea wave.height=0.2 fluid.spacing=0.04
    python benchmarks/window.py --steps 250 robot=ball water=window
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import time
from collections import defaultdict
from typing import Any

from seals.run import build_world, initial_configuration
from seals.run.build import run_settings

AAM = ["robot=aam", "water=window", "wave=sea", "wave.height=0.2", "fluid.spacing=0.04"]
BLOCK = 4
"""Steps that are timed together: the water advances by several of them at once."""
PARTS = {"_shift": "shift", "_place": "sides and bodies", "_treat": "ring", "_look": "surface"}


def timed(owner: Any, name: str, label: str, found: dict[str, float]) -> None:
    """Let a method add the time it takes to a sum."""
    method = getattr(owner, name)

    def measured(*given: Any, **named: Any) -> Any:
        start = time.perf_counter()
        out = method(*given, **named)
        found[label] += time.perf_counter() - start
        return out

    setattr(owner, name, measured)


def figures(words: list[str], steps: int, skip: int) -> dict[str, Any]:
    """Run a world for some steps and return its figures."""
    settings = run_settings(words)
    world = build_world(settings)
    world.reset({"robot": initial_configuration(settings, world.actors["robot"].robot)})
    window, step = world.fluid.simulation, world.step_size
    water, parts = window.water, defaultdict[str, float](float)
    begin = time.perf_counter()
    for _ in range(skip):
        world.step()
    start = time.perf_counter() - begin
    timed(world, "_exchange", "water in all", parts)
    timed(water.pipeline, "substep", "kernels of the substeps", parts)
    for name, label in PARTS.items():
        timed(window, name, label, parts)
    walls, cpu = [], time.process_time()
    for _ in range(steps // BLOCK):
        begin = time.perf_counter()
        for _ in range(BLOCK):
            world.step()
        walls.append((time.perf_counter() - begin) / BLOCK)
    cpu, told = time.process_time() - cpu, world.fluid.diagnostics()
    parts["robot"] = BLOCK * sum(walls) - parts.pop("water in all")
    substep = water.pipeline.current
    row = {
        "words": " ".join(words),
        "particles": int(told["particles"]),
        "samples": water.boundary_count,
        "spacings": list(window.box.counts),
        "spacing_mm": round(1e3 * water.spacing, 2),
        "substep_ms": round(1e3 * substep, 3),
        "sound_speed": round(water.sound_speed, 2),
        "sound_in_a_substep_spacings": round(water.sound_speed * substep / water.spacing, 2),
        "iterations": told["iterations"],
        "threads": len(os.sched_getaffinity(0)),
        "first_steps_s": round(start, 2),
        "step_ms": {
            "mean": round(1e3 * statistics.fmean(walls), 2),
            "median": round(1e3 * statistics.median(walls), 2),
            "least": round(1e3 * min(walls), 2),
            "processor": round(1e3 * cpu / steps, 2),
        },
        "parts_ms": {name: round(1e3 * took / steps, 2) for name, took in parts.items()},
        "of_real_time": {
            "mean": round(step / statistics.fmean(walls), 3),
            "median": round(step / statistics.median(walls), 3),
            "fastest_tenth": round(step / sorted(walls)[len(walls) // 10], 3),
        },
        "load": round(os.getloadavg()[0], 1),
    }
    world.close()
    return row


def main() -> None:
    """Print the figures, and once more as one line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("words", nargs="*", help="as of seals run")
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--skip", type=int, default=10)
    args = parser.parse_args()
    row = figures(args.words or AAM, args.steps, args.skip)
    for name, value in row.items():
        print(f"{name:28s} {value}")
    print(json.dumps(row))


if __name__ == "__main__":
    main()
