"""Clear sky: radiance by direction."""

from __future__ import annotations

from seals.arrays import Array, namespace
from seals.rendering.optics.path import channels


def sky(zenith: tuple[float, ...], horizon: tuple[float, ...], rise: Array) -> Array:
    """Return the radiance of the sky.

    Equation:
        L = L_zenith + (L_horizon - L_zenith) (1 - u)^4.

    Args:
        zenith: radiance straight up, red, green, blue; white in full light is one.
        horizon: radiance at the horizon.
        rise: u, upward component of the direction [1], shape (N, H, W).

    Returns:
        Radiance, shape (3, N, H, W).

    Limitations:
        The sun itself is not in it; no direction but up counts.
    """
    xp = namespace(rise)
    low = 1.0 - xp.clip(rise, 0.0, 1.0)
    share = (low * low) * (low * low)
    top = channels(zenith, rise)
    return top + (channels(horizon, rise) - top) * share[None]
