"""Fit of a central force: a point in the world that attracts or repels the vehicle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.regress import Table, gain
from seals.sysid.residual_force.residual import Residual
from seals.sysid.residual_force.terms import basis_of

_STARTS = 6
"""Points from which the fit starts."""
_POWERS = (-1.0, 0.0, 1.0, 2.0, 3.0)
"""Powers of the distance that are tried at each point of the grid."""
_GRID = 9
"""Points of the grid along each axis, over twice the range of the log."""
_CORE = 0.3
"""Distance below which a force no longer grows, to start with [m]."""


@dataclass(frozen=True, kw_only=True)
class Pull:
    """Central force towards a point.

    Args:
        place: of the point, world [m].
        place_sd: 1-sigma [m].
        power: q of the force ~ 1/distance^q; negative for a spring.
        power_sd: 1-sigma.
        core: distance below which it no longer grows [m].
        strength: at one metre, positive toward the point [N].
        strength_sd: 1-sigma [N].
        share: of the excess that it explains on held-out windows.
        share_sd: its standard error.
        distances: middle of each of some distances [m].
        sizes: mean force toward the point there [N].
        sizes_sd: 1-sigma [N].
    """

    place: tuple[float, ...]
    place_sd: tuple[float, ...]
    power: float
    power_sd: float
    core: float
    strength: float
    strength_sd: float
    share: float
    share_sd: float
    distances: tuple[float, ...]
    sizes: tuple[float, ...]
    sizes_sd: tuple[float, ...]

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the term ``pull``."""
        return {"place": self.place, "core": self.core, "pull_power": self.power}

    @property
    def sure(self) -> bool:
        """Return true if the point is significant on held-out windows."""
        return self.share > 2.0 * self.share_sd and self.share > 0.1

    def to_dict(self) -> dict[str, Any]:
        """Return the figures."""
        return asdict(self) | {"sure": self.sure}


def pull(
    found: Evidence, around: Conditions, left: Residual, *, without: Floats | None = None
) -> Pull | None:
    """Fit a central force: the point and the power of the distance.

    Args:
        found: evidence of the log.
        around: conditions at the knots.
        left: the missing force.
        without: part of it that is explained already, world axes [N], shape (n, 3).
    """
    position, force = around.position, left.force_world
    force = force if without is None else force - without
    spread = np.sqrt(left.force_world_sd**2 + float(left.gust[0]) ** 2)
    if np.sqrt(((position - position.mean(axis=0)) ** 2).sum(axis=1).mean()) < 0.05:
        return None
    solution = _best(position, force, spread)
    if solution is None:
        return None
    x, sd = solution
    settings = {"place": tuple(map(float, x[:3])), "core": float(abs(x[3])), "pull_power": x[4]}
    table = Table(found, basis_of("pull", settings, around))
    won = gain(found.before, table.held_out([0]), found)
    strength = float(table.solve([0])[0])
    bins = _profile(position, force, spread, x[:3])
    return Pull(
        place=settings["place"],
        place_sd=tuple(map(float, sd[:3])),
        power=float(x[4]),
        power_sd=float(sd[4]),
        core=settings["core"],
        strength=strength,
        strength_sd=float(np.sqrt(table.covariance([0])[0, 0])),
        share=won.share,
        share_sd=won.share_sd,
        distances=bins[0],
        sizes=bins[1],
        sizes_sd=bins[2],
    )


def _shape(position: Floats, x: Floats) -> Floats:
    """Force of unit strength toward a point, shape (n, 3)."""
    away = x[:3] - position
    reach = np.sqrt((away**2).sum(axis=1) + x[3] ** 2 + 1e-4)
    shape: Floats = away * reach[:, None] ** (-1.0 - x[4])
    return shape


def _best(position: Floats, force: Floats, spread: Floats) -> tuple[Floats, Floats] | None:
    """Fit centre, softening radius and exponent from a grid of starts, with standard errors."""
    weight = 1.0 / spread
    middle, size = position.mean(axis=0), np.maximum(np.ptp(position, axis=0), 0.3)
    begins = _starts(position, force * weight, weight, middle, size)
    reach = 20.0 * float(size.max())
    low = np.array([*(middle - reach), 0.0, -1.5])
    high = np.array([*(middle + reach), 2.0 * float(size.max()), 3.0])

    def miss(x: Floats) -> Floats:
        shape = _shape(position, x) * weight
        strength = (shape * force * weight).sum() / max(float((shape**2).sum()), 1e-300)
        out: Floats = (strength * shape - force * weight).ravel()
        return out

    return bounded_fit(miss, begins, low, high, scale=0.3)


def bounded_fit(
    miss: Callable[[Floats], Floats],
    begins: Sequence[Floats],
    low: Floats,
    high: Floats,
    *,
    scale: float,
) -> tuple[Floats, Floats] | None:
    """Fit from several starts; return the best values and their standard errors, or None.

    Args:
        miss: whitened residuals at the knots.
        begins: starting values.
        low: lower bounds.
        high: upper bounds.
        scale: characteristic size of the values.
    """
    from scipy.optimize import least_squares

    fits = []
    for start in begins:
        begin = np.clip(start, low + 1e-6, high - 1e-6)
        fits.append(least_squares(miss, begin, bounds=(low, high), x_scale=scale, max_nfev=40))
    best = min(fits, key=lambda f: float(f.cost))
    if not np.isfinite(best.cost):
        return None
    # knots are correlated over about two of their spacings
    noise = 2.0 * max(1.0, 2.0 * float(best.cost) / best.fun.size)
    slope: Floats = np.asarray(best.jac)
    covariance = noise * np.linalg.pinv(slope.T @ slope, rcond=1e-12)
    return best.x, np.sqrt(np.maximum(np.diag(covariance), 0.0))


def _starts(
    position: Floats, target: Floats, weight: Floats, middle: Floats, size: Floats
) -> list[Floats]:
    """Grid points of best fit, no two of them neighbours."""
    line = np.linspace(-1.0, 1.0, _GRID)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    thin = slice(None, None, max(1, len(position) // 100))
    seen, target, weight = position[thin], target[thin], weight[thin]
    away = (middle + grid * size)[:, None, :] - seen
    reach = np.sqrt((away**2).sum(axis=2) + _CORE**2)
    score, best = np.full(len(grid), -1.0), np.zeros(len(grid))
    for power in _POWERS:
        shape = away * reach[:, :, None] ** (-1.0 - power) * weight
        hit = np.einsum("gni,ni->g", shape, target) ** 2 / np.einsum("gni,gni->g", shape, shape)
        best = np.where(hit > score, power, best)
        score = np.maximum(score, hit)
    out: list[int] = []
    for k in np.argsort(-score):
        apart = [np.abs(grid[k] - grid[o]).max() for o in out]
        if not out or min(apart) > 1.5 * (line[1] - line[0]):
            out.append(int(k))
        if len(out) == _STARTS:
            break
    return [np.array([*(middle + grid[k] * size), _CORE, best[k]]) for k in out]


def _profile(
    position: Floats, force: Floats, spread: Floats, place: Floats
) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Mean force toward a point by distance."""
    away = place - position
    distance = np.linalg.norm(away, axis=1)
    along = away / np.maximum(distance, 1e-6)[:, None]
    size = (force * along).sum(axis=1)
    uncertainty = np.sqrt(((spread * along) ** 2).sum(axis=1))
    edges = np.quantile(distance, np.linspace(0.0, 1.0, 7))
    part = np.clip(np.searchsorted(edges, distance, side="right") - 1, 0, 5)
    rows = [np.flatnonzero(part == k) for k in range(6)]
    rows = [r for r in rows if r.size]
    mean = [float(np.average(size[r], weights=uncertainty[r] ** -2)) for r in rows]
    sd = [float(np.sqrt(2.0 / np.sum(uncertainty[r] ** -2))) for r in rows]
    return tuple(float(distance[r].mean()) for r in rows), tuple(mean), tuple(sd)
