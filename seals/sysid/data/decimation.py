"""Thinning of a fast log to the rate at which the motion of bodies needs to be known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.logs.channels import columns_of
from seals.logs.log import Log
from seals.logs.resample import one_sign
from seals.logs.run_folder import ROBOT

STEP = 0.01
"""Step between the rows that are kept, at most [s]: rotors and thrusters are slower."""
SERVO_STEP = 0.002
"""The same where servos move joints fast [s]: a light arm follows them within 5 to 15 ms."""
_UNSEEN = 7.0
"""Way of the joints' commands from row to row that needs no closer rows, in their noise."""
_SECOND = 1.0
"""Span over which the speed of these commands is averaged, as long as a window [s]."""
ROWS = 4000
"""Rows of all logs together up to which every row is used."""
_COMPLETE = 0.9
"""Share of whole neighbourhoods from which on a channel is smoothed."""


def decimated(log: Log, rows: int, *, longest: float | None = None) -> Log:
    """Return every n-th row of a long log of a high rate; a short or slow one as it is.

    A measured channel that has samples in all rows is smoothed by a local parabola over 2 h + 1
    rows, h = n / 2 rounded down, which leaves cubics as they are (Savitzky and Golay 1964), and its
    stated noise becomes smaller accordingly. Of a channel with fewer samples those in the rows kept
    are taken. A command becomes its mean until the next row kept.

    Args:
        log: in the native format.
        rows: of all logs that are fitted together.
        longest: step between the rows kept, at most [s]; `longest_step` when left out.
    """
    steps = [np.diff(part.time) for part in log.segments() if part.rows > 1]
    step = float(np.median(np.concatenate(steps))) if steps else 0.0
    if rows <= ROWS or step <= 0.0:
        return log
    most = int((longest_step(log) if longest is None else longest) / step * (1.0 + 1e-6))
    if most < 2:
        return log
    groups = [np.flatnonzero(log.segment == part.segment[0]) for part in log.segments()]
    measured = [name for name in _stated(log.meta) if log.has(name)]
    for n in range(most, 1, -1):
        kept = [_kept(log, group, measured, n) for group in groups]
        if all(k is not None for k in kept):
            return _taken(log, groups, [k for k in kept if k is not None], measured, n)
    return log


def longest_step(log: Log) -> float:
    """Return the step between rows that follows the joints of a log [s], at most ``STEP``.

    From row to row their commands go no further than seven times the noise of the joints' readings,
    each joint weighted by the gain of its servo. Rows closer than ``SERVO_STEP`` are not asked for;
    where no noise is stated, every joint that is moved asks for these.
    """
    if not columns_of("joint_position_cmd", log.columns):
        return STEP
    fastest = max(_command_speed(part) for part in log.segments())
    noise = _stated(log.meta).get("joint_position", 0.0)
    if fastest == 0.0:
        return STEP
    return float(np.clip(_UNSEEN * noise / fastest, SERVO_STEP, STEP))


def _command_speed(run: Log) -> float:
    """Largest mean over a second of the speed of the joints' commands [rad/s or m/s].

    Equation:
        v^2 = sum (kp_j q_j')^2 / sum kp_j^2, with q' over ``STEP``.
    """
    # hold the last command in cells without a number; zero before the first one
    command: Floats = run.channel("joint_position_cmd").copy()
    for column in command.T:
        rows = np.where(np.isfinite(column), np.arange(column.size), -1)
        last = np.maximum.accumulate(rows)
        column[:] = np.where(last >= 0, column[last], 0.0)
    step = float(np.median(np.diff(run.time))) if run.rows > 1 else 0.0
    lag = min(max(1, round(STEP / step)), run.rows - 1) if step > 0.0 else 0
    if not lag:
        return 0.0
    rate = (command[lag:] - command[:-lag]) / (lag * step)
    square = rate**2 @ _shares(run.meta, command.shape[1])
    count = min(max(1, round(_SECOND / step)), square.size)
    total = np.concatenate([[0.0], np.cumsum(square)])
    # a sum of sums is good to rounding: joints that rest have a speed of zero
    most = float((total[count:] - total[:-count]).max()) / count if square.any() else 0.0
    return float(np.sqrt(max(most, 0.0)))


def _shares(meta: Mapping[str, Any], joints: int) -> Floats:
    """Squares of the servos' gains as shares of their sum, shape (J,); equal where none fit."""
    found: Any = meta.get("vehicle")
    for key in ("arm", "controller", "kp"):
        found = found.get(key) if isinstance(found, Mapping) else None
    drives = (meta.get(ROBOT) or {}).get("actuators") or {}
    found = next((d["kp_each"] for d in drives.values() if d.get("kp_each")), found)
    given = found if isinstance(found, list) else [found] * joints
    numbers = len(given) == joints and all(isinstance(x, int | float) for x in given)
    square = np.square(given if numbers else np.ones(joints), dtype=float)
    total = float(square.sum())
    return square / total if total > 0.0 else np.full(joints, 1.0 / joints)


def _stated(meta: Mapping[str, Any]) -> dict[str, float]:
    """White noise of the channels, 1-sigma, by name."""
    channels: Mapping[str, Any] = (meta.get("sensors") or {}).get("channels") or {}
    given = {k: v.get("sigma") for k, v in channels.items() if isinstance(v, Mapping)}
    return {k: float(v) for k, v in given.items() if isinstance(v, int | float)}


def _kept(
    log: Log, group: NDArray[np.int64], measured: list[str], n: int
) -> NDArray[np.int64] | None:
    """Rows of one run to keep, which hold all samples of slow channels; None for none such.

    Without a measured pose the first row is kept: the log states the state there.
    """
    if group.size < 2 * n:
        return None
    phases = set() if log.has("position") else {0}
    for name in measured:
        sampled = np.flatnonzero(np.isfinite(log.channel(name)[group]).any(axis=1))
        if sampled.size and sampled.size <= group.size * (1.0 / n + 0.02) + 1:
            phases |= set((sampled % n).tolist())
    if len(phases) > 1:
        return None
    return group[phases.pop() if phases else 0 :: n]


def _taken(
    log: Log,
    groups: list[NDArray[np.int64]],
    kept: list[NDArray[np.int64]],
    measured: list[str],
    n: int,
) -> Log:
    """Return the log in the rows kept."""
    columns, calmer = dict(log.columns), dict[str, float]()
    for name in (s for s in log.channels() if s.endswith("_cmd")):
        for column in columns_of(name, log.columns):
            columns[column] = _means(log.columns[column], groups, n)
    for name in measured:
        smooth, gain = _smoothed(log, name, groups, n)
        here = {k: i for i, k in enumerate(columns_of(name, log.columns)) if k in columns}
        whole = np.isfinite(smooth[np.concatenate(kept)][:, list(here.values())]).all(axis=1)
        if whole.mean() >= _COMPLETE:
            calmer[name] = gain
            columns |= {k: smooth[:, i] for k, i in here.items()}
    order = np.concatenate(kept)
    meta = dict(log.meta)
    if calmer:
        sensors = dict(meta.get("sensors") or {})
        channels = {
            k: {**v, "sigma": v["sigma"] * calmer[k]} if k in calmer else v
            for k, v in (sensors.get("channels") or {}).items()
        }
        meta["sensors"] = {**sensors, "channels": channels}
    return replace(
        log,
        columns={k: v[order] for k, v in columns.items()},
        segment=log.segment[order],
        meta=meta,
    )


def _means(values: Floats, groups: list[NDArray[np.int64]], n: int) -> Floats:
    """Mean of a held command over each row and the n - 1 after it."""
    out: Floats = values.copy()
    for group in groups:
        own = values[group]
        last = np.maximum.accumulate(np.where(np.isfinite(own), np.arange(own.size), 0))
        own = np.concatenate([own[last], np.full(n - 1, own[last[-1]])])
        out[group] = np.lib.stride_tricks.sliding_window_view(own, n).mean(axis=1)
    return out


def _smoothed(log: Log, name: str, groups: list[NDArray[np.int64]], n: int) -> tuple[Floats, float]:
    """Local parabola of a channel, NaN where a neighbour is missing, and its noise over that."""
    half = n // 2
    lags = np.arange(-half, half + 1, dtype=float)
    weight = np.linalg.pinv(np.vander(lags, min(3, lags.size), increasing=True))[0]
    values = log.channel(name)
    out = np.full_like(values, np.nan)
    for group in groups:
        own = values[group]
        if name == "orientation":
            own = one_sign(own)
        windows = np.lib.stride_tricks.sliding_window_view(own, lags.size, axis=0)
        found = windows @ weight
        if name == "orientation":
            found /= np.linalg.norm(found, axis=1, keepdims=True)
        out[group[half : own.shape[0] - half]] = found
    return out, float(np.sqrt(np.sum(weight**2)))
