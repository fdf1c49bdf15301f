"""The model along a measured course, to first order in state errors, wrenches and parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Array, Floats
from seals.diagnose.discrepancy import FreeWrench
from seals.diagnose.plant import Plant, nonzero, spread, tiled
from seals.diagnose.trajectory import Course, difference
from seals.frames import exponential, matrix_of, multiply
from seals.motion import Reading
from seals.twin import Rates, TwinState

WRENCH = "free_wrench"
_ROWS = 24000
"""Rows of one batch: as many as stay in the cache."""
_NUDGE = 1e-5
"""Step of the difference quotients of the state [m, rad, m/s, rad/s]."""


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """What the model makes of the course at given parameters; T rows.

    Args:
        defect: state error after one step from the course, against the course, shape (T, n).
        reading: of the inertial sensors, angular velocity and specific force, shape (T, 6).
    """

    defect: Floats
    reading: Floats


@dataclass(frozen=True, kw_only=True)
class Dynamics:
    """Derivatives along a course; T rows, n state errors.

    Args:
        transition: of the state error over one step, shape (T, n, n).
        kick: effect of a constant wrench over one step, shape (T, n, 6).
        sense: of the specific force by the state error, shape (T, 3, n).
        feel: of the specific force by the wrench, shape (T, 3, 6).
        slope: of the rates of the state error by the state error, shape (T, n, n).
    """

    transition: Floats
    kick: Floats
    sense: Floats
    feel: Floats
    slope: Floats


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Derivatives by parameters; T rows, p parameters.

    Args:
        keys: of the parameters.
        push: state error after one step, shape (T, n, p).
        reading: of the inertial sensors, shape (T, 6, p).
    """

    keys: tuple[str, ...]
    push: Floats
    reading: Floats


def predict(
    plant: Plant, course: Course, values: Mapping[str, float], *, delay: float = 0.0
) -> Prediction:
    """Take one step from every row of the course with the model.

    Args:
        plant: extended model.
        course: where the steps start.
        values: changes by factor key.
        delay: of the inertial sensors that the windows take care of [s].
    """
    used = nonzero(values)
    rows = np.arange(plant.samples.rows)
    state = course.state(rows)
    drive, torque = plant.drive(used), plant.friction(used, course.rates)
    following = np.minimum(rows + 1, len(rows) - 1)
    pair = None if torque is None else (torque, torque[following])
    twin = plant.twin(used, len(rows), stiff=False)
    after, rates = plant.advance(twin, state, rows, drive, pair)
    if course.joints.shape[1]:
        # a command reaches the joints after the reading of its row
        twin = twin if torque is None else plant.twin(used, len(rows))
        rates = plant.rates(twin, state, rows, None if drive is None else drive.at[rows, 0])
    reading = _stacked(plant.reading(state, rates, used))
    late = used.get(DELAY, 0.0) - delay
    if late:
        reading = _late(plant, reading, late)
    return Prediction(defect=difference(after, course.state(following)), reading=reading)


DELAY = "sensor_delay.delay"


def _late(plant: Plant, reading: Floats, delay: float) -> Floats:
    """Readings as they were a little earlier, run by run."""
    out: Floats = reading.copy()
    for first, last in plant.samples.runs:
        time = plant.samples.time[first:last]
        for k in range(reading.shape[1]):
            out[first:last, k] = np.interp(time - delay, time, reading[first:last, k])
    return out


def dynamics_along(plant: Plant, course: Course, values: Mapping[str, float]) -> Dynamics:
    """Derivatives by state and wrench at every row."""
    plant.library.effects.setdefault(WRENCH, FreeWrench(correction=True))  # type: ignore[attr-defined]  # the library's mapping is a dict of its own
    used = nonzero(values)
    size, joints = course.size, course.joints.shape[1]
    moves = [(k, _NUDGE) for k in range(size)]
    count = plant.samples.rows
    base = _accelerations(plant, course, used, [None], stiff=False)[0]
    slope = np.zeros((count, size, size))
    sense = np.zeros((count, 3, size))
    shifts = [_shift(size, k, s) for k, s in moves]
    moved = _accelerations(plant, course, used, shifts, stiff=False)
    for (k, step), rates in zip(moves, moved, strict=True):
        change = (rates - base) / step
        slope[:, 6:12, k] = change[:, :6]
        slope[:, 12 + joints :, k] = change[:, 9:]
        sense[:, :, k] = change[:, 6:9]
    _kinematics(slope, course)
    keys = [f"{WRENCH}.{p}_{a}" for p in ("force", "torque") for a in "xyz"]
    scale = [plant.vehicle.mass, plant.vehicle.mass * 0.01]
    pushes = [(key, scale[i // 3]) for i, key in enumerate(keys)]
    rate, feel = _wrench_columns(plant, course, used, pushes, base)
    transition, integral = discrete(slope, plant.samples.step)
    kick = np.matmul(integral, _average(rate))
    return Dynamics(transition=transition, kick=kick, sense=sense, feel=feel, slope=slope)


def columns_along(
    plant: Plant,
    course: Course,
    values: Mapping[str, float],
    keys: Sequence[str],
    dynamics: Dynamics,
) -> Columns:
    """Derivatives by parameters at every row."""
    used = nonzero(values)
    count, size = plant.samples.rows, course.size
    push, reading = np.zeros((count, size, len(keys))), np.zeros((count, 6, len(keys)))
    _, integral = discrete(dynamics.slope, plant.samples.step)
    state = course.state(np.arange(count))
    base = _accelerations(plant, course, used, [None])[0]
    rates = _as_rates(base, state)
    seen = _stacked(plant.reading(state, rates, used))
    factors = plant.library.factors
    timed = [k for k in keys if k.partition(".")[0] in ("command_delay", "rotor_lag")]
    sensed = [k for k in keys if k.partition(".")[0] in _SENSOR_EFFECTS]
    plain = [k for k in keys if k not in timed and k not in sensed]
    index = {key: i for i, key in enumerate(keys)}
    jobs = [(k, factors[k].nudge) for k in plain]
    changes = _parameter_changes(plant, course, used, jobs, base)
    for key in timed:
        step = factors[key].nudge
        later = {**used, key: used.get(key, 0.0) + step}
        moved = _accelerations(plant, course, used, [None], drive=plant.drive(later))[0]
        changes[key] = (moved - base) / step
    for key, change in changes.items():
        i = index[key]
        rate = np.zeros((count, size))
        joints = course.joints.shape[1]
        rate[:, 6:12], rate[:, 12 + joints :] = change[:, :6], change[:, 9:]
        push[:, :, i] = np.matmul(integral, _average(rate)[:, :, None])[:, :, 0]
        # the faults of the sensors themselves change these responses only to second order
        reading[:, :, i] = _felt(plant, change)
    for key in sensed:
        if key == "sensor_delay.delay":
            for first, last in plant.samples.runs:
                slope = np.gradient(seen[first:last], plant.samples.step, axis=0)
                reading[first:last, :, index[key]] = -slope
            continue
        step = factors[key].nudge
        later = {**used, key: used.get(key, 0.0) + step}
        moved = _stacked(plant.reading(state, rates, later))
        reading[:, :, index[key]] = (moved - seen) / step
    return Columns(keys=tuple(keys), push=push, reading=reading)


_SENSOR_EFFECTS = (
    "accelerometer_bias",
    "accelerometer_scale",
    "gyroscope_bias",
    "sensor_misalignment",
    "sensor_delay",
)


def _felt(plant: Plant, change: Floats) -> Floats:
    """Change of the inertial readings by accelerations and specific force, shape (T, 6)."""
    arm, turn = plant.vehicle.imu_position, plant.vehicle.imu_turn
    force = change[:, 6:9]
    if np.any(arm):
        force = force + np.cross(change[:, 3:6], arm)
    return np.concatenate([np.zeros_like(force), force @ turn.T], axis=1)


def discrete(slope: Floats, step: float) -> tuple[Floats, Floats]:
    """Transition over one step and the integral of it, to fourth order in the step.

    Args:
        slope: A at every row, shape (T, n, n); the step uses the mean of its two ends.
        step: [s].

    Returns:
        exp(A h) and the integral of exp(A s) over the step, each (T, n, n).
    """
    a = _average(slope) * step
    eye = np.eye(slope.shape[1])
    integral = eye + np.matmul(a, eye / 2.0 + np.matmul(a, eye / 6.0 + a / 24.0))
    return eye + np.matmul(a, integral), integral * step


def _average(values: Floats) -> Floats:
    """Mean of each row and the next."""
    mean: Floats = 0.5 * (values + np.concatenate([values[1:], values[-1:]]))
    return mean


def _shift(size: int, k: int, step: float) -> Floats:
    error = np.zeros(size)
    error[k] = step
    return error


def _accelerations(
    plant: Plant,
    course: Course,
    used: Mapping[str, float],
    shifts: Sequence[Floats | None],
    drive: Any = None,
    *,
    stiff: bool = True,
) -> list[Floats]:
    """Linear, angular acceleration, specific force and joint accelerations for shifted courses.

    Each result has the shape (T, 9 + J).
    """
    count = plant.samples.rows
    drive = plant.drive(used) if drive is None else drive
    out: list[Floats] = []
    batch = max(1, _ROWS // count)
    for start in range(0, len(shifts), batch):
        chosen = shifts[start : start + batch]
        rows = np.tile(np.arange(count), len(chosen))
        state = _shifted(course.state(rows), np.repeat(_dense(chosen, course.size), count, axis=0))
        twin = plant.twin(dict(used), len(rows), stiff=stiff)
        rates = plant.rates(twin, state, rows, None if drive is None else drive.at[rows, 0])
        out += list(_packed(rates).reshape(len(chosen), count, -1))
    return out


def _dense(shifts: Sequence[Floats | None], size: int) -> Floats:
    return np.array([np.zeros(size) if s is None else s for s in shifts])


def _shifted(state: TwinState, error: Floats) -> TwinState:
    """States with errors added, one each."""
    if not error.any():
        return state
    joints = state.joints.shape[1]
    parts = (
        state.position + error[:, :3],
        multiply(state.quaternion, exponential(error[:, 3:6])),
        state.velocity + error[:, 6:9],
        state.spin + error[:, 9:12],
        state.joints + error[:, 12 : 12 + joints],
        state.rates + error[:, 12 + joints :],
    )
    return TwinState(*(np.asfortranarray(x) for x in parts))


def _packed(rates: Rates) -> Floats:
    parts = (rates.velocity, rates.spin, rates.specific_force, rates.rates)
    return np.concatenate(parts, axis=1)


def _as_rates(packed: Floats, state: TwinState) -> Rates:
    still = np.zeros_like(state.velocity)
    return Rates(
        position=still,
        quaternion=np.zeros_like(state.quaternion),
        velocity=packed[:, :3],
        spin=packed[:, 3:6],
        joints=state.rates,
        rates=packed[:, 9:],
        specific_force=packed[:, 6:9],
    )


def _parameter_changes(
    plant: Plant,
    course: Course,
    used: Mapping[str, float],
    jobs: Sequence[tuple[str, float]],
    base: Floats,
    *,
    stiff: bool = True,
) -> dict[str, Floats]:
    """Derivatives of accelerations and specific force by parameters of laws."""
    count = plant.samples.rows
    drive = plant.drive(used)
    out: dict[str, Floats] = {}
    batch = max(1, _ROWS // count)
    for start in range(0, len(jobs), batch):
        chosen = jobs[start : start + batch]
        rows = np.tile(np.arange(count), len(chosen))
        twin = plant.twin(_spread(used, chosen, count), len(rows), stiff=stiff)
        state = tiled(course.state(np.arange(count)), len(chosen))
        rates = plant.rates(twin, state, rows, None if drive is None else drive.at[rows, 0])
        packed = _packed(rates).reshape(len(chosen), count, -1)
        for k, (key, step) in enumerate(chosen):
            out[key] = (packed[k] - base) / step
    return out


def _spread(
    used: Mapping[str, float], jobs: Sequence[tuple[str, float]], rows: int
) -> dict[str, Array]:
    """Batched values; keys that no job moves stay numbers."""
    moved = {key for key, _ in jobs}
    rest: dict[str, Array] = {k: float(v) for k, v in used.items() if k not in moved}
    return rest | spread({k: v for k, v in used.items() if k in moved}, jobs, rows)


def _wrench_columns(
    plant: Plant,
    course: Course,
    used: Mapping[str, float],
    pushes: Sequence[tuple[str, float]],
    base: Floats,
) -> tuple[Floats, Floats]:
    """Rates of the state error and specific force by a wrench, (T, n, 6) and (T, 3, 6)."""
    changes = _parameter_changes(plant, course, used, pushes, base, stiff=False)
    count, size, joints = plant.samples.rows, course.size, course.joints.shape[1]
    rate, feel = np.zeros((count, size, 6)), np.zeros((count, 3, 6))
    for i, (key, _) in enumerate(pushes):
        rate[:, 6:12, i], rate[:, 12 + joints :, i] = changes[key][:, :6], changes[key][:, 9:]
        feel[:, :, i] = changes[key][:, 6:9]
    return rate, feel


def _kinematics(slope: Floats, course: Course) -> None:
    """Fill in what position and attitude owe to the other state errors."""
    rotation, joints = matrix_of(course.quaternion), course.joints.shape[1]
    slope[:, :3, 3:6] = -np.matmul(rotation, _skew(course.velocity))
    slope[:, :3, 6:9] = rotation
    slope[:, 3:6, 3:6] = -_skew(course.spin)
    slope[:, 3:6, 9:12] = np.eye(3)
    for k in range(joints):
        slope[:, 12 + k, 12 + joints + k] = 1.0


def _skew(vector: Floats) -> Floats:
    out = np.zeros((len(vector), 3, 3))
    x, y, z = vector.T
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -z, y, -x
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = z, -y, x
    return out


def _stacked(reading: Reading) -> Floats:
    both: Floats = np.concatenate([reading.angular_velocity, reading.specific_force], axis=1)
    return both
