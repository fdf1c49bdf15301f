"""Plans by command and of a single effect; wrong questions are refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals.cli.main import main
from seals.logs.native import read_native
from seals.sysid.diagnosis import diagnose
from seals.sysid.experiment_design.ranking import propose
from seals.sysid.predictors.problem import prepare


@pytest.mark.thorough
def test_a_single_effect_gets_the_liveliest_manoeuvre(hovering: Path) -> None:
    """Drag needs motion: hovering has no chance to show it."""
    found = propose(prepare(read_native(hovering)), ["rotor_drag"])
    assert found.best.separation > 20.0 * max(found.plain.separation, 0.1)
    assert found.best.manoeuvre.name != "hover"


@pytest.mark.thorough
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
