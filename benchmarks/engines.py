"""Comparison of engines with closed-form solutions: ``python benchmarks/engines.py``.

One line a quantity: closed form, PyBullet, MuJoCo, free motion, and the largest deviation that is
allowed. It writes the table of docs/engines.md with ``--write``, and ends with 1 when a value lies
outside. Steps of 4 ms.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import machine
import numpy as np

ENGINES = ("pybullet", "mujoco", "free")
PAGE = Path(__file__).parents[1] / "docs" / "engines.md"
HEAD, END = "<!-- table: python benchmarks/engines.py --write -->\n", "<!-- end of table -->\n"
GRAVITY = 9.81
STEP = 0.004
WATER = 998.0


class Case(NamedTuple):
    """One quantity: name, unit, closed form (None: the engines are compared), tolerance, measure.

    ``free`` says whether motion without contacts will do.
    """

    name: str
    unit: str
    expected: float | None
    tolerance: float
    measure: Callable[[str], float]
    free: bool = False


def world(engine: str, *words: str) -> Any:
    """Build a world."""
    from seals.api import make

    return make([f"backend={engine}", *words])


def after(engine: str, seconds: float, read: Callable[[Any], float], *words: str) -> float:
    """Step a world and read a number from its robot's body."""
    scene = world(engine, *words)
    for _ in range(round(seconds / STEP)):
        scene.step()
    found = read(scene.actors["robot"].body)
    scene.close()
    return float(found)


def still(*effects: str) -> tuple[str, ...]:
    """Overrides that switch drags off."""
    return tuple(f"effects.{e}.coefficient_{axis}=0" for e in effects for axis in "xyz")


def height(body: Any) -> float:
    """Height of the base [m]."""
    return float(body.read().position[2])


def stopped(engine: str) -> float:
    """Vertical displacement of the manipulator's centre of mass in 0.5 s, fingers at limits [m]."""
    words = ("robot=aam", "initial.joint_position=[1.55,0,0,-0.6,-0.6,-0.6]", *still("air_drag"))
    scene = world(engine, *words)
    actor = scene.actors["robot"]
    robot = actor.robot

    def centre() -> float:
        poses = actor.body.poses()
        at = poses.origins[0] + np.einsum("lij,lj->li", poses.rotations[0], robot.centre)
        return float(robot.mass @ at[:, 2] / robot.mass.sum())

    begin = centre()
    for _ in range(125):
        scene.step()
    found = centre() - begin
    scene.close()
    return found


def lifted(engine: str) -> float:
    """Height of a cube that a fixed-base hand has gripped and lifted by 1.2 rad [m]."""
    words = ["robot=aam", "robot.fixed_base=true", "initial.position=[-0.07,0,0.452]"]
    words += ["initial.joint_position=[0,0,0,-0.5,-0.5,-0.5]", "environment.ground_level=0"]
    words += ["+objects.cube={robot: cube, position: [0,0,0.0255], rpy: [0,0,0.35]}"]
    scene = world(engine, *words)
    for k in range(650):
        time = k * STEP
        swing = 0.6 * (1.0 - math.cos(math.pi * min(max(time - 0.9, 0.0) / 1.2, 1.0)))
        finger = -0.5 + min(time / 0.5, 1.0) * 0.7
        scene.actors["robot"].joint_command = np.array([[swing, 0, 0, finger, finger, finger]])
        scene.step()
    found = float(scene.actors["cube"].body.read().position[2])
    scene.close()
    return found


def cases() -> Iterator[Case]:
    """Yield all cases."""
    yield from freely()
    yield from touching()


def freely() -> Iterator[Case]:
    """Yield the cases of motion without contacts."""
    flight = ("robot=cube", "initial.angular_velocity=[3,5,7]", *still("air_drag"))
    flight = (*flight, "initial.velocity=[0,0,3]")
    fall = 3.0 - 0.5 * GRAVITY
    yield Case(
        "free flight: way in 1 s", "m", fall, 1e-6, lambda e: after(e, 1.0, height, *flight), True
    )
    box = ("robot=box", "water=fossen", f"environment.water_density={WATER}")
    deep = (*box, "initial.position=[0,0,-9]", *still("water_drag"))
    mass, added, plan = 4.1916, 5.0, 0.06
    rise = (WATER * plan * 0.1 - mass) * GRAVITY / (mass + added) * 0.4
    yield Case(
        "added mass: speed of a rising box after 0.4 s",
        "m/s",
        rise,
        1e-6,
        lambda e: after(e, 0.4, lambda b: b.read().velocity[2], *deep),
        True,
    )
    middle = 0.05 - mass / (WATER * plan)
    afloat = (*box, f"initial.position=[0,0,{middle}]")
    yield Case(
        "floating box, set down at its draught: height after 2 s",
        "m",
        middle,
        1e-6,
        lambda e: after(e, 2.0, height, *afloat),
        True,
    )
    yield Case(
        "joint stops: fall in 0.5 s, fingers at their stops",
        "m",
        -0.125 * GRAVITY,
        1e-4,
        stopped,
        True,
    )


def touching() -> Iterator[Case]:
    """Yield the cases with contacts."""
    ground = ("robot=cube", "environment.ground_level=0")
    lying = (*ground, "initial.position=[0,0,0.0255]")
    yield Case(
        "contact: force under a lying cube",
        "N",
        0.1 * GRAVITY,
        1e-3,
        lambda e: after(e, 1.0, lambda b: b.contact_normals()[0], *lying),
    )
    slide = (*ground, "environment.friction=0.4", *still("air_drag"))
    slide = (*slide, "initial.position=[0,0,0.025]", "initial.velocity=[0.7648,0.6442,0]")
    yield Case(
        "friction cone: speed of a cube that slid 0.16 s",
        "m/s",
        1.0 - 0.4 * GRAVITY * 0.16,
        0.01,
        lambda e: after(e, 0.16, lambda b: float(np.linalg.norm(b.read().velocity)), *slide),
    )
    reach, hand = 0.427 - 0.08, 0.452 - 0.08
    swung = hand - reach * math.cos(1.2)
    yield Case("grasp: height of a cube swung up", "m", swung, 0.02, lifted)
    yield Case(
        "walk: way of the crab in 4 s",
        "m",
        None,
        0.08,
        lambda e: after(
            e,
            4.0,
            lambda b: float(np.linalg.norm(b.read().position[:2])),
            "experiment=crab_walk",
        ),
    )


def rows() -> Iterator[tuple[list[str], bool]]:
    """Yield the cells of every line, and whether its values are within the tolerance."""
    engines = [e for e in ENGINES if e == "free" or importlib.util.find_spec(e)]
    for case in cases():
        values = {e: case.measure(e) for e in engines if e != "free" or case.free}
        expected = case.expected
        if expected is None:
            expected = float(np.mean(list(values.values())))
        sound = all(abs(value - expected) <= case.tolerance for value in values.values())
        cells = [f"{values[e]:.6g}" if e in values else "" for e in ENGINES]
        closed = "" if case.expected is None else f"{case.expected:.6g}"
        yield [case.name, case.unit, closed, *cells, f"{case.tolerance:g}"], sound


def main() -> int:
    """Print the table; write it into the page on request."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="into docs/engines.md")
    write = parser.parse_args().write
    lines = ["| quantity | unit | closed form | PyBullet | MuJoCo | free | allowed |"]
    lines.append("|---|---|---|---|---|---|---|")
    good = True
    for cells, sound in rows():
        lines.append("| " + " | ".join(cells) + (" |" if sound else " **outside** |"))
        print(lines[-1], flush=True)
        good &= sound
    if write:
        text = PAGE.read_text(encoding="utf-8")
        before, _, rest = text.partition(HEAD)
        after_ = rest.partition(END)[2]
        PAGE.write_text(before + HEAD + "\n".join(lines) + "\n" + END + after_, encoding="utf-8")
    return 0 if good else 1


if __name__ == "__main__":
    machine.one_thread()
    sys.exit(main())
