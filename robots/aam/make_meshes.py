"""Writes ``aam.urdf`` and ``meshes``, and prints the hulls and the table of masses."""

from __future__ import annotations

from pathlib import Path

from seals.robots.workshop import arm
from seals.robots.workshop.airframe import COLOURS, Airframe
from seals.robots.workshop.files import publish
from seals.robots.workshop.links import Machine

FRAME = Airframe()


def machine() -> Machine:
    """Return the links and joints of the robot."""
    limbs = arm.links()
    frames, mounts = FRAME.frames()
    return Machine(
        name="aam",
        links=[FRAME.base(limbs), *limbs, *frames],
        joints=[*arm.arm("body", FRAME.shoulders[0]), *mounts],
        colours=COLOURS,
    )


if __name__ == "__main__":
    publish(machine(), Path(__file__).parent)
    print("hubs", FRAME.hubs())
