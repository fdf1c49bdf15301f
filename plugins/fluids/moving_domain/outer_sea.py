"""Outer sea around the moving domain: linear waves, advected by a current.

Lagrangian coordinates: water is labelled by its place of rest X in axes that move with the
current; its position is

    x = X + U t + xi(X, t),

with the displacement xi of the waves. In these axes the window is a box, and the sea is at rest.
"""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.environment.waves import Orbits, Waves
from seals.errors import ConfigError

ROUNDS = 3
"""Fixed-point iterations to find a place of rest; each gains a factor of the steepness."""


class OuterSea:
    """Linear waves and current around the moving domain.

    Args:
        wave: of the environment.
        level: mean surface height [m].
        current: east and north [m/s].

    Raises:
        ConfigError: the wave does not know how far it carries the water.
    """

    def __init__(self, wave: Waves, level: float, current: tuple[float, float]) -> None:
        still = wave.at(np.zeros((1, 3)), np.zeros((1, 1)), level).velocity is None
        if not still and not isinstance(wave, Orbits):
            raise ConfigError(
                f"wave={type(wave).__name__}: a window of particles needs the displacement of the "
                "water by the waves.\nUse wave=sea or wave=airy, or one with "
                "seals.environment.waves.Orbits."
            )
        self._orbits = wave if isinstance(wave, Orbits) and not still else None
        self.wave, self.level = wave, level
        self.current = np.array([*current, 0.0])

    @property
    def shortest(self) -> float:
        """Length of the shortest wave [m]; infinite for none."""
        return np.inf if self._orbits is None else self._orbits.shortest

    def displacement(self, rest: Floats, time: float) -> Floats:
        """Return the displacement of water particles by their rest positions [m], shape (n, 3)."""
        if self._orbits is None:
            return np.zeros_like(rest)
        return np.asarray(self._orbits.displacement(rest, np.array([[time]]), self.level))

    def places(self, rest: Floats, time: float) -> Floats:
        """Return the world positions of water particles by rest positions [m], shape (n, 3)."""
        return rest + self.current * time + self.displacement(rest, time)

    def rest(self, places: Floats, time: float) -> Floats:
        """Return the rest positions of the water particles at world positions [m], shape (n, 3)."""
        here = places - self.current * time
        out: Floats = here
        if self._orbits is not None:
            for _ in range(ROUNDS):
                out = here - self.displacement(out, time)
        return out

    def velocity(self, rest: Floats, time: float) -> Floats:
        """Return the velocity of water particles by their rest positions [m/s], shape (n, 3)."""
        out = np.repeat(self.current[None], len(rest), axis=0)
        if self._orbits is not None:
            out += np.asarray(self.wave.at(rest, np.array([[time]]), self.level).velocity)
        return out

    def elevation(self, places: Floats, time: float) -> Floats:
        """Return the surface height over world positions [m], shape (n,)."""
        here = np.zeros((len(places), 3))
        here[:, :2] = np.asarray(places)[:, :2] - self.current[:2] * time
        found = np.asarray(self.wave.at(here, np.array([[time]]), self.level).elevation)
        return np.broadcast_to(found, (len(places), 1))[:, 0].astype(float)
