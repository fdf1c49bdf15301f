"""What diagnoses keep of a trajectory and of a linearisation gives what is computed afresh."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.batch.response import Response
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.parallel import spread
from seals.sysid.predictors.extended_model import ExtendedModel, Held
from seals.sysid.predictors.linearise import Columns, _accelerations, _everywhere
from seals.sysid.predictors.problem import Linearisation, linearise_model
from seals.sysid.predictors.trajectory_cache import TrajectoryCache, packed
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.selection.window_models import WindowModels
from tests.unit.test_diagnose_along import VALUES, described, waving


@pytest.fixture(params=[None, 0.0], ids=["in air", "at the surface"])
def cache(request: pytest.FixtureRequest) -> TrajectoryCache:
    """A plant with an arm along its trajectory."""
    plant, trajectory = waving(read_vehicle(described(request.param)))
    known = plant.candidate_set.parameters
    assert set(VALUES) <= set(known)
    return TrajectoryCache(plant, trajectory)


def test_sensors_feel_the_command_in_force(cache: TrajectoryCache) -> None:
    """Another command to the joints changes a known response as it does a fresh evaluation."""
    inputs = cache.inputs(VALUES, Held.row)
    commanded = inputs.joint_command + 0.05
    inputs = inputs._replace(joint_command=commanded)
    twin = cache.plant.twin(VALUES, len(cache.rows))
    fresh = packed(twin.rates(cache.state, cache.time, inputs))
    known = cache.response(VALUES)
    assert np.abs(packed(known.rates) - fresh).max() > 1e-2
    assert packed(known.rates_under(inputs)) == pytest.approx(fresh, rel=1e-9, abs=1e-9)


def test_inputs_that_change_the_links_are_evaluated_afresh(cache: TrajectoryCache) -> None:
    """Rotors that run faster push the base: the known right side does not hold."""
    inputs = cache.inputs(VALUES, Held.row)
    inputs = inputs._replace(drive=1.1 * inputs.drive)
    twin = cache.plant.twin(VALUES, len(cache.rows))
    fresh = packed(twin.rates(cache.state, cache.time, inputs))
    found = packed(cache.response(VALUES).rates_under(inputs))
    assert found == pytest.approx(fresh, rel=1e-9, abs=1e-9)


def test_other_velocities_at_known_poses(cache: TrajectoryCache) -> None:
    """Poses of the trajectory serve shifts of velocities; those of poses keep their place."""
    size = cache.trajectory.size
    shifts = [1e-3 * np.eye(size)[k] for k in range(size)]
    found = _accelerations(cache, VALUES, shifts)
    fresh = _everywhere(cache, VALUES, shifts, stiff=True)
    assert cache.moved(VALUES, shifts[6:12], stiff=True) is not None
    assert np.array(found) == pytest.approx(np.array(fresh), rel=1e-9, abs=1e-9)


def test_a_fitter_is_built_again_from_its_linearisation(cache: TrajectoryCache) -> None:
    """What comes back from another process gives the same fit."""
    fitter = linearise_model(cache.plant, cache.trajectory, VALUES, window=0.5, gusts=1.2)
    about = spread(lambda _: Linearisation.of(fitter), [0, 1], 2)[0]
    again = about.fitter(cache.plant, window=0.5)
    assert again.windows.gusts == 1.2
    # a model that nobody asks again costs neither time nor memory
    assert not {"_marginal", "_weights", "_march"} & set(vars(again.windows))
    assert "fixed" not in vars(again)
    assert not {"found"} & set(vars(again.along))
    assert again.fit(()).cost == fitter.fit(()).cost


def test_a_released_linearisation_returns_where_it_is_asked_again(cache: TrajectoryCache) -> None:
    """It frees nearly all of its memory, keeps what the windows saw, and fits the same to a bit."""
    fitter = linearise_model(cache.plant, cache.trajectory, VALUES, window=0.5)
    shared = fitter.with_windows(fitter.windows.with_disturbance(2.0))
    cost, other, held = fitter.fit(()).cost, shared.fit(()).cost, _bytes(fitter)
    fitter.release()
    assert _bytes(fitter) < 0.1 * held
    assert fitter.windows.observed == shared.windows.observed
    assert fitter.fit(()).cost == cost
    shared.release()
    assert shared.fit(()).cost == other


def test_only_the_nominal_and_the_best_model_keep_their_linearisations(
    cache: TrajectoryCache,
) -> None:
    """Models that share theirs with one of these lose nothing, either."""
    starts = ({}, VALUES, VALUES)
    known, better, worse = (
        linearise_model(cache.plant, cache.trajectory, at, window=0.5) for at in starts
    )
    for fitter in (known, better, worse):
        fitter.fit(())
    shared = better.with_windows(better.windows.with_disturbance(2.0))
    models: Any = object.__new__(WindowModels)
    models.problem, models.nominal = SimpleNamespace(fitter=known), SimpleNamespace(fitter=known)
    others = [SimpleNamespace(fitter=fitter) for fitter in (known, shared, worse)]
    models._release(SimpleNamespace(fitter=better), others)
    assert [f.along for f in (known, better, worse) if "found" in vars(f.along)] == [
        known.along,
        better.along,
    ]
    assert "_marginal" in vars(better.windows)
    assert "_marginal" not in vars(worse.windows)


def _bytes(fitter: Fitter) -> int:
    """Memory of the arrays that a fitter computed."""
    seen: dict[int, int] = {}
    todo: list[object] = [fitter.along, fitter.cache, fitter.windows]
    todo += [v for k, v in vars(fitter).items() if k in ("columns", "fixed", "_square")]
    done = set()
    while todo:
        one = todo.pop()
        if isinstance(one, np.ndarray):
            whole = one if one.base is None else one.base
            seen[id(whole)] = getattr(whole, "nbytes", 0)
        elif id(one) not in done and not isinstance(one, ExtendedModel | Trajectory):
            done.add(id(one))
            parts = one if isinstance(one, tuple | list) else getattr(one, "__dict__", {}).values()
            todo += one.values() if isinstance(one, dict) else parts
    return sum(seen.values())


def test_many_responses_are_those_of_each_parameter(cache: TrajectoryCache) -> None:
    """However many parameters go through the windows together, none takes another's place."""
    windows = linearise_model(cache.plant, cache.trajectory, {}, window=0.5).windows
    rng, rows, size = np.random.default_rng(3), len(cache.rows), cache.trajectory.size
    push, reading = rng.standard_normal((rows, size, 70)), rng.standard_normal((rows, 6, 70))
    names = tuple(f"p{k}" for k in range(70))
    together = windows.responses(Columns(keys=names, push=push, reading=reading))
    assert together.shape[2] == 70
    for k in (0, 31, 32, 69):
        alone = Columns(keys=names[k : k + 1], push=push[:, :, [k]], reading=reading[:, :, [k]])
        found = windows.responses(alone)[:, :, 0]
        assert together[:, :, k] == pytest.approx(found, rel=1e-9, abs=1e-9)
    none = Columns(keys=(), push=push[:, :, :0], reading=reading[:, :, :0])
    assert windows.responses(none).shape == (*together.shape[:2], 0)


def test_many_parameters_are_linearised_some_at_a_time(
    cache: TrajectoryCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What bounds the memory of a screen changes none of its numbers."""
    fitter = linearise_model(cache.plant, cache.trajectory, {}, window=0.5)
    keys = tuple(cache.plant.candidate_set.parameters)[:8]
    whole, asked = fitter.whitened(keys, {}), []
    known = fitter.columns_at
    monkeypatch.setattr("seals.sysid.predictors.windows_fit.BLOCK", 3)
    monkeypatch.setattr(fitter, "columns_at", lambda k, v: asked.append(tuple(k)) or known(k, v))
    found = fitter.whitened(keys, {})
    assert asked == [keys[:3], keys[3:6], keys[6:]]
    assert found.outputs == pytest.approx(whole.outputs, rel=1e-12, abs=1e-12)
    assert found.cross == pytest.approx(whole.cross, rel=1e-12, abs=1e-12)
    assert fitter.whitened((), {}).outputs.shape == (*whole.outputs.shape[:2], 0)


def test_few_equations_of_motion_are_kept(
    cache: TrajectoryCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last values are at hand, also for a plant in which nothing else acts; older ones go."""
    made: list[int] = []
    build = Response.__init__

    def counted(self: Response, *args: object) -> None:
        made.append(1)
        build(self, *args)  # type: ignore[arg-type]

    monkeypatch.setattr(Response, "__init__", counted)
    for mass in (0.01, 0.02, 0.03, 0.04, 0.04, 0.03):
        cache.response({"mass.mass": mass})
    assert len(made) == 4
    cache.response({"mass.mass": 0.01})
    assert len(made) == 5
