"""Stepping patterns: the phase of every leg in the gait cycle."""

from __future__ import annotations

import enum
from typing import Any

import numpy as np

from seals.arrays import Array, namespace
from seals.plugins.controllers.walking.anatomy import Anatomy


class Pattern(enum.Enum):
    """Names of stepping patterns.

    tripod: every second leg at once, both sides against each other; on eight legs this is the
    alternating tetrapod. tetrapod: thirds of the legs, one after the other. ripple: waves from the
    rear to the front, both sides half a cycle apart. wave: one leg after the other. trot: the
    diagonal pairs of four legs. crawl: one of four legs after the other, the fore leg of a side
    after its hind leg, with a rest on all four before each (McGhee and Frank 1968).
    """

    tripod = "tripod"
    tetrapod = "tetrapod"
    ripple = "ripple"
    wave = "wave"
    trot = "trot"
    crawl = "crawl"


DUTY = {
    Pattern.tripod: 0.5,
    Pattern.tetrapod: 2.0 / 3.0,
    Pattern.ripple: 0.7,
    Pattern.trot: 0.55,
    Pattern.crawl: 0.85,
}
"""Share of the cycle on the ground with which the groups of a pattern relieve each other [1]."""


def phases_of(pattern: Pattern, anatomy: Anatomy) -> Array:
    """Return the phase of every leg, as a share of the cycle, shape (N,)."""
    rank, side = anatomy.rank, anatomy.side
    count = float(rank.max()) + 1.0
    if pattern in (Pattern.tripod, Pattern.trot):
        return lagged(anatomy, 0.5, 0.5)
    if pattern is Pattern.tetrapod:
        return lagged(anatomy, 1.0 / 3.0, 1.0 / 3.0)
    if pattern is Pattern.ripple:
        return lagged(anatomy, 1.0 / count, 0.5)
    return np.mod((rank + side * count) / (2.0 * count), 1.0)


def lagged(anatomy: Anatomy, along: Any, across: Any) -> Array:
    """Return phases with a lag between neighbouring legs and one between the sides, (N,) or (B, N).

    Args:
        anatomy: of the animal.
        along: lag of a leg behind the one in front of it [cycles], a number or shape (B, 1).
        across: lag of the right side behind the left [cycles], likewise.
    """
    phases = along * anatomy.rank + across * anatomy.side
    return phases - namespace(phases).floor(phases)


def duty_of(pattern: Pattern, legs: int) -> float:
    """Return the duty factor of a pattern [1].

    Example:
        >>> duty_of(Pattern.tripod, 6)
        0.5
    """
    return DUTY.get(pattern, 1.0 - 1.0 / legs)
