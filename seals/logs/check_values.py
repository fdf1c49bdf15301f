"""Checks of single columns: missing, infinite, constant, repeated and clipped samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import nearest
from seals.logs.channels import CHANNELS, stem_of
from seals.logs.finding import LARGEST, Finding, Severity
from seals.logs.log import Log

_MOSTLY = 0.5
_FEWEST = 20
_CLIPPED_RUN = 3
_CLIPPED_JUMP = 20.0


_EULER = " With roll and pitch it makes the attitude: axes.euler=ZYX, or another order."


def check_values(log: Log) -> list[Finding]:
    """Return the findings about single columns and about missing channels."""
    found = _channels(log)
    for name, values in log.columns.items():
        if name != "t":
            found += _column(name, values, log.time)
    return found


def _channels(log: Log) -> list[Finding]:
    if not any(np.isfinite(values).any() for key, values in log.columns.items() if key != "t"):
        text = "no channel holds a single sample.\nAt least one measured channel is needed."
        return [Finding(severity=Severity.REFUSE, code="no_samples", channel="", message=text)]
    found = []
    for stem in log.channels():
        known = CHANNELS.get(stem)
        if known is None:
            close = nearest(stem, CHANNELS)
            hint = f" Did you mean '{close}'?" if close else ""
            hint = _EULER if stem == "yaw" else hint
            text = f"not a known channel; it is carried along and not used.{hint}"
            found.append(_about(stem, "unknown_channel", text, Severity.NOTE))
            continue
        absent = [f"{stem}_{x}" for x in known.suffixes if f"{stem}_{x}" not in log.columns]
        if absent:
            text = f"components that are not in the log: {', '.join(absent)}."
            found.append(_about(stem, "missing_components", text, Severity.NOTE))
    return found


def _about(
    channel: str,
    code: str,
    message: str,
    severity: Severity = Severity.WARN,
    *,
    count: int = 0,
    where: float | None = None,
) -> Finding:
    return Finding(
        severity=severity, code=code, channel=channel, message=message, count=count, where=where
    )


def _column(name: str, values: Floats, time: Floats) -> list[Finding]:
    infinite = np.abs(values) > LARGEST
    if infinite.any():
        where = float(time[np.argmax(infinite)])
        text = f"{infinite.sum()} samples are infinite, or beyond {LARGEST:g}.\n"
        text += "Write a missing sample as NaN."
        return [
            _about(name, "infinite", text, Severity.REFUSE, count=int(infinite.sum()), where=where)
        ]
    there = ~np.isnan(values)
    held, times = values[there], time[there]
    if held.size == 0:
        return [_about(name, "no_samples", "not a single sample.", count=int(values.size))]
    found = _missing(name, values.size, held.size)
    known = CHANNELS.get(stem_of(name))
    command = known is not None and known.command
    if held.size < _FEWEST:
        return found
    if np.ptp(held) == 0.0:
        severity = Severity.NOTE if command else Severity.WARN
        text = f"all {held.size} samples are {held[0]:.6g}. Is the sensor connected?"
        return [*found, _about(name, "constant", text, severity, count=int(held.size))]
    if command or (known is not None and known.stem == "orientation"):
        return found
    return [*found, *_flat(name, held, times)]


def _missing(name: str, rows: int, there: int) -> list[Finding]:
    share = 1.0 - there / rows
    if share <= _MOSTLY:
        return []
    text = f"{share:.0%} of the rows have no sample: a slower sensor, or one that dropped out."
    return [_about(name, "mostly_missing", text, Severity.NOTE, count=rows - there)]


def _flat(name: str, values: Floats, times: Floats) -> list[Finding]:
    steps = np.abs(np.diff(values))
    # rounding leaves differences far below the step of any sensor
    moving = steps[steps > 1e-6 * np.ptp(values)]
    if np.mean(steps == 0.0) > _MOSTLY:
        text = f"{np.mean(steps == 0.0):.0%} of the samples repeat the one before: a slower sensor "
        text += "written at the rate of the log, or a coarse one."
        return [_about(name, "held_samples", text, Severity.NOTE, count=int(np.sum(steps == 0.0)))]
    found: list[Finding] = []
    if moving.size == 0:
        return found
    for level, word in ((values.max(), "above"), (values.min(), "below")):
        count, first = _clipped(values == level, steps, float(np.min(moving)))
        if count:
            text = (
                f"{count} samples stand at {level:.6g}, {word} which nothing is reported: the "
                "sensor is at the end of its range."
            )
            where = float(times[first])
            found.append(_about(name, "saturated", text, count=count, where=where))
    return found


def _clipped(at_level: NDArray[np.bool_], steps: Floats, quantum: float) -> tuple[int, int]:
    """Count the samples in flat runs at the extreme that are entered or left with a jump.

    The top of a slow, coarsely written curve is flat too, but is reached in steps of one quantum.
    """
    edges = np.diff(np.concatenate([[0], at_level.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    padded = np.concatenate([[0.0], steps, [0.0]])
    jump = np.maximum(padded[begins], padded[ends])
    enough = max(_CLIPPED_JUMP * quantum, 0.5 * float(np.median(steps[steps > 0.0])))
    real = (ends - begins >= _CLIPPED_RUN) & (jump > enough)
    if not real.any():
        return 0, 0
    return int(np.sum((ends - begins)[real])), int(begins[real][0])
