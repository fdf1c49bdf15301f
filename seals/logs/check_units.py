"""Checks of units and of the sign of gravity, by the magnitude of quantities."""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats
from seals.logs.finding import Finding, Severity
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
        text = f"in quiet moments the accelerometer reads {size:.4g} m/s^2; at rest it is 9.81. "
        text += "Is gravity removed, or the unit another?"
        return [_warn("rest_force", "specific_force", text, len(means))]
    return _sign(log, means)


def _sign(log: Log, means: Floats) -> list[Finding]:
    upward = float(np.median(means[:, 2])) / STANDARD_GRAVITY
    # with an attitude the world axis decides, in check_frames
    if upward > -0.8 or log.has("orientation"):
        return []
    text = (
        f"at rest z reads {upward * STANDARD_GRAVITY:.4g} m/s^2, +9.81 is meant: body axes with z "
        "down (FRD), or the sign of acceleration instead of specific force.\n"
        "Turn y and z (FRD to FLU); ignore this when the vehicle lies upside down."
    )
    return [_warn("frame_down", "specific_force", text, len(means))]


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
