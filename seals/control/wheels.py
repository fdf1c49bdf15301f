"""Driven wheels for control: the speeds at which a vehicle moves ahead and turns."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control.plant import Plant
from seals.errors import ConfigError
from seals.multibody.tree import poses_in_base


class DrivenWheels(NamedTuple):
    """Wheels of a robot that motors turn, joints at zero, body axes about the body origin.

    Args:
        joints: index of the joint of each, n of them.
        sense: 1 for wheels that roll ahead at a positive speed, -1 for others [1], shape (n,).
        left: y of each [m], shape (n,).
        radius: [m], shape (n,).
        fastest: largest speed [rad/s], shape (n,).
    """

    joints: tuple[int, ...]
    sense: Floats
    left: Floats
    radius: Floats
    fastest: Floats

    def speeds(self, ahead: float, turn: float) -> Floats:
        """Return the speeds at which all wheels roll without slipping ahead [rad/s], shape (n,).

        Equation:
            w = (u - r y) / R. Where one is beyond its largest speed all are lowered by the same
            share: the vehicle keeps to its curve.

        Args:
            ahead: u, speed along body x [m/s].
            turn: r, rate about body z [rad/s].

        Example:
            >>> one = np.ones(2)
            >>> two = DrivenWheels((0, 1), one, np.array([0.5, -0.5]), 0.1 * one, 20.0 * one)
            >>> two.speeds(1.0, 1.0).tolist()
            [5.0, 15.0]
        """
        wanted = self.sense * (ahead - turn * self.left) / self.radius
        share = float(np.max(np.abs(wanted) / self.fastest))
        return wanted / max(share, 1.0)


def wheels_of(plant: Plant) -> DrivenWheels:
    """Return the wheels of a robot that motors turn; see the actuator ``wheels``.

    Raises:
        ConfigError: an axle does not lie across the robot, or a joint slides.
    """
    tree = plant.robot.tree
    origins, turns = poses_in_base(tree)
    rows = []
    for bound in plant.effects.joint_drives:
        motor: Any = bound.effect
        if not hasattr(motor, "no_load_speed"):
            continue
        motor.of_joints("kd", tree.joints)
        for joint in motor.joints:
            link = tree.child[joint]
            across = float((turns[link] @ tree.axis[joint])[1])
            if abs(across) < 0.99 or tree.slides[joint]:
                raise ConfigError(
                    f"actuators.{bound.name}: joint '{plant.robot.joints[joint]}' is no axle "
                    "across the robot.\nAllowed: continuous joints whose axis is along body y; "
                    "body x points ahead"
                )
            top = motor.no_load_speed
            rows.append((joint, np.sign(across), float(origins[link][1]), motor.radius, top))
    columns = np.array([row[1:] for row in rows]).reshape(-1, 4).T
    return DrivenWheels(tuple(row[0] for row in rows), *columns)
