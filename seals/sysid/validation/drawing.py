"""Output of an ablation as picture and table."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from seals.errors import printable
from seals.logs.atomic import atomic_path
from seals.report.pictures import figure_class, log_scale
from seals.report.style import CYCLE, MUTED
from seals.sysid.validation.ablation import Ablation
from seals.sysid.validation.verification import Verification
from seals.terminal import drawing

UNITS = {
    "position": "m",
    "orientation": "rad",
    "velocity": "m/s",
    "depth": "m",
    "joint_position": "rad",
    "angular_velocity": "rad/s",
    "specific_force": "m/s²",
}
"""Units of the channels."""
_SHOWN = (0.1, 1.0)
"""Horizons that the table shows; the others are in verify.json [s]."""
_WIDE = 12.0
"""Ratio of the largest to the smallest error from which on the scale is logarithmic."""


def print_table(found: Verification) -> None:
    """Print errors by channel and horizon, one column per variant."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    ablation = found.ablation
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("error")
    table.add_column("at", justify="right")
    for name in (*(m.model.name for m in ablation.variants), "noise floor"):
        table.add_column(escape(printable(name)).replace("_", " "), justify="right")
    levels = (f"{m.level:.3g}" for m in ablation.variants)
    table.add_row("times the floor", "", *levels, "1", style="bold")
    for name in ablation.first.plain:
        for horizon in _SHOWN:
            values = [m.plain[name].get(horizon) for m in ablation.variants]
            values.append(ablation.floor.get(name, {}).get(horizon))
            cells = ["-" if v is None else f"{v:.2g}" for v in values]
            table.add_row(
                escape(f"{printable(name).replace('_', ' ')} [{UNITS.get(name, '1')}]"),
                f"{horizon:g} s",
                *cells,
            )
    Console(file=drawing(sys.stdout), highlight=False).print(table)


def draw_ablation(path: Path, found: Verification) -> None:
    """Draw the ablation as a waterfall chart with the noise floor.

    Raises:
        MissingExtra: there is no matplotlib.
    """
    ablation = found.ablation
    figure = canvas((1.9 + 1.5 * (len(ablation.variants) + 1), 4.2))
    axes = figure.add_subplot()
    _bars(axes, ablation)
    words = found.word.replace("_", " ")
    title = printable(f"{found.overlay.name} on {ablation.name}: {words}")
    axes.set_title(title, fontsize=11)
    with atomic_path(path) as beside:
        figure.savefig(beside, dpi=130, format="png")


def canvas(size: tuple[float, float]) -> Any:
    """Return an empty matplotlib figure of given width and height [in]; needs no display.

    Raises:
        MissingExtra: there is no matplotlib.
    """
    figure = figure_class()(figsize=size, layout="constrained")
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    return figure


def _bars(axes: Any, ablation: Ablation) -> None:
    """Bars: ends in grey, changes in colour, blue where the error falls."""
    levels = [m.level for m in ablation.variants]
    count, low = len(levels), min(*(m.level for m in ablation.variants), 1.0)
    wide = max(levels) > _WIDE * low
    base = 0.4 * low if wide else 0.0
    for k, level in ((0, levels[0]), (count, levels[-1])):
        axes.bar(k, level - base, bottom=base, color=MUTED, width=0.6)
        _note(axes, k, level, f"{level:.3g}", bold=True)
    for k in range(1, count):
        change = levels[k] - levels[k - 1]
        bottom = min(levels[k], levels[k - 1])
        colour = CYCLE[0] if change <= 0.0 else CYCLE[1]
        axes.bar(k, abs(change), bottom=bottom, color=colour, width=0.6)
        _note(axes, k, bottom + abs(change), f"{change:+.2g}")
    for k, level in enumerate(levels):
        axes.plot([k - 0.3, k + 1.3], [level] * 2, color=MUTED, linewidth=0.8)
    axes.axhline(1.0, color=CYCLE[2], linestyle="--", linewidth=1.4, label="noise floor")
    axes.legend(loc="upper right", frameon=False, fontsize=9)
    words = (printable(m.model.name).replace("_", " ") for m in ablation.variants)
    names = [name.replace(" model", "\nmodel") for name in words]
    axes.set_xticks(range(count + 1), [*names, "whole\nmodel"], fontsize=9)
    axes.set_ylabel("error of the simulator,\ntimes the noise floor")
    if wide:
        log_scale(axes, "y")
    axes.set_ylim(base, max(levels) * (2.5 if wide else 1.2))
    axes.set_xlim(-0.5, count + 0.5)
    axes.spines[["top", "right"]].set_visible(False)


def _note(axes: Any, at: float, height: float, text: str, *, bold: bool = False) -> None:
    axes.annotate(
        text,
        (at, height),
        textcoords="offset points",
        xytext=(0, 3),
        ha="center",
        fontsize=9,
        fontweight="bold" if bold else "normal",
    )
