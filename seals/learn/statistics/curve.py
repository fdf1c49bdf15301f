"""Metrics of a learning curve: normalised area and mean of its last part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from seals.arrays import Floats
from seals.errors import SealsError, refuse_unlisted

LAST = 0.1
"""Share of the budget whose evaluations count as the end of a curve."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Values over control steps, or over seconds.

    Args:
        x: rising, shape (points,).
        y: shape (points,).

    Raises:
        SealsError: shapes differ, there are fewer than two points, ``x`` does not rise, or a value
            is not finite.
    """

    x: Floats
    y: Floats

    def __post_init__(self) -> None:
        if self.x.ndim != 1 or self.x.shape != self.y.shape or len(self.x) < 2:
            raise SealsError(
                f"a curve has x of shape {self.x.shape} and y of shape {self.y.shape}.\n"
                "Allowed: one shape for both, and at least two evaluations."
            )
        if not np.isfinite([self.x, self.y]).all():
            raise SealsError("a curve holds a value that is not finite.\nLook into its file.")
        if not (np.diff(self.x) > 0.0).all():
            place = int(np.argmin(np.diff(self.x))) + 1
            raise SealsError(
                f"a curve is not increasing at point {place}: x is {self.x[place - 1]:g}, "
                f"then {self.x[place]:g}.\nThe steps of one run increase: were two files joined?"
            )


def curve(x: ArrayLike, y: ArrayLike) -> Curve:
    """Return a curve from arrays, checked."""
    return Curve(np.asarray(x, dtype=float), np.asarray(y, dtype=float))


def area(line: Curve, *, budget: float) -> float:
    """Return the mean height of a curve from 0 to the budget: the area below it over its width.

    Before its first evaluation a curve counts as zero: what was not measured earns nothing.

    Args:
        line: to be measured; straight between its points.
        budget: end of the range, in the unit of ``x``.

    Raises:
        SealsError: the curve ends before the budget.

    Example:
        >>> area(curve([0, 10, 20], [0.0, 1.0, 1.0]), budget=20)
        0.75
    """
    _refuse_short(line, budget)
    inside = line.x[(line.x > line.x[0]) & (line.x < budget)]
    knots = np.concatenate([[line.x[0]], inside, [budget]])
    heights = np.interp(knots, line.x, line.y)
    below = 0.5 * (heights[1:] + heights[:-1]) @ np.diff(knots)
    return float(below / budget)


def last_mean(line: Curve, *, budget: float, share: float = LAST) -> float:
    """Return the mean of the evaluations in the last part of the budget.

    Args:
        line: to be measured.
        budget: end of the range, in the unit of ``x``.
        share: of the budget that counts as the end; its first point counts.

    Raises:
        SealsError: the curve ends before the budget, or there is no evaluation in the last part.

    Example:
        >>> last_mean(curve([0, 80, 90, 100], [0.0, 0.5, 0.8, 1.0]), budget=100)
        0.9
    """
    _refuse_short(line, budget)
    # steps are whole numbers: a product such as 0.9 * 50000 must not miss one by rounding
    first = (1.0 - share) * budget * (1.0 - 1e-12)
    chosen = (line.x >= first) & (line.x <= budget)
    if not chosen.any():
        raise SealsError(
            f"there is no evaluation in the last {share:.0%} of {budget:g}.\nEvaluate more often."
        )
    return float(line.y[chosen].mean())


METRICS = {"area": area, "last": last_mean}
"""Metrics of a curve by name: how fast it rises, and how high it ends."""


def metric(name: str, line: Curve, *, budget: float) -> float:
    """Return a metric of a curve by its name.

    Raises:
        SealsError: there is no such metric, or the curve is too short.
    """
    refuse_unlisted(name, METRICS, f"metric '{name}' is unknown", error=SealsError)
    return float(METRICS[name](line, budget=budget))


def held(line: Curve, *, budget: float) -> Curve:
    """Return a curve extended to the budget by its last value.

    For runs that stopped early because they had succeeded. It is an assumption: say so.
    """
    if line.x[-1] >= budget:
        return line
    return Curve(np.append(line.x, budget), np.append(line.y, line.y[-1]))


def on_grid(lines: list[Curve], *, budget: float, points: int = 101) -> tuple[Floats, Floats]:
    """Return curves over one common abscissa.

    Curves that were evaluated at the same steps keep them; others are laid straight between their
    evaluations over an even grid.

    Args:
        lines: one curve a run.
        budget: end of the abscissa.
        points: of an even grid.

    Returns:
        Abscissa, shape (points,), and values, shape (runs, points).

    Raises:
        SealsError: a curve ends before the budget.
    """
    for line in lines:
        _refuse_short(line, budget)
    first = lines[0].x
    same = all(line.x.shape == first.shape and (line.x == first).all() for line in lines)
    begin = max(line.x[0] for line in lines)
    grid = first[first <= budget] if same else np.linspace(begin, budget, points)
    return grid, np.stack([np.interp(grid, line.x, line.y) for line in lines])


def _refuse_short(line: Curve, budget: float) -> None:
    if not 0.0 < budget <= line.x[-1]:
        raise SealsError(
            f"a curve ends at {line.x[-1]:g}, and the budget is {budget:g}.\n"
            "Finish the run, or compare up to a smaller budget."
        )
