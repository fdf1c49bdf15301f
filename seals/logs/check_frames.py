"""Checks of frame conventions: consistency of channels that depend on one another."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.logs.finding import Finding, Severity
from seals.logs.log import Log

_SPAN = 0.15
_FEWEST = 30
_LEAST_RATE = 0.05
_SURE = 0.9
_UNSURE = 0.7
_TURNED = 0.3
"""Turn of a sensor from which nobody calls it a misalignment [rad]."""
_CONVENTIONS = {
    "w, x, y, z": "",
    "x, y, z, w": "the quaternion's order looks like x, y, z, w.\n"
    "Convert it with axes.quaternion=xyzw",
    "inverse": "the quaternion looks inverted: it turns world vectors into body vectors.\n"
    "Convert it with axes.inverse=true",
    "flipped": "gyroscope and attitude disagree in the sign of y and z: one has body axes with z "
    "down (FRD).\nConvert it with axes.imu=frd; where the attitude is the wrong one, with "
    "axes.body=frd axes.imu=flu",
}


def check_frames(log: Log) -> list[Finding]:
    """Return the findings about quaternions, gravity's direction and the sign of depth."""
    found = []
    if all(f"orientation_{x}" in log.columns for x in "wxyz"):
        norms = _norms(log)
        found += norms
        if not any(finding.severity is Severity.REFUSE for finding in norms):
            found += [*_rates(log), *_gravity(log)]
    return [*found, *_depth(log)]


def _finding(code: str, channel: str, message: str, *, refuse: bool, count: int = 0) -> Finding:
    severity = Severity.REFUSE if refuse else Severity.WARN
    return Finding(severity=severity, code=code, channel=channel, message=message, count=count)


def _norms(log: Log) -> list[Finding]:
    norm = np.linalg.norm(log.channel("orientation"), axis=1)
    error = np.abs(norm[np.isfinite(norm)] - 1.0)
    off = int(np.sum(error > 0.05))
    if off == 0:
        return []
    text = (
        f"{off} quaternions are not of unit length (off by up to {error.max():.3g}).\n"
        "Attitude must be a unit quaternion w, x, y, z, not angles."
    )
    return [
        _finding("quaternion_norm", "orientation", text, refuse=off > 0.01 * error.size, count=off)
    ]


def _multiply(p: Floats, q: Floats) -> Floats:
    """Hamilton product of quaternions w, x, y, z, shape (N, 4)."""
    vector = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    scalar = p[:, 0] * q[:, 0] - np.sum(p[:, 1:] * q[:, 1:], axis=1)
    return np.column_stack([scalar, vector])


def _mean_rates(early: Floats, late: Floats, span: Floats) -> Floats:
    """Mean body rate between two attitudes w, x, y, z, shape (N, 3) [rad/s]."""
    turn = _multiply(early * np.array([1.0, -1.0, -1.0, -1.0]), late)
    turn *= np.where(turn[:, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(turn[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, turn[:, :1])
    rates: Floats = angle * turn[:, 1:] / np.maximum(sine, 1e-12) / span[:, None]
    return rates


def _pairs(log: Log) -> tuple[Floats, Floats, Floats, Floats]:
    """Attitudes ``_SPAN`` apart in one segment, the rotation between, and the mean gyro rate."""
    q, gyro = log.channel("orientation"), log.channel("angular_velocity")
    good = np.flatnonzero(np.isfinite(q).all(axis=1))
    if good.size < _FEWEST:
        return q[:0], q[:0], q[:0, 0], gyro[:0]
    stride = max(1, round(_SPAN / max(float(np.median(np.diff(log.time[good]))), 1e-6)))
    first, last = good[:-stride], good[stride:]
    span = log.time[last] - log.time[first]
    keep = (log.segment[first] == log.segment[last]) & (span > 0.0) & (span < 3.0 * _SPAN)
    first, last = first[keep], last[keep]
    held = ~np.isnan(gyro.sum(axis=1))
    total = np.concatenate(
        [np.zeros((1, 3)), np.cumsum(np.where(held[:, None], gyro, 0.0), axis=0)]
    )
    count = np.concatenate([[0], np.cumsum(held)])
    number = (count[last] - count[first])[:, None]
    mean = (total[last] - total[first]) / np.maximum(number, 1)
    some = number[:, 0] > 0
    return q[first][some], q[last][some], span[keep][some], mean[some]


def _rates(log: Log) -> list[Finding]:
    if not log.has("angular_velocity"):
        return []
    early, late, span, gyro = _pairs(log)
    if len(early) < _FEWEST:
        return []
    order, inverse = [3, 0, 1, 2], np.array([1.0, -1.0, -1.0, -1.0])
    rates = {
        "w, x, y, z": _mean_rates(early, late, span),
        "x, y, z, w": _mean_rates(early[:, order], late[:, order], span),
        "inverse": _mean_rates(early * inverse, late * inverse, span),
    }
    rates["flipped"] = rates["w, x, y, z"] * np.array([1.0, -1.0, -1.0])
    if float(np.sqrt(np.mean(rates["w, x, y, z"] ** 2))) < _LEAST_RATE:
        return []
    likeness = {name: _likeness(gyro, rate) for name, rate in rates.items()}
    best = max(likeness, key=lambda name: likeness[name])
    ours = likeness["w, x, y, z"]
    if likeness[best] > _SURE and ours < _UNSURE:
        return [_finding("attitude_convention", "orientation", _CONVENTIONS[best], refuse=True)]
    if ours < _SURE and (turned := _mounting(gyro, rates["w, x, y, z"])):
        return [_finding("mounting", "angular_velocity", turned, refuse=False)]
    return _scale(gyro, rates["w, x, y, z"]) if ours > _SURE else []


def _mounting(gyro: Floats, rate: Floats) -> str:
    """Tell how a sensor is turned whose readings are the attitude's rates in other axes."""
    from scipy.spatial.transform import Rotation

    size = float(np.sqrt(np.sum(gyro * gyro) * np.sum(rate * rate)))
    if not size:
        return ""
    # Wahba's problem: the turn from the sensor's axes to those of the body
    turn, _ = Rotation.align_vectors(rate, gyro)
    if _likeness(turn.apply(gyro), rate) < _SURE or turn.magnitude() < _TURNED:
        return ""
    rpy = ", ".join(f"{angle + 0.0:.3f}" for angle in turn.as_euler("xyz"))
    return (
        f"it follows the attitude's rates in axes turned by {np.degrees(turn.magnitude()):.0f} "
        f"degrees: the sensor is mounted so.\nUnless robot.yaml states it, add there: "
        f"sensors: {{imu: {{rpy: [{rpy}]}}}}"
    )


def _likeness(a: Floats, b: Floats) -> float:
    size = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    return float(np.sum(a * b)) / size if size > 0.0 else 0.0


def _scale(gyro: Floats, rate: Floats) -> list[Finding]:
    ratio = float(np.sum(gyro * rate) / np.sum(rate * rate))
    if 0.5 < ratio < 2.0:
        return []
    degrees = 40.0 < ratio < 80.0
    guess = "it looks like deg/s, rad/s is needed" if degrees else "is its unit right?"
    text = f"the gyroscope reads {ratio:.3g} times the rate of the attitude: {guess}.\n"
    text += "Convert it, or give the reader its unit."
    return [_finding("unit_rate", "angular_velocity", text, refuse=degrees)]


def _gravity(log: Log) -> list[Finding]:
    if not log.has("specific_force"):
        return []
    q, force = log.channel("orientation"), log.channel("specific_force")
    good = np.isfinite(q).all(axis=1) & np.isfinite(force).all(axis=1)
    if good.sum() < _FEWEST:
        return []
    w, x, y, z = q[good].T
    last_row = np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    upward = float(np.median(np.sum(last_row * force[good], axis=1)))
    if upward > -4.9:
        return []
    text = (
        f"turned into the world, the accelerometer reads {upward:.3g} m/s^2 upwards, +9.81 is "
        "meant: the axes look like FRD and NED (z down).\n"
        "Convert it with axes.world=ned axes.body=frd"
    )
    return [_finding("frame_down", "specific_force", text, refuse=True, count=int(good.sum()))]


def _depth(log: Log) -> list[Finding]:
    if not (log.has("depth") and "position_z" in log.columns):
        return []
    depth, height = log.columns["depth"], log.columns["position_z"]
    good = np.isfinite(depth) & np.isfinite(height)
    if good.sum() < _FEWEST or np.ptp(height[good]) < 0.2 or np.ptp(depth[good]) == 0.0:
        return []
    down, up = depth[good] - depth[good].mean(), height[good] - height[good].mean()
    likeness = float(np.sum(down * up) / np.sqrt(np.sum(down**2) * np.sum(up**2)))
    if likeness < _SURE:
        return []
    text = "depth rises with height: depth is positive down, position_z positive up (ENU).\n"
    text += "Turn the sign of the one that is wrong."
    return [_finding("depth_sign", "depth", text, refuse=True, count=int(good.sum()))]
