"""Immersion and actuator limits of every robot of a batch, for controllers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from seals.arrays import Array, as_like, namespace, some
from seals.control.actuator_limits import KNOWN, SLOW, WET
from seals.control.plant import ROTOR, Plant
from seals.effects.binding import BoundEffect, EffectSet
from seals.effects.rows import rows_of
from seals.environment.sample import Sample
from seals.motion import Inputs, Motion
from seals.multibody.rows import take, take_motion


class BatchActuatorLimits(NamedTuple):
    """Limits and gains of the drives, shape (B, n) each; see `ActuatorLimits`."""

    gain: Array
    limit: Array
    low: Array


class BatchActuatorLimitEstimator:
    """Estimator of gains and limits of all drives of a batch from the model of the robot.

    Args:
        plant: the robot.
        effects: bound to the links of the batch, in the library of ``like``.
        links: number of links.
        like: array whose library, type and device to use.
        batch: B.
    """

    def __init__(
        self, plant: Plant, effects: EffectSet, *, links: int, like: Array, batch: int
    ) -> None:
        layout = plant.layout
        self._links, self._batch = links, batch
        self._actuators = effects.actuators
        self._laws = [b for b in effects.actuations if KNOWN in b.effect.accounts_for]
        self._rotors = as_like([[float(kind == ROTOR) for kind in layout.kind]], like)
        self._limit, self._low = as_like(layout.limit[None], like), as_like(layout.low[None], like)
        self._ones = as_like(np.ones((batch, layout.drives)), like)
        self._wet = plant.environment.water_level is not None and bool(self._laws)
        self._far = 0.1 + 2.0 * float(np.abs(layout.position).max(initial=0.0))
        joints = as_like(np.zeros((1, 0)), like)
        self._probes = [Inputs(0.0, joints, share * self._limit) for share in (SLOW, 1.0)]
        self._own = {
            b.name: [b.hooks.drives(probe, b.params) for probe in self._probes]
            for b in self._actuators
        }

    def now(self, motion: Motion, sample: Sample) -> BatchActuatorLimits:
        """Return the actuator limits; rows of motion and sample link by link."""
        xp, one = namespace(self._ones), self._ones
        dry = BatchActuatorLimits(one, one * self._limit, one * self._low * (1.0 - self._rotors))
        if not self._wet or sample.depth is None or not some(sample.depth >= -self._far):
            return dry
        gains, shares = [], []
        for actuator in self._actuators:
            slow, full = self._gains(actuator, motion, sample)
            gains.append(slow)
            shares.append(xp.minimum(full / slow, slow * 0.0 + 1.0))
        gain = one * xp.concat(gains, axis=1)
        share = xp.concat(shares, axis=1)
        share = self._rotors * xp.sqrt(share) + (1.0 - self._rotors) * share
        still = self._rotors * xp.astype(gain < WET, gain.dtype)
        return BatchActuatorLimits(gain, self._limit * share, self._low * share * (1.0 - still))

    def _gains(self, actuator: BoundEffect, motion: Motion, sample: Sample) -> list[Array]:
        """Thrust relative to the drive's own map, at low speed and at its limit."""
        rows = rows_of(actuator.links, self._links, self._batch)
        part = take_motion(motion, rows)
        out = []
        for probe, own in zip(self._probes, self._own[actuator.name], strict=True):
            drives = own
            for law in self._laws:
                if law.links == actuator.links:
                    medium = take(sample.view(law.kind), rows)
                    drives = law.hooks.actuation(drives, part, medium, probe, law.params)
            out.append(drives.thrust / own.thrust)
        return out


class BatchImmersionEstimator:
    """Estimator of the total submersion and buoyancy of every robot of a batch.

    Args:
        places: origins of the links in the base [m], each (1, 3).
        turns: rotations of the links in the base, each (3, 3).
        volume: displaced by every link when submerged [m^3], rows link by link or one.
        gravity: [m/s^2].
    """

    def __init__(
        self, places: Sequence[Array], turns: Sequence[Array], volume: Array, gravity: float
    ) -> None:
        self._places, self._turns, self._gravity = places, turns, gravity
        self._volume = volume

    def now(self, sample: Sample) -> tuple[Array, Array, Array]:
        """Return submersion (B, 1), buoyancy [N] (B, 1) and its centre, base axes [m] (B, 3)."""
        xp = namespace(sample.submersion)
        wet = self._volume * sample.submersion
        weight = wet * sample.water_density
        batch = sample.normal.shape[0] // len(self._turns)
        zero = sample.normal[:batch, 0:1] * 0.0
        whole, volume, force, moment = zero, zero, zero, sample.normal[:batch] * 0.0
        for k, (place, turn) in enumerate(zip(self._places, self._turns, strict=True)):
            rows = slice(k * batch, (k + 1) * batch)
            own = _rows(weight, rows)
            centre = _rows(sample.buoyancy_centre, rows) @ turn.T + place
            whole = whole + _rows(self._volume, rows)
            volume, force = volume + _rows(wet, rows), force + own
            moment = moment + own * centre
        centre = moment / xp.maximum(force, force * 0.0 + 1e-9)
        return volume / whole, force * self._gravity, centre


def _rows(x: Array, rows: slice) -> Array:
    return x if x.shape[0] == 1 else x[rows]
