"""Conversion of a figure to plotly's JSON, without importing plotly."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.report.figures import Chart, Mark, Series, downsampled, edges, even
from seals.report.style import MUTED


def drawn(chart: Chart) -> dict[str, Any]:
    """Return ``data`` and ``layout`` of a chart for plotly.js; the page adds the theme."""
    ready = chart.coloured()
    traces: list[dict[str, Any]] = []
    for line in ready.series:
        traces += (
            _stack(even(line)) if chart.stacked else _line(downsampled(line), single=chart.single)
        )
    if chart.stacked and len(chart.series) > 1:
        traces.append(_total(ready))
    return {"data": traces, "layout": _layout(chart)}


def _line(line: Series, *, single: bool) -> list[dict[str, Any]]:
    """One line, and its band below it."""
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "markers" if line.points else "lines",
        "name": line.name,
        "x": _numbers(line.x, single=single),
        "y": _numbers(line.y, single=single),
        "line": {"color": line.colour, "width": 1.6, "dash": "dash" if line.dashed else "solid"},
        "marker": {"color": line.colour, "size": 4},
        "legendgroup": line.name,
    }
    if line.band is None:
        return [trace]
    x, y = _outline(line)
    outline = {
        "type": "scatter",
        "mode": "lines",
        "x": _numbers(x, single=single),
        "y": _numbers(y, single=single),
        "fill": "toself",
        "fillcolor": f"{line.colour}33",
        "line": {"width": 0},
        "hoverinfo": "skip",
        "showlegend": False,
        "legendgroup": line.name,
    }
    return [outline, trace]


def _outline(line: Series) -> tuple[Floats, Floats]:
    """The band's outline; every stretch between two gaps is a polygon of its own."""
    low, high = edges(line)
    solid = np.isfinite(low) & np.isfinite(high)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], solid, [False]]).astype(int)))
    x: list[Floats] = []
    y: list[Floats] = []
    gap = np.array([np.nan])
    for first, last in ends.reshape(-1, 2):
        part = slice(first, last)
        x += [line.x[part], line.x[part][::-1], gap]
        y += [high[part], low[part][::-1], gap]
    if not x:
        return np.zeros(0), np.zeros(0)
    return np.concatenate(x)[:-1], np.concatenate(y)[:-1]


def _stack(line: Series) -> list[dict[str, Any]]:
    """Positive and negative parts as areas of two stacks, so that signs do not cancel."""
    values = np.nan_to_num(line.y)
    parts = (("up", np.maximum(values, 0.0)), ("down", np.minimum(values, 0.0)))
    shown = [(sign, part) for sign, part in parts if np.any(part != 0.0)] or [parts[0]]
    return [
        {
            "type": "scatter",
            "mode": "lines",
            "name": line.name,
            "legendgroup": line.name,
            "showlegend": k == 0,
            "stackgroup": sign,
            "x": _numbers(line.x),
            "y": _numbers(part),
            "line": {"width": 0.6, "color": line.colour},
            "fillcolor": f"{line.colour}a6",
            "hovertemplate": "%{y:.4g}",
        }
        for k, (sign, part) in enumerate(shown)
    ]


def _total(chart: Chart) -> dict[str, Any]:
    """The sum of a stack as a line."""
    parts = [even(line) for line in chart.series]
    return {
        "type": "scatter",
        "mode": "lines",
        "name": "sum",
        "x": _numbers(parts[0].x),
        "y": _numbers(np.sum([np.nan_to_num(part.y) for part in parts], axis=0)),
        "line": {"width": 1.6, "color": "ink"},
        "hovertemplate": "%{y:.4g}",
    }


def _layout(chart: Chart) -> dict[str, Any]:
    """Axes, marks and margins."""
    y_axis: dict[str, Any] = {"title": {"text": chart.y_label, "standoff": 6}}
    if chart.equal:
        y_axis |= {"scaleanchor": "x", "scaleratio": 1}
    return {
        "xaxis": {"title": {"text": chart.x_label, "standoff": 4}},
        "yaxis": y_axis,
        "shapes": [line_of(mark, level=mark.level) for mark in chart.marks],
        "annotations": [label_of(m, level=m.level, at=m.at) for m in chart.marks],
        "meta": {"time": chart.x_label.startswith("time")},
    }


def line_of(mark: Mark, *, level: bool) -> dict[str, Any]:
    """Return a mark as a dotted line across the chart, for plotly's ``shapes``."""
    along, across = ("y", "x") if level else ("x", "y")
    ends = {f"{along}0": mark.at, f"{along}1": mark.at, f"{across}0": 0, f"{across}1": 1}
    line = {"color": MUTED, "width": 1, "dash": "dot"}
    return {"type": "line", f"{along}ref": along, f"{across}ref": "paper", **ends, "line": line}


def label_of(mark: Mark, *, level: bool, at: float, colour: str = MUTED) -> dict[str, Any]:
    """Return the words of a mark, for plotly's ``annotations``.

    Args:
        mark: to be named.
        level: whether it lies across the chart; others stand upright.
        at: coordinate of the mark on its axis.
        colour: of the words, hexadecimal.
    """
    if level:
        place = {"xref": "paper", "x": 1, "yref": "y", "y": at, "xanchor": "right"}
    else:
        place = {"xref": "x", "x": at, "yref": "paper", "y": 1, "xanchor": "left"}
    words = {"text": mark.label, "showarrow": False, "font": {"size": 11, "color": colour}}
    return {**place, "yanchor": "bottom" if level else "top", **words}


def _numbers(values: Floats, *, single: bool = False) -> dict[str, str]:
    """Numbers in plotly's binary form: a fifth of the text, and NaN stays a gap."""
    kind = "f4" if single else "f8"
    raw = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {"dtype": kind, "bdata": base64.b64encode(raw).decode("ascii")}
