"""Footfall diagram: a bar for each stance phase of each foot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.experiments.crab_gaits.walks import Walk
from seals.logs.atomic import atomic_path
from seals.report.pictures import figure_class

SPAN = 1.5
"""Time that is shown [s]."""


def draw_falls(walks: Mapping[str, Walk], path: Path) -> None:
    """Draw the stance phases of all feet, one row of the figure per walk.

    Args:
        walks: by name.
        path: of the picture.
    """
    rows = -(-len(walks) // 2)
    figure = figure_class()(figsize=(10.0, 1.5 * rows), layout="constrained")
    axes: Any = figure.subplots(rows, 2, squeeze=False)
    for panel in axes.flat[len(walks) :]:
        panel.set_visible(False)
    for panel, (name, walk) in zip(axes.flat, walks.items(), strict=False):
        span = SPAN if walk.size < 0.2 else 4.0 * SPAN
        shown = walk.time < walk.time[0] + span
        time = walk.time[shown] - walk.time[0]
        for k in range(len(walk.feet)):
            colour = "#b5541c" if walk.feet[k].startswith("left") else "#2a6f97"
            # start and length of every time that a foot stands [s]
            step = float(time[1] - time[0])
            change = np.diff(np.concatenate(([0], walk.stands[shown, k].astype(int), [0])))
            starts, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
            panel.broken_barh(
                [(float(time[a]), step * float(b - a)) for a, b in zip(starts, ends, strict=True)],
                (k - 0.4, 0.8),
                color=colour,
            )
        panel.set_yticks(range(len(walk.feet)), [foot.replace("_", " ") for foot in walk.feet])
        panel.tick_params(labelsize=6)
        panel.invert_yaxis()
        panel.set_xlim(0.0, span)
        panel.set_title(f"{name}: {walk.lengths:.2f} body lengths/s", fontsize=8)
    axes.flat[len(walks) - 1].set_xlabel("time [s]", fontsize=7)
    with atomic_path(path) as beside:
        figure.savefig(beside, dpi=110, format="png")
