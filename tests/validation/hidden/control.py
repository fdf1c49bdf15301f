"""Controllers that fly a reference: cascaded for rotors, direct for six thrusters."""

from __future__ import annotations

import numpy as np

from tests.validation.hidden.references import Wanted, at, joints
from tests.validation.hidden.rotation import Array, cross, exponential, matrix, multiply, to_body
from tests.validation.hidden.vehicles import GRAVITY, WATER, Vehicle


class Controller:
    """Feedback of noisy estimates to actuator commands, for a batch of one kind of vehicle."""

    def __init__(
        self, vehicles: list[Vehicle], wanted: Wanted, dither: Array, rng: np.random.Generator
    ) -> None:
        self.wanted, self._rng = wanted, rng
        self._driven_by_rotors = vehicles[0].rotor
        self._centre = np.stack([v.centre for v in vehicles], axis=-1)
        self._dither = dither
        self._mass = np.array([v.mass for v in vehicles])
        self._inertia = np.stack([v.inertia for v in vehicles], axis=-1)
        self._limit = np.array([v.limit for v in vehicles])
        self._gain = np.array([v.thrust for v in vehicles])
        self._lift = np.array([WATER * v.volume for v in vehicles]) * GRAVITY
        self._added = np.stack([v.added for v in vehicles], axis=-1)
        self._drag = np.stack([v.water_quadratic for v in vehicles], axis=-1)
        self._sum = np.zeros((3, len(vehicles)))
        self._turn_sum = np.zeros((3, len(vehicles)))
        self._share = np.stack([_allocation(v) for v in vehicles], axis=-1)
        self._arms = [v.arm for v in vehicles]
        self._lean = np.zeros((3, len(vehicles)))
        self._ratio = np.array([v.water_ratio for v in vehicles])

    def __call__(
        self, t: float, place: Array, q: Array, velocity: Array, spin: Array, step: float
    ) -> Array:
        """Commands (na, n) from world place and velocity, attitude and body rates."""
        place = place + self._noise(3, 0.002)
        velocity = velocity + self._noise(3, 0.004)
        spin = spin + self._noise(3, 0.004)
        q = multiply(q, exponential(self._noise(3, 0.001)))
        self._lean = np.zeros((3, place.shape[1]))
        if self._arms[0] is not None:
            joint = joints(self.wanted, t)
            for i, arm in enumerate(self._arms):
                self._lean[:, i] = arm.centre(joint[:, i : i + 1])[:, 0] - self._centre[:, i]
            speed = self._rotors(t, place, q, velocity, spin, step)
            return np.concatenate((speed, joint))
        if not self._driven_by_rotors:
            return self._thrusters(t, place, q, velocity, spin, step)
        return self._rotors(t, place, q, velocity, spin, step)

    def _noise(self, rows: int, size: float) -> Array:
        return size * self._rng.standard_normal((rows, self._mass.shape[0]))

    def _rotors(
        self, t: float, place: Array, q: Array, velocity: Array, spin: Array, step: float
    ) -> Array:
        want, rate, accel = at(self.wanted, t)
        miss = want[:3] - place
        self._sum = np.clip(self._sum + 1.2 * miss * step, -2.5, 2.5)
        pull = accel[:3] + 5.0 * miss + 3.6 * (rate[:3] - velocity) + self._sum
        force = self._mass * pull
        force[2] += self._mass * GRAVITY
        under = np.clip(0.5 - place[2] / 0.12, 0.0, 1.0) * (self._lift > 0.0)
        force[2] -= under * self._lift
        slow = np.clip(velocity, -1.0, 1.0)
        force += under * self._drag * np.abs(slow) * slow
        force[2] = np.maximum(force[2], 0.15 * self._mass * GRAVITY)
        tilt = np.sqrt(force[0] ** 2 + force[1] ** 2)
        steep = np.where(under > 0.5, 0.35, 0.75)
        force[:2] *= np.minimum(1.0, steep * force[2] / np.maximum(tilt, 1e-9))
        turn = matrix(q)
        goal = _facing(force, want[3])
        error = np.einsum("ijn,ikn->jkn", goal, turn)
        lean = 0.5 * np.stack(
            (error[1, 2] - error[2, 1], error[2, 0] - error[0, 2], error[0, 1] - error[1, 0])
        )
        turning = np.zeros_like(spin)
        turning[2] = rate[3]
        self._turn_sum = np.clip(self._turn_sum + lean * step * 8.0, -6.0, 6.0)
        stiff = np.array([[70.0], [70.0], [14.0]])
        damp = np.array([[13.0], [13.0], [5.0]])
        torque = self._inertia * (stiff * lean + damp * (turning - spin) + self._turn_sum)
        total = (force * turn[:, 2]).sum(0)
        # thrust through the centre of gravity, which an arm carries about
        torque[0] += self._lean[1] * total
        torque[1] -= self._lean[0] * total
        loss = 1.0 + under * (self._ratio - 1.0)
        wrench = np.concatenate((np.maximum(total, 0.0)[None], torque)) / loss
        thrust = (self._share * wrench).sum(1)
        speed = np.sqrt(np.maximum(thrust, 0.0) / self._gain)
        speed = speed + self._dither * self._rng.standard_normal(speed.shape)
        return np.clip(speed, 0.15 * self._limit, self._limit)

    def _thrusters(
        self, t: float, place: Array, q: Array, velocity: Array, spin: Array, step: float
    ) -> Array:
        want, rate, accel = at(self.wanted, t)
        turn = matrix(q)
        miss = want[:3] - place
        self._sum = np.clip(self._sum + 0.5 * miss * step, -1.0, 1.0)
        heavy = self._mass + self._added[:3]
        pull = to_body(turn, accel[:3] + 1.6 * miss + 2.0 * (rate[:3] - velocity) + self._sum)
        body_rate = to_body(turn, rate[:3])
        force = heavy * pull + self._drag * np.abs(body_rate) * body_rate
        heading = np.arctan2(turn[1, 0], turn[0, 0])
        off = np.mod(want[3] - heading + np.pi, 2.0 * np.pi) - np.pi
        roll = np.arctan2(turn[2, 1], turn[2, 2])
        self._turn_sum[2] = np.clip(self._turn_sum[2] + 0.6 * off * step, -0.5, 0.5)
        self._turn_sum[0] = np.clip(self._turn_sum[0] - 0.6 * roll * step, -0.5, 0.5)
        spin_mass = self._inertia + self._added[3:]
        roll_torque = spin_mass[0] * (-2.5 * roll - 2.0 * spin[0] + self._turn_sum[0])
        yaw_torque = spin_mass[2] * (2.5 * off + 2.5 * (rate[3] - spin[2]) + self._turn_sum[2])
        wrench = np.concatenate((force, roll_torque[None], yaw_torque[None]))
        thrust = (self._share * wrench).sum(1)
        thrust = thrust + self._dither * self._rng.standard_normal(thrust.shape)
        return np.clip(thrust, -self._limit, self._limit)


def _allocation(vehicle: Vehicle) -> Array:
    """Matrix from the controlled wrench to the thrust of each actuator."""
    moment = cross(vehicle.positions - vehicle.centre[:, None], vehicle.axes)
    if vehicle.rotor:
        ratio = vehicle.torque / vehicle.thrust
        rows = np.stack((vehicle.axes[2], moment[0], moment[1], -ratio * vehicle.directions))
    else:
        rows = np.stack((*vehicle.axes, moment[0], moment[2]))
        out = np.zeros(rows.shape[::-1])
        driven = list(vehicle.driven)
        out[:, driven] = np.linalg.pinv(rows[driven])
        return out
    return np.asarray(np.linalg.pinv(rows), dtype=float)


def _facing(force: Array, yaw: Array) -> Array:
    """Attitude matrices whose z axis is along the force and whose x axis looks along the yaw."""
    up = force / np.sqrt((force**2).sum(0))
    ahead = np.stack((np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)))
    left = cross(up, ahead)
    left /= np.sqrt((left**2).sum(0))
    return np.stack((cross(left, up), left, up), axis=1)
