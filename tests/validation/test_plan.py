"""Plans: the proposed manoeuvre tells effects apart when the independent generator flies it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
import yaml

from seals.logs.native import read_native
from seals.sysid.diagnosis import diagnose
from seals.sysid.experiment_design.plan import Plan
from seals.sysid.experiment_design.ranking import propose
from seals.sysid.predictors.problem import Problem, prepare

ROOT = Path(__file__).parents[2]
if str(ROOT) not in sys.path:
    sys.path.append(str(ROOT))

from tests.validation.replanned import flown, separated  # noqa: E402


@pytest.fixture(scope="module")
def problem(hovering: Path) -> Problem:
    """The hover, made ready."""
    return prepare(read_native(hovering))


@pytest.fixture(scope="module")
def plan(problem: Problem) -> Plan:
    """The plan that would tell bias from scale."""
    return propose(problem, ["accelerometer_scale", "accelerometer_bias"])


def test_the_proposal_moves_up_and_down(plan: Plan) -> None:
    """Only a changing specific force tells scale from bias, and hovering is known not to."""
    assert plan.best.manoeuvre.name in ("heave", "vertical chirp", "all axes")
    assert plan.best.confidence > 0.95
    assert plan.plain.confidence < 0.8
    assert plan.plain.separation < 0.1 * plan.best.separation


def test_the_proposal_can_be_written_as_json(plan: Plan) -> None:
    """The form of ``next_experiment`` names the manoeuvre, its confidence and a sentence."""
    answer = json.loads(json.dumps(plan.to_dict()))
    assert answer["manoeuvre"] == plan.best.manoeuvre.name
    assert answer["effects"] == ["accelerometer_scale", "accelerometer_bias"]
    assert "Hover would not" in answer["sentence"]
    assert len(answer["ranked"]) == len(plan.ranked)


def test_the_independent_flight_separates(hovering: Path, plan: Plan, tmp_path: Path) -> None:
    """Flown by another simulator with the true effect, the proposal gets it named alone."""
    truth = yaml.safe_load((hovering / "truth.yaml").read_text(encoding="utf-8"))
    log = flown(tmp_path, hovering, plan, plan.best.manoeuvre, seed=1)
    found = diagnose(read_native(log))
    assert separated(found, truth["effects"][0]["name"], truth["twins"])
