"""Writes ``aam_dual_arm.urdf`` and ``meshes``, and prints the hulls and the table of masses."""

from __future__ import annotations

import math
from pathlib import Path

from seals.robots.workshop import arm
from seals.robots.workshop.airframe import COLOURS, Airframe
from seals.robots.workshop.files import publish
from seals.robots.workshop.links import Machine

FRAME = Airframe(
    propeller=0.140,
    battery=0.70,
    shoulders=((0.07, 0.045, -0.08), (-0.07, -0.045, -0.08)),
)


def machine() -> Machine:
    """Return the links and joints of the robot: the rear arm is the front one turned about z."""
    front, rear = FRAME.shoulders
    limbs = [*arm.links(prefix="front_"), *arm.links(prefix="rear_")]
    frames, mounts = FRAME.frames()
    joints = [
        *arm.arm("body", front, prefix="front_"),
        *arm.arm("body", rear, prefix="rear_", yaw=math.pi),
        *mounts,
    ]
    return Machine(
        name="aam_dual_arm",
        links=[FRAME.base(limbs), *limbs, *frames],
        joints=joints,
        colours=COLOURS,
    )


if __name__ == "__main__":
    publish(machine(), Path(__file__).parent, shared=Path(__file__).parents[1] / "aam")
    print("hubs", FRAME.hubs())
