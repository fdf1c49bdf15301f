"""Chart of the residual force and torque over time, coloured by regime."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.report import Block, Chart, Choice, Paragraph, Series
from seals.report.figures import Mark
from seals.sysid.candidates.activity import log_rows as rows_of_logs
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.predictors.problem import Problem
from seals.sysid.predictors.surface_model_error import submersion
from seals.sysid.report.overlay import plot_time, run_numbers
from seals.sysid.residual_force.residual import Residual, thinned_rows

REGIMES = {"air": "#c08a00", "entry": "#cf5f8f", "water": "#2fa3c4"}
"""Colours of what surrounds the vehicle."""
_AFTER = "#3b444c"
_DRY, _WET = 0.02, 0.98
"""Submerged shares of the hull between which it pierces the surface."""
_AXES = (
    ("force x (forward)", "N"),
    ("force y (left)", "N"),
    ("force z (up)", "N"),
    ("torque x (roll)", "N·m"),
    ("torque y (pitch)", "N·m"),
    ("torque z (yaw)", "N·m"),
)


def wrench_blocks(
    problem: Problem, before: Residual, after: Residual | None, candidates: Sequence[Candidate] = ()
) -> list[Block]:
    """Return charts of the residual wrench by component, largest first.

    Args:
        problem: the log.
        before: what the model before lacks.
        after: what the model after lacks; None when nothing was added.
        candidates: named effects, whose beginnings and ends are marked.
    """
    first = _placed(problem, before)
    then = None if after is None else (after, _placed(problem, after))
    loud = {k: _loudness(before, k) for k in range(6)}
    options: dict[str, Sequence[Block]] = {}
    for k in sorted(loud, key=lambda k: -loud[k]):
        name, unit = _AXES[k]
        chart = Chart(
            title=f"Missing {name}",
            y_label=f"{name} [{unit}]",
            series=tuple(_lines(k, before, first, then)),
            marks=(Mark(at=0.0, label="", level=True), *_activity_marks(problem, candidates)),
        )
        options[f"{name}: {loud[k]:.2g} × its uncertainty"] = (chart,)
    return [
        Choice(label="Axis, largest force first:", options=options),
        Paragraph(text=_caption(first.regime, after), tone="caption"),
    ]


def _activity_marks(problem: Problem, candidates: Sequence[Candidate]) -> tuple[Mark, ...]:
    """Return the times at which effects begin and end, as chart marks."""
    samples, time = problem.samples, plot_time(problem)
    logs, marks = rows_of_logs(samples), []
    for candidate in candidates:
        for span in () if candidate.activity is None else candidate.activity.spans:
            rows = slice(*logs[span.log])
            for moment, word in ((span.start, "begins"), (span.end, "ends")):
                if moment is not None:
                    row = rows.start + int(np.searchsorted(samples.time[rows], moment.value))
                    at = float(time[min(row, rows.stop - 1)])
                    marks.append(Mark(at=at, label=f"{candidate.name} {word}"))
    return tuple(marks)


def log_rows(problem: Problem, time: Floats) -> NDArray[np.int64]:
    """Return the rows of the log nearest to given times, run by run."""
    samples = problem.samples
    first, last = np.array(samples.runs).T
    begin = samples.time[first]
    if (begin[1:] > samples.time[last - 1][:-1]).all():
        run = np.searchsorted(begin, time + 0.5 * samples.step) - 1
    else:
        # clocks overlap: a new run begins where time jumps back
        run = np.concatenate([[0], np.cumsum(np.diff(time) < 0.0)])
    run = np.clip(run, 0, len(first) - 1)
    steps = np.round((time - begin[run]) / samples.step).astype(np.int64)
    rows: NDArray[np.int64] = np.clip(first[run] + steps, first[run], last[run] - 1)
    return rows


@dataclass(frozen=True, kw_only=True)
class _Places:
    """Drawn points: index, time and regime of each, and whether a run ends there."""

    keep: NDArray[np.int64]
    time: Floats
    regime: NDArray[np.str_]
    last: NDArray[np.bool_]


def _placed(problem: Problem, found: Residual) -> _Places:
    """Choose the points of a wrench to draw, the last one of every run among them."""
    rows = log_rows(problem, found.time)
    ends = np.flatnonzero(np.diff(run_numbers(problem)[rows]))
    keep = np.union1d(thinned_rows(len(rows)), ends).astype(np.int64)
    drawn = rows[keep]
    if not problem.vehicle.has_water:
        regime = np.full(len(drawn), "air")
    else:
        share = submersion(problem.plant, problem.fitter.trajectory)[drawn]
        regime = np.where(share < _DRY, "air", np.where(share > _WET, "water", "entry"))
    return _Places(
        keep=keep,
        time=plot_time(problem)[rows[keep]],
        regime=regime,
        last=np.isin(keep, ends),
    )


def _loudness(found: Residual, k: int) -> float:
    """Root mean square of one component relative to its error bar and the stated gusts."""
    values, spread = _component(found, k)
    uncertainty = np.hypot(spread, found.gust[k // 3])
    return float(np.sqrt(np.mean((values / np.maximum(uncertainty, 1e-12)) ** 2)))


def _component(found: Residual, k: int) -> tuple[Floats, Floats]:
    if k < 3:
        return found.force[:, k], found.force_sd[:, k]
    return found.torque[:, k - 3], found.torque_sd[:, k - 3]


def _lines(
    k: int, before: Residual, at: _Places, after: tuple[Residual, _Places] | None
) -> list[Series]:
    """Lines of a component: before, after, one for each regime, and the stated gusts."""
    x, last = at.time, at.last
    values, spread = (a[at.keep] for a in _component(before, k))
    out = []
    for name, colour in REGIMES.items():
        inside = at.regime == name
        # a line reaches to the next point, so that colours join
        reach = inside | np.concatenate([[False], inside[:-1] & ~last[:-1]])
        if inside.any():
            y = np.where(reach & ~last, values, np.nan)
            label = name if after is None else f"before, {name}"
            out.append(Series(name=label, x=x, y=y, colour=colour, band=2.0 * spread))
    if after is not None:
        found, own = after
        values, spread = (a[own.keep] for a in _component(found, k))
        y = np.where(own.last, np.nan, values)
        out.append(Series(name="after", x=own.time, y=y, colour=_AFTER, band=2.0 * spread))
    gust = float(before.gust[k // 3])
    if gust > 0.0:
        x = np.array([x.min(), x.max(), np.nan, x.min(), x.max()])
        y = 2.0 * gust * np.array([1.0, 1.0, np.nan, -1.0, -1.0])
        name = "stated gusts, 95 % within"
        out.append(Series(name=name, x=x, y=y, colour="#7f8a94", dashed=True))
    return out


def _caption(wet: NDArray[np.str_], after: Residual | None) -> str:
    seen = [name for name in REGIMES if (wet == name).any()]
    colours = "The colour is the medium of the vehicle" if len(seen) > 1 else "The vehicle is in"
    colours += f" ({', '.join(seen)}). " if len(seen) > 1 else f" {seen[0]} throughout. "
    dark = "" if after is None else "Dark: residual force with the final model. "
    return (
        "External force and torque, in body axes, that would have to be added to the model for "
        "it to "
        "follow the measurements. Shaded: two standard errors, "
        f"including the uncertainty of the data sheet. {colours}{dark}Values between the "
        "dashed lines may be gusts of the stated strength. A sensor fault also appears here, as an "
        "apparent force."
    )
