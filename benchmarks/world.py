"""Steps per second of a world with one robot: ``python benchmarks/world.py``.

Case ``chain``: eight links, eight effects on all of them (seven without added mass), ledger and a
noisy IMU. Case ``aam``: the aerial-aquatic manipulator with its rotors, servos, battery, Fossen
water, IMU, contact sensors at the finger-tips, and the controller that holds it. Steps of 4 ms.
The time is that of the processor; other programs still slow it down, so compare the highest.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import machine

HEIGHTS = {"in air": 5.0, "crossing": 0.0, "submerged": -5.0}
BLOCK = 100
"""Steps between resets, so that the robot stays in the medium that is measured."""


ADDED = ("~effects.added_mass", "~effects.arm_added_mass")
AAM = (
    "robot=aam",
    "water=fossen",
    "guide=hover",
    "+sensor@sensors.touch_1=contact",
    "sensors.touch_1.link=tip_1",
)


def chain_settings(folder: Path, *, added_mass: bool, height: float) -> Any:
    """Return the eight-link chain at a height [m]."""
    import scene

    effects = scene.effects(added_mass=added_mass, scale=0.1)
    return scene.settings(scene.chain(folder), effects, height=height)


def aam_settings(*, added_mass: bool, height: float, piloted: bool = True) -> Any:
    """Return the manipulator at a height [m], held there by its controller or left alone."""
    from seals.config.compose import compose
    from seals.run.build import build_run

    words = [w for w in AAM if piloted or not w.startswith(("controller", "guide"))]
    words += [f"initial.position=[0,0,{height}]", "time.duration=4.0"]
    return build_run(compose([*words, *(() if added_mass else ADDED)]))


def steps_a_second(settings: Any, repeats: int) -> tuple[float, float, float]:
    """Return median, lowest and highest steps a second over blocks of steps."""
    from seals.run import build_world, initial_configuration

    world = build_world(settings)
    start = {"robot": initial_configuration(settings, world.actors["robot"].robot)}

    def block() -> float:
        world.reset(start)
        world.step()
        begin = time.process_time()
        for _ in range(BLOCK):
            world.step()
        return BLOCK / (time.process_time() - begin)

    block()
    found = machine.median(block, repeats)
    world.close()
    return found


def main() -> None:
    """Print steps a second with and without added mass, in air, at the surface and under it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=11, help="blocks of 100 steps of each case")
    parser.add_argument("--case", choices=("chain", "aam", "all"), default="all")
    given = parser.parse_args()
    print(machine.describe())
    print(f"{'world, 4 ms':40} {'steps/s':>9} {'lowest':>9} {'highest':>9} {'x real time':>12}")
    with tempfile.TemporaryDirectory() as folder:
        for case, settings in cases(Path(folder), given.case):
            speed = steps_a_second(settings, given.repeats)
            print(
                f"{case:40} {speed[0]:9.0f} {speed[1]:9.0f} {speed[2]:9.0f} "
                f"{speed[0] * 0.004:12.1f}"
            )


def cases(folder: Path, chosen: str) -> Iterator[tuple[str, Any]]:
    """Yield names and settings of the cases."""
    for added_mass in (True, False):
        words = f"{'with' if added_mass else 'without'} added mass"
        for name, height in HEIGHTS.items():
            if chosen != "aam":
                settings = chain_settings(folder, added_mass=added_mass, height=height)
                yield f"chain, {name}, {words}", settings
        for name, height in HEIGHTS.items():
            if chosen != "chain":
                yield f"aam, {name}, {words}", aam_settings(added_mass=added_mass, height=height)
        if chosen != "chain":
            left = aam_settings(added_mass=added_mass, height=HEIGHTS["in air"], piloted=False)
            yield f"aam, no controller, {words}", left


if __name__ == "__main__":
    machine.one_thread()
    main()
