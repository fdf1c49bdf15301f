"""Cascade controller for a batch of robots whose joints are held."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, as_like, namespace
from seals.control import Plant
from seals.control.added import added_inertia, water_drag
from seals.control.attitude import error_of, lean_of
from seals.control.batched import BatchAllocation, View
from seals.control.filters import NONE
from seals.control.mass_properties import MassPropertyEstimator
from seals.errors import ConfigError
from seals.frames import cross
from seals.plugins.controllers.cascade.gains import CascadeSettings, Gains


class BatchMemory(NamedTuple):
    """State of the cascade for a batch; see `controller.CascadeState`.

    Args:
        sum: of the velocity error, world axes [m], shape (B, 3).
        turn_sum: of the attitude error, body axes [rad s], shape (B, 3).
        drive: states of the drives as reckoned [rad/s or N], shape (B, n).
        fresh: 1 before the first call, when the drives are taken to be where they are wanted.
    """

    sum: Array
    turn_sum: Array
    drive: Array
    fresh: Array


class CascadeBatch:
    """Velocity control by the law of `Cascade`, joints held, on any array library.

    Args:
        settings: the cascade.
        plant: the robot; its centre of gravity is that of the held posture.
        joints: held joint values [rad or m], shape (J,).
        like: array whose library, type and device to use.
        weights: of lift, roll, pitch and yaw where the rotors cannot do it all.

    Raises:
        ConfigError: the cascade has a gain on the rate of the velocity.
    """

    def __init__(
        self, settings: CascadeSettings, plant: Plant, joints: Array, like: Array, weights: Array
    ) -> None:
        if max(settings.rate_gain) > 0.0:
            raise ConfigError(
                f"controller.rate_gain={list(settings.rate_gain)} has no form over a batch.\n"
                "Allowed: [0.0, 0.0]"
            )
        at = MassPropertyEstimator(plant.robot).at(np.asarray(joints, dtype=float))
        self._settings, self._like, self._g = settings, like, plant.gravity
        self._mass, self._centre = at.mass, as_like(at.centre[None], like)
        self._inertia = as_like(at.inertia, like)
        added = added_inertia(plant)
        self._added, self._added_turn = as_like(added[:3, :3], like), as_like(added[3:, 3:], like)
        self._drag = as_like(water_drag(plant)[None], like)
        self._allocation = BatchAllocation(
            plant, at.centre, like, saturation=settings.saturation, weights=weights
        )
        layout = plant.layout
        self._rise = as_like(np.maximum(layout.lag, NONE)[None], like)
        self._fall = as_like(np.maximum(layout.fall, NONE)[None], like)
        self._drives = layout.drives
        pairs: Any = zip(settings.gains(0), settings.gains(1), strict=True)
        self._gains = [tuple(as_like(np.atleast_2d(x), like) for x in pair) for pair in pairs]

    def start(self, batch: int) -> BatchMemory:
        """Return zero integrators."""
        zero = as_like(np.zeros((batch, 3)), self._like)
        drive = as_like(np.zeros((batch, self._drives)), self._like)
        return BatchMemory(zero, zero, drive, drive[:, 0:1] + 1.0)

    def command(
        self, view: View, velocity: Array, yaw: Array, memory: BatchMemory
    ) -> tuple[Array, BatchMemory]:
        """Return rotor speeds, shape (B, n), and the new state."""
        xp = namespace(velocity)
        wet = view.submersion
        gains = Gains(*(air + wet * (water - air) for air, water in self._gains))
        at_centre = _turned(
            view.rotation, cross(view.angular_velocity, self._centre + view.angular_velocity * 0.0)
        )
        error = velocity - view.velocity - at_centre
        asked = short(gains.speed * error + gains.sum * memory.sum, self._settings.acceleration)
        force = self._force(view, asked, velocity)
        least = gains.least * (self._mass * self._g)
        lean = lean_of(force, yaw, tilt=gains.tilt, least=least)
        turn_error = error_of(view.rotation, lean)
        want = -gains.turn * turn_error - gains.spin * view.angular_velocity
        want = want - gains.turn_sum * gains.shape * memory.turn_sum
        torque = self._torque(view, want)
        lift = xp.sum(force * view.rotation[:, :, 2], axis=1, keepdims=True)
        wanted = self._allocation.commands(xp.concat((lift, torque), axis=1), view)
        drive = xp.where(memory.fresh > 0.5, wanted, memory.drive)
        order = self._quickened(wanted, drive, view)
        held = xp.any(wanted >= (1.0 - 1e-6) * view.limit, axis=1)[:, None]
        total = _summed(memory.sum, error, view.step, gains.sum_limit)
        turn_total = _summed(memory.turn_sum, turn_error, view.step, gains.turn_sum_limit)
        lag = xp.where(xp.abs(order) < xp.abs(drive), self._fall, self._rise)
        after = order + (drive - order) * xp.exp(-view.step / lag)
        kept = BatchMemory(
            xp.where(held, memory.sum, total),
            xp.where(held, memory.turn_sum, turn_total),
            after,
            memory.fresh * 0.0,
        )
        return order, kept

    def _quickened(self, wanted: Array, drive: Array, view: View) -> Array:
        """Commands that make the drives follow faster than by their own lag."""
        xp = namespace(wanted)
        lag = xp.where(xp.abs(wanted) < xp.abs(drive), self._fall, self._rise)
        ahead = drive + self._settings.quicker * (wanted - drive) * (lag / self._rise)
        order = xp.where(self._rise > NONE, ahead, wanted)
        return xp.minimum(xp.maximum(order, view.low), view.limit)

    def _force(self, view: View, asked: Array, velocity: Array) -> Array:
        """Force the rotors shall make, world axes [N]."""
        xp = namespace(asked)
        carried = _unturned(view.rotation, asked) @ self._added.T
        through = _unturned(view.rotation, velocity)
        met = self._drag * xp.abs(through) * through
        force = self._mass * asked + view.submersion * _turned(view.rotation, carried + met)
        up = self._mass * self._g - view.buoyancy
        return xp.concat((force[:, :2], force[:, 2:3] + up), axis=1)

    def _torque(self, view: View, want: Array) -> Array:
        """Torque about the centre of gravity that the rotors shall make [N m]."""
        turned = want @ self._inertia.T + view.submersion * (want @ self._added_turn.T)
        torque = turned + cross(view.angular_velocity, view.angular_velocity @ self._inertia.T)
        up = view.buoyancy * view.rotation[:, 2, :]
        return torque - cross(view.buoyancy_centre - self._centre, up)


def _turned(rotation: Array, vector: Array) -> Array:
    return namespace(rotation).matmul(rotation, vector[:, :, None])[:, :, 0]


def _unturned(rotation: Array, vector: Array) -> Array:
    return namespace(rotation).matmul(vector[:, None, :], rotation)[:, 0, :]


def short(vector: Array, longest: float) -> Array:
    """Return vectors limited to a length, shape (B, 3)."""
    xp = namespace(vector)
    length = xp.sqrt(xp.sum(vector * vector, axis=1, keepdims=True))
    return vector * xp.minimum(
        longest / xp.maximum(length, length * 0.0 + 1e-9), length * 0.0 + 1.0
    )


def _summed(total: Array, error: Array, step: float, most: Array) -> Array:
    xp = namespace(total)
    return xp.minimum(xp.maximum(total + step * error, -most), most)
