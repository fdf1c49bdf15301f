"""What the drives can do at their present place: rotors push harder, and slower, under water."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.control.plant import Plant
from seals.effects.binding import BoundEffect
from seals.effects.evaluation import take, take_motion
from seals.medium.sample import Sample
from seals.motion import Inputs, Motion

KNOWN = "thrust in water"
"""Phenomenon that a controller knows of its drives; all other changes are hidden from it."""


class ThrustGauge:
    """Gains and limits of all drives at one instant, by the model of the robot.

    Args:
        plant: the robot in its surroundings.
    """

    def __init__(self, plant: Plant) -> None:
        """Find the effects that the model knows."""
        effects = plant.effects
        self._layout, self._actuators = plant.layout, effects.actuators
        self._laws = [b for b in effects.actuations if KNOWN in b.effect.accounts_for]
        self._ones = np.ones(self._layout.drives)
        self._dry = plant.environment.water_level is None or not self._laws
        self._full = Inputs(0.0, np.zeros((1, 0)), self._layout.limit[None])

    def now(self, motion: Motion, sample: Sample) -> tuple[Floats, Floats]:
        """Return thrust against that in the drive's own map at one command, and largest commands.

        Args:
            motion: of all links.
            sample: the surroundings at all links.

        Returns:
            Gains [1] and limits [rad/s or N], shape (n,) each.
        """
        if self._dry:
            return self._ones, self._layout.limit
        gain = self._ones.copy()
        for actuator in self._actuators:
            first = actuator.hooks.first
            gain[first : first + actuator.hooks.count] = self._gain(actuator, motion, sample)
        return gain, self._layout.limit

    def _gain(self, actuator: BoundEffect, motion: Motion, sample: Sample) -> Floats:
        own = actuator.hooks.drives(self._full, actuator.params)
        drives = own
        for law in self._laws:
            if law.links == actuator.links:
                rows = slice(law.links[0], law.links[-1] + 1)
                part, medium = take_motion(motion, rows), take(sample.view(law.kind), rows)
                drives = law.hooks.actuation(drives, part, medium, self._full, law.params)
        ratio: Floats = (drives.thrust / own.thrust)[0]
        return ratio
