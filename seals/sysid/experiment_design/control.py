"""Feedback controller for any vehicle with rotors or thrusters, derived from its layout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.batch import TwinState
from seals.effects.binding import has_hook
from seals.frames import matrix_of
from seals.sysid.data.vehicle import Vehicle

_LEAST = 0.15
"""Least rotor speed as a share of the largest."""


@dataclass(frozen=True, kw_only=True)
class Gains:
    """Gains of the cascade controller, per unit of mass and inertia.

    Args:
        place: of the position error [1/s^2].
        speed: of the velocity error [1/s].
        sum: of the sum of the position error [1/s^3].
        most: largest effect of that sum [m/s^2].
        turn: of the attitude error, roll and pitch, and yaw [1/s^2], shape (3,).
        spin: of the error of the body rates [1/s], shape (3,).
        turn_sum: of the sum of the attitude error [1/s^3].
    """

    place: float
    speed: float
    sum: float
    most: float
    turn: tuple[float, float, float]
    spin: tuple[float, float, float]
    turn_sum: float


ROTORS = Gains(
    place=5.0,
    speed=3.6,
    sum=1.2,
    most=2.5,
    turn=(70.0, 70.0, 14.0),
    spin=(13.0, 13.0, 5.0),
    turn_sum=8.0,
)
THRUSTERS = Gains(
    place=1.6,
    speed=2.0,
    sum=0.5,
    most=1.0,
    turn=(2.5, 2.5, 2.5),
    spin=(2.0, 2.0, 2.5),
    turn_sum=0.6,
)


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """Reference of a batch at one time; M members.

    Args:
        place: [m], shape (M, 3).
        velocity: [m/s], shape (M, 3).
        acceleration: [m/s^2], shape (M, 3).
        yaw: [rad], shape (M,).
        turning: rate of the heading [rad/s], shape (M,).
    """

    place: Floats
    velocity: Floats
    acceleration: Floats
    yaw: Floats
    turning: Floats


class Controller:
    """Position and attitude feedback with compensation of the unforced accelerations.

    Args:
        vehicle: nominal model: masses, layout of the actuators.
        batch: number of vehicles M.
        tilt: largest lean [rad].
        gains: of the cascade; those of the kind of vehicle when left out.
    """

    def __init__(
        self, vehicle: Vehicle, batch: int, *, tilt: float, gains: Gains | None = None
    ) -> None:
        self.rotors = vehicle.commands == "rotor_speed_cmd"
        self.gains = gains or (ROTORS if self.rotors else THRUSTERS)
        self._lean = float(np.tan(tilt))
        robot = vehicle.robot
        self.mass = vehicle.mass
        self.inertia = np.diag(robot.inertia[0]).copy()
        added = next((e for e in vehicle.effects.values() if has_hook(e, "inertia")), None)
        names = ("mass_x", "mass_y", "mass_z", "inertia_x", "inertia_y", "inertia_z")
        self._added = np.array([float(getattr(added, n, 0.0)) for n in names])
        self._both, self._gain, self._limit = _layout(vehicle)
        self._share = np.linalg.pinv(self._both, rcond=1e-3)
        self._ratio = float(np.prod([e.submerged_thrust() for e in vehicle.effects.values()]))
        self._level = vehicle.environment.water_level if vehicle.has_water else None
        self._height = 0.0 if vehicle.hull is None else float(vehicle.hull.volume ** (1.0 / 3.0))
        self._sum = np.zeros((batch, 3))
        self._turn_sum = np.zeros((batch, 3))

    def wet(self, height: Floats) -> Floats:
        """Approximate submersion at a height of the origin [m], shape (M, 1)."""
        if self._level is None:
            return np.zeros((len(height), 1))
        depth = (self._level - height) / max(self._height, 1e-3)
        share: Floats = np.clip(0.5 + depth, 0.0, 1.0)[:, None]
        return share

    def idle(self, batch: int) -> Floats:
        """Actuator states at hover (rotors) or at zero (thrusters), shape (batch, n)."""
        thrust = self.mass * 9.81 / len(self._gain) if self.rotors else 0.0
        return np.tile(np.sqrt(thrust / self._gain), (batch, 1))

    def commands(
        self,
        wanted: Wanted,
        state: TwinState,
        felt: tuple[Floats, Floats],
        drive: Floats,
        step: float,
    ) -> Floats:
        """Commands of the actuators, shape (M, n).

        What the actuators do not explain of the accelerations is met in advance.

        Args:
            wanted: reference.
            state: as estimated.
            felt: rates of velocity and spin in body axes [m/s^2, rad/s^2], (M, 3) each.
            drive: states of the actuators, shape (M, n).
            step: time between commands [s].
        """
        turn = matrix_of(state.quaternion)
        wet = self.wet(state.position[:, 2])
        pull = self._pull(wanted, state, turn, step)
        heavy = np.concatenate([np.full(3, self.mass), self.inertia]) + wet * self._added
        own = self._wrench(drive, wet) / heavy
        loose = felt[0] + np.cross(state.angular_velocity, state.velocity) - own[:, :3]
        need = pull - np.einsum("mij,mj->mi", turn, loose)
        force = heavy[:, :3] * np.einsum("mji,mj->mi", turn, need)
        up = need if self.rotors else np.tile([0.0, 0.0, 1.0], (len(need), 1))
        goal = facing(self._bounded(up), wanted.yaw)
        error = _turn_between(turn, goal)
        self._turn_sum = np.clip(self._turn_sum + error * step, -0.5, 0.5)
        rate = np.zeros_like(error)
        rate[:, 2] = wanted.turning
        g = self.gains
        twist = np.array(g.turn) * error + np.array(g.spin) * (rate - state.angular_velocity)
        twist = twist + g.turn_sum * self._turn_sum - (felt[1] - own[:, 3:])
        torque = heavy[:, 3:] * twist
        if self.rotors:
            force[:, :2] = 0.0
            force[:, 2] = np.maximum(force[:, 2], 0.1 * self.mass * 9.81 * (1.0 - wet[:, 0]))
        return self._allocate(np.concatenate([force, torque], axis=1), wet)

    def _wrench(self, drive: Floats, wet: Floats) -> Floats:
        """Force and torque of the actuators, body axes, shape (M, 6)."""
        thrust = drive
        if self.rotors:
            thrust = self._gain * drive**2 * (1.0 + wet * (self._ratio - 1.0))
        wrench: Floats = thrust @ self._both.T
        return wrench

    def _pull(self, wanted: Wanted, state: TwinState, turn: Floats, step: float) -> Floats:
        """Feedback acceleration towards the reference, world axes."""
        g = self.gains
        miss = wanted.place - state.position
        self._sum = np.clip(self._sum + g.sum * miss * step, -g.most, g.most)
        velocity = np.einsum("mij,mj->mi", turn, state.velocity)
        pull = wanted.acceleration + g.place * miss + self._sum
        total: Floats = pull + g.speed * (wanted.velocity - velocity)
        return total

    def _bounded(self, up: Floats) -> Floats:
        """Limit the tilt of directions."""
        out: Floats = up.copy()
        out[:, 2] = np.maximum(out[:, 2], 0.15 * 9.81)
        side = np.linalg.norm(out[:, :2], axis=1)
        out[:, :2] *= np.minimum(1.0, self._lean * out[:, 2] / np.maximum(side, 1e-9))[:, None]
        return out

    def _allocate(self, wrench: Floats, wet: Floats) -> Floats:
        thrust = wrench @ self._share.T
        if not self.rotors:
            bounded: Floats = np.clip(thrust, -self._limit, self._limit)
            return bounded
        thrust = thrust / (1.0 + wet * (self._ratio - 1.0))
        speed = np.sqrt(np.maximum(thrust, 0.0) / self._gain)
        commands: Floats = np.clip(speed, _LEAST * self._limit, self._limit)
        return commands


def _layout(vehicle: Vehicle) -> tuple[Floats, Floats, Floats]:
    """Wrench by thrusts, shape (6, n); thrust coefficients and limits, shape (n,)."""
    rotors = vehicle.commands == "rotor_speed_cmd"
    actuator = vehicle.effects["rotors" if rotors else "thrusters"]
    table = actuator.constants()
    axis, position = np.asarray(table["axis"]), np.asarray(table["position"])
    moment = np.cross(position, axis)
    count = len(axis)
    gain = np.ones(count)
    if rotors:
        gain = np.broadcast_to(np.ravel(table["thrust_coefficient"]), count).astype(float)
        reaction = np.broadcast_to(np.ravel(table["reaction_coefficient"]), count)
        moment = moment + (reaction / gain)[:, None] * axis
    limit = np.asarray(actuator.limit)  # type: ignore[attr-defined]  # rotors and thrusters have it
    both = np.concatenate([axis.T, moment.T], axis=0)
    return both, gain, np.broadcast_to(limit, count).astype(float)


def facing(up: Floats, yaw: Floats) -> Floats:
    """Attitudes with z along ``up`` that look along the heading, shape (M, 3, 3)."""
    z = up / np.linalg.norm(up, axis=1, keepdims=True)
    ahead = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=1)
    y = np.cross(z, ahead)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([np.cross(y, z), y, z], axis=2)


def _turn_between(turn: Floats, goal: Floats) -> Floats:
    """Rotation vector, to first order, from an attitude to a goal, body axes."""
    error = np.einsum("mji,mjk->mik", turn, goal)
    return 0.5 * np.stack(
        [
            error[:, 2, 1] - error[:, 1, 2],
            error[:, 0, 2] - error[:, 2, 0],
            error[:, 1, 0] - error[:, 0, 1],
        ],
        axis=1,
    )
