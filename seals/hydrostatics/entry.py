"""Course of the added mass of a hull that enters the water, after that of a sphere."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.hydrostatics.compound import HullCompound
from seals.hydrostatics.octahedron import Cuttable
from seals.hydrostatics.placed import HullPlaced
from seals.hydrostatics.wetted import Hull

COURSE = (4.8812, -2.6969, -3.8049, 1.6756, 1.9433, -0.9983)
"""Coefficients of `course`. The first is Wagner's limit (4 / pi) 3^(3/2) (2 / 3)^(3/4); the others
are fitted to the potential flow about lenses, their sum is one."""
SOFT = 0.005
"""Submerged part, of half a sphere, within which the onset of `course` is softened [1].

To 0.06 radii the force grows with the depth, not with its root, whose beginning no step resolves.
"""
_ROOT = (1.0 + SOFT) ** 0.25
_END = sum(c * _ROOT ** (k - 1) for k, c in enumerate(COURSE))
"""The series at x = 1."""
LEVELS, ROUNDS = 65, 3
"""Levels at which a hull is cut at once, and how often the interval between two is cut again."""
TOUCHED = 1e-9
"""Submerged share at which a hull counts as touching the water [1]."""
HALF = 1.0 - math.sqrt(0.5)
"""Depth of a sphere at which its waterline encloses half of its widest circle [radii]."""
HALF_SHARE = HALF * HALF * (3.0 - HALF) / 4.0
"""Submerged share of a sphere at that depth [1]."""
ELLIPSOID = np.full(6, 0.5)
"""Entry shares of an ellipsoid [1]."""
WAYS = np.concatenate((np.eye(3), -np.eye(3)))
"""Normals of the surface, link axes, for which `entry_shares` are given."""


def course(part: Array) -> tuple[Array, Array]:
    """Return the added mass of an entering sphere, as a share of that at one radius, and its slope.

    Equation:
        S(x) = L(b (3 - b) / 2) / L(1), x = b^2 (3 - b) / 2 the volume below the undisturbed
        surface against half of the sphere's, b the depth in radii. L(b) is the added mass of the
        lens below the surface: half of that of the rigid body made of the spherical cap and its
        mirror image, since the potential vanishes on the surface; L -> (4/3) rho c^3 (disc of
        radius c, b -> 0), L(1) = (pi/3) rho R^3 (half sphere). The water rises at the body: by
        Wagner's half of the depth at first (c^2 = 3 R h), by nothing when the sides are vertical.
        S is a series in x^(1/4) within 0.1 % of lenses by source rings, x^(3/4) P(x^(1/4)),
        softened to x (x + d)^(-1/4) P((x + d)^(1/4)) with d = 0.005.

    Args:
        part: x, clipped to 0 ... 1 [1], any shape.

    References:
        von Karman 1929, NACA TN 321; Wagner 1932, ZAMM 12; Shiffman and Spencer 1947, Quart. Appl.
        Math. 5 (lens); Lamb 1932, art. 102 (disc).

    Example:
        >>> import numpy as np
        >>> share, slope = course(np.array([0.0, 0.0145, 1.0]))
        >>> [round(float(s), 2) for s in share]
        [0.0, 0.13, 1.0]
    """
    xp = namespace(part)
    x = xp.clip(part, 0.0, 1.0)
    root = xp.sqrt(xp.sqrt(x + SOFT))
    inner, steep = 0.0 * root, 0.0 * root
    for k, factor in reversed(list(enumerate(COURSE))):
        inner = inner * root + factor
        steep = steep * root + factor * (k - 1.0)
    below = xp.astype(part < 1.0, x.dtype)
    # d/dx (P / q) = (q P' - P) / q^2 / (4 q^3), and q^4 = x + d
    slope = (inner + 0.25 * x / (x + SOFT) * steep) / root
    return x * inner / (root * _END), below * slope / _END


def entry_shares(hull: Hull) -> Floats:
    """Return how much of a hull is submerged when a sphere of the same course is half immersed.

    Equation:
        s_e = s' / (2 s_1): s' is the share of the hull at which its waterplane first reaches half
        of its widest area A, s_1 that of a sphere, so that s_e = 1/2 for spheres and ellipsoids. A
        flat face takes its momentum up over some way, too, lest a step miss it: s' is at least the
        share at the depth 0.293 r, that of a sphere of radius r, the lesser of (A / pi)^(1/2) and
        half of the hull's height.

    Args:
        hull: the hull.

    Returns:
        Shares for surfaces with the normals `WAYS` in link axes [1], shape (6,).

    Example:
        >>> from seals.hydrostatics import HullSphere
        >>> entry_shares(HullSphere(radius=0.2)).round(3)
        array([0.5, 0.5, 0.5, 0.5, 0.5, 0.5])
    """
    touching, reach = TOUCHED * hull.volume, np.full(len(WAYS), hull.reach)
    low = _first(hull, lambda volume, _: volume > touching, -reach, reach)
    # the highest point is the lowest one along the opposite normal
    height = -low - np.roll(low, 3)
    # half of the widest waterplane, but not above the depth of a sphere
    widest = _cuts(hull, _levels(low, low + height))[1].max(axis=1)
    half = _first(hull, lambda _, area: area >= 0.5 * widest[:, None], low, low + height)
    radius = np.minimum(np.sqrt(widest / math.pi), 0.5 * height)
    level = np.maximum(half, low + HALF * radius)
    found: Floats = _cuts(hull, level[:, None])[0][:, 0] / hull.volume * 0.5 / HALF_SHARE
    return found


def entry_share(shares: Array | None, normal: Array) -> Array:
    """Return the share of `entry_shares` for a surface of any normal, shape (N, 1).

    Args:
        shares: for the normals `WAYS`, shape (1 or N, 6); None for those of an ellipsoid.
        normal: of the surface, link axes [1], shape (N, 3).
    """
    xp = namespace(normal)
    if shares is None:
        return 0.0 * normal[:, 0:1] + 0.5
    ahead, back = xp.clip(normal, 0.0, None), xp.clip(-normal, 0.0, None)
    both = shares[:, :3] * ahead * ahead + shares[:, 3:] * back * back
    return both[:, 0:1] + both[:, 1:2] + both[:, 2:3]


def _levels(low: Floats, high: Floats) -> Floats:
    return np.linspace(low, high, LEVELS, axis=1)


def _first(hull: Hull, test: Callable[[Floats, Floats], Any], low: Floats, high: Floats) -> Floats:
    """Return the lowest levels at which a test of volume and waterplane area holds [m].

    Args:
        hull: the hull.
        test: of shapes (6, K).
        low: where it does not hold, for the normals `WAYS` [m], shape (6,).
        high: where it does.
    """
    rows = np.arange(len(WAYS))
    for _ in range(ROUNDS):
        # each round narrows the interval by LEVELS - 1
        levels = _levels(low, high)
        k = np.argmax(test(*_cuts(hull, levels)), axis=1)
        low, high = levels[rows, np.maximum(k - 1, 0)], levels[rows, k]
    return high


def _cuts(hull: Hull, levels: Floats) -> tuple[Floats, Floats]:
    """Return submerged volume [m^3] and waterplane area [m^2] for the normals `WAYS`.

    Args:
        hull: the hull.
        levels: some of each normal [m], shape (6, K), as the results.
    """
    if isinstance(hull, HullPlaced):
        x, y, z = np.repeat(WAYS, levels.shape[1], axis=0).T
        sums = hull.sums(np, x, y, z, levels.ravel())
        return sums.volume.reshape(levels.shape), sums.area.reshape(levels.shape)
    if isinstance(hull, HullCompound):
        found = [_cuts(part, levels - (WAYS @ hull.lift)[:, None]) for part in hull.parts]
        volume, area = (sum(column) for column in zip(*found, strict=True))
        return hull.scale * volume, hull.scale * area
    each = zip(WAYS, levels, strict=True)
    # one normal at a time: a hull of many samples takes the memory of all levels
    rows = np.stack([cast(Cuttable, hull).cut(up[None], own[None])[0] for up, own in each])
    return rows[:, :, 0], rows[:, :, 4]
