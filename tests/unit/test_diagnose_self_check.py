"""Self-check of a fit: a finer simulation of the vehicle, whose answer is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.logs.native import read_native
from seals.logs.shipped import shipped_logs
from seals.robot.build import build_robot
from seals.robot.settings import RobotSettings
from seals.sysid.predictors.linear_screen import candidate_keys
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.problem import Problem, prepare
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores import self_check as module
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, scored
from seals.sysid.scores.self_check import self_check, simulated_readings, tipped
from seals.sysid.selection import relinearised
from seals.sysid.selection.relinearised import refit_about_own_values, repeat_worse_fits

ROWS = 400


@pytest.fixture(scope="module")
def fitted() -> tuple[Problem, EvidenceHypothesis]:
    """Four seconds of a shipped flight, with the wind that it holds."""
    log = read_native(shipped_logs()["hidden_effect/flight_a"])
    problem = prepare(log.select(np.arange(ROWS)))
    fitter = problem.fitter
    nominal = EvidenceHypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)
    wind = next(c for c in problem.plant.candidate_set.candidates if c.name == "wind")
    fit = fitter.fit(candidate_keys([wind]))
    return problem, scored([wind], fit, fitter, nominal)


def test_a_fit_gives_back_what_a_finer_simulation_had(
    fitted: tuple[Problem, EvidenceHypothesis],
) -> None:
    """Each component of the wind to a third of its own 1-sigma, and hardly any gain beside it."""
    _, hypothesis = fitted
    found = self_check(hypothesis)
    assert found is not None
    for key in hypothesis.fit.free:
        assert found.error[key] < 0.33 * hypothesis.fit.spread(key)
    assert found.gain < 1.0 < 0.05 * hypothesis.score


def test_an_engine_that_does_not_reproduce_the_simulation_is_found_out(
    fitted: tuple[Problem, EvidenceHypothesis], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Readings of half a metre a second more wind: the error is that half, the interval wider."""
    problem, hypothesis = fitted
    key = hypothesis.fit.free[0]
    values = dict(hypothesis.fit.values) | {key: hypothesis.fit.values[key] + 0.5}
    other = simulated_readings(problem.fitter, values)
    monkeypatch.setattr(module, "simulated_readings", lambda fitter, values: other)
    found = self_check(hypothesis)
    assert found is not None
    assert found.error[key] == pytest.approx(0.5, rel=0.2)
    wide = replace(hypothesis.fit, error=found.error)
    assert wide.robust_spread(key) > max(0.4, hypothesis.fit.robust_spread(key))


def test_a_vehicle_that_gusts_tip_over_is_not_simulated_without_them(
    fitted: tuple[Problem, EvidenceHypothesis],
) -> None:
    """Its commands hold the controller's answers to gusts that a simulation does not have."""
    _, hypothesis = fitted
    level = hypothesis.fitter.windows.gusts
    rows = hypothesis.fitter.windows.with_disturbance(100.0 * level)
    gusty = replace(hypothesis, fitter=hypothesis.fitter.with_windows(rows))
    assert tipped(gusty.fitter) == pytest.approx(100.0 * tipped(hypothesis.fitter))
    assert self_check(gusty) is None


def test_gusts_turn_the_whole_vehicle_and_not_the_frame_that_is_its_base(tmp_path: Path) -> None:
    """Two spheres of inertia I on y: the least inertia is 2 I about y; the base is a point."""
    body = '<link name="{0}"><inertial><mass value="0.5"/><inertia ixx="{1}" iyy="{1}" izz="{1}" '
    body += 'ixy="0" ixz="0" iyz="0"/></inertial></link>'
    joint = '<joint name="j{0}" type="fixed"><origin xyz="0 {1} 0"/><parent link="base"/>'
    joint += '<child link="{0}"/></joint>'
    text = '<robot name="r">' + body.format("base", 0)
    for name, place in (("left", 0.1), ("right", -0.1)):
        text += body.format(name, 5e-3) + joint.format(name, place)
    (tmp_path / "r.urdf").write_text(text + "</robot>", encoding="utf-8")
    robot = build_robot(RobotSettings(name="r", folder=str(tmp_path), urdf="r.urdf"))
    vehicle = SimpleNamespace(robot=robot, gust=(0.0, 2e-3), gust_time=0.5)
    plant = SimpleNamespace(vehicle=vehicle, samples=SimpleNamespace(step=0.01))
    fitter: Any = SimpleNamespace(plant=plant, windows=SimpleNamespace(length=101, gusts=1.0))
    assert tipped(fitter) == pytest.approx(2e-3 / 0.01 * np.sqrt(2.0 * 0.5 * 1.0 / 3.0))


def test_a_fit_with_one_more_effect_is_never_left_worse_than_without(
    fitted: tuple[Problem, EvidenceHypothesis],
) -> None:
    """A fit of the payload that was caught far off is repeated from the values of its base."""
    problem, base = fitted
    payload = next(c for c in problem.plant.candidate_set.candidates if c.name == "payload")
    keys = candidate_keys((*base.candidates, payload))
    far = {k: v for k, v in base.fit.values.items() if k in keys} | {payload.keys[0]: 1.0}
    caught = base.fitter.fit(keys, start=far, iterations=0, coarse=True)
    assert caught.cost > base.fit.cost + 100.0
    chosen = {payload.label: (payload, caught, base.fitter)}
    stated = EvidenceHypothesis(
        candidates=(), fit=problem.fitter.fit(()), fitter=problem.fitter, score=0.0
    )
    repeat_worse_fits(problem, stated, base, chosen, 1)
    assert chosen[payload.label][1].cost < base.fit.cost + 1.0


def test_tolerances_that_run_away_do_not_spoil_a_repeated_fit(
    fitted: tuple[Problem, EvidenceHypothesis], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Linear about its own tolerances a model may not fly: then it is so about the effect alone."""
    problem, wind = fitted
    keys, own = wind.fit.free, relinearised.linearise_model

    def astray(plant: Any, trajectory: Any, at: Mapping[str, float], **more: Any) -> Fitter:
        # the further the tolerances, the worse: a centre of gravity half a metre below the rotors
        far = {"centre_of_gravity.offset_z": -0.5} if set(at) - set(keys) else {}
        return own(plant, trajectory, {**at, **far}, **more)

    monkeypatch.setattr(relinearised, "linearise_model", astray)
    found = refit_about_own_values(problem, wind, wind)
    assert set(found.fitter.at) == set(keys)
    assert found.fit.cost == pytest.approx(wind.fit.cost, rel=0.01)


def test_a_second_round_that_overshoots_is_not_kept(
    fitted: tuple[Problem, EvidenceHypothesis], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the fits about own values the better one stays, whichever round it is from."""
    problem, wind = fitted
    own, rounds = relinearised.linearise_model, list[Fitter]()

    def worse_and_worse(*given: Any, **more: Any) -> Fitter:
        fitter = own(*given, **more)
        fit, late = fitter.fit, 50.0 * (1 + len(rounds))
        rounds.append(fitter)

        def farther(*keys: Any, **start: Any) -> Fit:
            found = fit(*keys, **start)
            return replace(found, cost=found.cost + late)

        monkeypatch.setattr(fitter, "fit", farther)
        return fitter

    monkeypatch.setattr(relinearised, "linearise_model", worse_and_worse)
    stated = replace(wind, candidates=(), fit=problem.fitter.fit(()), fitter=problem.fitter)
    found = refit_about_own_values(problem, stated, wind)
    assert len(rounds) == 2
    assert found.fitter is rounds[0]
