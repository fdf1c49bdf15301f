"""Still water: a flat surface at rest."""

from __future__ import annotations

from dataclasses import dataclass

from seals.arrays import Array
from seals.environment.waves import Sea, WaveOptions


@dataclass(kw_only=True)
class WaveStill(WaveOptions):
    """Still water at the mean level.

    Equation:
        eta = 0.

    Args:
        None.

    Assumptions:
        No motion of the water but a current.

    Valid range:
        Tanks and calm days.

    Limitations:
        None within its purpose.

    References:
        None needed.

    Example:
        >>> WaveStill().at(None, None, 0.5).elevation
        0.5
    """

    def at(self, position: Array, time: Array, level: float) -> Sea:
        """Return the flat sea."""
        return Sea(level, None, None, None, None)
