"""Charts of measurement and model by channel, largest residual first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.report import Block, Chart, Choice, Paragraph, Series
from seals.report.figures import Mark, extremes
from seals.report.style import unit_text
from seals.sysid.predictors.problem import Problem
from seals.sysid.report.started import Track, run_offsets, tracks
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

MEASURED, BEFORE, AFTER = "#3b444c", "#d8602a", "#2f80d0"
"""Colours of the measurement and of the model before and after."""
POINTS = 560
"""Rows of a channel that are drawn at most."""


def overlay_blocks(
    problem: Problem,
    before: EvidenceHypothesis,
    after: EvidenceHypothesis,
    *,
    names: tuple[str, str],
    most: int,
) -> list[Block]:
    """Return the charts of all channels, chosen by one selector.

    Args:
        problem: the log.
        before: model before.
        after: model after; the same object when nothing was added.
        names: of both in the legend.
        most: rows of a channel that are drawn at most.
    """
    found = tracks(before, after)
    time, run = plot_time(problem), run_numbers(problem)
    options: dict[str, Sequence[Block]] = {}
    for track in found:
        first, last = track.level(track.before), track.level(track.after)
        label = f"{track.name}: {_level(first)}"
        if after is not before:
            label += f" → {_level(last)}"
        options[label] = _charts(track, time, run, names, same=after is before, most=most)
    return [
        Choice(label="Channel, worst first:", options=options),
        Paragraph(text=_caption(problem), tone="caption"),
    ]


def levels(before: EvidenceHypothesis, after: EvidenceHypothesis) -> dict[str, dict[str, float]]:
    """Return the residual of each channel in units of its standard deviation, before and after."""
    return {
        t.name: {"before": t.level(t.before), "after": t.level(t.after)}
        for t in tracks(before, after)
    }


def plot_time(problem: Problem) -> Floats:
    """Time of every row [s]; runs with overlapping clocks are concatenated."""
    samples = problem.samples
    time: Floats = samples.time.copy()
    shifts = run_offsets(
        [float(time[a]) for a, _ in samples.runs], [float(time[b - 1]) for _, b in samples.runs]
    )
    for (first, last), shift in zip(samples.runs, shifts, strict=True):
        time[first:last] += shift
    return time


def run_numbers(problem: Problem) -> NDArray[np.intp]:
    """Number of the run that each row belongs to, shape (T,)."""
    numbers = np.zeros(problem.samples.rows, dtype=np.intp)
    for k, (first, last) in enumerate(problem.samples.runs):
        numbers[first:last] = k
    return numbers


def _level(value: float) -> str:
    return f"{value:.2g}" if value < 10 else f"{value:.0f}"


def _caption(problem: Problem) -> str:
    length = problem.fitter.windows.length * problem.samples.step
    stated = not problem.samples.posed
    start = (
        "is started once at the beginning of each run, within the stated uncertainty of the "
        "initial "
        "state, and then simulated with the logged commands"
        if stated
        else f"is restarted every {length:.2g} s from the best-fitting initial state, and then "
        "simulated with the logged commands (the restarts cause small steps in the lines)"
    )
    return (
        f"Each model {start}. Its data sheet values are already fitted within their "
        "tolerances. The shaded band would contain 95 % of the measurements if the model were "
        "correct (two standard deviations of sensor noise and of the stated gusts). Numbers "
        "beside a channel: typical residual in units of its expected spread, before → after; 1 "
        "is ideal (gusts are correlated in time, so these need not agree with the held-out "
        "error). Long logs are drawn with fewer points; all peaks are kept."
    )


def _charts(
    track: Track,
    time: Floats,
    run: NDArray[np.intp],
    names: tuple[str, str],
    *,
    same: bool,
    most: int,
) -> tuple[Chart, Chart]:
    rows = _kept(track, most)
    window = np.repeat(np.arange(len(track.rows)), track.rows.shape[1])[rows]
    x = time[track.rows.ravel()[rows]]
    measured, before, after, spread = (
        a.ravel()[rows] for a in (track.measured, track.before, track.after, track.spread)
    )
    unit = unit_text(track.unit)
    models = (
        [(names[0], before, BEFORE)]
        if same
        else [(names[0], before, BEFORE), (names[1], after, AFTER)]
    )
    runs = run[track.rows.ravel()[rows]]
    shown = [_series("measured", x, measured, runs, colour=MEASURED)]
    rest = []
    for k, (name, residual, colour) in enumerate(models):
        last = k == len(models) - 1
        band = 2.0 * spread if last else None
        line = _series(name, x, measured - residual, window, colour=colour, band=band)
        shown.append(line)
        rest.append(_series(name, x, residual, window, colour=colour))
    zero = _series("expected: 95 % within", x, 0.0 * x, window, colour="#7f8a94", band=2.0 * spread)
    # the band lies below, the measurement above everything
    shown = [*shown[:0:-1], shown[0]]
    return (
        Chart(
            title=f"{track.name}: measured and modelled",
            y_label=f"{track.name} [{unit}]" if unit else track.name,
            series=tuple(shown),
        ),
        Chart(
            title=f"{track.name}: measured less modelled",
            y_label=f"residual [{unit}]" if unit else "residual",
            series=(zero, *rest),
            marks=(Mark(at=0.0, label="", level=True),),
            note="A correct model stays within the grey band and shows no pattern.",
        ),
    )


def _kept(track: Track, most: int) -> NDArray[np.intp]:
    """Rows to draw: those with a measurement, downsampled without losing peaks."""
    good = np.flatnonzero(np.isfinite(track.before).ravel())
    if len(good) <= most:
        return good
    residual = track.before.ravel()[good]
    ends = np.flatnonzero(np.diff(good // track.rows.shape[1]))
    bins = max(most // 2 - len(ends), 50)
    kept = np.concatenate([extremes(residual, bins), ends, ends + 1])
    rows: NDArray[np.intp] = good[np.unique(kept)]
    return rows


def _series(
    name: str,
    x: Floats,
    y: Floats,
    window: NDArray[np.intp],
    *,
    colour: str,
    band: Floats | None = None,
) -> Series:
    """Return a line with a gap wherever the window, or the run, changes."""
    cut = np.flatnonzero(np.diff(window)) + 1
    return Series(
        name=name,
        x=np.insert(x, cut, np.nan),
        y=np.insert(y, cut, np.nan),
        colour=colour,
        band=None if band is None else np.insert(band, cut, np.nan),
    )
