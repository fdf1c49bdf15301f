"""Self-check of a fit: recovery of its parameters from a finer simulation of the vehicle.

The vehicle is simulated with the effects of a hypothesis window by window along the log's own
commands, in half the predictor's steps and without linearisation. The fit should give back the
parameters that the simulation had.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from seals.arrays import Floats
from seals.frames import exponential, multiply
from seals.robot.whole_body import whole_body
from seals.sysid.data.samples import Samples
from seals.sysid.data.trajectory import Trajectory, posture_readings
from seals.sysid.predictors.extended_model import nonzero
from seals.sysid.predictors.normal_equations import newton_step, reserve
from seals.sysid.predictors.problem import linearise_model
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

_FINER = 2
"""Steps of the simulation for each one of the predictor."""
_TIPPED = 0.3
"""Angle [rad] by which gusts may tip the vehicle in a window: a simulation without them leaves the
flight beyond, for the commands hold the controller's answers to them."""


@dataclass(frozen=True, kw_only=True)
class SelfCheck:
    """Errors of a fit on simulated readings with known parameters.

    Args:
        error: by key, how far the fit misses the value that the simulation had.
        gain: fall of the misfit by moving the effects away from those values [chi2].
    """

    error: Mapping[str, float]
    gain: float


def self_check(hypothesis: EvidenceHypothesis) -> SelfCheck | None:
    """Check the fit of a hypothesis on a simulation with its effects.

    Returns:
        None where the windows cannot be simulated one by one: those of whole runs without a pose,
        those that follow late sensors, those of a vehicle with joints or of effects that act for
        a time, and those in which gusts tip the vehicle over.
    """
    fitter, fit = hypothesis.fitter, hypothesis.fit
    joints = fitter.plant.vehicle.robot.tree.joints
    whole = type(fitter) is not Fitter or not fitter.plant.samples.posed
    if whole or fitter.windows.delay or joints or fitter.plant.activity:
        return None
    if tipped(fitter) > _TIPPED:
        return None
    seen = simulated_readings(fitter, fit.values)
    if seen is None:
        return None
    readings, trajectory = seen
    if not fitter.plant.vehicle.commands:
        # nothing steers a falling body back: it leaves the range in which the flight is linear
        level = fitter.windows.gusts
        fitter = linearise_model(fitter.plant, trajectory, fit.values, gusts=level)
    other = fitter.with_windows(fitter.windows.with_readings(readings))
    found = other.reevaluated(fit)
    # tolerances have no prior here: the simulation had exactly these values
    found = replace(found, centre=found.at)
    moved, gain = newton_step(found)
    held = [k for k, key in enumerate(found.keys) if key not in found.free]
    return SelfCheck(
        error={key: abs(float(moved[k])) for k, key in enumerate(found.keys)},
        gain=gain - reserve(found, held),
    )


def tipped(fitter: Fitter) -> float:
    """Return the tilt of the vehicle due to the stated gusts within a window, 1-sigma [rad].

    Equation:
        sigma^2 = (torque / inertia)^2 2 tau T^3 / 3, a torque of the correlation time tau that
        acts for T > tau. The inertia is that of the whole vehicle, its base may be a bare frame.
    """
    vehicle, windows = fitter.plant.vehicle, fitter.windows
    inertia = float(np.linalg.eigvalsh(whole_body(vehicle.robot)[2]).min())
    span = (windows.length - 1) * fitter.plant.samples.step
    torque = windows.gusts * float(vehicle.gust[1])
    return torque / inertia * float(np.sqrt(2.0 * min(vehicle.gust_time, span) * span**3 / 3.0))


def simulated_readings(
    fitter: Fitter, values: Mapping[str, float]
) -> tuple[Samples, Trajectory] | None:
    """Simulate every window from the trajectory's state at its first row.

    Returns:
        The log with readings of the simulation, and its states; None where they leave all bounds.
    """
    plant, rows = fitter.plant, fitter.windows.rows
    fine = plant.of(plant.candidate_set, parts=_FINER * plant.parts)
    fine.command_delay = plant.command_delay
    used = nonzero(values)
    twin, drive = fine.twin(used, len(rows)), fine.drive(used)
    state = fitter.trajectory.state(rows[:, 0])
    channels: dict[str, Floats] = {
        name: np.full_like(seen, np.nan) for name, seen in plant.samples.channels.items()
    }
    names = ("position", "quaternion", "velocity", "angular_velocity")
    states = {name: np.array(getattr(fitter.trajectory, name)) for name in names}
    for k in range(rows.shape[1]):
        for name in names:
            states[name][rows[:, k]] = getattr(state, name)
        after, rates = fine.advance(twin, state, rows[:, k], drive)
        read = fine.reading(state, rates, used)
        turn = fine.pose_turn(used, len(state.quaternion))
        found = {
            **posture_readings(state, plant.vehicle.environment.water_level),
            "orientation": np.asarray(state.quaternion)
            if turn is None
            else np.asarray(multiply(state.quaternion, exponential(turn))),
            "angular_velocity": read.angular_velocity,
            "specific_force": read.specific_force,
        }
        if not all(np.isfinite(x).all() for x in found.values()):
            return None
        for name in channels.keys() & found.keys():
            channels[name][rows[:, k]] = found[name]
        state = after
    return replace(plant.samples, channels=channels), fitter.trajectory._replace(**states)
