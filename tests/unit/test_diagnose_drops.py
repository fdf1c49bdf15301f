"""Drops without pose: the model between the rows, trials of whole runs, errors at the surface."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.data.samples import Samples
from seals.sysid.data.vehicle import Vehicle, read_vehicle
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.problem import Problem, follow_measurements, linearise_model
from seals.sysid.predictors.rollout import simulated_trajectory
from seals.sysid.predictors.substep_integrator import SubstepIntegrator, finer
from seals.sysid.predictors.surface_model_error import surface_model_error
from seals.sysid.predictors.trials import nearest_trajectories, trials
from seals.sysid.predictors.whole_run import UnmodelledDisturbance, converged, linearise_about
from seals.sysid.predictors.windows import Windows
from seals.sysid.selection.whole_run_models import fit_nominal

STEP, ROWS = 0.02, 60


def meta() -> dict[str, Any]:
    """A box of one kilogram that falls from 0.25 m, a little tilted, and floats."""
    size = [0.15, 0.15, 0.07]
    sigma = {
        "position": 0.005,
        "orientation": 0.01,
        "velocity": 0.02,
        "angular_velocity": 0.02,
    }
    start = {
        "segment": 0,
        "position": [0.0, 0.0, 0.25],
        "orientation": [0.995004, 0.0, 0.0998334, 0.0],
        "velocity": [0.0, 0.0, 0.0],
        "angular_velocity": [0.1, 0.0, 0.2],
        "sigma": sigma,
    }
    drag = {"coefficient_x": 5.0, "coefficient_y": 5.0, "coefficient_z": 14.0}
    box = {"type": "box", "position": [0, 0, 0], "rpy": [0, 0, 0], "size": size}
    return {
        "vehicle": {
            "name": "drop",
            "mass": 1.0,
            "inertia": [[0.006, 0, 0], [0, 0.006, 0], [0, 0, 0.01]],
            "centre_of_gravity": [0, 0, 0],
            "hull": {
                "primitives": [box],
                "displaced_volume": 0.00108,
                "centre_of_buoyancy": [0, 0, 0.012],
                "plan_area": 0.0225,
            },
        },
        "environment": {"gravity": [0, 0, -9.81], "water_level": 0.0, "water_density": 998.0},
        "baseline": [
            {"name": "gravity"},
            {"name": "buoyancy", "medium": "water"},
            {"name": "quadratic_drag", "medium": "water", "parameters": drag},
        ],
        "sensors": {
            "channels": {"angular_velocity": {"sigma": 0.012}, "specific_force": {"sigma": 0.12}}
        },
        "tolerance": {"mass": {"sigma": 0.005}, "displaced_volume": {"sigma": 0.005}},
        "disturbance": {"force_sigma": 0.012, "torque_sigma": 3e-4, "correlation_time": 0.35},
        "initial_state": [start],
    }


def problem_of(vehicle: Vehicle) -> Problem:
    """The stated model's own readings as a log of one run."""
    channels = {n: np.zeros((ROWS, 3)) for n in ("angular_velocity", "specific_force")}
    none = np.zeros((ROWS, 0))
    samples = Samples(
        time=STEP * np.arange(ROWS),
        step=STEP,
        runs=((0, ROWS),),
        channels=channels,
        command=none,
        voltage=None,
        joint_command=none,
    )
    trajectory = simulated_trajectory(samples, vehicle, parts=4)
    plant = ExtendedModel(vehicle, candidate_set_of(vehicle, speeds=np.ones(3)), samples, parts=4)
    reading = SubstepIntegrator(plant).substeps(trajectory, {}).reading[::4]
    channels["angular_velocity"][:], channels["specific_force"][:] = reading[:, :3], reading[:, 3:]
    fitter = linearise_model(plant, trajectory, {})
    return Problem(vehicle=vehicle, samples=samples, plant=plant, fitter=fitter)


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A sound log."""
    return problem_of(read_vehicle(meta()))


def test_finer_rows_divide_every_row(problem: Problem) -> None:
    """The times of the parts run on from row to row, and the runs keep their ends."""
    rows = finer(problem.samples, 4)
    assert np.allclose(np.diff(rows.time), STEP / 4)
    assert rows.runs == ((0, 4 * ROWS),)


def test_a_free_fall_is_exact_between_the_rows(problem: Problem) -> None:
    """Before it touches the water the hull follows the parabola at every part of a row."""
    substeps = SubstepIntegrator(problem.plant).substeps(problem.fitter.trajectory, {})
    time = finer(problem.samples, 4).time[:32]
    assert np.allclose(substeps.trajectory.position[:32, 2], 0.25 - 0.5 * 9.81 * time**2, atol=1e-9)


@pytest.mark.parametrize("key", ["slamming_change.coefficient", "added_mass_change.mass_z"])
def test_responses_match_a_simulated_impact(problem: Problem, key: str) -> None:
    """Responses that a fit uses at the impact are those of two simulations, to a few per cent."""
    integrator, trajectory = SubstepIntegrator(problem.plant), problem.fitter.trajectory
    substeps = integrator.substeps(trajectory, {})
    disturbance = UnmodelledDisturbance(gusts=1.3, surface_error=None)
    fitter = linearise_about(integrator, trajectory, (), {}, disturbance).fitter
    found = fitter.columns_at([key], {}).push[:, :, 0]
    step = 0.01
    after = integrator.substeps(trajectory, {key: step})
    exact = (after.defect - substeps.defect) / step
    assert np.abs(exact).max() > 0.1
    assert np.abs(found - exact)[:-1].max() < 0.04 * np.abs(exact).max()


def test_an_impact_is_doubted_and_a_floating_hull_is_not(problem: Problem) -> None:
    """Where the hull strikes the water the readings count less than where it floats at rest."""
    surface_error = surface_model_error(problem.plant, problem.fitter.trajectory)
    assert surface_error is not None
    speed = problem.fitter.trajectory.velocity[:, 2]
    strike = int(np.argmax(surface_error.blur))
    assert speed[strike] < -1.0
    assert surface_error.blur[:8].max() == 0.0
    assert surface_error.blur[-5:].max() < 0.5 * surface_error.blur[strike]


def test_trials_are_the_same_every_time_and_find_the_run(problem: Problem) -> None:
    """The draws repeat; the first is the datasheet's, and its trajectory is the nearest here."""
    one, two = (trials(problem.plant, leave=("tether", "waves")) for _ in range(2))
    assert [t.values for t in one] == [t.values for t in two]
    assert not one[0].start.any()
    near, next_to_it = nearest_trajectories(problem.plant, leave=("tether", "waves"), ranks=(0, 1))
    away = np.abs(near.position - problem.fitter.trajectory.position)
    assert away.max() < 0.05
    assert not np.array_equal(near.position, next_to_it.position)


def test_a_fit_that_got_stuck_sets_out_from_other_courses(problem: Problem) -> None:
    """From a trajectory that turned over nothing comes; the next one leads to the readings."""
    good = problem.fitter.trajectory
    turned = np.zeros((len(good.position), 12))
    turned[:, 3] = np.linspace(0.0, 3.0, len(turned))
    stuck, other = good.moved(turned), good.moved(0.02 * turned)
    alone = fit_nominal(problem.plant, [stuck], processes=1)[1]
    assert alone.fit.cost > 1.5 * alone.fitter.windows.observed
    outset, base = fit_nominal(problem.plant, [stuck, other], processes=1)
    assert base.fit.cost < base.fitter.windows.observed
    assert np.array_equal(outset.fitter.trajectory.position, other.position)


def test_a_fit_of_a_sound_run_stays_at_the_datasheet_and_travels(problem: Problem) -> None:
    """The stated model follows its own readings, and a fit survives a change of process."""
    integrator = SubstepIntegrator(problem.plant)
    disturbance = UnmodelledDisturbance(
        gusts=1.3, surface_error=surface_model_error(problem.plant, problem.fitter.trajectory)
    )
    found = converged(
        linearise_about(integrator, problem.fitter.trajectory, (), {}, disturbance), rounds=6
    )
    assert found.done
    assert found.fit.cost < 2.0
    copied = pickle.loads(pickle.dumps(found))
    copied.fitter.attach(integrator)
    assert copied.fitter.start(()).cost == pytest.approx(found.fit.cost, abs=1e-6)


def test_a_step_of_a_trajectory_that_diverges_is_halved(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A first step that is taken a hundred times too far does not end beyond the readings."""
    own, factors = Windows.states, iter([100.0])
    monkeypatch.setattr(Windows, "states", lambda *given: next(factors, 1.0) * own(*given))
    moved = problem.fitter.trajectory.moved(np.full((problem.samples.rows, 12), 2e-3))
    begun = linearise_model(problem.plant, moved, {}, gusts=problem.fitter.windows.gusts)
    found = follow_measurements(begun, ())
    assert np.abs(found.trajectory.velocity - problem.fitter.trajectory.velocity).max() < 0.05
    assert found.fit(()).cost < begun.fit(()).cost + 1.0
