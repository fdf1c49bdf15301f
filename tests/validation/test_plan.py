"""Plans: the proposed manoeuvre tells effects apart when the independent generator flies it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.logs.native import read_native
from seals.sysid.diagnosis import diagnose
from seals.sysid.experiment_design.flight import fly
from seals.sysid.experiment_design.manoeuvres import manoeuvres
from seals.sysid.experiment_design.plan import Plan
from seals.sysid.experiment_design.ranking import propose
from seals.sysid.experiment_design.scene import scene_of
from seals.sysid.predictors.problem import Problem, prepare
from tests.validation.hidden import generate
from tests.validation.replanned import flown, separated


@pytest.fixture(scope="module")
def problem(hovering: Path) -> Problem:
    """The hover, made ready."""
    return prepare(read_native(hovering))


@pytest.fixture(scope="module")
def plan(problem: Problem) -> Plan:
    """The plan that would tell bias from scale."""
    return propose(problem, ["accelerometer_scale", "accelerometer_bias"])


@pytest.mark.thorough
def test_the_proposal_moves_up_and_down(plan: Plan) -> None:
    """Only a changing specific force tells scale from bias, and hovering is known not to."""
    assert plan.best.manoeuvre.name in ("heave", "vertical chirp", "all axes")
    assert plan.best.confidence > 0.95
    assert plan.plain.confidence < 0.8
    assert plan.plain.separation < 0.1 * plan.best.separation


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["aam", "quad", "crossing", "auv"])
def test_rehearsals_follow_their_references(kind: str, tmp_path: Path) -> None:
    """Vehicles of all kinds stay at their places within centimetres; stiff servos do not ring."""
    words = ("--level", "null", "--vehicle", kind, "--seed", "4", "--no-gain")
    assert generate.main([str(tmp_path), "--count", "1", *words]) in (None, 0)
    log = read_native(next(p for p in sorted(tmp_path.iterdir()) if p.is_dir()))
    if kind == "aam":
        log.meta["vehicle"]["arm"]["controller"] |= {"kp": 8.0, "kd": 0.3}
    problem = prepare(log)
    scene, step = scene_of(problem.vehicle), 0.04 if problem.vehicle.has_water else 0.02
    time = np.arange(0.0, 8.0, step)
    chosen = [m for m in manoeuvres(scene.kind) if m.name in ("hover", "all axes")]
    flights = [m.path(scene, time) for m in chosen if m.path is not None]
    assert len(flights) == 2
    seen, commands = fly(problem, scene, flights, {}, step=step)
    position, joints, rates = (
        np.stack([getattr(s, name) for s in seen])
        for name in ("position", "joints", "joint_velocity")
    )
    miss = position - np.stack([f.place for f in flights], axis=1)
    assert np.abs(miss[:, 0]).max() < 0.02
    assert np.sqrt(np.mean(miss[:, 1] ** 2)) < 0.06
    hover = commands[:, 0]
    assert np.std(np.diff(hover, axis=0)) < 0.02 * np.abs(hover).max() + 1.0
    assert np.abs(joints - np.stack([f.joints for f in flights], axis=1)).max(initial=0) < 0.1
    assert np.sqrt(np.sum(rates[:, 0] ** 2, axis=1).mean()) < 0.05


@pytest.mark.thorough
def test_the_proposal_can_be_written_as_json(plan: Plan) -> None:
    """The form of ``next_experiment`` names the manoeuvre, its confidence and a sentence."""
    answer = json.loads(json.dumps(plan.to_dict()))
    assert answer["manoeuvre"] == plan.best.manoeuvre.name
    assert answer["effects"] == ["accelerometer_scale", "accelerometer_bias"]
    assert "Hover would not" in answer["sentence"]
    assert len(answer["ranked"]) == len(plan.ranked)


@pytest.mark.thorough
def test_the_independent_flight_separates(hovering: Path, plan: Plan, tmp_path: Path) -> None:
    """Flown by another simulator with the true effect, the proposal gets it named alone."""
    truth = yaml.safe_load((hovering / "truth.yaml").read_text(encoding="utf-8"))
    log = flown(tmp_path, hovering, plan, plan.best.manoeuvre, seed=1)
    found = diagnose(read_native(log))
    assert separated(found, truth["effects"][0]["name"], truth["twins"])
