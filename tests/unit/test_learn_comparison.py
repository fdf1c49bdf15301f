"""Arms from raw tables: what is read, what is claimed, what is refused."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import ConfigError, LogError, SealsError
from seals.learn.comparison.application import compare
from seals.learn.comparison.page import AnalysisPlan, claims
from seals.learn.comparison.runs import Run, find_arms, read_run, read_table
from seals.learn.statistics.interval import wilson

STEPS = np.arange(0, 1001, 100)


def lay(folder: Path, successes: Sequence[float], *, seed: int, pace: float = 1.0) -> Path:
    """Write the table of a run as training does."""
    folder.mkdir(parents=True)
    lines = ["step,seconds,updates,episodes,success,return"]
    rows = zip(STEPS, successes, strict=False)
    lines += [f"{step},{pace * step},{step // 2},20,{value},{-step}" for step, value in rows]
    (folder / "evaluation.csv").write_text("\n".join(lines) + "\n")
    (folder / "run.json").write_text(json.dumps({"seed": seed, "state": "done"}))
    return folder


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Six seeds of a slow arm and of a fast one that end at the same height."""
    for seed in range(6):
        slow = np.clip(STEPS / 1000, 0, 1) * (0.9 + 0.01 * seed)
        fast = np.clip(STEPS / (250 + 20 * seed), 0, 1) * (0.90 - 0.01 * seed)
        lay(tmp_path / "study" / "slow" / str(seed), slow, seed=seed)
        lay(tmp_path / "study" / "fast" / str(seed), fast, seed=seed, pace=2.0)
    return tmp_path / "study"


def runs(study: Path) -> dict[str, list[Run]]:
    """The arms of a study, read."""
    found = find_arms({}, str(study))
    return {name: [read_run(place, arm=name) for place in places] for name, places in found.items()}


def test_scores_are_those_of_the_curves(study: Path) -> None:
    """Area and end of every run equal the closed forms of the lines that were written."""
    found = compare(runs(study), AnalysisPlan(reference="slow"))
    fast, slow = found.arms
    assert (fast.name, slow.name, found.terms.budget) == ("fast", "slow", 1000.0)
    heights = 0.9 + 0.01 * np.arange(6)
    np.testing.assert_allclose(slow.scores["area"], 0.5 * heights, rtol=1e-12)
    np.testing.assert_allclose(slow.scores["last"], 0.95 * heights, rtol=1e-12)
    # of six runs the interquartile mean leaves out one at either end
    assert slow.middle["area"].value == pytest.approx(0.5 * heights[1:-1].mean())
    assert slow.band.line[-1] == pytest.approx(heights[1:-1].mean())
    assert slow.clock is not None
    assert fast.clock is not None
    assert (slow.clock.x[-1], fast.clock.x[-1]) == (1000.0, 2000.0)


def test_only_what_the_interval_shows_is_claimed(study: Path) -> None:
    """Every fast run rises faster: claimed. The ends overlap: not claimed."""
    found = compare(runs(study), AnalysisPlan(reference="slow"))
    area, last = found.duels
    assert (area.verdict, area.improvement.value) == ("better", 1.0)
    # two deals of the 924 in which six runs of twelve can lie apart
    assert area.p == pytest.approx(2 / 924)
    assert area.pairs == wilson(6, 6)
    assert last.verdict == "open"
    assert last.improvement.low < 0.5 < last.improvement.high
    words = claims(found)
    assert words[0].startswith("fast learns faster than slow")
    other = compare(runs(study), AnalysisPlan(reference="fast"))
    assert claims(other)[0].startswith("slow learns more slowly than fast")
    same = {name: every for name, every in runs(study).items() if name == "slow"}
    twin = compare({**same, "again": same["slow"]}, AnalysisPlan())
    assert [duel.verdict for duel in twin.duels] == ["open", "open"]
    assert all("no difference is shown" in text for text in claims(twin))


def test_unequal_effort_is_told(study: Path) -> None:
    """Updates, early stops, unfinished and few runs stand beside the table."""
    arms = runs(study)
    for run in arms["fast"]:
        run.columns["updates"][:] *= 3  # type: ignore[index]
    short = lay(study.parent / "early", np.linspace(0, 0.9, 6), seed=9)
    (short / "run.json").write_text(json.dumps({"seed": 9, "state": "running"}))
    arms["slow"] = [*arms["slow"][:3], read_run(short, arm="slow")]
    with pytest.raises(SealsError, match=r"slow, seed 9: a curve ends at 500"):
        compare(arms, AnalysisPlan(budget=1000))
    found = compare(arms, AnalysisPlan(budget=1000, hold=True))
    told = " ".join(found.remarks)
    assert "Gradient updates differ: fast 1500, slow 438" in told
    assert "slow: 4 runs" in told
    assert "slow: 1 runs stopped early and keep their last value" in told
    assert "Not finished: slow, seed 9" in told
    # without a budget the shortest run sets it, and the rest is left out aloud
    cut = compare(arms, AnalysisPlan())
    assert cut.terms.budget == 500
    assert "fast: 6 runs continued" in " ".join(cut.remarks)


def test_the_command_writes_numbers_page_and_picture(
    study: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Folders by arm, terms by key; out=FOLDER leaves no other folder behind."""
    monkeypatch.chdir(study.parent)
    words = ["evaluate", "--compare", "slow=study/slow/*", "fast='study/fast/[0-4]'"]
    assert main([*words, "out=result", "budget=800", "resamples=500"]) == 0
    told = capsys.readouterr().out
    assert "fast learns faster than slow" in told
    kept = json.loads((study.parent / "result" / "comparison.json").read_text())
    assert kept["terms"]["budget"] == 800
    assert len(kept["arms"]["fast"]["runs"]) == 5
    assert kept["arms"]["slow"]["curves"]["over_budget"]["x"][-1] == 800
    assert {duel["against"] for duel in kept["duels"]} == {"slow"}
    # six runs against five make no pairs
    assert kept["duels"][0]["pairs"] is None
    assert (study.parent / "result" / "comparison.png").read_bytes()[:4] == b"\x89PNG"
    page = (study.parent / "result" / "comparison.html").read_text()
    assert "fast learns faster than slow" in page
    assert not (study.parent / "runs").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "nothing to compare"),
        (["nowhere"], "there is no such folder"),
        (["study=nowhere"], "there is no such folder"),
        (["sac='nowhere/*'"], "arm 'sac': no folder"),
        (["study", "reference=slw"], "Did you mean 'slow'"),
        (["study", "value=succes"], "Did you mean 'success'"),
        (["study", "level=95"], "0.999"),
        (["study", "budget=5000"], "ends at 1000, and the budget is 5000"),
    ],
)
def test_mistyped_comparisons_are_refused(
    study: Path,
    words: list[str],
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two lines say what and what to write instead; no folder is left behind."""
    monkeypatch.chdir(study.parent)
    assert main(["evaluate", "--compare", *words]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.splitlines()) == 2
    assert not (study.parent / "runs").exists()


def test_two_runs_of_one_seed_are_refused(study: Path) -> None:
    """They are no two runs."""
    arms = runs(study)
    arms["slow"].append(arms["slow"][0])
    with pytest.raises(ConfigError, match="seed 0 more than once"):
        compare(arms, AnalysisPlan())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p.unlink(), "is missing"),
        (lambda p: p.write_text("step,success\n"), "holds 0 rows"),
        (lambda p: p.write_text("step,step\n1,2\n"), "different names"),
        (lambda p: p.write_text("step,success\n1,2,3\n"), "line 2 has 3 cells"),
        (lambda p: p.write_text("step,success\n1,high\n"), "column 'success'"),
    ],
)
def test_broken_tables_are_refused(
    study: Path, change: Callable[[Path], object], words: str
) -> None:
    """Each fault is named with its place."""
    path = study / "slow" / "0" / "evaluation.csv"
    change(path)
    with pytest.raises(LogError, match=words):
        read_run(path.parent, arm="slow")


def test_half_a_line_of_a_killed_run_is_left_out(study: Path) -> None:
    """What was written whole counts; what was cut off does not."""
    path = study / "slow" / "0" / "evaluation.csv"
    whole = read_table(path)
    path.write_text(path.read_text() + "1100,1100,55")
    assert read_table(path)["step"].tolist() == whole["step"].tolist()


def test_runs_are_sorted_by_number(study: Path) -> None:
    """Run 2 comes before run 10."""
    lay(study / "slow" / "10", STEPS / 1000, seed=10)
    assert [run.seed for run in runs(study)["slow"]] == [0, 1, 2, 3, 4, 5, 10]


@pytest.mark.slow
def test_a_study_holds_learners_and_ablations_against_their_references(tmp_path: Path) -> None:
    """Two comparisons lie beside it: with SAC, and with SACfD; arms that are not there are not."""
    from seals.experiments.learning_study import main
    from seals.experiments.learning_study.arms import ARMS, COMPARISONS
    from seals.experiments.learning_study.looks import keep, restore
    from seals.experiments.learning_study.running import compare as compare_study
    from seals.logs.atomic import write_table

    assert {arm for arms in COMPARISONS.values() for arm in arms} == set(ARMS)
    out = tmp_path / "study"
    for arm, height in (("rlpd", 0.9), ("sac", 0.6), ("sacfd", 0.8), ("sacfd_shuffled", 0.5)):
        for seed in range(4):
            lay(out / arm / str(seed), np.clip(STEPS / 900, 0, height), seed=seed)
    assert compare_study(out) == 0
    for name, reference, arms in (
        ("learners", "sac", {"sac", "sacfd", "rlpd"}),
        ("ablations", "sacfd", {"sacfd", "sacfd_shuffled"}),
    ):
        told = json.loads((tmp_path / f"study_{name}" / "comparison.json").read_text())
        assert told["terms"]["reference"] == reference
        assert set(told["arms"]) == arms

    # the table of all looks alone tells the same again
    again = restore(keep(out), tmp_path / "again" / "study")
    assert main(["--looks", str(tmp_path / "study_looks.parquet"), "--out", str(again)]) == 0
    for name in ("learners", "ablations"):
        told, same = (
            (folder.parent / f"study_{name}" / "comparison.json").read_text()
            for folder in (out, again)
        )
        # but for where the runs lie
        arms = json.loads(same.replace(str(again), str(out)))["arms"]
        assert arms == json.loads(told)["arms"]
    write_table(tmp_path / "other.parquet", {"step": np.arange(3.0)})
    with pytest.raises(LogError, match="holds no arms"):
        restore(tmp_path / "other.parquet", tmp_path / "other")
