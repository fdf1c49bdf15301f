"""Plans: the proposed manoeuvre tells effects apart when the independent generator flies it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
import yaml

from seals.cli.main import main
from seals.logs.native import read_native
from seals.sysid.diagnosis import diagnose
from seals.sysid.experiment_design.plan import Plan
from seals.sysid.experiment_design.ranking import propose
from seals.sysid.predictors.problem import Problem, prepare

ROOT = Path(__file__).parents[2]
if str(ROOT) not in sys.path:
    sys.path.append(str(ROOT))

from tests.validation.hidden import generate  # noqa: E402
from tests.validation.replanned import flown, separated  # noqa: E402


@pytest.fixture(scope="module")
def hovering(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A hover whose accelerometer reads too little: bias or scale, a hover cannot tell."""
    folder = tmp_path_factory.mktemp("cases")
    words = ["--level", "confounded", "--vehicle", "quad", "--effect", "accelerometer_scale"]
    generate.main([str(folder), *words, "--count", "1", "--seed", "3", "--no-gain"])
    return next(p for p in sorted(folder.iterdir()) if p.is_dir())


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


def test_a_single_effect_gets_the_liveliest_manoeuvre(problem: Problem) -> None:
    """Drag needs motion: hovering has no chance to show it."""
    found = propose(problem, ["rotor_drag"])
    assert found.best.separation > 20.0 * max(found.plain.separation, 0.1)
    assert found.best.manoeuvre.name != "hover"


def test_the_command_writes_a_plan_that_flies(
    hovering: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Plan, picture and experiment are written; the simulator flies it to a sound log."""
    monkeypatch.chdir(tmp_path)
    names = "effects=[accelerometer_scale,accelerometer_bias]"
    assert main(["plan", names, f"log={hovering}", "out=plan"]) == 0
    assert "expected confidence" in capsys.readouterr().out
    assert (tmp_path / "plan/plan.png").stat().st_size > 10_000
    assert main(["run", "experiment=plan/experiment.yaml", "out=flown"]) == 0
    found = diagnose(read_native(tmp_path / "flown"))
    assert found.answer.verdict.value in ("nothing_missing", "cannot_tell")
    assert found.held_out["before"] == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["effects=[linear_darg]"], "linear_drag"),
        (["effects=[payload,payload]"], "several different ones"),
        ([], "effects=[payload,thrust_coefficient]"),
    ],
)
def test_wrong_questions_are_refused(
    hovering: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Unknown names, repeated names and no names at all: two lines, exit code 2."""
    assert main(["plan", *words, f"log={hovering}"]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 2
    assert said in lines[1]
