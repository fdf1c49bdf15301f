"""Charts as PNG or lossless WebP images."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import optional_import
from seals.logs.atomic import atomic_path
from seals.report.figures import Chart, Series
from seals.report.style import MUTED

SIZE = (8.0, 3.6)
"""Width and height [inch] at 140 dots per inch."""
ROW, KEY = 90, 6
"""Letters of title and legend that fit above a chart, and those that a key of a legend takes."""
LEGEND = 0.17
"""Height of a row of a legend under a chart [inch]."""


def write_picture(path: str | Path, charts: Chart | list[Chart]) -> Path:
    """Write one chart, or several below each other, as an image, atomically.

    Args:
        path: the file, ``.png`` or ``.webp``.
        charts: what to draw.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    rows = [charts] if isinstance(charts, Chart) else charts
    # the object interface: pyplot would keep global state and look for a display
    heights = [SIZE[1] + LEGEND * _rows_below(chart) for chart in rows]
    figure = figure_class()(figsize=(SIZE[0], sum(heights)), dpi=140, layout="constrained")
    grid = figure.add_gridspec(len(rows), 1, height_ratios=heights)
    for number, chart in enumerate(rows):
        _draw(figure.add_subplot(grid[number]), chart.coloured())
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas: Any = FigureCanvasAgg(figure)
    with atomic_path(path) as beside:
        # ``savefig`` would draw twice: once for the layout, then without it
        if Path(path).suffix == ".webp":
            canvas.print_webp(beside, pil_kwargs={"lossless": True})
        else:
            canvas.print_png(beside, metadata={"Software": "SEALS"})
    return Path(path)


def figure_class() -> Any:
    """Return matplotlib's ``Figure``, imported without the settings of the working directory.

    A file ``matplotlibrc`` there, which may be a stranger's, can have programs such as LaTeX run.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    with (
        optional_import("pictures need matplotlib", "Install it: pip install matplotlib"),
        _elsewhere(),
    ):
        import matplotlib
        from matplotlib.figure import Figure
    # a name of a stranger may hold signs of formulas, which are refused in a traceback or drawn
    matplotlib.rcParams["text.parse_math"] = False
    return Figure


def log_scale(axes: Any, axis: str) -> None:
    """Give an axis, ``x`` or ``y``, a logarithmic scale with labels that need no formulas."""
    from matplotlib.ticker import LogFormatter

    getattr(axes, f"set_{axis}scale")("log")
    side = getattr(axes, f"{axis}axis")
    side.set_major_formatter(LogFormatter(labelOnlyBase=True))
    side.set_minor_formatter(LogFormatter(minor_thresholds=(2, 0.4)))


@contextlib.contextmanager
def _elsewhere() -> Iterator[None]:
    """Be in the folder of the program where the working directory holds settings."""
    if "matplotlib" in sys.modules or not os.path.lexists("matplotlibrc"):
        yield
        return
    here = os.open(".", os.O_RDONLY)
    try:
        os.chdir(os.path.dirname(__file__))
        yield
    finally:
        os.chdir(here)
        os.close(here)


def dress(axes: Any, x: str, y: str) -> None:
    """Label a pair of axes, and draw its grid beneath, without a frame above and at the right."""
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(True, color="#e3e6e8", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _draw(axes: Any, chart: Chart) -> None:
    """Draw one chart on one pair of axes."""
    if chart.stacked:
        _stack(axes, [line.even() for line in chart.series])
    else:
        for line in chart.series:
            _line(axes, line.downsampled())
    for mark in chart.marks:
        (axes.axhline if mark.level else axes.axvline)(mark.at, color=MUTED, lw=0.8, ls=":")
        # the label of a level stands at the left
        where = (0.0, mark.at) if mark.level else (mark.at, 1.0)
        transform = axes.get_yaxis_transform() if mark.level else axes.get_xaxis_transform()
        side = {"ha": "left", "va": "bottom" if mark.level else "top"}
        axes.text(*where, f" {mark.label} ", transform=transform, fontsize=8, color=MUTED, **side)
    axes.set_title(chart.title, loc="left", fontsize=10, fontweight="bold")
    dress(axes, chart.x_label, chart.y_label)
    if chart.equal:
        axes.set_aspect("equal", adjustable="datalim")
    if axes.get_legend_handles_labels()[0]:
        # beside the title where both fit in one row, else under the chart: never over the curves
        below = _rows_below(chart)
        if below:
            columns = -(-len(axes.get_legend_handles_labels()[1]) // below)
            place = {"loc": "upper left", "bbox_to_anchor": (0.0, -0.14), "ncols": columns}
        else:
            place = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": 4}
        axes.legend(fontsize=8, frameon=False, borderaxespad=0.2, **place)


def _rows_below(chart: Chart) -> int:
    """Return how many rows a legend takes under a chart; 0 where it fits beside the title."""
    names = [line.name for line in chart.series if line.name]
    if chart.stacked and len(names) > 1:
        names.append("sum")
    if not names or (
        len(names) <= 4 and len(chart.title) + sum(len(name) + KEY for name in names) <= ROW
    ):
        return 0
    columns = min(max(int(1.3 * ROW) // (max(map(len, names)) + KEY), 1), 4)
    return -(-len(names) // columns)


def _line(axes: Any, line: Series) -> None:
    style = "--" if line.dashed else "-"
    if line.points:
        axes.plot(line.x, line.y, ".", ms=3, color=line.colour, label=line.name)
    else:
        axes.plot(line.x, line.y, style, lw=1.4, color=line.colour, label=line.name)
    if line.band is not None:
        low, high = line.edges()
        axes.fill_between(line.x, low, high, color=line.colour, alpha=0.2, lw=0)


def _stack(axes: Any, lines: list[Series]) -> None:
    """Areas upwards for positive and downwards for negative values, and their sum."""
    if not lines:
        return
    x = lines[0].x
    top, bottom = np.zeros_like(x), np.zeros_like(x)
    for line in lines:
        values = np.nan_to_num(line.y)
        up, down = top + np.maximum(values, 0.0), bottom + np.minimum(values, 0.0)
        axes.fill_between(x, top, up, color=line.colour, alpha=0.65, lw=0, label=line.name)
        axes.fill_between(x, bottom, down, color=line.colour, alpha=0.65, lw=0)
        top, bottom = up, down
    if len(lines) > 1:
        axes.plot(x, top + bottom, color="#1b2127", lw=1.4, label="sum")
