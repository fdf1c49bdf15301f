"""Controllers of planned flights: those of the library, chosen by the vehicle's actuators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.batch import TwinState
from seals.control import Plant, Reference, RobotState
from seals.control.plant import ROTOR, build_plant
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
    """Return the nominal model of a vehicle for controllers; its joints are one arm.

    Args:
        vehicle: nominal model.
        stowed: joint values at rest [rad or m], shape (J,).
    """
    robot, joints = vehicle.robot, vehicle.robot.tree.joints
    arm = Arm(name=ALL, joints=tuple(range(joints)), tool=0, stowed=stowed)
    robot = replace(robot, arms={ALL: arm} if joints else {}, grippers={}, legs={})
    return build_plant(robot, bind_effects(vehicle.effects, robot.links), vehicle.environment)


def controller_of(vehicle: Vehicle, tilt: float, *, rate: float) -> Any:
    """Return the controller that flies a vehicle: the cascade for rotors, else the station.

    Args:
        vehicle: nominal model.
        tilt: largest lean [rad].
        rate: calls a second, those of the rows [Hz].
    """
    if vehicle.commands == "rotor_speed_cmd":
        return get("controller", "cascade").load()(rate=rate, tilt=[tilt, tilt], **AIRBORNE)
    return get("controller", "station").load()(rate=rate, **SUBMERGED)


def carrying(plant: Plant) -> Floats:
    """Return drive states at the start: rotors that share the weight, thrusters at rest, (1, n)."""
    layout = plant.layout
    share = plant.gravity * float(plant.robot.mass.sum()) / layout.drives
    speed = np.sqrt(share / layout.thrust_coefficient)
    return np.where([k == ROTOR for k in layout.kind], speed, 0.0)[None]


@dataclass(frozen=True, kw_only=True)
class Course:
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
        rates = [p.rates(step) for p in flights]
        rows = max(len(p.yaw) for p in flights)
        still = {"rows": rows, "still": True}
        return cls(
            place=_padded([p.place for p in flights], rows=rows),
            velocity=_padded([r[0] for r in rates], **still),
            acceleration=_padded([r[1] for r in rates], **still),
            yaw=_padded([p.yaw[:, None] for p in flights], rows=rows),
            yaw_rate=_padded([r[2][:, None] for r in rates], **still),
            joints=_padded([p.joints for p in flights], rows=rows),
        )

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

    def start(self) -> TwinState:
        """Return bodies at rest where the references begin."""
        half, joints = 0.5 * self.yaw[0], self.joints[0]
        zero = np.zeros_like(self.place[0])
        turn = np.concatenate([zero[:, :2], np.sin(half), np.cos(half)], axis=1)
        return TwinState(self.place[0], turn, zero, zero, joints, np.zeros_like(joints))


@dataclass(kw_only=True)
class Follow:
    """Guide along the only flight of a course; see `seals.control.protocols.Guide`.

    Args:
        course: with one flight.
        step: between its rows [s].
        wait: at its start [s].
    """

    course: Course
    step: float
    wait: float

    @property
    def rate(self) -> float:
        """Calls a second [Hz]."""
        return 1.0 / self.step

    def bind(self, plant: Plant) -> None:
        """Accept any robot."""

    def start(self, situation: RobotState) -> float:
        """Return the time of the first row [s]."""
        return situation.time + self.wait

    def aim(self, situation: RobotState, memory: float) -> tuple[Reference, float]:
        """Return the reference of the present row."""
        row = round((situation.time - memory) / self.step)
        aim = self.course.aim(min(max(row, 0), self.course.rows - 1))
        place: Any = aim.position
        return aim._replace(
            velocity=aim.velocity[0],
            acceleration=aim.acceleration[0],
            yaw=np.asarray(aim.yaw).item(),
            yaw_rate=np.asarray(aim.yaw_rate).item(),
            joints={name: values[0] for name, values in aim.joints.items()},
            position=place[0],
        ), memory

    def finished(self, memory: float) -> bool | None:
        """Return None: the log has as many rows as the course."""
        return None

    def stage(self, memory: float) -> str:
        """Return ``planned``, the only stage."""
        return "planned"


def _padded(parts: Sequence[Floats], *, rows: int, still: bool = False) -> Floats:
    """References of different length, shape (rows, M, k), padded by the last row or by zero."""
    out = []
    for part in parts:
        last = np.zeros_like(part[-1:]) if still else part[-1:]
        out.append(np.concatenate([part, np.repeat(last, rows - len(part), axis=0)]))
    return np.stack(out, axis=1)
