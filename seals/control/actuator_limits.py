"""Limits and gains of the drives in their present medium: air or water."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control.plant import ROTOR, Plant
from seals.effects.binding import BoundEffect
from seals.environment.sample import Sample
from seals.motion import Inputs, Motion
from seals.multibody.rows import take, take_motion

KNOWN = "thrust in water"
"""Phenomenon that a controller knows of its drives; all other changes are hidden from it."""
SLOW = 1e-3
"""Share of the largest command at which the gain is found."""


WET = 10.0
"""Gain of a rotor above which it may be turned back: in air it would have to stop first."""


class ActuatorLimits(NamedTuple):
    """Limits and gains of the drives in their present medium, shape (n,) each.

    Args:
        gain: thrust against that of the drive's own map at one command [1].
        limit: largest commands [rad/s or N].
        low: lowest commands; rotors are turned back under water only [rad/s or N].
    """

    gain: Floats
    limit: Floats
    low: Floats


class ActuatorLimitEstimator:
    """Estimator of gains and limits of all drives from the model of the robot.

    Args:
        plant: the robot in its surroundings.
    """

    def __init__(self, plant: Plant) -> None:
        effects = plant.effects
        self._layout, self._actuators = plant.layout, effects.actuators
        self._laws = [b for b in effects.actuations if KNOWN in b.effect.accounts_for]
        self._rotors = np.array([kind == ROTOR for kind in plant.layout.kind])
        self._ones = np.ones(self._layout.drives)
        # no disc touches the water when all links are this far above it
        self._far = 0.1 + 2.0 * float(np.abs(plant.layout.position).max(initial=0.0))
        dry_low = np.where(self._rotors, 0.0, self._layout.low)
        self._air = ActuatorLimits(self._ones, self._layout.limit, dry_low)
        self._dry = plant.environment.water_level is None or not self._laws
        # a motor at the end of its torque hides what a slow rotor does
        both = np.stack((SLOW * self._layout.limit, self._layout.limit))
        self._probe = Inputs(0.0, np.zeros((1, 0)), both)
        self._own = {b.name: b.hooks.drives(self._probe, b.params) for b in self._actuators}

    def now(self, motion: Motion, sample: Sample) -> ActuatorLimits:
        """Return the limits and gains at one instant."""
        if self._dry or (sample.depth is not None and float(sample.depth.max()) < -self._far):
            return self._air
        gain, share = self._ones.copy(), self._ones.copy()
        for actuator in self._actuators:
            columns = slice(actuator.hooks.first, actuator.hooks.first + actuator.hooks.count)
            slow, full = self._gains(actuator, motion, sample)
            gain[columns] = slow
            # as many commands as make the largest thrust: more of them make no more
            share[columns] = np.minimum(full / slow, 1.0)
        share = np.where(self._rotors, np.sqrt(share), share)
        low = np.where(self._rotors & (gain < WET), 0.0, self._layout.low * share)
        return ActuatorLimits(gain, self._layout.limit * share, low)

    def _gains(self, actuator: BoundEffect, motion: Motion, sample: Sample) -> Floats:
        """Ratio of the thrust to that without effects, at low and at full speed, shape (2, n)."""
        own = drives = self._own[actuator.name]
        for law in self._laws:
            if law.links == actuator.links:
                rows = slice(law.links[0], law.links[-1] + 1)
                part, medium = take_motion(motion, rows), take(sample.view(law.kind), rows)
                drives = law.hooks.actuation(drives, part, medium, self._probe, law.params)
        ratio: Floats = drives.thrust / own.thrust
        return ratio
