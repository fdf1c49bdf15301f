"""Comparison of measured and simulated acceleration, with residuals."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.errors import printable
from seals.logs.atomic import atomic_path
from seals.logs.log import Log
from seals.report.style import CYCLE, MUTED
from seals.sysid.validation.drawing import canvas
from seals.sysid.validation.verification import Verification

COLOURS = CYCLE[1], CYCLE[0]
"""Colours of the model before and after."""


@dataclass(frozen=True, kw_only=True)
class AccelerationTrack:
    """Specific force of a log along one axis of the inertial sensor, measured and simulated.

    Args:
        axis: x, y or z: the one with the largest residual of the first variant.
        time: of the rows that the windows share [s], shape (W, K).
        measured: [m/s^2], shape (W, K); NaN for no sample.
        simulated: of the first and the last variant [m/s^2], each (W, K).
    """

    axis: str
    time: Floats
    measured: Floats
    simulated: tuple[Floats, Floats]

    @property
    def levels(self) -> tuple[float, float]:
        """Root mean square residual before and after [m/s^2]."""
        before, after = (
            float(np.sqrt(np.nanmean((self.measured - s) ** 2))) for s in self.simulated
        )
        return before, after


def acceleration_of(found: Verification, log: Log) -> AccelerationTrack | None:
    """Compare the accelerometer of a log with its replays; None without readings.

    Args:
        found: with the replays of the first and the last variant.
        log: that was replayed.
    """
    if not log.has("specific_force"):
        return None
    parts = log.segments()
    rows = found.ablation.first.track.rows
    seen = np.concatenate([p.channel("specific_force") for p in parts])[rows]
    before, after = (
        m.track.reading[:, :, 3:6] for m in (found.ablation.first, found.ablation.last)
    )
    given = np.isfinite(seen)
    if not given.all(axis=2).any():
        return None
    left = np.nansum((seen - before) ** 2, axis=(0, 1))
    k = int(np.argmax(left))
    return AccelerationTrack(
        axis="xyz"[k],
        time=np.concatenate([p.time for p in parts])[rows],
        measured=seen[:, :, k],
        simulated=(before[:, :, k], after[:, :, k]),
    )


def draw_acceleration(path: Path, track: AccelerationTrack, found: Verification) -> None:
    """Draw measured and simulated acceleration before and after, the residuals below.

    Raises:
        MissingExtra: there is no matplotlib.
    """
    figure = canvas((9.0, 6.4))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    added = " and ".join(printable(part).replace("_", " ") for part in found.overlay.parts)
    names = f"stated model: {track.levels[0]:.2g}", f"with {added}: {track.levels[1]:.2g}"
    upper.plot(*_line(track.time, track.measured), color=MUTED, linewidth=2.4, label="measured")
    for simulated, colour, name in zip(track.simulated, COLOURS, names, strict=True):
        label = f"{name} m/s² left"
        upper.plot(*_line(track.time, simulated), color=colour, linewidth=1.1, label=label)
        residual = track.measured - simulated
        lower.plot(*_line(track.time, residual), color=colour, linewidth=1.1)
    upper.set_ylabel(f"specific force {track.axis} [m/s²]")
    lower.set_ylabel("measured less\nsimulated [m/s²]")
    lower.set_xlabel("time [s]")
    lower.axhline(0.0, color=MUTED, linewidth=0.8)
    upper.legend(loc="best", frameon=False, fontsize=9)
    upper.set_title(printable(f"{found.overlay.name} on {found.ablation.name}"), fontsize=11)
    for axes in (upper, lower):
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    with atomic_path(path) as beside:
        figure.savefig(beside, dpi=130, format="png")


def _line(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Windows as one line with a gap between them; rows without a sample are left out."""
    gap = np.full((len(x), 1), np.nan)
    time, value = (np.concatenate([a, gap], axis=1).ravel() for a in (x, y))
    given = np.isfinite(value) | ~np.isfinite(time)
    return time[given], value[given]
