"""Predictions of a model in windows with fitted start states, and their standard deviation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.frames import exponential, matrix_of, multiply
from seals.logs.channels import unit_of
from seals.sysid.predictors.windows import Windows
from seals.sysid.scores.channels import component, restarted
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


@dataclass(frozen=True, kw_only=True)
class Track:
    """Component of a channel in all windows; W windows of K rows, NaN for no sample.

    Args:
        name: of the component.
        unit: of it.
        rows: of the log, shape (W, K).
        measured: shape (W, K).
        before: measured less the model before, shape (W, K).
        after: measured less the model after, shape (W, K).
        spread: 1-sigma of the residual of a right model, shape (W, K).
    """

    name: str
    unit: str
    rows: NDArray[np.int64]
    measured: Floats
    before: Floats
    after: Floats
    spread: Floats

    def level(self, residual: Floats) -> float:
        """Root mean square of a residual in units of its standard deviation; 1 for a true model."""
        good = np.isfinite(residual)
        ratio = residual[good] / self.spread[good]
        return float(np.sqrt(np.mean(ratio**2))) if good.any() else 0.0


def tracks(before: EvidenceHypothesis, after: EvidenceHypothesis) -> tuple[Track, ...]:
    """Return all components that were read, largest residual of the first model first."""
    windows = before.fitter.windows
    first, spread = restarted(before.fitter, before.fit.values)
    last = first
    if after is not before:
        # the windows may differ: the rows of the log are common
        whole = np.full((windows.samples.rows, first.shape[2]), np.nan)
        whole[after.fitter.windows.rows] = restarted(after.fitter, after.fit.values)[0]
        last = whole[windows.rows]
    if "orientation" in windows.channel_of:
        turned = windows.samples.channels["orientation"][windows.rows]
        column = windows.channel_of.index("orientation")
        at = slice(column, column + 3)
        first[:, :, at] = attitude(turned, first[:, :, at])
        if last is not first:
            last[:, :, at] = attitude(turned, last[:, :, at])
    out = []
    for i, channel in enumerate(windows.channel_of):
        values = _measured_values(windows, channel)
        if values is None or not np.isfinite(first[:, :, i]).any():
            continue
        axis = i - windows.channel_of.index(channel)
        sign = -1.0 if channel == "depth" else 1.0
        width = windows.channel_of.count(channel)
        seen = np.where(np.isfinite(first[:, :, i]), values[:, axis][windows.rows], np.nan)
        out.append(
            Track(
                name=component(channel, axis, width),
                unit="rad" if channel == "orientation" else unit_of(channel) or "",
                rows=windows.rows,
                measured=seen,
                before=sign * first[:, :, i],
                after=sign * last[:, :, i],
                spread=spread[:, :, i],
            )
        )
    return tuple(sorted(out, key=lambda t: -t.level(t.before)))


def _measured_values(windows: Windows, channel: str) -> Floats | None:
    """Return the measured channel, shape (T, k); orientation as unwrapped roll, pitch and yaw."""
    values = windows.samples.channels.get(channel)
    if values is None or channel != "orientation":
        return values
    angles = np.full((len(values), 3), np.nan)
    good = np.isfinite(values[:, 0])
    angles[good] = np.unwrap(_angles(values[good]), axis=0)
    return angles


def attitude(measured: Floats, residual: Floats) -> Floats:
    """Convert an attitude error in body axes to roll, pitch and yaw [rad], shape (..., 3).

    Args:
        measured: q_WB_xyzw, shape (..., 4).
        residual: turn from the model to the measurement, body axes [rad], shape (..., 3).
    """
    out = np.full(residual.shape, np.nan)
    good = np.isfinite(residual).all(axis=-1) & np.isfinite(measured).all(axis=-1)
    model = multiply(measured[good], exponential(-residual[good]))
    gap = _angles(measured[good]) - _angles(model)
    out[good] = (gap + np.pi) % (2.0 * np.pi) - np.pi
    return out


def _angles(quaternion: Floats) -> Floats:
    turn = matrix_of(quaternion)
    roll = np.arctan2(turn[:, 2, 1], turn[:, 2, 2])
    pitch = np.arcsin(np.clip(-turn[:, 2, 0], -1.0, 1.0))
    yaw = np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
    return np.stack([roll, pitch, yaw], axis=1)


def run_offsets(starts: Sequence[float], ends: Sequence[float]) -> list[float]:
    """Time shifts that concatenate runs with overlapping times [s].

    Example:
        >>> run_offsets([0.0, 0.0], [2.0, 1.0])
        [0.0, 2.5]
        >>> run_offsets([0.0, 3.0], [2.0, 4.0])
        [0.0, 0.0]
    """
    if all(b > a for a, b in zip(ends, starts[1:], strict=False)):
        return [0.0] * len(starts)
    shifts, at = [], None
    for first, last in zip(starts, ends, strict=True):
        shift = 0.0 if at is None else at + 0.5 - first
        shifts.append(shift)
        at = last + shift
    return shifts
