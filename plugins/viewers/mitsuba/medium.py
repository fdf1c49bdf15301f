"""Jerlov water types as participating media."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from seals.rendering.optics import Optics

FURTHEST = 0.95
"""Largest mean cosine of the phase function: beyond it is no scattering worth the name."""


def medium_of(optics: Optics) -> Mapping[str, Any] | None:
    """Return the medium of the water; None for water as clear as air.

    Equation:
        Extinction a + (1 - f) b, albedo (1 - f) b over it; f, the share that goes on nearly
        straight, is not scattered, as in `seals.rendering.optics`. The phase function is that of
        Henyey and Greenstein whose backward share is b_b / ((1 - f) b).
    """
    water, medium = optics.water, optics.medium
    if water is None or medium is None:
        return None
    scattered = [(1.0 - optics.forward_share) * b for b in water.scattering]
    back = [v - a for v, a in zip(medium.veiling, water.absorption, strict=True)]
    albedo = [s / max(t, 1e-9) for s, t in zip(scattered, medium.direct, strict=True)]
    # colours are at most one: the size goes into the scale
    scale = max(*medium.direct, 1e-6)
    return {
        "type": "homogeneous",
        "scale": scale,
        "sigma_t": {"type": "rgb", "value": [max(t / scale, 1e-6) for t in medium.direct]},
        "albedo": {"type": "rgb", "value": [min(max(x, 0.0), 0.999) for x in albedo]},
        "phase": {"type": "hg", "g": mean_cosine(back[1] / max(scattered[1], 1e-9))},
    }


def mean_cosine(backward: float) -> float:
    """Return the Henyey-Greenstein parameter g for a given backscatter fraction.

    Equation:
        B(g) = (1 - g) / (2 g) ((1 + g) / sqrt(1 + g^2) - 1).

    Args:
        backward: share of the light that is turned by more than a right angle [1].

    Example:
        >>> round(mean_cosine(0.5), 3), round(backward_share(mean_cosine(0.07)), 4)
        (0.0, 0.07)
    """
    low, high = 1e-4, FURTHEST
    if backward >= backward_share(low):
        return 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if backward_share(middle) > backward else (low, middle)
    return 0.5 * (low + high)


def backward_share(g: float) -> float:
    """Return the backscatter fraction of a Henyey-Greenstein phase function [1]."""
    return (1.0 - g) / (2.0 * g) * ((1.0 + g) / float((1.0 + g * g) ** 0.5) - 1.0)
