"""Limits and gains of the drives in their present medium, air or water; batch first."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Array, as_like, namespace, some
from seals.control.plant import ROTOR, Plant
from seals.effects.binding import BoundEffect, EffectSet, rows_of
from seals.environment.sample import Sample
from seals.motion import Inputs, Motion
from seals.multibody.kinematics import take, take_motion

KNOWN = "thrust in water"
"""Phenomenon that a controller knows of its drives; all other changes are hidden from it."""
SLOW = 1e-3
"""Share of the largest command at which the gain is found."""


WET = 10.0
"""Gain of a rotor above which it may be turned back: in air it would have to stop first."""


class ActuatorLimits(NamedTuple):
    """Limits and gains of the drives in their present medium, shape (B, n) each.

    Args:
        gain: thrust against that of the drive's own map at one command [1].
        limit: largest commands [rad/s or N].
        low: lowest commands; rotors are turned back under water only [rad/s or N].
    """

    gain: Array
    limit: Array
    low: Array


class ActuatorLimitEstimator:
    """Estimator of gains and limits of all drives from the model of the robot.

    Args:
        plant: the robot in its surroundings.
        effects: bound to the links of a batch, in the library of ``like``; None for the plant's.
        links: number of links that they are bound to; None for those of the plant.
        like: array whose library, type and device to use; None for NumPy.
        batch: number of robots B.
    """

    def __init__(
        self,
        plant: Plant,
        effects: EffectSet | None = None,
        *,
        links: int | None = None,
        like: Array | None = None,
        batch: int = 1,
    ) -> None:
        layout, effects = plant.layout, plant.effects if effects is None else effects
        like = np.zeros(1) if like is None else like
        self._links, self._batch = len(plant.robot.links) if links is None else links, batch
        self._actuators = sorted(effects.actuators, key=lambda b: b.hooks.first)
        self._laws = [b for b in effects.actuations if KNOWN in b.effect.accounts_for]
        self._rotors = as_like([[float(kind == ROTOR) for kind in layout.kind]], like)
        self._limit, self._low = as_like(layout.limit[None], like), as_like(layout.low[None], like)
        one = as_like(np.ones((batch, layout.drives)), like)
        self._air = ActuatorLimits(one, one * self._limit, one * self._low * (1.0 - self._rotors))
        self._wet = plant.environment.water_level is not None and bool(self._laws)
        # no disc touches the water when all links are this far above it
        self._far = 0.1 + 2.0 * float(np.abs(layout.position).max(initial=0.0))
        joints = as_like(np.zeros((1, 0)), like)
        # a motor at the end of its torque hides what a slow rotor does
        self._probes = [Inputs(0.0, joints, share * self._limit) for share in (SLOW, 1.0)]
        self._own = {
            b.name: [b.hooks.drives(probe, b.params) for probe in self._probes]
            for b in self._actuators
        }

    def now(self, motion: Motion, sample: Sample) -> ActuatorLimits:
        """Return the limits and gains at one instant; rows of the arguments link by link."""
        if not self._wet or sample.depth is None or not some(sample.depth >= -self._far):
            return self._air
        xp, one = namespace(self._limit), self._air.gain
        gains, shares = [], []
        for actuator in self._actuators:
            slow, full = self._gains(actuator, motion, sample)
            gains.append(slow)
            # as many commands as make the largest thrust: more of them make no more
            shares.append(xp.minimum(full / slow, slow * 0.0 + 1.0))
        gain, share = one * xp.concat(gains, axis=1), xp.concat(shares, axis=1)
        share = self._rotors * xp.sqrt(share) + (1.0 - self._rotors) * share
        still = self._rotors * xp.astype(gain < WET, gain.dtype)
        return ActuatorLimits(gain, self._limit * share, self._low * share * (1.0 - still))

    def _gains(self, actuator: BoundEffect, motion: Motion, sample: Sample) -> list[Array]:
        """Thrust relative to the drive's own map, at low speed and at its limit, (B, k) each."""
        rows = rows_of(actuator.links, self._links, self._batch)
        part, out = take_motion(motion, rows), []
        for probe, own in zip(self._probes, self._own[actuator.name], strict=True):
            drives = own
            for law in self._laws:
                if law.links == actuator.links:
                    medium = take(sample.view(law.kind), rows)
                    drives = law.hooks.actuation(drives, part, medium, probe, law.params)
            out.append(drives.thrust / own.thrust)
        return out
