"""Exponents of power laws, fitted to the residual force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.regress import Gain, Table, drawn, gain
from seals.sysid.residual_force.terms import basis_of

_DRAWS = 60
_FLAT = 0.6
"""Standard error from which on an exponent says nothing."""
_STANDSTILL = 0.01
"""Share of the mean wrench of the actuators below which they count as standing still."""


@dataclass(frozen=True, kw_only=True)
class Exponent:
    """Exponent of a power law.

    Args:
        law: what the force is a power of: speed, throttle or height.
        medium: in which it acts.
        value: the exponent [1].
        sd: standard error, from a block bootstrap.
        share: of the excess that the law explains on held-out windows.
        share_sd: its standard error.
        coefficients: fitted at that exponent, body axes [N] at the unit of the quantity.
    """

    law: str
    medium: str
    value: float
    sd: float
    share: float
    share_sd: float
    coefficients: tuple[float, ...]

    @property
    def sure(self) -> bool:
        """Return true if the law is significant and its exponent is determined."""
        return self.share > 2.0 * self.share_sd and self.share > 0.1 and self.sd < _FLAT

    def to_dict(self) -> dict[str, Any]:
        """Return the figures."""
        return asdict(self)


def exponents(found: Evidence, around: Conditions) -> tuple[Exponent, ...]:
    """Fit power laws of speed, throttle and height where the log covers enough range."""
    out = []
    before = found.before
    if np.quantile(around.speed, 0.9) > 0.1:
        media = ("any", "water", "air") if around.crossing else ("any",)
        fits = [_fitted(found, m, "speed", before, _speed(around, m)) for m in media]
        out.append(max(fits, key=lambda e: e.share))
    if around.throttle is not None and np.ptp(around.throttle) > 0.05 * around.throttle.mean():
        out.append(_fitted(found, "any", "throttle", before, _throttle(around)))
    if around.ground is not None and np.ptp(around.position[:, 2]) > 0.1:
        out.append(_fitted(found, "any", "height", before, _height(around)))
    return tuple(sorted(out, key=lambda e: -e.share))


Family = tuple[Callable[[float], Floats], Floats]


def _speed(around: Conditions, medium: str) -> Family:
    return (
        lambda p: basis_of("drag", {"drag_power": p}, around, medium),
        np.arange(0.0, 3.76, 0.25),
    )


def _throttle(around: Conditions) -> Family:
    assert around.throttle is not None
    # powers below zero have no value at a standstill
    level = np.maximum(around.throttle / around.throttle.mean(), _STANDSTILL)
    axes = np.concatenate([np.eye(3), np.zeros((3, 3))])
    return lambda p: level[:, None, None] ** p * axes, np.arange(-0.5, 3.1, 0.5)


def _height(around: Conditions) -> Family:
    settings = {"level": around.ground or 0.0}
    return (
        lambda p: basis_of("near", {**settings, "near_power": p}, around, "any"),
        np.arange(0.0, 4.1, 0.5),
    )


def _fitted(found: Evidence, medium: str, law: str, before: Floats, family: Family) -> Exponent:
    """Profile of the misfit over the exponent, with its minimum and standard error."""
    make, grid = family
    tables = [Table(found, make(p)) for p in grid]
    columns = range(tables[0].width)
    weights: list[Floats] = [np.ones(found.count)]
    weights += [
        np.bincount(d, minlength=found.count).astype(float) for d in drawn(found.count)[:_DRAWS]
    ]
    lowest = []
    for weight in weights:
        at = [t.solve(columns, weight) for t in tables]
        cost = [float(weight @ t.misfit(columns, x)) for t, x in zip(tables, at, strict=True)]
        lowest.append(_bottom(grid, np.array(cost)))
    best = lowest[0]
    chosen = Table(found, make(best))
    won: Gain = gain(before, chosen.held_out(columns), found)
    return Exponent(
        law=law,
        medium=medium,
        value=best,
        sd=float(np.std(lowest[1:])) if len(lowest) > 2 else float("inf"),
        share=won.share,
        share_sd=won.share_sd,
        coefficients=tuple(float(c) for c in chosen.solve(columns)),
    )


def _bottom(grid: Floats, cost: Floats) -> float:
    """Minimum of a parabola through the smallest value and its neighbours."""
    k = int(np.clip(np.argmin(cost), 1, len(grid) - 2))
    a, b, c = cost[k - 1 : k + 2]
    bend = a - 2.0 * b + c
    shift = 0.5 * (a - c) / bend if bend > 1e-9 else 0.0
    step = grid[1] - grid[0]
    return float(np.clip(grid[k] + np.clip(shift, -1.0, 1.0) * step, grid[0], grid[-1]))
