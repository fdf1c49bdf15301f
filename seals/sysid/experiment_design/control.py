"""Feedback controller for any vehicle with rotors or thrusters, derived from its layout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.batch import TwinState
from seals.control.attitude import lean_for
from seals.control.plant import layout_of
from seals.effects.binding import bind_effects, has_hook
from seals.frames import exponential, matrix_of, multiply
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.experiment_design.motions import Path

GRAVITY = 9.81
_ESTIMATE = (0.002, 0.004, 0.004, 0.001)
"""Noise of the estimates: place [m], velocity [m/s], body rates [rad/s], attitude [rad]."""
_AXES = ((2, 1), (0, 2), (1, 0))
"""Entries of a turn that lie across each axis."""
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


class Controller:
    """Feedback of place and attitude along references, for a batch of M vehicles.

    What the actuators do not explain of the accelerations is met in advance.

    Args:
        vehicle: nominal model: masses, layout of the actuators.
        flights: references, one row a step, M of them; a shorter one ends at its last place.
        step: time between rows [s].
        tilt: largest lean [rad].
        rng: of the noise of the estimates.
        gains: of the cascade; those of the kind of vehicle when left out.

    Attributes:
        rows: of the longest reference.
        joints: references of the joints [rad], shape (rows, M, J).
    """

    def __init__(
        self,
        vehicle: Vehicle,
        flights: Sequence[Path],
        *,
        step: float,
        tilt: float,
        rng: np.random.Generator,
        gains: Gains | None = None,
    ) -> None:
        self.rows, self._step, self._tilt, self._rng = (
            max(len(p.yaw) for p in flights),
            step,
            tilt,
            rng,
        )
        rates = [p.rates(step) for p in flights]
        self._place = self._padded([p.place for p in flights])
        self._velocity = self._padded([r[0] for r in rates], still=True)
        self._acceleration = self._padded([r[1] for r in rates], still=True)
        self._yaw = self._padded([p.yaw for p in flights])
        self._turning = self._padded([r[2] for r in rates], still=True)
        self.joints = self._padded([p.joints for p in flights])
        self.rotors = vehicle.commands == "rotor_speed_cmd"
        self.gains = gains or (ROTORS if self.rotors else THRUSTERS)
        self.mass = vehicle.mass
        self.inertia = np.diag(vehicle.robot.inertia[0]).copy()
        added = next((e for e in vehicle.effects.values() if has_hook(e, "inertia")), None)
        names = ("mass_x", "mass_y", "mass_z", "inertia_x", "inertia_y", "inertia_z")
        self._added = np.array([float(getattr(added, n, 0.0)) for n in names])
        own = vehicle.effects["rotors" if self.rotors else "thrusters"]
        layout = layout_of(vehicle.robot, bind_effects({"drives": own}, vehicle.robot.links))
        self._gain, self._limit = layout.thrust_coefficient, layout.limit
        lever = (layout.reaction_coefficient / self._gain)[:, None] * layout.axis
        moment = np.cross(layout.position, layout.axis) + lever
        self._both = np.concatenate([layout.axis.T, moment.T])
        self._share = np.linalg.pinv(self._both, rcond=1e-3)
        self._ratio = float(np.prod([e.submerged_thrust() for e in vehicle.effects.values()]))
        self._level = vehicle.environment.water_level if vehicle.has_water else None
        self._height = 0.0 if vehicle.hull is None else float(vehicle.hull.volume ** (1.0 / 3.0))
        self._sum = np.zeros((len(flights), 3))
        self._turn_sum = np.zeros((len(flights), 3))

    def _padded(self, parts: Sequence[Floats], *, still: bool = False) -> Floats:
        """References of different length, shape (rows, M, ...), padded by the last row or 0."""
        out = []
        for part in parts:
            last = np.zeros_like(part[-1:]) if still else part[-1:]
            out.append(np.concatenate([part, np.repeat(last, self.rows - len(part), axis=0)]))
        return np.stack(out, axis=1)

    def start(self) -> tuple[TwinState, Floats]:
        """Return bodies at rest where the references begin, and actuators at hover or at zero."""
        half = 0.5 * self._yaw[0]
        still, zero, joints = np.zeros_like(half), np.zeros_like(self._sum), self.joints[0]
        turn = np.stack([still, still, np.sin(half), np.cos(half)], axis=1)
        thrust = self.mass * GRAVITY / len(self._gain) if self.rotors else 0.0
        drive = np.tile(np.sqrt(thrust / self._gain), (len(half), 1))
        return TwinState(self._place[0], turn, zero, zero, joints, np.zeros_like(joints)), drive

    def commands(
        self, row: int, state: TwinState, felt: tuple[Floats, Floats], drive: Floats
    ) -> Floats:
        """Commands of the actuators, shape (M, n).

        Args:
            row: of the references.
            state: of the bodies; the estimates are noisy.
            felt: rates of velocity and spin in body axes [m/s^2, rad/s^2], (M, 3) each.
            drive: states of the actuators, shape (M, n).
        """
        noise = [s * self._rng.standard_normal(self._sum.shape) for s in _ESTIMATE]
        position, velocity = state.position + noise[0], state.velocity + noise[1]
        spin = state.angular_velocity + noise[2]
        turn = matrix_of(multiply(state.quaternion, exponential(noise[3])))
        wet = np.zeros((len(position), 1))
        if self._level is not None:
            depth = (self._level - position[:, 2:3]) / max(self._height, 1e-3)
            wet = np.clip(0.5 + depth, 0.0, 1.0)
        g, step = self.gains, self._step
        miss = self._place[row] - position
        self._sum = np.clip(self._sum + g.sum * miss * step, -g.most, g.most)
        pull = self._acceleration[row] + g.place * miss + self._sum
        pull = pull + g.speed * (self._velocity[row] - np.einsum("mij,mj->mi", turn, velocity))
        heavy = np.concatenate([np.full(3, self.mass), self.inertia]) + wet * self._added
        thinner = 1.0 + wet * (self._ratio - 1.0)
        thrust = self._gain * drive**2 * thinner if self.rotors else drive
        own = thrust @ self._both.T / heavy
        loose = felt[0] + np.cross(spin, velocity) - own[:, :3]
        need = pull - np.einsum("mij,mj->mi", turn, loose)
        force = heavy[:, :3] * np.einsum("mji,mj->mi", turn, need)
        up = need if self.rotors else np.tile([0.0, 0.0, GRAVITY], (len(need), 1))
        least = np.float64(0.15 * GRAVITY)
        # a force that points down is met by falling, not by leaning the other way
        up = np.maximum(up, [-np.inf, -np.inf, least])
        goal = lean_for(up, self._yaw[row][:, None], tilt=np.float64(self._tilt), least=least)
        # to first order: as long as the sine of the angle
        sine = np.einsum("mji,mjk->mik", turn, goal)
        error = np.stack([0.5 * (sine[:, i, j] - sine[:, j, i]) for i, j in _AXES], axis=1)
        self._turn_sum = np.clip(self._turn_sum + error * step, -0.5, 0.5)
        rate = np.zeros_like(error)
        rate[:, 2] = self._turning[row]
        twist = np.array(g.turn) * error + np.array(g.spin) * (rate - spin)
        twist = twist + g.turn_sum * self._turn_sum - (felt[1] - own[:, 3:])
        if self.rotors:
            force[:, :2] = 0.0
            force[:, 2] = np.maximum(force[:, 2], 0.1 * self.mass * GRAVITY * (1.0 - wet[:, 0]))
        thrust = np.concatenate([force, heavy[:, 3:] * twist], axis=1) @ self._share.T
        if not self.rotors:
            bounded: Floats = np.clip(thrust, -self._limit, self._limit)
            return bounded
        speed = np.sqrt(np.maximum(thrust / thinner, 0.0) / self._gain)
        return np.asarray(np.clip(speed, _LEAST * self._limit, self._limit))
