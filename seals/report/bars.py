"""Horizontal bar charts with error bars, for rankings and waterfalls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from math import isfinite, log10
from typing import Any

from seals.report.drawing import marks_of
from seals.report.figures import Mark
from seals.report.style import CYCLE

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
        "marks": marks_of(chart.marks),
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
