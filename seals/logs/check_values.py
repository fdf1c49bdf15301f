"""Checks of single columns: missing, infinite, constant, repeated, clipped, filled, in what unit.

Interpolated samples are straight lines in all noisy channels; a wrong unit or sign of gravity shows
in the magnitude.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats, true_spans
from seals.errors import nearest
from seals.logs.channels import CHANNELS, stem_of
from seals.logs.finding import LARGEST, Finding, Severity
from seals.logs.log import Log
from seals.logs.units import STANDARD_GRAVITY

_WINDOW = 0.25
_QUIET_SHARE = 0.05
_LONG_ENOUGH = 1.0
_FASTEST = 40.0
_FASTEST_ROTOR = 5000.0
_LIMITS = {"pitch": math.pi / 2, "roll": math.pi, "joint_position": 4 * math.pi}
_REST_UNITS = {"g": 1.0, "mg": 1000.0, "cm/s^2": 100.0 * STANDARD_GRAVITY}


def check_units(log: Log) -> list[Finding]:
    """Return the findings about units and about gravity's sign in the accelerometer."""
    return [*_accelerometer(log), *_rates(log), *_angles(log)]


def _quiet_forces(log: Log) -> tuple[Floats, float]:
    """Return the mean specific force in windows in which it hardly changes.

    Returns:
        the means, shape (windows, 3), in the unit of the log, and the length of one window [s].
    """
    force = log.channel("specific_force")
    # an axis that is not there counts as zero, a row without a sample does not count
    force = np.where(np.isnan(force).all(axis=0), 0.0, force)
    sampled = np.isfinite(force).all(axis=1)
    means, length = [], 0.0
    for segment in np.unique(log.segment):
        rows = np.flatnonzero((log.segment == segment) & sampled)
        if rows.size < 2:
            continue
        step = float(np.median(np.diff(log.time[rows])))
        if not step > 0.0:
            continue
        # rows of one channel may be closer than those of the log
        width = max(10, round(_WINDOW / max(step, _WINDOW / rows.size)))
        count = rows.size // width
        parts = force[rows[: count * width]].reshape(count, width, 3)
        mean, scatter = parts.mean(axis=1), np.linalg.norm(parts.std(axis=1), axis=1)
        size = np.linalg.norm(mean, axis=1)
        means.append(mean[(scatter < _QUIET_SHARE * size) & (size > 0.0)])
        length = max(length, width * step)
    return (np.concatenate(means) if means else np.zeros((0, 3))), length


def _accelerometer(log: Log) -> list[Finding]:
    if not log.has("specific_force"):
        return []
    means, length = _quiet_forces(log)
    if len(means) * length < _LONG_ENOUGH:
        return []
    size = float(np.median(np.linalg.norm(means, axis=1)))
    for unit, at_rest in _REST_UNITS.items():
        if abs(size / at_rest - 1.0) < 0.1:
            text = (
                f"at rest the accelerometer reads {size:.4g}: this looks like {unit}, m/s^2 is "
                f"needed (9.81 at rest).\nConvert it, or give the reader the unit {unit}."
            )
            return [
                Finding(
                    severity=Severity.REFUSE,
                    code="unit_acceleration",
                    channel="specific_force",
                    message=text,
                    count=len(means),
                )
            ]
    if not 0.8 < size / STANDARD_GRAVITY < 1.25:
        text = (
            f"at low accelerations the accelerometer reads {size:.4g} m/s^2; at rest it is 9.81. "
        )
        text += "Was gravity removed, or is the unit different?"
        return [_warn("rest_force", "specific_force", text, len(means))]
    upward = float(np.median(means[:, 2])) / STANDARD_GRAVITY
    # with an attitude the world axis decides, in check_frames
    if upward > -0.8 or log.has("orientation"):
        return []
    told = (
        f"at rest z reads {upward * STANDARD_GRAVITY:.4g} m/s^2 instead of +9.81: body axes with z "
        "down (FRD), or acceleration instead of specific force.\n"
        "Reverse y and z (FRD to FLU); ignore this if the vehicle lies upside down."
    )
    return [_warn("frame_down", "specific_force", told, len(means))]


def _rates(log: Log) -> list[Finding]:
    found = []
    if log.has("angular_velocity"):
        size = np.abs(log.channel("angular_velocity"))
        high = float(np.nanquantile(size, 0.995)) if np.isfinite(size).any() else 0.0
        if high > _FASTEST:
            text = f"the gyroscope reads up to {high:.4g} rad/s. Is it in deg/s?"
            found.append(_warn("unit_rate", "angular_velocity", text))
    if log.has("rotor_speed_cmd"):
        speed = log.channel("rotor_speed_cmd")
        high = float(np.nanmax(speed)) if np.isfinite(speed).any() else 0.0
        if high > _FASTEST_ROTOR:
            text = f"rotor speeds up to {high:.5g} rad/s. Are they in rpm?"
            found.append(_warn("unit_rotor_speed", "rotor_speed_cmd", text))
    return found


def _angles(log: Log) -> list[Finding]:
    found = []
    for stem, limit in _LIMITS.items():
        if not log.has(stem):
            continue
        size = np.abs(log.channel(stem))
        high = float(np.nanmax(size)) if np.isfinite(size).any() else 0.0
        if high > limit + 0.1:
            text = f"angles up to {high:.4g} rad, beyond {limit:.3g}. Are they in degrees?"
            found.append(_warn("unit_angle", stem, text))
    return found


def _warn(code: str, channel: str, message: str, count: int = 0) -> Finding:
    return Finding(severity=Severity.WARN, code=code, channel=channel, message=message, count=count)


_NOISY = ("angular_velocity", "specific_force")
_ROUNDED = 2.5
"""Second difference of a straight line after rounding, in steps of the rounding."""
_MOVED = 4.0
"""Motion of a drawn line within the shortest stretch, in steps of the rounding."""
_SHORTEST = 0.25
"""Straight stretch that counts [s]: a lost packet or two is no reason for words."""
_SHARE = 0.1
"""Share of the log in straight stretches from which a warning is due."""
_LONG = 1.0
"""Straight stretch from which the log is refused [s]: longer than any lost packet; what stands
there was never measured."""


def check_filled(log: Log) -> list[Finding]:
    """Return the finding about periods in which all inertial channels are straight lines."""
    names = [f"{stem}_{axis}" for stem in _NOISY for axis in "xyz"]
    columns = [log.columns[name] for name in names if name in log.columns]
    if len(columns) < 3 or log.rows < 50:
        return []
    straight = np.ones(log.rows, dtype=bool)
    for values in columns:
        # rows with the second difference of a straight line, as rounded in the file
        quantum = _quantum(values)
        bend = np.abs(np.diff(values, 2))
        flat = np.zeros(values.size, dtype=bool)
        flat[1:-1] = bend <= _ROUNDED * quantum
        straight &= flat
    # the same value throughout is a frozen sensor: another check's business
    runs = [run for run in true_spans(straight) if _seconds(log, run) >= _SHORTEST]
    runs = [part for run in runs for part in _drawn(log, columns, run)]
    if not runs:
        return []
    longest = max(runs, key=lambda run: _seconds(log, run))
    total = sum(_seconds(log, run) for run in runs)
    span = float(log.time.max() - log.time.min())
    if _seconds(log, longest) < _LONG and total < _SHARE * span:
        return []
    refused = _seconds(log, longest) >= _LONG
    first, start = float(log.time.min()), float(log.time[longest[0]])
    text = (
        f"all inertial channels run in straight lines for {total:.3g} s in {len(runs)} "
        f"stretch(es), the longest {_seconds(log, longest):.3g} s: lost samples were "
        "interpolated.\n"
        f"Keep only measured samples: seals convert ... span=[{first:.4g},{start:.4g}]"
    )
    return [
        Finding(
            severity=Severity.REFUSE if refused else Severity.WARN,
            code="filled",
            channel="angular_velocity",
            message=text,
            count=len(runs),
            where=start,
        )
    ]


def _drawn(log: Log, columns: list[Floats], run: tuple[int, int]) -> list[tuple[int, int]]:
    """Return the parts of a run in which lines were drawn: they move, and keep to their chords.

    A smooth signal that is rounded coarsely has small second differences as well, at rest and in
    motion; but at rest it moves by little more than the rounding, and in motion it leaves the
    chord.
    """
    rows = max(8, round(_SHORTEST * (run[1] - run[0]) / max(_seconds(log, run), 1e-9)))
    quanta = [_quantum(values) for values in columns]
    drawn = np.zeros(log.rows, dtype=bool)
    for first in range(run[0], max(run[1] - rows, run[0]) + 1, rows):
        # what is left over at the end goes with the last piece
        last = run[1] if run[1] - first < 2 * rows else first + rows
        pieces = [values[first:last] for values in columns]
        share = np.linspace(0.0, 1.0, last - first)
        moved = [abs(piece[-1] - piece[0]) for piece in pieces]
        bowed = [np.max(np.abs(p - p[0] - share * (p[-1] - p[0]))) for p in pieces]
        moves = any(m > _MOVED * q for m, q in zip(moved, quanta, strict=True))
        keeps = all(b <= _ROUNDED * q for b, q in zip(bowed, quanta, strict=True))
        drawn[first:last] = moves and keeps
    return true_spans(drawn)


def _seconds(log: Log, run: tuple[int, int]) -> float:
    return float(log.time[run[1] - 1] - log.time[run[0]])


def _quantum(values: Floats) -> float:
    """Smallest step between neighbours: that of the rounding, in a file that rounds."""
    steps = np.abs(np.diff(values))
    moving = steps[np.isfinite(steps) & (steps > 1e-9 * np.nanmax(np.abs(values), initial=1e-12))]
    return float(np.min(moving)) if moving.size else 0.0


_MOSTLY = 0.5
_FEWEST = 20
_CLIPPED_RUN = 3
_CLIPPED_JUMP = 20.0


_MEANT = {
    "gyro": "angular_velocity",
    "gyr": "angular_velocity",
    "rates": "angular_velocity",
    "acc": "specific_force",
    "accel": "specific_force",
    "quat": "orientation",
    "quaternion": "orientation",
    "attitude": "orientation",
    "pos": "position",
    "motor": "motor_pwm",
    "x": "position_x",
    "y": "position_y",
    "z": "position_z",
}
"""Names that other programs give a channel of ours."""
_EULER = " Together with roll and pitch it gives the attitude: axes.euler=ZYX, or another order."


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
            close = _MEANT.get(stem.casefold()) or nearest(stem, CHANNELS)
            hint = f" Did you mean '{close}'?" if close else ""
            hint = _EULER if stem == "yaw" else hint
            text = f"not a known channel; it is kept but not used.{hint}"
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
        text = (
            f"{np.mean(steps == 0.0):.0%} of the samples equal the preceding one: a slower sensor "
        )
        text += "written at the rate of the log, or a coarse one."
        return [_about(name, "held_samples", text, Severity.NOTE, count=int(np.sum(steps == 0.0)))]
    found: list[Finding] = []
    if moving.size == 0:
        return found
    for level, word in ((values.max(), "above"), (values.min(), "below")):
        count, first = _clipped(values == level, steps, float(np.min(moving)))
        if count:
            text = (
                f"{count} samples are at {level:.6g}, {word} which there are no readings: the "
                "sensor is saturated."
            )
            where = float(times[first])
            found.append(_about(name, "saturated", text, count=count, where=where))
    return found


def _clipped(at_level: NDArray[np.bool_], steps: Floats, quantum: float) -> tuple[int, int]:
    """Count the samples in flat runs at the extreme that are entered or left with a jump.

    The top of a slow, coarsely written curve is flat too, but is reached in steps of one quantum.
    """
    begins, ends = np.array(true_spans(at_level), dtype=np.int64).reshape(-1, 2).T
    padded = np.concatenate([[0.0], steps, [0.0]])
    jump = np.maximum(padded[begins], padded[ends])
    enough = max(_CLIPPED_JUMP * quantum, 0.5 * float(np.median(steps[steps > 0.0])))
    real = (ends - begins >= _CLIPPED_RUN) & (jump > enough)
    if not real.any():
        return 0, 0
    return int(np.sum((ends - begins)[real])), int(begins[real][0])
