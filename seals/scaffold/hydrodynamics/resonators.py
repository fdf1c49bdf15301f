"""Fit of the retardation function of a floating hull by coupled resonators."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from seals.arrays import Floats
from seals.scaffold.hydrodynamics.boundary_elements import Radiation

TOLERANCE = 0.025
"""Root of the mean squared misfit of a group of motions, by its size, that ends the search [1]."""
MOST = 4
"""Largest number of resonators of one group of motions."""
COUPLED = 0.05
"""Cross term, by the root of its two diagonal ones, above which motions are coupled [1]."""
STARTS = 4
"""Starts of a search, for each resonator."""
_LEAST_DAMPING = 1e-3
_LIGHT = 1e-3
"""Added inertia of a motion, by that of the heaviest, below which it counts as none [1]."""
_WEAK = 1e-3
"""Radiation of a motion, by that of the strongest, below which it makes no waves [1]."""


class Resonators(NamedTuple):
    """Stable and passive model of K(iw) = B(w) + i w (A(w) - A_inf).

    Equation: K(s) = s G^T (s^2 + s D + W^2)^-1 G; see the effect `radiation_memory`.

    Args:
        frequency: W [rad/s], shape (m,).
        damping: D, symmetric and positive definite [1/s], shape (m, m).
        coupling: G, shape (m, 6).
        misfit: root of the mean squared difference of motions that make waves, in units of their
            added mass, by the size of K [1].
    """

    frequency: Floats
    damping: Floats
    coupling: Floats
    misfit: float


def fit_resonators(found: Radiation, *, tolerance: float = TOLERANCE) -> Resonators:
    """Fit coupled resonators to the radiation of a floating hull.

    Passive and stable by construction: D is a Cholesky product plus a little. It vanishes at zero
    and infinite frequency like the true function. Motions that are coupled by radiation share their
    resonators; each group gets as few as the tolerance allows.

    Args:
        found: added mass and damping over frequency.
        tolerance: misfit of a group of motions that is good enough [1].

    References: Perez and Fossen 2009, Modeling, Identification and Control 30(1): constraints on
        the model; Duindam et al. 2009, Modeling and Control of Complex Physical Systems, ch. 2:
        passive structure.
    """
    w, centre = found.frequency, float(found.frequency.mean())
    unit = np.sqrt(np.maximum(np.diag(found.limit), _least(found)))
    data = found.damping + 1j * w[:, None, None] * (found.added_mass - found.limit)
    data = data / np.outer(unit, unit) / centre
    # motions with significant radiation: rotation about an axis of symmetry has none
    power = np.abs(np.einsum("wii->wi", data)).max(axis=0) * (np.diag(found.limit) > _least(found))
    moving = [k for k in range(6) if power[k] > _WEAK * power.max()]
    groups = _groups(data, moving)
    parts = [_fit_group(data[:, g][:, :, g], w / centre, tolerance) for g in groups]
    count = sum(len(part.frequency) for part in parts)
    frequency, damping = np.zeros(count), np.zeros((count, count))
    coupling = np.zeros((count, 6))
    start = 0
    for part, group in zip(parts, groups, strict=True):
        own = slice(start, start + len(part.frequency))
        frequency[own], damping[own, own] = centre * part.frequency, centre * part.damping
        coupling[own, group] = centre * part.coupling * unit[group]
        start = own.stop
    apart = _transfer(frequency, damping, coupling, w) / np.outer(unit, unit) / centre - data
    size, wrong = (float(np.linalg.norm(x[:, moving][:, :, moving])) for x in (data, apart))
    misfit = wrong / size if size > 0.0 else 0.0
    return Resonators(frequency, damping, coupling, misfit)


def _least(found: Radiation) -> Floats:
    """Added inertia below which that of a motion is negligible, shape (6,)."""
    heaviest = max(float(np.diag(found.limit)[:3].max()), 1e-300)
    return _LIGHT * heaviest * np.array([1.0] * 3 + [found.length**2] * 3)


def _groups(data: Floats, motions: list[int]) -> list[list[int]]:
    """Groups of motions that are coupled by radiation."""
    size = np.abs(data).max(axis=0)
    scale = np.sqrt(np.diag(size))
    tied = size > COUPLED * np.outer(scale, scale)
    groups: list[list[int]] = []
    for k in motions:
        near = [g for g in groups if any(tied[k, j] for j in g)]
        groups = [g for g in groups if g not in near]
        groups.append(sorted([k, *(j for g in near for j in g)]))
    return groups


def _fit_group(data: Floats, w: Floats, tolerance: float) -> Resonators:
    """Smallest model of a group of motions within the tolerance, or else the best one."""
    best: Resonators | None = None
    for count in range(1, MOST + 1):
        found = _fit(data, w, count)
        best = found if best is None or found.misfit < best.misfit else best
        if best.misfit < tolerance:
            break
    assert best is not None
    return best


def _fit(data: Floats, w: Floats, count: int) -> Resonators:
    """Best least-squares fit from several random starts, with a fixed seed."""
    rng = np.random.default_rng(count)
    width = data.shape[1]
    size = float(np.linalg.norm(data))
    upper = np.triu_indices(width)

    def apart(x: Floats) -> Floats:
        wrong = _transfer(*_unpacked(x, count, width), w) - data
        return _real(wrong[:, upper[0], upper[1]]) / size

    def slopes(x: Floats) -> Floats:
        return np.asarray(_real(_slopes(x, count, width, w)[..., upper[0], upper[1]]).T / size)

    best = None
    for _ in range(STARTS * count):
        start = np.concatenate(
            (
                rng.uniform(-1.0, 0.7, count),
                rng.normal(size=count * (count + 1) // 2),
                rng.uniform(-0.7, 0.7, count * width),
            )
        )
        found = least_squares(apart, start, slopes, max_nfev=150)
        best = found if best is None or found.cost < best.cost else best
    assert best is not None
    parts = _unpacked(best.x, count, width)
    misfit = float(np.linalg.norm(_transfer(*parts, w) - data)) / size
    return Resonators(*parts, misfit)


def _unpacked(x: Floats, count: int, width: int) -> tuple[Floats, Floats, Floats]:
    """Frequencies, damping and coupling from the free parameters of a fit."""
    entries = count * (count + 1) // 2
    lower = np.zeros((count, count))
    lower[np.tril_indices(count)] = x[count : count + entries]
    damping = lower @ lower.T + _LEAST_DAMPING * np.eye(count)
    return (
        np.exp(np.clip(x[:count], -5.0, 5.0)),
        damping,
        x[count + entries :].reshape(count, width),
    )


def _real(values: Floats) -> Floats:
    """Flatten (..., W, n) complex values to (..., 2 W n): real parts, then imaginary parts."""
    flat = values.reshape(*values.shape[:-2], -1)
    return np.concatenate((flat.real, flat.imag), axis=-1)


def _slopes(x: Floats, count: int, width: int, w: Floats) -> Floats:
    """Derivatives of K(iw) with respect to the free parameters of a fit, shape (P, W, n, n)."""
    frequency, damping, coupling = _unpacked(x, count, width)
    rows, columns = np.tril_indices(count)
    lower = np.zeros((count, count))
    lower[rows, columns] = x[count : count + len(rows)]
    s = 1j * np.asarray(w)[:, None, None]
    inner = _response(frequency, damping, coupling, s)
    # dK = s (dG^T X + X^T dG - X^T dM X), X = M^-1 G
    turned = lower.T @ inner
    out = [-2.0 * frequency[k] ** 2 * s * _outer(inner[:, k], inner[:, k]) for k in range(count)]
    for a, b in zip(rows, columns, strict=True):
        one = _outer(inner[:, a], turned[:, b])
        out.append(-s * s * (one + np.swapaxes(one, 1, 2)))
    for k in range(count):
        for i in range(width):
            one = np.zeros((len(w), width, width), dtype=complex)
            one[:, i] = inner[:, k]
            out.append(s * (one + np.swapaxes(one, 1, 2)))
    return np.array(out)


def _outer(a: Floats, b: Floats) -> Floats:
    return a[:, :, None] * b[:, None, :]


def _response(frequency: Floats, damping: Floats, coupling: Floats, s: Any) -> Any:
    """(s^2 + s D + W^2)^-1 G, complex, shape (W, m, n)."""
    matrix = s * s * np.eye(len(frequency)) + s * damping + np.diag(frequency**2)
    return np.linalg.solve(matrix, np.broadcast_to(coupling + 0j, (len(s), *coupling.shape)))


def _transfer(frequency: Floats, damping: Floats, coupling: Floats, w: Floats) -> Floats:
    """K = i w G^T (W^2 - w^2 + i w D)^-1 G, complex, shape (W, n, n)."""
    s = 1j * np.asarray(w)[:, None, None]
    out: Floats = s * (coupling.T @ _response(frequency, damping, coupling, s))
    return out
