"""Flight of the endurance run: changing references in waves, above and below the surface."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import Reference
from seals.robot.model import RobotModel
from seals.world import Actor

OVERRIDES = (
    "robot=aam",
    "water=fossen",
    "wave=sea",
    "wave.height=0.2",
    "wave.period=2.5",
    "guide=commanded",
    "initial.position=[0,0,1]",
    "initial.drives=carrying",
    # a battery that lasts: an hour of flight would empty the robot's own three times
    "effects.battery.capacity=1e6",
    "time.step=0.004",
    "name=soak",
)
"""An open sea of 0.2 m, deep water."""
LENGTH = 4.0
"""Time between two commands [s]."""
REACH = np.array([3.0, 3.0, 2.0])
"""Half the size of the box in which places are drawn, about the water level [m]."""
SPEED, GAIN = 1.0, 0.8
"""Largest wanted speed [m/s]; speed for a distance [1/s]."""


class Wish(NamedTuple):
    """Reference for a while: position [m], heading [rad], joints by arm, grip by gripper."""

    place: Floats
    yaw: float
    joints: dict[str, Floats]
    grip: dict[str, float]

    @classmethod
    def drawn(cls, robot: RobotModel, seed: int, number: int) -> Wish:
        """Return the reference of a stretch, determined by its seed and its number.

        Args:
            robot: whose arms are moved, within the middle half of the range of each joint.
            seed: of all commands.
            number: of the stretch.
        """
        rng = np.random.default_rng([seed, number])
        place = rng.uniform(-REACH, REACH)
        yaw = float(rng.uniform(-np.pi, np.pi))
        joints = {}
        for name, arm in robot.arms.items():
            columns = list(arm.joints)
            low, high = robot.lower[columns], robot.upper[columns]
            middle, half = 0.5 * (low + high), 0.25 * (high - low)
            joints[name] = rng.uniform(middle - half, middle + half)
        grip = {name: float(rng.uniform()) for name in robot.grippers}
        return cls(place, yaw, joints, grip)


def tell(actor: Actor, wanted: Wish) -> None:
    """Pass a reference to the guide, as a velocity towards its position."""
    assert actor.pilot is not None
    guide: Any = actor.pilot.guide
    away = wanted.place - actor.body.read().position
    velocity = GAIN * away
    length = float(np.linalg.norm(velocity))
    if length > SPEED:
        velocity = velocity * (SPEED / length)
    guide.tell(Reference(velocity=velocity, yaw=wanted.yaw, joints=wanted.joints, grip=wanted.grip))
