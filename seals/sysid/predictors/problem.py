"""Identification problem of one log: trajectory, linearised model and windows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.frames import conjugate, exponential, multiply, rotation_vector
from seals.logs.log import Log
from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.data.contact import contact_free
from seals.sysid.data.decimation import decimated
from seals.sysid.data.robot_description import RobotDescription, described_by
from seals.sysid.data.samples import Samples, read_samples
from seals.sysid.data.standing import joints_at_rest, refuse_frozen, still_joints
from seals.sysid.data.supply import typical_shortfall
from seals.sysid.data.trajectory import Trajectory, difference, measured_trajectory
from seals.sysid.data.vehicle import Vehicle, read_vehicle
from seals.sysid.decision.policy import DecisionPolicy, SearchBudget
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.linearise import (
    Dynamics,
    ReleasableDynamics,
    dynamics_along,
    predict,
)
from seals.sysid.predictors.rollout import simulated_trajectory, start_sigma, start_states
from seals.sysid.predictors.surface_model_error import enters, surface_model_error
from seals.sysid.predictors.trajectory_cache import TrajectoryCache
from seals.sysid.predictors.windows import WHOLE, Windows
from seals.sysid.predictors.windows_fit import Fitter

LATE = 3e-3
"""Delay of the inertial sensors from which on the windows follow it [s]."""
WINDOW = 1.0
"""Length of a window [s]: about three correlation times of the gusts."""
LOOSE = 30.0
"""Factor on the gusts under which any force may act."""
_LOOSE, _IMPACT = 0.3, 3.0
"""Free force, in weights, under which the trajectory is refined, in general and on impact."""
_BIASES = (0.1, 1.0)
"""1-sigma of the free biases of gyroscope [rad/s] and accelerometer [m/s^2] meanwhile."""
_FINE = 0.04
"""Spacing of the knots of the free force [s]."""
FORGOTTEN = 5.0
"""Time constants after which the start of an actuator no longer matters."""
GUSTS = 1.3
"""Factor on the stated level of the gusts, which is good to a factor of two."""


_SETTLED = 5e-3
"""Change of attitude [rad] and velocity [m/s] below which a trajectory has settled."""
_DIVERGED = 2.0
"""Factor on cost and floor by which a step of a trajectory is too long and is halved."""


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Identification problem of one log.

    Args:
        vehicle: stated model.
        samples: the log.
        plant: extended model.
        fitter: of the nominal linearisation.
    """

    vehicle: Vehicle
    samples: Samples
    plant: ExtendedModel
    fitter: Fitter

    @property
    def policy(self) -> DecisionPolicy:
        """Thresholds of the decisions."""
        return self.plant.candidate_set.policy

    @property
    def budget(self) -> SearchBudget:
        """Limits of the search."""
        return self.plant.candidate_set.budget

    @cached_property
    def impact(self) -> bool:
        """True where a vehicle without actuators falls into water."""
        return enters(self.plant, self.fitter.trajectory)


def prepare(
    log: Log,
    *,
    policy: DecisionPolicy | None = None,
    robot: RobotDescription | None = None,
    free: Callable[[Vehicle, CandidateSet], CandidateSet] | None = None,
) -> Problem:
    """Prepare a log for identification: trajectory, linearised model, windows.

    Args:
        log: in the native format, or several joined ones.
        policy: thresholds of the decisions; the standard ones when left out.
        robot: of a robot folder; left out, the log describes its own.
        free: what makes parameters of the extended model free; none when left out.

    Raises:
        LogError: the log cannot be used.
    """
    log = contact_free(log)
    log = decimated(log, log.rows)
    policy = policy or DecisionPolicy()
    robot = robot or described_by(log.meta)
    still = still_joints(log, robot, errors=policy.joint_moving)
    vehicle = read_vehicle(log.meta, robot, still=still)
    samples = read_samples(log, vehicle)
    refuse_frozen(log, samples, vehicle)
    parts = _parts(vehicle, samples)
    if samples.posed:
        trajectory = measured_trajectory(samples, vehicle)
    else:
        trajectory = simulated_trajectory(samples, vehicle, parts=parts)
    candidate_set = candidate_set_of(
        vehicle,
        speeds=typical_speeds(trajectory),
        logs=max(len(samples.logs), 1),
        shortfall=typical_shortfall(samples.voltage, vehicle.full_voltage),
        open_loop=log.has("motor_pwm"),
    )
    candidate_set = replace(candidate_set, policy=policy)
    candidate_set = candidate_set if free is None else free(vehicle, candidate_set)
    rest = joints_at_rest(
        samples, vehicle.sigma.get("joint_position", 0.0), quiet=policy.joint_quiet
    )
    candidate_set = candidate_set.without(
        c for c in candidate_set.candidates if c.in_arm and c.variant.get("joint") in rest
    )
    plant = ExtendedModel(vehicle, candidate_set, samples, parts=parts)
    fitter = linearise_model(plant, trajectory, {})
    if samples.posed:
        trajectory = refined(plant, trajectory, window=WINDOW)
        fitter = linearise_model(plant, trajectory, {})
    else:
        fitter = follow_measurements(fitter, ())
    return Problem(vehicle=vehicle, samples=samples, plant=plant, fitter=fitter)


def _parts(vehicle: Vehicle, samples: Samples) -> int:
    """Return the equal parts of a row in which the model is integrated.

    Twice as many of a body that falls into water, four times of rotors that are reversed: their
    thrust, quadratic in a speed with a lag, bends within ten milliseconds.
    """
    parts = max(1, round(samples.step / 0.01))
    if vehicle.has_water and not vehicle.commands:
        parts *= 2
    speeds = samples.command if vehicle.commands == "rotor_speed_cmd" else np.zeros((1, 1))
    if np.any((speeds.min(axis=0) < 0.0) & (speeds.max(axis=0) > 0.0)):
        parts *= 4
    return parts


def linearise_model(
    plant: ExtendedModel,
    trajectory: Trajectory,
    at: Mapping[str, float],
    *,
    window: float = WINDOW,
    gusts: float = GUSTS,
) -> Fitter:
    """Linearise the model along a trajectory and set up the windows."""
    about = Linearisation(trajectory=trajectory, at=dict(at), gusts=gusts)
    return about.fitter(plant, window=window)


@dataclass(frozen=True, kw_only=True)
class Linearisation:
    """Picklable linearisation from which another process rebuilds a fitter.

    Args:
        trajectory: about which the model is linear.
        at: parameters of the linearisation.
        gusts: factor on their stated level.
    """

    trajectory: Trajectory
    at: Mapping[str, float]
    gusts: float

    @classmethod
    def of(cls, fitter: Fitter) -> Linearisation:
        """Return the linearisation of a fitter made by `linearise_model`."""
        return cls(trajectory=fitter.trajectory, at=fitter.at, gusts=fitter.windows.gusts)

    def fitter(self, plant: ExtendedModel, *, window: float = WINDOW) -> Fitter:
        """Build the fitter for a plant; what it needs is computed where it is used.

        Args:
            plant: extended model.
            window: length of the windows [s].
        """
        cache = TrajectoryCache(plant, self.trajectory)
        dynamics = ReleasableDynamics(plant, self.trajectory, self.at, cache)
        delay = self.at.get(plant.candidate_set.sensor_delay, 0.0)
        delay = delay if abs(delay) > LATE else 0.0
        windows = windows_of(
            plant, self.trajectory, dynamics, window=window, gusts=self.gusts, delay=delay
        )
        return Fitter(plant, self.trajectory, dynamics, windows, at=self.at, cache=cache)


def windows_of(
    plant: ExtendedModel,
    trajectory: Trajectory,
    dynamics: Dynamics | ReleasableDynamics,
    *,
    window: float = WINDOW,
    gusts: float = GUSTS,
    delay: float = 0.0,
) -> Windows:
    """Set up the windows of a log.

    Args:
        plant: extended model.
        trajectory: about which it is linear.
        dynamics: derivatives along the trajectory.
        window: length [s].
        gusts: factor on their stated level.
        delay: of the inertial sensors [s].
    """
    surface_error = surface_model_error(plant, trajectory)
    posed = plant.samples.posed
    return Windows(
        plant.samples,
        plant.vehicle,
        trajectory,
        dynamics,
        length=window if posed else WHOLE,
        gusts=gusts,
        surface_error=surface_error,
        knot=None if surface_error is None else max(surface_error.knot, 1.5 * plant.samples.step),
        stated=None if posed else stated_starts(plant, trajectory),
        skip=transient_rows(plant),
        delay=delay,
    )


def rewindowed(fitter: Fitter, *, gusts: float = 1.0, delay: float | None = None) -> Fitter:
    """Return a fitter with the same linearisation and other gusts or sensor delay.

    Args:
        fitter: of the linearisation.
        gusts: factor on the gusts of its windows.
        delay: of the sensors; that of its windows when left out [s].
    """
    late = fitter.windows.delay if delay is None else delay
    level = gusts * fitter.windows.gusts
    if late == fitter.windows.delay:
        return fitter.with_windows(fitter.windows.with_disturbance(level))
    windows = windows_of(fitter.plant, fitter.trajectory, fitter.along, gusts=level, delay=late)
    return fitter.with_windows(windows)


def follow_measurements(
    fitter: Fitter, free: tuple[str, ...], *, at: Mapping[str, float] | None = None, rounds: int = 4
) -> Fitter:
    """Move the trajectory to the best fit of the measurements and relinearise there.

    Args:
        fitter: of the present trajectory.
        free: keys that are estimated beside the tolerances.
        at: values to start from.
        rounds: at most, those not counted that halve a step which diverged.
    """
    kept: _Step | None = None
    while rounds:
        fit = fitter.fit(free, start=at, iterations=4)
        if kept is not None and not fit.cost < _DIVERGED * (kept.cost + fitter.windows.observed):
            kept = kept.halved()
        else:
            rounds -= 1
            prediction = predict(fitter.plant, fitter.trajectory, fit.values, cache=fitter.cache)
            error = fitter.windows.states(fitter.windows.residual(prediction), prediction)
            if not np.isfinite(error).all():
                break
            kept = _Step(fitter=fitter, error=error, values=fit.values, cost=fit.cost)
        fitter, at = kept.taken(), kept.values
        if np.abs(kept.error[:, 3:9]).max() < _SETTLED:
            break
    return fitter


@dataclass(frozen=True, kw_only=True)
class _Step:
    """Step of a trajectory to the best fit of the measurements.

    Args:
        fitter: of the trajectory before it.
        error: of that trajectory, shape (T, 12).
        values: of the parameters after it.
        cost: before it.
    """

    fitter: Fitter
    error: Floats
    values: Mapping[str, float]
    cost: float

    def halved(self) -> _Step:
        """Return half the step of states and parameters."""
        begin = self.fitter.at
        values = {k: 0.5 * (v + float(begin.get(k, 0.0))) for k, v in self.values.items()}
        return replace(self, error=0.5 * self.error, values=values)

    def taken(self) -> Fitter:
        """Return the fitter after the step."""
        trajectory, gusts = self.fitter.trajectory.moved(self.error), self.fitter.windows.gusts
        return linearise_model(self.fitter.plant, trajectory, self.values, gusts=gusts)


def transient_rows(plant: ExtendedModel) -> int:
    """Return the number of rows until the actuators' unknown start state has decayed.

    The time constants may be longer than stated by the scale of a change that may be missing.
    """
    vehicle, parameters = plant.vehicle, plant.candidate_set.parameters
    lags = np.append(vehicle.lag, [] if vehicle.fall is None else vehicle.fall)
    if not len(lags):
        return 0
    _, change, _ = plant.timing({k: p.scale for k, p in parameters.items()})
    return int(np.ceil(FORGOTTEN * (lags.max() + max(change, 0.0)) / plant.samples.step))


def typical_speeds(trajectory: Trajectory) -> Floats:
    """Root mean square of the speed along the body axes [m/s], shape (3,)."""
    speeds: Floats = np.maximum(np.sqrt(np.mean(trajectory.velocity**2, axis=0)), 0.02)
    return speeds


def refined(
    plant: ExtendedModel,
    trajectory: Trajectory,
    *,
    window: float = WINDOW,
    at: Mapping[str, float] | None = None,
) -> Trajectory:
    """Estimate the trajectory from the measured pose with a free force (smoother).

    The inertial sensors' biases are free: their faults must not bend the trajectory.

    Args:
        plant: extended model.
        trajectory: to start from.
        window: length of the windows [s].
        at: changes of the model by parameter key; none when left out.
    """
    values = dict(at or {})
    vehicle = plant.vehicle
    weight = vehicle.mass * vehicle.environment.gravity
    level = weight * (_IMPACT if enters(plant, trajectory) else _LOOSE)
    for _ in range(2 if vehicle.has_water else 1):
        dynamics = dynamics_along(plant, trajectory, values)
        windows = Windows(
            plant.samples,
            vehicle,
            trajectory,
            dynamics,
            length=window,
            gusts=level / max(float(vehicle.gust[0]), 1e-9),
            skip=transient_rows(plant),
            bias=_BIASES,
            ignore=("joint_position",),
            knot=max(_FINE, 1.5 * plant.samples.step),
        )
        prediction = predict(plant, trajectory, values)
        error = windows.states(windows.residual(prediction), prediction)
        # no free torque acts on the joints: they stay as measured
        error[:, 12:] = 0.0
        astray = _astray(plant, values, trajectory, trajectory.moved(error), windows.rows)
        error[windows.rows[astray]] = 0.0
        trajectory = trajectory.moved(error)
    return trajectory


def _astray(
    plant: ExtendedModel,
    values: Mapping[str, float],
    before: Trajectory,
    after: Trajectory,
    rows: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Return a mask of windows that a step moves away from the measured pose, shape (W,).

    Where forces change within a row or two, as on rotors that touch water, a step of a linear
    model can diverge: a stretch as long as the free force can bend the trajectory then lies off.

    Args:
        plant: extended model.
        values: changes of its parameters.
        before: trajectory before the step.
        after: trajectory after it.
        rows: of the windows, shape (W, K).
    """
    samples, sigma = plant.samples, plant.vehicle.sigma
    place, turn = samples.channels["position"], samples.channels["orientation"]
    turned = plant.pose_turn(values, len(turn))
    if turned is not None:
        turn = multiply(turn, exponential(-turned))

    def off(trajectory: Trajectory) -> Floats:
        shift = (trajectory.position - place) / sigma["position"]
        tilt = rotation_vector(multiply(conjugate(turn), trajectory.quaternion))
        both = np.concatenate([shift, tilt / sigma["orientation"]], axis=1)[rows]
        given = np.isfinite(both)
        total = np.where(given, both, 0.0) ** 2
        mean = _stretches(total.sum(axis=2), count) / np.maximum(
            _stretches(given.sum(axis=2).astype(float), count), 1.0
        )
        worst: Floats = mean.max(axis=1)
        return worst

    count = min(max(1, round(_FINE / samples.step)), rows.shape[1])
    limit = plant.candidate_set.policy.trajectory_astray**2
    out: NDArray[np.bool_] = ~(off(after) <= np.maximum(limit, off(before)))
    return out


def _stretches(values: Floats, count: int) -> Floats:
    """Sums over all runs of ``count`` consecutive rows of every window, (W, K - count + 1)."""
    total = np.cumsum(np.pad(values, ((0, 0), (1, 0))), axis=1)
    out: Floats = total[:, count:] - total[:, :-count]
    return out


def stated_starts(plant: ExtendedModel, trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Return stated less estimated start states, shape (runs, 12), and their 1-sigma (12,)."""
    vehicle, runs = plant.vehicle, plant.samples.runs
    stated = start_states(vehicle.initial_state[: len(runs)])
    firsts = np.array([first for first, _ in runs])
    return difference(stated, trajectory.state(firsts)), start_sigma(vehicle)
