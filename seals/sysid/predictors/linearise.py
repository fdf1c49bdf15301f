"""Linearisation of the model along a trajectory by state errors, wrenches and parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from seals.arrays import Floats
from seals.batch import Rates, TwinState
from seals.frames import matrix_of, skew_last
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.predictors.extended_model import ExtendedModel, Values, nonzero
from seals.sysid.predictors.sensor_readings import (
    add_centripetal,
    as_simulated,
    at_sensor,
    delayed,
)
from seals.sysid.predictors.trajectory_cache import (
    ExpansionPoint,
    TrajectoryCache,
    accelerations,
    packed,
)

_ROWS = 24000
"""Rows of one batch, those of all links: as many as stay in the cache."""
_NUDGE = 1e-5
"""Step of the difference quotients of the state [m, rad, m/s, rad/s]."""


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """One-step prediction of the model from every row of a trajectory; T rows.

    Args:
        defect: state error after one step, against the next row, shape (T, n).
        reading: of the inertial sensors, angular velocity and specific force, and the turn of the
            measured attitude where an effect turns it, shape (T, 6 or 9).
    """

    defect: Floats
    reading: Floats


@dataclass(frozen=True, kw_only=True)
class Dynamics:
    """Linear time-varying model of the state error along a trajectory; T rows, n states.

    Equation:
        x'(t) = A x + B u and y = C x + D u, with the state error x, the wrench u and the specific
        force y; over one step x(k + 1) = exp(A h) x(k) + G u(k) + defect(k).

    Args:
        transition: exp(A h), shape (T, n, n).
        input_matrix: G, the effect of a constant wrench over one step, shape (T, n, 6).
        output_matrix: C, shape (T, 3, n).
        feedthrough: D, shape (T, 3, 6).
        integral: of the transition over one step, shape (T, n, n), see `discrete`; None where
            accelerations at the rows do not say what is pushed.
        friction_correction: factor on the error of a step that was found without the steep slope of
            dry friction, shape (T, n, n); None without dry friction.
    """

    transition: Floats
    input_matrix: Floats
    output_matrix: Floats
    feedthrough: Floats
    integral: Floats | None = None
    friction_correction: Floats | None = None

    def pushed(self, rates: Floats) -> Floats:
        """State error after one step by accelerations at its two ends, shape (T, n, p).

        Args:
            rates: derivatives of the state at the rows, those of the pose zero, shape (T, n, p).
        """
        count = rates.shape[1] // 2
        driven = np.concatenate((rates[:, 6:12], rates[:, 6 + count :]), axis=1)
        out: Floats = np.matmul(self._driven, _average(driven))
        return out

    @cached_property
    def _driven(self) -> Floats:
        """Columns of the integral at velocities, shape (T, n, 6 + J)."""
        assert self.integral is not None
        count = self.integral.shape[2] // 2
        parts = self.integral[:, :, 6:12], self.integral[:, :, 6 + count :]
        return np.concatenate(parts, axis=2)

    def corrected(self, defect: Floats) -> Floats:
        """Return the one-step error corrected for the slope of dry friction, shape (T, n)."""
        factor = self.friction_correction
        return defect if factor is None else np.matmul(factor, defect[:, :, None])[:, :, 0]


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Derivatives of steps and readings by parameters; T rows, p parameters.

    Args:
        keys: of the parameters.
        push: state error after one step, shape (T, n, p).
        reading: of the inertial sensors and the turn of the pose, shape (T, 6 or 9, p).
    """

    keys: tuple[str, ...]
    push: Floats
    reading: Floats


def predict(
    plant: ExtendedModel,
    trajectory: Trajectory,
    values: Mapping[str, float],
    *,
    delay: float = 0.0,
    cache: TrajectoryCache | None = None,
    expansion_point: ExpansionPoint | None = None,
    dynamics: Dynamics | None = None,
) -> Prediction:
    """Predict one step from every row of the trajectory.

    Args:
        plant: extended model.
        trajectory: where the steps start.
        values: changes by parameter key.
        delay: of the inertial sensors that the windows take care of [s].
        cache: the plant along the trajectory, where it is known.
        expansion_point: exact steps at values nearby; the steps then follow from the accelerations
            at the rows and from ``dynamics``, to first order in the change of both. Left out, the
            steps are taken.
        dynamics: derivatives along the trajectory, with an expansion point.
    """
    used = nonzero(values)
    cache = TrajectoryCache(plant, trajectory) if cache is None else cache
    rates = cache.response(used).rates
    if expansion_point is None or dynamics is None:
        defect = cache.expansion_point(used).defect
        defect = defect if dynamics is None else dynamics.corrected(defect)
    else:
        change = np.zeros_like(expansion_point.defect)
        joints = trajectory.joints.shape[1]
        rate = accelerations(rates) - expansion_point.rate
        change[:, 6:12], change[:, 12 + joints :] = rate[:, :6], rate[:, 6:]
        pushed = dynamics.pushed(change[:, :, None])[:, :, 0]
        defect = dynamics.corrected(expansion_point.defect) + pushed
    reading = read_rows(plant, cache.state, cache.sensor_rates(used), used)
    late = used.get(plant.candidate_set.sensor_delay, 0.0) - delay
    if late:
        reading = delayed(plant, reading, late)
    if step := plant.half_step_readings:
        rate = cache.sensor_rates(used).angular_velocity
        reading = as_simulated(plant.vehicle, plant.samples, reading, rate, step)
    return Prediction(defect=defect, reading=reading)


def dynamics_along(
    plant: ExtendedModel,
    trajectory: Trajectory,
    values: Mapping[str, float],
    *,
    cache: TrajectoryCache | None = None,
) -> Dynamics:
    """Return the derivatives by state and wrench at every row."""
    used = nonzero(values)
    count, size = plant.samples.rows, trajectory.size
    cache = TrajectoryCache(plant, trajectory) if cache is None else cache
    state_matrix = np.zeros((count, size, size))
    output_matrix = np.zeros((count, 3, size))
    moved = [k for k in range(size) if k > 2 or k in _places(plant, used)]
    _differentiate(cache, used, moved, state_matrix, output_matrix, stiff=False)
    add_centripetal(output_matrix, plant.vehicle, trajectory.angular_velocity)
    _kinematics(state_matrix, trajectory)
    rate, feedthrough = _wrench_columns(cache, used)
    transition, integral = discrete(state_matrix, plant.samples.step)
    friction_correction = None
    if plant.friction(used, trajectory.joint_velocity) is not None:
        # the columns of the joint rates again with dry friction; the output matrix in place
        rates = range(12 + cache.trajectory.joints.shape[1], cache.trajectory.size)
        out: Floats = state_matrix.copy()
        _differentiate(cache, used, rates, out, output_matrix, stiff=True)
        plain, state_matrix = (
            integral,
            out,
        )
        transition, integral = discrete(state_matrix, plant.samples.step)
        friction_correction = np.matmul(integral, np.linalg.inv(plain))
    input_matrix = np.matmul(integral, _average(rate))
    return Dynamics(
        transition=transition,
        input_matrix=input_matrix,
        output_matrix=output_matrix,
        feedthrough=feedthrough,
        integral=integral,
        friction_correction=friction_correction,
    )


def _differentiate(
    cache: TrajectoryCache,
    used: Mapping[str, float],
    errors: Sequence[int],
    state_matrix: Floats,
    output_matrix: Floats,
    *,
    stiff: bool,
) -> None:
    """Fill in the columns of some state errors by difference quotients."""
    joints, size = cache.trajectory.joints.shape[1], cache.trajectory.size
    shifts = [np.zeros(size), *(_shift(size, k, _NUDGE) for k in errors)]
    base, *found = _accelerations(cache, used, shifts, stiff=stiff)
    for k, moved in zip(errors, found, strict=True):
        change = (moved - base) / _NUDGE
        state_matrix[:, 6:12, k], state_matrix[:, 12 + joints :, k] = change[:, :6], change[:, 9:]
        output_matrix[:, :, k] = at_sensor(cache.plant.vehicle, change)


def _places(plant: ExtendedModel, used: Mapping[str, float]) -> tuple[int, ...]:
    """Position components on which accelerations depend."""
    acting = {*plant.vehicle.effects, *(k.partition(".")[0] for k in used)}
    laws = [type(plant.candidate_set.effects[n]) for n in acting & set(plant.candidate_set.effects)]
    # laws of strangers may know where they are, too
    if (
        plant.vehicle.sea is not None
        or acting & set(plant.candidate_set.waves)
        or any(law.identification.placed or not law.__module__.startswith("seals.") for law in laws)
    ):
        return (0, 1, 2)
    around = plant.vehicle.environment
    return () if around.water_level is None and around.ground_level is None else (2,)


def columns_along(
    plant: ExtendedModel,
    trajectory: Trajectory,
    values: Mapping[str, float],
    keys: Sequence[str],
    dynamics: Dynamics,
    *,
    delay: float = 0.0,
    cache: TrajectoryCache | None = None,
) -> Columns:
    """Return the derivatives by parameters at every row; sensor delay is left to the windows."""
    used = nonzero(values)
    count, size, joints = plant.samples.rows, trajectory.size, trajectory.joints.shape[1]
    cache = TrajectoryCache(plant, trajectory) if cache is None else cache
    index = {key: i for i, key in enumerate(keys)}
    rate = np.zeros((count, size, len(keys)))
    reading = np.zeros((count, plant.reading_size, len(keys)))
    sensed = [k for k in keys if plant.changes_readings(k.partition(".")[0])]
    moving = [k for k in keys if k not in sensed]
    for key, change in cache.changes(used, moving).items():
        i = index[key]
        rate[:, 6:12, i], rate[:, 12 + joints :, i] = change[:, :6], change[:, 9:]
        # the faults of the sensors themselves change these responses only to second order
        reading[:, :, i] = _reading_change(plant, change)
    for key, change in _sensed(cache, used, sensed, delay).items():
        reading[:, :, index[key]] = change
    push = dynamics.pushed(rate)
    for key in moving:
        if key.partition(".")[0] in plant.timed:
            # a command jumps inside a step, where the rates at its two ends do not see it
            change = cache.pushed(used, key)
            push[:, :, index[key]] = dynamics.corrected(change)
            nudge = plant.candidate_set.parameters[key].nudge
            later = cache.sensor_rates({**used, key: used.get(key, 0.0) + nudge})
            change = (packed(later) - packed(cache.sensor_rates(used))) / nudge
            reading[:, :, index[key]] = _reading_change(plant, change)
    return Columns(keys=tuple(keys), push=push, reading=reading)


def _sensed(
    cache: TrajectoryCache, used: Mapping[str, float], keys: Sequence[str], delay: float
) -> dict[str, Floats]:
    """Derivatives of the readings by faults of the sensors, each (T, 6)."""
    if not keys:
        return {}
    plant, rates = cache.plant, cache.sensor_rates(used)
    late = plant.candidate_set.sensor_delay
    seen = read_rows(plant, cache.state, rates, used)
    out = {}
    for key in keys:
        if key == late:
            out[key] = -delayed(plant, seen, used.get(late, 0.0) - delay, order=1)
            continue
        step = plant.candidate_set.parameters[key].nudge
        later = {**used, key: used.get(key, 0.0) + step}
        out[key] = (read_rows(plant, cache.state, rates, later) - seen) / step
    return out


def _reading_change(plant: ExtendedModel, change: Floats) -> Floats:
    """Change of the readings by accelerations and specific force, shape (T, 6 or 9)."""
    out = np.zeros((len(change), plant.reading_size))
    out[:, 3:6] = at_sensor(plant.vehicle, change)
    return out


def discrete(state_matrix: Floats, step: float) -> tuple[Floats, Floats]:
    """Return the transition matrix of one step and its integral, to fourth order.

    Args:
        state_matrix: A at every row, shape (T, n, n); the step uses the mean of its two ends.
        step: [s].

    Returns:
        exp(A h) and the integral of exp(A s) over the step, each (T, n, n).
    """
    a = _average(state_matrix) * step
    eye = np.eye(state_matrix.shape[1])
    own = np.abs(np.diagonal(a, axis1=1, axis2=2)).max(initial=0.0)
    halvings = max(int(np.ceil(np.log2(own / _LARGEST))), 0) if own > _STEEP else 0
    a = a / 2**halvings
    integral = eye + np.matmul(a, eye / 2.0 + np.matmul(a, eye / 6.0 + a / 24.0))
    whole = eye + np.matmul(a, integral)
    for _ in range(halvings):
        integral = 0.5 * (integral + np.matmul(integral, whole))
        whole = np.matmul(whole, whole)
    return whole, integral * step


_STEEP, _LARGEST = 1.5, 0.5
"""Rate times step from which on the series is taken in halved steps, and what it may be then."""


def _average(values: Floats) -> Floats:
    """Mean of each row and the next."""
    mean: Floats = 0.5 * (values + np.concatenate([values[1:], values[-1:]]))
    return mean


def _shift(size: int, k: int, step: float) -> Floats:
    error = np.zeros(size)
    error[k] = step
    return error


def _accelerations(
    cache: TrajectoryCache,
    used: Mapping[str, float],
    shifts: Sequence[Floats],
    *,
    stiff: bool = True,
) -> list[Floats]:
    """Accelerations (linear, angular, joints) and specific force for shifted trajectories.

    Each result has the shape (T, 9 + J).
    """
    joints = cache.trajectory.joints.shape[1]
    still = [not (s[:6].any() or s[12 : 12 + joints].any()) for s in shifts]
    chosen = [s for s, same in zip(shifts, still, strict=True) if same]
    at_rest = cache.moved(used, chosen, stiff=stiff)
    if at_rest is None:
        return _everywhere(cache, used, shifts, stiff=stiff)
    others = [s for s, same in zip(shifts, still, strict=True) if not same]
    parts = iter(at_rest), iter(_everywhere(cache, used, others, stiff=stiff))
    return [next(parts[0] if same else parts[1]) for same in still]


def _everywhere(
    cache: TrajectoryCache, used: Mapping[str, float], shifts: Sequence[Floats], *, stiff: bool
) -> list[Floats]:
    """Accelerations and specific force for trajectories at other poses."""
    plant, trajectory = cache.plant, cache.trajectory
    count, drive = plant.samples.rows, plant.drive(used)
    out: list[Floats] = []
    batch = max(1, _ROWS // (count * len(plant.vehicle.robot.links)))
    for start in range(0, len(shifts), batch):
        chosen = shifts[start : start + batch]
        rows = np.tile(np.arange(count), len(chosen))
        state = _shifted(trajectory.state(rows), np.repeat(np.array(chosen), count, axis=0))
        twin = plant.twin(dict(used), len(rows), stiff=stiff)
        rates = plant.rates(twin, state, rows, None if drive is None else drive.at[rows, 0])
        out += list(packed(rates).reshape(len(chosen), count, -1))
    return out


def _shifted(state: TwinState, error: Floats) -> TwinState:
    """Return states with one error added to each."""
    if not error.any():
        return state
    return TwinState(*map(np.asfortranarray, state.moved(error)))


def _wrench_columns(cache: TrajectoryCache, used: Mapping[str, float]) -> tuple[Floats, Floats]:
    """Rates of the state error and specific force by a wrench, (T, n, 6) and (T, 3, 6)."""
    changes = cache.response(used).pushed()
    count, size, joints = len(cache.rows), cache.trajectory.size, cache.trajectory.joints.shape[1]
    rate, feedthrough = np.zeros((count, size, 6)), np.zeros((count, 3, 6))
    for i, change in enumerate(changes):
        rate[:, 6:12, i], rate[:, 12 + joints :, i] = change[:, :6], change[:, 9:]
        feedthrough[:, :, i] = at_sensor(cache.plant.vehicle, change)
    return rate, feedthrough


def _kinematics(state_matrix: Floats, trajectory: Trajectory) -> None:
    """Fill in the kinematic rows: position and attitude by the other state errors."""
    rotation, joints = matrix_of(trajectory.quaternion), trajectory.joints.shape[1]
    state_matrix[:, :3, 3:6] = -np.matmul(rotation, skew_last(trajectory.velocity))
    state_matrix[:, :3, 6:9] = rotation
    state_matrix[:, 3:6, 3:6] = -skew_last(trajectory.angular_velocity)
    state_matrix[:, 3:6, 9:12] = np.eye(3)
    for k in range(joints):
        state_matrix[:, 12 + k, 12 + joints + k] = 1.0


def read_rows(plant: ExtendedModel, state: TwinState, rates: Rates, values: Values) -> Floats:
    """Return readings as rows: both inertial sensors, and the turn of the pose if there is one.

    Shape (N, 6 or 9) [rad/s, m/s^2, rad].
    """
    reading = plant.reading(state, rates, values)
    parts = [reading.angular_velocity, reading.specific_force]
    turn = plant.pose_turn(values, len(parts[0]))
    both: Floats = np.concatenate(parts if turn is None else [*parts, turn], axis=1)
    return both


class ReleasableDynamics:
    """Dynamics along a trajectory that are computed where they are used, and again once released.

    Args:
        plant: extended model.
        trajectory: about which it is linear.
        at: values of the linearisation by parameter key.
        cache: the plant along the trajectory.
    """

    def __init__(
        self,
        plant: ExtendedModel,
        trajectory: Trajectory,
        at: Mapping[str, float],
        cache: TrajectoryCache,
    ) -> None:
        self.plant, self.trajectory, self.at, self.cache = plant, trajectory, at, cache

    @cached_property
    def found(self) -> Dynamics:
        """The dynamics."""
        return dynamics_along(self.plant, self.trajectory, self.at, cache=self.cache)

    def release(self) -> None:
        """Release the memory of the dynamics and of the evaluations along the trajectory."""
        self.__dict__.pop("found", None)
        self.cache.release()


def dynamics_of(given: Dynamics | ReleasableDynamics) -> Dynamics:
    """Return dynamics, computed where they are not at hand."""
    return given if isinstance(given, Dynamics) else given.found
