"""Checks of channels that depend on one another: frames, axes, handedness, time offset, thrust.

Position is compared with attitude and accelerometer, and rotor speeds with the weight, which finds
wrong units and coefficients.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.logs.accelerations import even, second_derivative, world_acceleration
from seals.logs.axes import permutation
from seals.logs.finding import Finding, Severity
from seals.logs.log import Log
from seals.logs.time_offset import cosine, delay_between, time_offset

_SPAN = 0.15
_FEWEST_SAMPLES = 30
_LEAST_RATE = 0.05
_SURE = 0.9
_UNSURE = 0.7
_TURNED = 0.3
"""Turn of a sensor from which nobody calls it a misalignment [rad]."""
_CONVENTIONS = {
    "w, x, y, z": "",
    "x, y, z, w": "the quaternion's order looks like x, y, z, w.\n"
    "Convert it with axes.quaternion=xyzw",
    "inverse": "the quaternion looks inverted: it rotates world vectors into body axes.\n"
    "Convert it with axes.inverse=true",
    "flipped": "gyroscope and attitude disagree in the sign of y and z: one has body axes with z "
    "down (FRD).\nConvert it with axes.imu=frd; if the attitude is wrong, with "
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


def _mean_rates(early: Floats, late: Floats, span: Floats) -> Floats:
    """Mean body rate between two attitudes w, x, y, z, shape (N, 3) [rad/s]."""
    # Hamilton product with the conjugate: the turn between two attitudes
    p = early * np.array([1.0, -1.0, -1.0, -1.0])
    vector = p[:, :1] * late[:, 1:] + late[:, :1] * p[:, 1:] + np.cross(p[:, 1:], late[:, 1:])
    scalar = p[:, 0] * late[:, 0] - np.sum(p[:, 1:] * late[:, 1:], axis=1)
    turn = np.column_stack([scalar, vector])
    turn *= np.where(turn[:, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(turn[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, turn[:, :1])
    rates: Floats = angle * turn[:, 1:] / np.maximum(sine, 1e-12) / span[:, None]
    return rates


def _pairs(log: Log) -> tuple[Floats, Floats, Floats, Floats]:
    """Attitudes ``_SPAN`` apart in one segment, the rotation between, and the mean gyro rate."""
    q, gyro = log.channel("orientation"), log.channel("angular_velocity")
    good = np.flatnonzero(np.isfinite(q).all(axis=1))
    if good.size < _FEWEST_SAMPLES:
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
    if len(early) < _FEWEST_SAMPLES:
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
    likeness = {name: cosine(gyro, rate) for name, rate in rates.items()}
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
    if cosine(turn.apply(gyro), rate) < _SURE or turn.magnitude() < _TURNED:
        return ""
    rpy = ", ".join(f"{angle + 0.0:.3f}" for angle in turn.as_euler("xyz"))
    return (
        "it follows the rates of the attitude in axes rotated by "
        f"{np.degrees(turn.magnitude()):.0f} "
        f"degrees: this is the mounting of the sensor.\nUnless robot.yaml states it, add there: "
        f"sensors: {{imu: {{rpy: [{rpy}]}}}}"
    )


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
    if good.sum() < _FEWEST_SAMPLES:
        return []
    w, x, y, z = q[good].T
    last_row = np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    upward = float(np.median(np.sum(last_row * force[good], axis=1)))
    if upward > -4.9:
        return []
    text = (
        f"rotated to world axes, the accelerometer reads {upward:.3g} m/s^2 upwards instead of "
        "+9.81: the axes look like FRD and NED (z down).\n"
        "Convert it with axes.world=ned axes.body=frd"
    )
    return [_finding("frame_down", "specific_force", text, refuse=True, count=int(good.sum()))]


def _depth(log: Log) -> list[Finding]:
    if not (log.has("depth") and "position_z" in log.columns):
        return []
    depth, height = log.columns["depth"], log.columns["position_z"]
    good = np.isfinite(depth) & np.isfinite(height)
    if good.sum() < _FEWEST_SAMPLES or np.ptp(height[good]) < 0.2 or np.ptp(depth[good]) == 0.0:
        return []
    down, up = depth[good] - depth[good].mean(), height[good] - height[good].mean()
    likeness = float(np.sum(down * up) / np.sqrt(np.sum(down**2) * np.sum(up**2)))
    if likeness < _SURE:
        return []
    text = "depth rises with height: depth is positive down, position_z positive up (ENU).\n"
    text += "Reverse the sign of the wrong one."
    return [_finding("depth_sign", "depth", text, refuse=True, count=int(good.sum()))]


_SQUARED = {
    "rpm": (60.0 / (2.0 * math.pi)) ** 2,
    "Hz": (1.0 / (2.0 * math.pi)) ** 2,
}
_WITHIN = 1.6
"""Factor within which a ratio of squares points to a unit."""
_ODD = 1.35
"""Ratio of thrust and weight that no tolerance of a data sheet explains."""
_FLYING = 5.0
"""Least specific force along the rotors in flight [m/s^2]."""
_FEWEST = 50


def hover_ratio(log: Log, vehicle: Mapping[str, Any], channel: str = "rotor_speed_cmd") -> Floats:
    """Return thrust over mass, and specific force along the rotors' mean axis, row by row.

    1 in a flight whose rotor speeds, thrust coefficients and mass belong together.

    Args:
        log: with rotor speeds and specific force.
        vehicle: ``mass`` and ``rotors`` as in ``meta.yaml``.
        channel: of the speeds.
    """
    stated = vehicle.get("rotors")
    listed = stated if isinstance(stated, list | tuple) else ()
    rotors = [rotor for rotor in listed if isinstance(rotor, Mapping)]
    mass = vehicle.get("mass")
    usable = log.has(channel) and log.has("specific_force") and isinstance(mass, int | float)
    if not rotors or not usable or log.channel(channel).shape[1] != len(rotors):
        return np.zeros(0)
    try:
        factor = np.array([float(rotor["thrust_coefficient"]) for rotor in rotors])
        axis = np.array([rotor["axis"] for rotor in rotors], dtype=float).mean(axis=0)
    except (KeyError, TypeError, ValueError):
        # what is wrong in a description is the business of the check of it
        return np.zeros(0)
    speed = np.stack([_filled(log.time, v) for v in log.channel(channel).T], axis=1)
    used = axis != 0.0
    force = log.channel("specific_force")[:, used] @ axis[used] / max(np.linalg.norm(axis), 1e-9)
    thrust = (speed**2) @ factor
    flying = np.isfinite(force) & (force > _FLYING) & (thrust > 0.1 * float(np.nanmedian(thrust)))
    ratio: Floats = thrust[flying] / (float(mass or 1.0) * force[flying])
    return ratio[np.isfinite(ratio) & (ratio > 0.0)]


def _filled(time: Floats, values: Floats) -> Floats:
    good = np.isfinite(values)
    return np.interp(time, time[good], values[good]) if good.any() else values


def check_thrust(log: Log, vehicle: Mapping[str, Any]) -> list[Finding]:
    """Return the finding about rotor speeds that do not carry the vehicle."""
    found = []
    for channel in ("rotor_speed_cmd", "rotor_speed"):
        ratios = hover_ratio(log, vehicle, channel)
        if ratios.size < _FEWEST:
            continue
        ratio = float(np.median(ratios))
        text = f"in flight the rotors' thrust is {ratio:.3g} times mass and acceleration"
        unit = next(
            (
                unit
                for unit, factor in _SQUARED.items()
                if abs(math.log(ratio / factor)) < math.log(_WITHIN)
            ),
            "",
        )
        if unit:
            advice = (
                f"{text}: the speeds are in {unit}, rad/s is needed.\nGive the reader the unit "
            )
            advice += f"{unit}, or say motors.command={unit}."
            found.append(_finding("unit_rotor_speed", channel, advice, refuse=True))
        elif abs(math.log(ratio)) > math.log(_ODD):
            advice = (
                f"{text}.\nCheck thrust_coefficient, max_speed and mass of the robot, and "
                "motors.command, motors.range and motors.order."
            )
            found.append(_finding("thrust_unlike_weight", channel, advice, refuse=False))
    return found


_LEAST = 0.25
"""Root mean square of an acceleration that tells anything [m/s^2]."""
_TURN = math.radians(12.0)
"""Turn of the position's axes against the attitude's that is worth a word: twice what a compass
indoors, or a marker body stuck on by hand, is off by."""
_UNLIKE = 0.3
"""Correlation of one axis below which its columns are doubted."""
_TIE = 0.02
_BEHIND = 0.06
"""Delay of a pose against the inertial sensors beyond which no fit follows it [s]."""
_LATE = 0.025
"""Time offset that is worth a word [s]: a tenth of the shortest period of a vehicle's motion."""
_SIGNED = tuple(
    tuple(sign + axis for sign, axis in zip(signs, axes, strict=True))
    for axes in itertools.permutations("xyz")
    for signs in itertools.product(("", "-"), repeat=3)
)
"""The 48 ways to name three axes with signs."""
_ATTITUDES = {
    "axes.quaternion=xyzw": (3, 0, 1, 2),
    "axes.inverse=true": (0, 1, 2, 3),
}


def check_motion(log: Log) -> list[Finding]:
    """Return the findings about position, attitude, accelerometer and their clocks."""
    stems = ("position", "orientation", "specific_force")
    rows = even(log, stems)
    found: list[Finding] = []
    if rows is not None:
        place, attitude, force = (rows.channels[stem] for stem in stems)
        moved = second_derivative(place)
        felt = world_acceleration(attitude, force)
        if _size(moved[rows.there]) > _LEAST:
            # delay from magnitudes, which do not depend on axes
            sizes = (np.linalg.norm(moved, axis=1)[:, None], np.linalg.norm(felt, axis=1)[:, None])
            late, likeness = delay_between(*sizes, rows.there)
            shift = round(late / 0.01) if likeness > _UNSURE else 0
            there = rows.there & np.roll(rows.there, shift)
            a, b = _centred(np.roll(moved, shift, axis=0)[there]), _centred(felt[there])
            found = _axes(a, b) or _attitude(a, attitude[there], force[there], b)
    return found if found else _clocks(log)


def _centred(values: Floats) -> Floats:
    centred: Floats = values - values.mean(axis=0)
    return centred


def _size(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(_centred(values) ** 2, axis=1))))


def _likeness(a: Floats, b: Floats) -> float:
    size = math.sqrt(float(np.sum(np.abs(a) ** 2) * np.sum(np.abs(b) ** 2)))
    return float(np.real(np.sum(a * np.conj(b)))) / size if size > 0.0 else 0.0


def _warn(code: str, channel: str, text: str, *, refuse: bool = False) -> Finding:
    severity = Severity.REFUSE if refuse else Severity.WARN
    return Finding(severity=severity, code=code, channel=channel, message=text)


def _axes(moved: Floats, felt: Floats) -> list[Finding]:
    """Find the signed permutation or rotation from the accelerometer's axes to the position's."""
    excited = [k for k in range(3) if _size(felt[:, k : k + 1]) > _LEAST]
    score = _each(moved, felt, excited)
    if not excited or min(score) > _UNLIKE:
        return _heading(moved, felt)
    fits = {}
    for axes in _SIGNED:
        turned = moved @ permutation(axes, where="axes").T
        if min(_each(turned, felt, excited)) > _UNSURE:
            fits[axes] = _likeness(turned, felt)
    best = max(fits.values(), default=0.0)
    likely = [axes for axes, value in fits.items() if value > best - _TIE]
    if best < _SURE or not likely:
        return _heading(moved, felt)
    # where the motion leaves a choice: few changes of the columns, and a right-handed world
    likely.sort(
        key=lambda axes: (
            sum(axis != own for axis, own in zip(axes, "xyz", strict=True)),
            _left(axes),
        )
    )
    first = likely[0]
    left = all(_left(axes) for axes in likely)
    more = " or ".join(f"[{','.join(axes)}]" for axes in likely[1:3])
    both = f" (or {more}: this motion is consistent with both)" if more else ""
    text = (
        "its second derivative follows the accelerometer, rotated by the attitude, only with "
        "different "
        f"axes{': it is mirrored (left-handed)' if left else ''}.\nConvert it with "
        f"axes.position=[{','.join(first)}]{both}"
    )
    return [_warn("position_axes", "position", text, refuse=True)]


def _each(moved: Floats, felt: Floats, axes: Sequence[int]) -> list[float]:
    return [_likeness(moved[:, k], felt[:, k]) for k in axes]


def _left(axes: Sequence[str]) -> bool:
    return bool(np.linalg.det(permutation(axes, where="axes")) < 0.0)


def _heading(moved: Floats, felt: Floats) -> list[Finding]:
    """Find a turn about the vertical between position and attitude."""
    p, a = moved[:, 0] + 1j * moved[:, 1], felt[:, 0] + 1j * felt[:, 1]
    size = math.sqrt(float(np.sum(np.abs(p) ** 2) * np.sum(np.abs(a) ** 2)))
    turn = complex(np.vdot(p, a))
    if _size(moved[:, :2]) < _LEAST or _size(felt[:, :2]) < _LEAST or abs(turn) < _SURE * size:
        return []
    # the position must be turned by this angle: its own axes are turned the other way
    angle = -float(np.angle(turn))
    if abs(angle) < _TURN:
        return []
    text = (
        f"its axes are rotated by {math.degrees(angle):.3g} deg about the vertical against "
        "those of "
        f"the attitude.\nConvert it with axes.heading={angle:.4g}, or rotate the attitude."
    )
    return [_warn("position_heading", "position", text)]


def _attitude(moved: Floats, attitude: Floats, force: Floats, felt: Floats) -> list[Finding]:
    """Find another quaternion convention under which accelerometer and position agree."""
    ours = _likeness(moved, felt)
    if ours > _UNSURE:
        return []
    for option, order in _ATTITUDES.items():
        sign = np.array([-1.0, -1.0, -1.0, 1.0]) if "inverse" in option else 1.0
        other = _centred(world_acceleration((attitude * sign)[:, order], force))
        if _likeness(moved, other) > _SURE:
            text = (
                f"turned by it, the accelerometer does not follow the position (correlation "
                f"{ours:.2g}).\nConvert it with {option}"
            )
            return [_warn("attitude_convention", "orientation", text, refuse=True)]
    if ours > 0.3:
        return []
    text = (
        f"rotated by the attitude, the accelerometer does not follow the second derivative of the "
        f"position (correlation {ours:.2g}).\nDo all three belong to one vehicle, one clock and "
        "one world frame? See axes.* and late= of seals convert."
    )
    return [_warn("motion_unlike", "position", text)]


def _clocks(log: Log) -> list[Finding]:
    offset = time_offset(log)
    if offset is None or offset.likeness < _UNSURE:
        return []
    if abs(offset.late) < max(_LATE, offset.spread):
        return []
    which = "late" if offset.late > 0.0 else "early"
    pose = ", ".join(
        f"{stem}: {-offset.late:.3f}"
        for stem in ("position", "orientation", "velocity")
        if log.has(stem)
    )
    text = (
        f"inertial channels are {abs(offset.late):.3f} s {which} against the pose "
        "(gyroscope against attitude).\n"
        f"Correct the clock of the pose: seals convert ... 'late={{{pose}}}'"
    )
    refuse = offset.late < -max(_BEHIND, 3.0 * offset.spread)
    return [_warn("time_offset", "angular_velocity", text, refuse=refuse)]
