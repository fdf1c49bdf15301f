"""Conversion of charts to the JSON that the page's script draws."""

from __future__ import annotations

import base64
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.report.figures import Chart, Mark, Series

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
        "marks": marks_of(chart.marks),
        "lines": made,
    }


def marks_of(marks: tuple[Mark, ...]) -> list[list[Any]]:
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
