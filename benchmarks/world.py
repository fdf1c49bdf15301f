"""Steps a second of a world with one eight-link robot: ``python benchmarks/world.py``.

Eight effects on all links (seven without added mass), ledger and a noisy IMU, steps of 4 ms.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import machine

HEIGHTS = {"in air": 5.0, "crossing": 0.0, "submerged": -5.0}
BLOCK = 100
"""Steps between resets, so that the robot stays in the medium that is measured."""


def steps_a_second(
    folder: Path, *, added_mass: bool, height: float, repeats: int
) -> tuple[float, float, float]:
    """Return median, lowest and highest steps a second over blocks of steps."""
    import scene

    from seals.run import build_world, initial_configuration

    settings = scene.settings(
        scene.chain(folder), scene.effects(added_mass=added_mass, scale=0.1), height=height
    )
    world = build_world(settings)
    start = {"robot": initial_configuration(settings, world.actors["robot"].robot)}

    def block() -> float:
        world.reset(start)
        world.step()
        begin = time.perf_counter()
        for _ in range(BLOCK):
            world.step()
        return BLOCK / (time.perf_counter() - begin)

    block()
    found = machine.median(block, repeats)
    world.close()
    return found


def main() -> None:
    """Print steps a second with and without added mass, in air, at the surface and under it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=11, help="blocks of 100 steps of each case")
    repeats = parser.parse_args().repeats
    print(machine.describe())
    print(
        f"{'world, 8 links, 8 effects, 4 ms':34} "
        f"{'steps/s':>9} {'lowest':>9} {'highest':>9} {'x real time':>12}"
    )
    with tempfile.TemporaryDirectory() as folder:
        for added_mass in (True, False):
            for name, height in HEIGHTS.items():
                speed = steps_a_second(
                    Path(folder), added_mass=added_mass, height=height, repeats=repeats
                )
                case = f"{name}, {'with' if added_mass else 'without'} added mass"
                print(
                    f"{case:34} {speed[0]:9.0f} {speed[1]:9.0f} {speed[2]:9.0f} "
                    f"{speed[0] * 0.004:12.1f}"
                )


if __name__ == "__main__":
    machine.one_thread()
    main()
