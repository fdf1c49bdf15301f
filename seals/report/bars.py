"""Horizontal bar charts with error bars, as the JSON that the page's script draws."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from math import isfinite, log10
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.report.figures import Chart, Mark, Series
from seals.report.style import CYCLE

_VISIBLE = 1e-5
"""Share of a column's span below which a screen shows no difference."""


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Numeric columns of a page; equal ones, such as a common time, are stored once.

    Args:
        texts: one for each column: ``4`` or ``8`` bytes a number, then the numbers in base 64.

    Example:
        >>> columns = Columns()
        >>> columns.add(np.arange(3.0)), columns.add(np.ones(2)), columns.add(np.arange(3.0))
        (0, 1, 0)
    """

    texts: list[str] = field(default_factory=list)
    _index: dict[str, int] = field(default_factory=dict)

    def add(self, values: Floats) -> int:
        """Add a column, shape (points,), and return its index; NaN is a gap.

        Numbers take single precision where no screen shows its rounding.
        """
        with np.errstate(over="ignore"):
            single = np.asarray(values, dtype="<f4")
        solid = values[np.isfinite(values)]
        span = np.ptp(solid) if solid.size else 0.0
        near = np.abs(single.astype(float) - values)[np.isfinite(values)] <= _VISIBLE * span
        short = bool(near.all())
        raw = single if short else np.ascontiguousarray(values, dtype="<f8")
        text = ("4" if short else "8") + base64.b64encode(raw.tobytes()).decode("ascii")
        if text not in self._index:
            self._index[text] = len(self.texts)
            self.texts.append(text)
        return self._index[text]


def drawn(chart: Chart, columns: Columns) -> dict[str, Any]:
    """Return a chart as data for the page's script; its values are added to the columns."""
    ready = chart.coloured()
    if chart.stacked:
        made = _stack([line.even() for line in ready.series], columns)
    else:
        made = [_line(line.downsampled(), columns) for line in ready.series]
    return {
        "title": chart.title,
        "x": chart.x_label,
        "y": chart.y_label,
        "time": chart.x_label.startswith("time"),
        "equal": chart.equal,
        "marks": _marks_of(chart.marks),
        "lines": made,
    }


def _marks_of(marks: tuple[Mark, ...]) -> list[list[Any]]:
    """Return marks as position, label, and whether each is a level."""
    return [[mark.at, mark.label, mark.level] for mark in marks]


def _line(line: Series, columns: Columns) -> dict[str, Any]:
    """One line with its band."""
    made: dict[str, Any] = {
        "name": line.name,
        "colour": line.colour,
        "dash": line.dashed,
        "dots": line.points,
        "x": columns.add(line.x),
        "y": columns.add(line.y),
    }
    if line.band is not None:
        low, high = line.edges()
        made |= {"low": columns.add(low), "high": columns.add(high)}
    return made


def _stack(lines: list[Series], columns: Columns) -> list[dict[str, Any]]:
    """Stacked areas; positive and negative parts are stacked separately.

    A part that changes its sign is two areas, of which the second is not in the legend; more than
    one part has a line for the sum.
    """
    made: list[dict[str, Any]] = []
    ground: dict[float, float | Floats] = {1.0: 0.0, -1.0: 0.0}
    for line in lines:
        values = np.nan_to_num(line.y)
        signs = [sign for sign in ground if np.any(sign * values > 0.0)] or [1.0]
        for k, sign in enumerate(signs):
            base = ground[sign] + np.zeros_like(values)
            top = base + sign * np.maximum(sign * values, 0.0)
            ground[sign] = top
            area = {"low": columns.add(base), "high": columns.add(top), "area": True}
            made.append(_line(line, columns) | area | {"quiet": k > 0})
    if len(lines) > 1:
        total = np.sum([np.nan_to_num(line.y) for line in lines], axis=0)
        made.append(_line(Series(name="sum", x=lines[0].x, y=total, colour="ink"), columns))
    return made


_ROW, _FRAME = 30, 74
"""Height of a bar and of the axis with its label [pixel]."""


@dataclass(frozen=True, kw_only=True)
class Bar:
    """One bar.

    Args:
        label: beside the bar.
        value: where it ends.
        start: where it begins.
        error: half width of the error bar; None for none.
        colour: hexadecimal.
        text: at the end of the bar, a figure with its unit.
    """

    label: str
    value: float
    start: float = 0.0
    error: float | None = None
    colour: str = CYCLE[0]
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class Bars:
    """Bar chart, the first bar on top.

    Args:
        title: what is shown, a few words.
        x_label: quantity and unit.
        bars: from top to bottom.
        marks: levels worth a thin line with a label (their ``at`` is on x).
        log: whether the axis is logarithmic.
        note: one line below the chart.

    Example:
        >>> Bars(title="Gain", x_label="1", bars=[Bar(label="wind", value=2.0)]).height
        104
    """

    title: str
    x_label: str
    bars: Sequence[Bar]
    marks: tuple[Mark, ...] = field(default=())
    log: bool = False
    note: str = ""
    kind: str = field(default="bars", init=False)

    @property
    def height(self) -> int:
        """Height on the page [pixel]."""
        return _FRAME + _ROW * len(self.bars)


def drawn_bars(chart: Bars) -> dict[str, Any]:
    """Return the bars for the page's script; a bar without a finite value has no length."""
    chart = _drawable(chart)
    return {
        "title": chart.title,
        "x": chart.x_label,
        "y": "",
        "log": chart.log,
        "range": _range(chart),
        "marks": _marks_of(chart.marks),
        "bars": [asdict(bar) for bar in chart.bars],
    }


def _drawable(chart: Bars) -> Bars:
    """Return the chart with finite numbers only; a bar without a finite value has no length."""
    ends = [bar.value for bar in chart.bars if isfinite(bar.value)]
    base = min(ends, default=1.0) if chart.log else 0.0
    bars = []
    for bar in chart.bars:
        start = bar.start if isfinite(bar.start) else base
        error = bar.error if bar.error is not None and isfinite(bar.error) else None
        if isfinite(bar.value):
            bars.append(replace(bar, start=start, error=error))
        else:
            start = base if chart.log and start <= 0.0 else start
            bars.append(replace(bar, value=start, start=start, error=None, text="not determined"))
    marks = tuple(mark for mark in chart.marks if isfinite(mark.at))
    return replace(chart, bars=bars, marks=marks)


def _range(chart: Bars) -> list[float]:
    """Axis limits that leave room for the figures at the ends of the bars."""
    ends = [bar.value + (bar.error or 0.0) for bar in chart.bars]
    low_ends = [bar.value - (bar.error or 0.0) for bar in chart.bars]
    starts = [bar.start for bar in chart.bars]
    marks = [mark.at for mark in chart.marks]
    high = max([*ends, *starts, *marks], default=1.0)
    low = min([*low_ends, *starts, *marks], default=0.0)
    if chart.log:
        first, last = log10(max(low, 1e-12)), log10(max(high, 1e-12))
        span = max(last - first, 0.3)
        return [first - 0.04 * span, last + 0.28 * span]
    span = max(high - low, 1e-9)
    return [low - 0.03 * span, high + 0.28 * span]
