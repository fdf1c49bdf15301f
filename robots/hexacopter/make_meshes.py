"""Writes ``hexacopter.urdf`` and ``meshes``, and prints the hulls and the table of masses."""

from __future__ import annotations

from pathlib import Path

from seals.robots.workshop import arm
from seals.robots.workshop.airframe import COLOURS, Airframe
from seals.robots.workshop.files import publish
from seals.robots.workshop.links import Machine

FRAME = Airframe(rotors=6, reach=0.30, height=0.09, battery=0.80, shoulders=((0.07, 0.0, -0.10),))


def machine() -> Machine:
    """Return the links and joints of the robot."""
    limbs = arm.links(roll=True)
    frames, mounts = FRAME.frames()
    return Machine(
        name="hexacopter",
        links=[FRAME.base(limbs), *limbs, *frames],
        joints=[*arm.arm("body", FRAME.shoulders[0], roll=True), *mounts],
        colours=COLOURS,
    )


if __name__ == "__main__":
    publish(machine(), Path(__file__).parent, shared=Path(__file__).parents[1] / "aam")
    print("hubs", FRAME.hubs())
