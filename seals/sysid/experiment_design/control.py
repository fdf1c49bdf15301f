"""Controllers of planned flights: those of the library, chosen by the vehicle's actuators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.batch import TwinState
from seals.control import Plant, Reference
from seals.control.plant import build_plant
from seals.effects.binding import bind_effects
from seals.registry import get
from seals.robot.limbs import Arm
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.experiment_design.motions import Path

ALL = "all"
"""Name of the arm that stands for all joints of a vehicle."""
AIRBORNE: dict[str, Any] = {
    "position_gain": [1.4, 0.8],
    "speed_gain": [3.6, 2.5],
    "sum_gain": [2.0, 0.9],
    "turn_gain": [70.0, 70.0],
    "spin_gain": [13.0, 13.0],
    "turn_sum_gain": [8.0, 8.0],
    "least": [0.3, 0.15],
    "quicker": 1.0,
}
"""Gains of rotors, in air and in water: rows of a log hold commands about as long as rotors lag."""
SUBMERGED: dict[str, Any] = {
    "position_gain": 2.0,
    "speed_gain": 4.0,
    "sum_gain": 2.0,
    "quicker": 1.0,
}
"""Gains of thrusters: firm, for the information lies in how fast the vehicle really moves."""


def plant_of(vehicle: Vehicle, stowed: Floats) -> Plant:
    """Return the stated model of a vehicle for controllers; its joints are one arm.

    Args:
        vehicle: stated model.
        stowed: joint values at rest [rad or m], shape (J,).
    """
    robot, joints = vehicle.robot, vehicle.robot.tree.joints
    arm = Arm(name=ALL, joints=tuple(range(joints)), tool=0, stowed=stowed)
    robot = replace(robot, arms={ALL: arm} if joints else {}, grippers={}, legs={})
    return build_plant(robot, bind_effects(vehicle.effects, robot.links), vehicle.environment)


def controller_of(vehicle: Vehicle, tilt: float, *, rate: float) -> Any:
    """Return the controller that flies a vehicle: the cascade for rotors, else the station.

    Args:
        vehicle: stated model.
        tilt: largest lean [rad].
        rate: calls a second, those of the rows [Hz].
    """
    if vehicle.commands == "rotor_speed_cmd":
        return get("controller", "cascade").load()(rate=rate, tilt=[tilt, tilt], **AIRBORNE)
    return get("controller", "station").load()(rate=rate, **SUBMERGED)


class Course(NamedTuple):
    """References of a batch of flights, one row a step; a shorter one ends at its last place.

    Args:
        place: [m], shape (rows, M, 3).
        velocity: [m/s], likewise.
        acceleration: [m/s^2], likewise.
        yaw: heading [rad], shape (rows, M, 1).
        yaw_rate: [rad/s], likewise.
        joints: [rad or m], shape (rows, M, J).
    """

    place: Floats
    velocity: Floats
    acceleration: Floats
    yaw: Floats
    yaw_rate: Floats
    joints: Floats

    @classmethod
    def of(cls, flights: Sequence[Path], step: float) -> Course:
        """Return the references of some paths with rows a step apart [s]."""
        rows = max(len(p.yaw) for p in flights)
        parts = zip(*((p.place, p.yaw[:, None], p.joints) for p in flights), strict=True)
        place, yaw, joints = (
            np.stack([np.pad(x, ((0, rows - len(x)), (0, 0)), mode="edge") for x in part], axis=1)
            for part in parts
        )
        velocity, yaw_rate = (np.gradient(x, step, axis=0) for x in (place, yaw))
        acceleration = np.gradient(velocity, step, axis=0)
        return cls(place, velocity, acceleration, yaw, yaw_rate, joints)

    @property
    def rows(self) -> int:
        """Rows of the longest reference."""
        return len(self.yaw)

    def aim(self, row: int) -> Reference:
        """Return the references of all flights at a row."""
        return Reference(
            velocity=self.velocity[row],
            acceleration=self.acceleration[row],
            yaw=self.yaw[row],
            yaw_rate=self.yaw_rate[row],
            joints={ALL: self.joints[row]} if self.joints.shape[2] else {},
            position=self.place[row],
        )

    def only(self, row: int) -> Reference:
        """Return the reference of the only flight at a row."""
        aim = self.aim(row)
        numbers = {name: getattr(aim, name)[0] for name in ("velocity", "acceleration", "position")}
        numbers |= {name: getattr(aim, name).item() for name in ("yaw", "yaw_rate")}
        return aim._replace(**numbers, joints={name: x[0] for name, x in aim.joints.items()})

    def start(self) -> TwinState:
        """Return bodies at rest where the references begin."""
        half, joints = 0.5 * self.yaw[0], self.joints[0]
        zero = np.zeros_like(self.place[0])
        turn = np.concatenate([zero[:, :2], np.sin(half), np.cos(half)], axis=1)
        return TwinState(self.place[0], turn, zero, zero, joints, np.zeros_like(joints))
