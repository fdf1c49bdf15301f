"""A log made ready: course, linearisation and windows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from seals.arrays import Floats
from seals.logs.log import Log
from seals.sysid.along import Along
from seals.sysid.catalogue import library_of
from seals.sysid.decision.policy import DecisionPolicy, SearchBudget
from seals.sysid.fit import Fitter
from seals.sysid.linearise import DELAY, Dynamics, dynamics_along, predict
from seals.sysid.plant import Plant
from seals.sysid.rollout import simulated_course, start_states
from seals.sysid.rough import surface
from seals.sysid.samples import Samples, read_samples
from seals.sysid.trajectory import Course, difference, measured_course
from seals.sysid.vehicle import Vehicle, read_vehicle
from seals.sysid.windows import Windows

LATE = 3e-3
"""Delay of the inertial sensors from which on the windows follow it [s]."""
WINDOW = 1.0
"""Length of a window [s]: about three correlation times of the gusts."""
LOOSE = 30.0
"""Factor on the gusts under which any force may act."""
_LOOSE, _IMPACT = 0.3, 3.0
"""Free force, in weights, under which the course is refined, in general and on impact."""
_BIASES = (0.1, 1.0)
"""1-sigma of the free biases of gyroscope [rad/s] and accelerometer [m/s^2] meanwhile."""
_ARM = 0.1
"""Lever of the free torque [m]."""
_QUICK = 0.05
"""Spacing of the knots of the gusts where a hull pierces the surface [s]."""
_FINE = 0.04
"""Spacing of the knots of the free force [s]."""
_FORGOTTEN = 5.0
"""Time constants after which an actuator has forgotten its start."""
GUSTS = 1.3
"""Factor on the stated level of the gusts, which is good to a factor of two."""


_SETTLED = 5e-3
"""Change of attitude [rad] and velocity [m/s] below which a course has settled."""


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Everything a diagnosis needs of one log.

    Args:
        vehicle: nominal model.
        samples: the log.
        plant: extended model.
        fitter: of the nominal linearisation.
    """

    vehicle: Vehicle
    samples: Samples
    plant: Plant
    fitter: Fitter

    @property
    def policy(self) -> DecisionPolicy:
        """Thresholds of the decisions."""
        return self.plant.library.policy

    @property
    def budget(self) -> SearchBudget:
        """Limits of the search."""
        return self.plant.library.budget

    @property
    def impact(self) -> bool:
        """Whether the vehicle falls into water without actuators."""
        return self.vehicle.has_water and not len(self.vehicle.lag)


def prepare(
    log: Log,
    *,
    window: float = WINDOW,
    gusts: float = GUSTS,
    policy: DecisionPolicy | None = None,
) -> Problem:
    """Read a log, find its course, and linearise the model along it.

    Args:
        log: in the native format.
        window: length of the windows [s].
        gusts: factor on the stated disturbance.
        policy: thresholds of the decisions; the standard ones when left out.

    Raises:
        LogError: the log cannot be used.
    """
    vehicle = read_vehicle(log.meta)
    samples = read_samples(log, vehicle)
    parts = max(1, round(samples.step / 0.01))
    if vehicle.has_water and not vehicle.commands:
        parts *= 2
    if samples.posed:
        course = measured_course(samples, vehicle)
    else:
        course = simulated_course(samples, vehicle, parts=parts)
    library = library_of(vehicle, speeds=typical(course))
    library = library if policy is None else replace(library, policy=policy)
    plant = Plant(vehicle, library, samples, parts=parts)
    fitter = linearised(plant, course, {}, window=window, gusts=gusts)
    if samples.posed:
        course = refined(plant, course, window=window)
        fitter = linearised(plant, course, {}, window=window, gusts=gusts)
    else:
        fitter = followed(fitter, ())
    return Problem(vehicle=vehicle, samples=samples, plant=plant, fitter=fitter)


def linearised(
    plant: Plant,
    course: Course,
    at: Mapping[str, float],
    *,
    window: float = WINDOW,
    gusts: float = GUSTS,
) -> Fitter:
    """Linearise the model along a course and set up the windows."""
    along = Along(plant, course)
    dynamics = dynamics_along(plant, course, at, along=along)
    delay = at.get(DELAY, 0.0)
    delay = delay if abs(delay) > LATE else 0.0
    windows = windows_of(plant, course, dynamics, window=window, gusts=gusts, delay=delay)
    return Fitter(plant, course, dynamics, windows, at=at, along=along)


def windows_of(
    plant: Plant,
    course: Course,
    dynamics: Dynamics,
    *,
    window: float = WINDOW,
    gusts: float = GUSTS,
    delay: float = 0.0,
) -> Windows:
    """Set up the windows of a log.

    Args:
        plant: extended model.
        course: about which it is linear.
        dynamics: derivatives along the course.
        window: length [s].
        gusts: factor on their stated level.
        delay: of the inertial sensors [s].
    """
    rough = surface(plant, course)
    posed = plant.samples.posed
    return Windows(
        plant.samples,
        plant.vehicle,
        course,
        dynamics,
        length=window if posed else 1e6,
        gusts=gusts,
        extra=None if rough is None else rough.push,
        blur=None if rough is None else rough.blur,
        knot=None if rough is None else max(_QUICK, 1.5 * plant.samples.step),
        stated=None if posed else stated_starts(plant, course),
        skip=forgotten(plant),
        delay=delay,
    )


def rewindowed(fitter: Fitter, *, gusts: float = 1.0, delay: float | None = None) -> Fitter:
    """The same linearisation under other gusts or another delay of the inertial sensors.

    Args:
        fitter: of the linearisation.
        gusts: factor on the gusts of its windows.
        delay: of the sensors; that of its windows when left out [s].
    """
    late = fitter.windows.delay if delay is None else delay
    level = gusts * fitter.windows.gusts
    if late == fitter.windows.delay:
        return fitter.seen_through(fitter.windows.under(level))
    windows = windows_of(fitter.plant, fitter.course, fitter.dynamics, gusts=level, delay=late)
    return fitter.seen_through(windows)


def followed(
    fitter: Fitter,
    freed: tuple[str, ...],
    *,
    at: Mapping[str, float] | None = None,
    rounds: int = 4,
) -> Fitter:
    """Move a course to the best explanation of the measurements and linearise there again.

    Args:
        fitter: of the present course.
        freed: keys that are freed beside the tolerances.
        at: values to start from.
        rounds: at most.
    """
    for _ in range(rounds):
        fit = fitter.fit(freed, start=at, iterations=4)
        prediction = predict(fitter.plant, fitter.course, fit.values, along=fitter.along)
        error = fitter.windows.states(fitter.windows.residual(prediction), prediction)
        course = fitter.course.moved(error)
        fitter = linearised(fitter.plant, course, fit.values, gusts=fitter.windows.gusts)
        at = fit.values
        if np.abs(error[:, 3:9]).max() < _SETTLED:
            break
    return fitter


def forgotten(plant: Plant) -> int:
    """Rows after which the actuators' unknown start no longer matters."""
    lag = plant.vehicle.lag
    return int(np.ceil(_FORGOTTEN * lag.max() / plant.samples.step)) if len(lag) else 0


def typical(course: Course) -> Floats:
    """Root mean square of the speed along the body axes [m/s], shape (3,)."""
    speeds: Floats = np.maximum(np.sqrt(np.mean(course.velocity**2, axis=0)), 0.02)
    return speeds


def refined(plant: Plant, course: Course, *, window: float) -> Course:
    """Course that fits the pose best when any force may act.

    The inertial sensors' biases are free: their faults must not bend the course.
    """
    vehicle = plant.vehicle
    weight = vehicle.mass * vehicle.environment.gravity
    impact = vehicle.has_water and not len(vehicle.lag)
    level = weight * (_IMPACT if impact else _LOOSE)
    for _ in range(2 if vehicle.has_water else 1):
        dynamics = dynamics_along(plant, course, {})
        windows = Windows(
            plant.samples,
            vehicle,
            course,
            dynamics,
            length=window,
            gusts=level / max(float(vehicle.gust[0]), 1e-9),
            skip=forgotten(plant),
            bias=_BIASES,
            ignore=("joint_position",),
            knot=max(_FINE, 1.5 * plant.samples.step),
        )
        prediction = predict(plant, course, {})
        error = windows.states(windows.residual(prediction), prediction)
        # no free torque acts on the joints: they stay as measured
        error[:, 12:] = 0.0
        course = course.moved(error)
    return course


def stated_starts(plant: Plant, course: Course) -> tuple[Floats, Floats]:
    """Stated start states against the course, shape (runs, 12), and their 1-sigma, shape (12,)."""
    vehicle, runs = plant.vehicle, plant.samples.runs
    stated = start_states(vehicle, len(runs))
    firsts = np.array([first for first, _ in runs])
    sigma = vehicle.initial_state[0]["sigma"]
    names = ("position", "orientation", "velocity", "angular_velocity")
    spread: Floats = np.repeat([float(sigma[n]) for n in names], 3)
    return difference(stated, course.state(firsts)), spread
