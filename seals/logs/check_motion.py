"""Checks of position against attitude and accelerometer: swapped axes, handedness, time offset."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.logs.accelerations import even, second_derivative, world_acceleration
from seals.logs.axes import permutation
from seals.logs.finding import Finding, Severity
from seals.logs.log import Log
from seals.logs.time_offset import delay_between, time_offset

_SURE = 0.9
_UNSURE = 0.7
_LEAST = 0.25
"""Root mean square of an acceleration that tells anything [m/s^2]."""
_TURN = math.radians(12.0)
"""Turn of the position's axes against the attitude's that is worth a word: twice what a compass
indoors, or a marker body stuck on by hand, is off by."""
_UNLIKE = 0.3
"""Correlation of one axis below which its columns are doubted."""
_TIE = 0.02
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
            shift = _shift(moved, felt, rows.there)
            there = rows.there & np.roll(rows.there, shift)
            a, b = _centred(np.roll(moved, shift, axis=0)[there]), _centred(felt[there])
            found = _axes(a, b) or _attitude(a, attitude[there], force[there], b)
    return found if found else _clocks(log)


def _shift(moved: Floats, felt: Floats, there: NDArray[np.bool_]) -> int:
    """Delay of the accelerometer in rows, from magnitudes, which do not depend on axes."""
    sizes = (np.linalg.norm(moved, axis=1)[:, None], np.linalg.norm(felt, axis=1)[:, None])
    late, likeness = delay_between(*sizes, there)
    return round(late / 0.01) if likeness > _UNSURE else 0


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
    likely.sort(key=lambda axes: (_changes(axes), _left(axes)))
    first = likely[0]
    left = all(_left(axes) for axes in likely)
    more = " or ".join(f"[{','.join(axes)}]" for axes in likely[1:3])
    text = (
        "its second derivative follows the accelerometer, turned by the attitude, only with other "
        f"axes{': it is mirrored (left-handed)' if left else ''}.\nConvert it with "
        f"axes.position=[{','.join(first)}]{f' (or {more}: this motion fits both)' if more else ''}"
    )
    return [_warn("position_axes", "position", text, refuse=True)]


def _each(moved: Floats, felt: Floats, axes: Sequence[int]) -> list[float]:
    return [_likeness(moved[:, k], felt[:, k]) for k in axes]


def _changes(axes: Sequence[str]) -> int:
    return sum(axis != own for axis, own in zip(axes, "xyz", strict=True))


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
        f"its axes are turned by {math.degrees(angle):.3g} deg about the vertical against those of "
        f"the attitude.\nConvert it with axes.heading={angle:.4g}, or turn the attitude."
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
        f"turned by the attitude, the accelerometer does not follow the second derivative of the "
        f"position (correlation {ours:.2g}).\nAre all three of one vehicle, one clock and one "
        "world? See axes.* and late= of seals convert."
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
        f"Put the pose on their clock: seals convert ... 'late={{{pose}}}'"
    )
    return [_warn("time_offset", "angular_velocity", text)]
