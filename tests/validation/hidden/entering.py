"""Added mass of an entering hull along the vertical: that of a sphere of like course."""

from __future__ import annotations

import numpy as np

from tests.validation.hidden.rotation import Array, cross

SERIES = (4.8812, -2.6969, -3.8049, 1.6756, 1.9433, -0.9983)
ONSET, BLEND = 0.005, 0.1
LOW = 1.0 - np.sqrt(0.5)
WAYS = np.concatenate((np.eye(3), -np.eye(3)))


def mass_share(x: Array) -> Array:
    """Added mass against that of a half sphere, x the wet volume against half of the sphere's."""
    x = np.clip(x, 0.0, 1.0)

    def softened(x: Array) -> Array:
        q = (x + ONSET) ** 0.25
        out: Array = x * np.polyval(SERIES[::-1], q) / q
        return out

    return softened(x) / softened(np.ones(1))


def widest(place: Array, share: Array, volume: Array, thick: Array) -> Array:
    """Wet share (6, n) at which a hull of cells is at its widest, for water along `WAYS`."""
    out = np.empty((6, share.shape[1]))
    for row, way in enumerate(WAYS):
        for case in range(share.shape[1]):
            up, part = way @ place[:, :, case], share[:, case]
            half = 0.5 * float(np.max(thick if np.ndim(thick) == 0 else thick[case]))
            levels = np.linspace(up.min() - half, up.max() + half, 161)
            wet = (part * np.clip((levels[:, None] - up) / (2.0 * half) + 0.5, 0.0, 1.0)).sum(1)
            area = np.gradient(wet, levels) * volume[case]
            first = levels[int(np.argmax(area >= 0.5 * area.max()))]
            radius = min(np.sqrt(area.max() / np.pi), 0.5 * (levels[-1] - levels[0]))
            level = max(first, levels[0] + LOW * radius)
            out[row, case] = np.interp(level, levels, wet) / (LOW**2 * (3.0 - LOW) / 2.0)
    return out


def beyond(
    wet: Array, up: Array, centroid: Array, added: Array, widest_at: Array
) -> tuple[Array, Array, Array]:
    """Mass e (n,), its slope with the wet share and its direction h (6, n)."""
    ahead, back = np.maximum(up, 0.0) ** 2, np.maximum(-up, 0.0) ** 2
    full = (widest_at[:3] * ahead + widest_at[3:] * back).sum(0)
    along = (up**2 * added[:3]).sum(0)

    def mass(s: Array) -> Array:
        y = np.maximum(0.5 * mass_share(s / full) - s, 0.0)
        out: Array = along * y * y / (y + BLEND * s + 1e-12)
        return out

    d = 1e-5
    slope = (mass(wet + d) - mass(np.maximum(wet - d, 0.0))) / (wet + d - np.maximum(wet - d, 0.0))
    return mass(wet), slope, np.concatenate((up, cross(centroid, up)))
