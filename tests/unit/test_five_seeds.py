"""One recipe with several seeds: what is told of them, and that every recipe is one."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hydra.utils import get_class

from seals.config.compose import compose
from seals.errors import ConfigError, SealsError
from seals.experiments import five_seeds
from seals.experiments.five_seeds import episode_tables
from seals.experiments.five_seeds.episode_tables import gather, shipped
from seals.experiments.five_seeds.outcome import table_of, write_curves
from seals.experiments.five_seeds.recipes import RECIPES, Recipe
from seals.experiments.five_seeds.shipping import ship
from seals.experiments.learning_study.arms import Training
from seals.learn.evaluation.page import EvaluationResult, write_results
from seals.plugins.learners.dagger import Dagger

PAGES = (
    "learning_walk.md",
    "learning_tasks.md",
    "learning_sight.md",
    "learning_results.md",
    "learning_manipulation.md",
)
"""Pages with tables of what was learned."""


def _judged(policy: str, successes: int, after: float) -> EvaluationResult:
    """Ten episodes, of which some succeeded, each after an equal time."""
    good = np.arange(10) < successes
    columns = {
        "seed": np.arange(10.0),
        "success": good.astype(float),
        "return": np.ones(10),
        "reached_after": np.where(good, after, np.nan),
        "cost_of_transport": np.where(good, 0.9, np.nan),
    }
    return EvaluationResult(policy=policy, world="", columns=columns)


@pytest.fixture
def folders(tmp_path: Path) -> list[Path]:
    """Two trainings: 9 of 10 and 8 of 10, with the scripted and a random policy beside them."""
    made = []
    for seed, successes in enumerate((9, 8)):
        folder = tmp_path / str(seed)
        beside = [_judged("scripted", 10, 2.4), _judged("random", 0, 0.0)] if seed == 0 else []
        judged = [_judged(str(folder / "policy"), successes, 2.0), *beside]
        write_results(judged, folder / "held_out", facts={"env": "crab_walk"})
        rows = ["step,seconds,success,return", "0,1.0,0.0,-1.0", f"800,60.0,0.9,{10.0 + seed}"]
        (folder / "evaluation.csv").write_text("\n".join(rows) + "\n")
        made.append(folder)
    return made


def test_seeds_are_counted_against_what_is_asked(folders: list[Path], tmp_path: Path) -> None:
    """Times and costs are of those that arrived; nine of ten are enough for 90 %."""
    write_results([_judged("p", 4, 3.0)], folders[1] / "MuJoCo", facts={"env": "crab_walk"})
    tables = gather(folders, ["MuJoCo"])
    said = table_of(tables, ["MuJoCo"], enough=0.9).splitlines()
    assert said[0].split(" | ")[1:4] == [
        "success (95 %)", "time to target, median [s]", "cost of transport, median"
    ]  # fmt: skip
    # bounds of Wilson's interval by hand
    assert said[2] == "| seed 0 | 9 of 10 (60 to 98 %) | 2.00 | 0.90 |  |  |  | 60 |"
    assert said[3].startswith(
        "| seed 1 | 8 of 10 (49 to 94 %) | 2.00 | 0.90 | 4 of 10 (17 to 69 %) |"
    )
    assert [line.split(" | ")[0] for line in said[4:6]] == ["| scripted", "| random"]
    asked, over = said[-1].split(" Over seeds: ")
    assert asked == "1 of 2 seeds reach 90% of their held-out starts."
    # two seeds are drawn alike, or both
    assert over == "85% (80% to 90%)."
    assert write_curves(tables, tmp_path / "seeds.png").stat().st_size > 0


def test_the_files_alone_tell_the_same_again(
    folders: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Written and read back; a recipe without files is refused in words."""
    tables = gather(folders, [])
    monkeypatch.setattr(episode_tables, "files", lambda _: tmp_path)
    (tmp_path / "tables").mkdir()
    tables.write(tmp_path / "tables", "crab_walk")
    again = shipped("crab_walk")
    assert table_of(again, [], enough=0.9) == table_of(tables, [], enough=0.9)
    assert np.array_equal(again.episodes["start"], tables.episodes["start"])
    with pytest.raises(SealsError, match="Those that do: crab_walk"):
        five_seeds.main(["catch", "--table"])
    with pytest.raises(SealsError, match="nothing was judged"):
        gather([tmp_path / "7"], [])


SHIPPED = sorted(
    p.stem
    for p in (Path(five_seeds.__file__).parent / "tables").glob("*.parquet")
    if not p.stem.endswith("_looks")
)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_page_has_the_table_of_the_episodes_that_come_along(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Line by line; every seed of a recipe has a hundred starts."""
    docs = Path(__file__).parents[2] / "docs"
    pages = "".join((docs / page).read_text(encoding="utf-8") for page in PAGES).splitlines()
    assert five_seeds.main([name, "--table"]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    assert len(told) > 2
    assert set(told) <= set(pages)
    tables = shipped(name)
    counts = np.unique(tables.episodes["policy"], return_counts=True)[1]
    assert set(counts % 100) == {0}


def test_the_best_on_validation_starts_is_shipped(folders: list[Path], tmp_path: Path) -> None:
    """Not the one that held-out starts favour; its card has command, curve and judgement."""
    for seed, folder in enumerate(folders):
        (folder / "policy").mkdir()
        card = {"format": "seals-policy", "version": 1, "seed": seed, "network": {}}
        (folder / "policy" / "card.json").write_text(json.dumps(card))
        (folder / "policy" / "policy.safetensors").write_bytes(bytes([seed]))
    target = ship(folders, tmp_path / "policies" / "walk", command="python -m it")
    card = json.loads((target / "card.json").read_text())
    assert card["seed"] == 1
    assert (target / "policy.safetensors").read_bytes() == b"\1"
    assert card["command"] == "python -m it"
    assert [look["step"] for look in card["curve"]] == [0.0, 800.0]
    assert card["held_out"]["success"] == 0.8
    assert card["held_out"]["medians"]["reached_after"] == 2.0
    (folders[0] / "evaluation.csv").unlink()
    with pytest.raises(ConfigError, match="is missing"):
        ship(folders, target, command="python -m it")


@pytest.mark.thorough
@pytest.mark.parametrize("name", RECIPES)
def test_every_recipe_is_a_training(name: str) -> None:
    """Its words compose, and demonstrations are recorded for a learner that takes them."""
    recipe = RECIPES[name]
    config = compose([*recipe.world, *recipe.lessons, *recipe.training], root="train")
    assert config.task.rate > 0.0
    # behaviour cloning has no choice: it wants them always; one that asks the script never does
    asks = issubclass(get_class(config.learner["_target_"]), Dagger)
    takes = config.learner.get("demonstrations", "none" if asks else "buffer") == "buffer"
    assert (recipe.shown > 0) == takes


@pytest.mark.slow
def test_the_paper_s_own_arm_learns_for_a_moment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Recorded, pretrained by the table of its appendix, trained and judged: but for shorter."""
    pytest.importorskip("torchrl", reason="the extra learn is not installed")
    plain = five_seeds.judgements

    def judgements(*given: Any) -> list[Training]:
        fewer = {"episodes=100": "episodes=2"}
        jobs = plain(*given)
        return [Training(j.folder, tuple(fewer.get(w, w) for w in j.words)) for j in jobs]

    monkeypatch.setattr(five_seeds, "judgements", judgements)
    monkeypatch.setitem(RECIPES, "reach_paper", RECIPES["reach_paper"]._replace(shown=2))
    short = ("learner.pretrain=5", "learner.random_steps=40", "learner.batch=64", "count=4")
    course = ("course.steps=120", "course.look_every=80", "course.episodes=2")
    out = tmp_path / "paper"
    words = ["reach_paper", "--seeds", "1", "--out", str(out), *short, *course]
    assert five_seeds.main(words) == 0
    assert "of 1 seeds reach 95% of their held-out starts" in capsys.readouterr().out
    facts = json.loads((out / "0" / "run.json").read_text())
    # two updates a step after the random ones, besides the pretraining
    assert (facts["state"], facts["step"], facts["updates"]) == ("done", 120, 5 + 2 * (120 - 40))
    card = json.loads((out / "demonstrations" / "card.json").read_text())
    assert (card["who"], card["human"], card["by"]) == ("scripted", False, "scripted")
    with (out / "0" / "held_out" / "episodes.csv").open(newline="") as file:
        assert [row["policy"] for row in csv.DictReader(file)][2:] == ["scripted"] * 2 + [
            "random"
        ] * 2


def test_rounds_of_labels_build_on_one_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each round trains on all that is there and adds what the expert says; none is done twice."""
    said: list[tuple[str, ...]] = []

    def run(*words: str) -> None:
        said.append(words)
        out = next((word for word in words if word.startswith("out=")), None)
        if out is not None:
            Path(out.removeprefix("out=")).mkdir()

    monkeypatch.setattr(five_seeds, "run_verb", run)
    recipe = Recipe(("env=catch",), ("learner=bc",), shown=6, rounds=2, labelled=3)
    last = f"demonstrations={tmp_path / 'demonstrations_2'}"
    assert five_seeds.demonstrated(tmp_path, recipe, ["task.duration=4"]) == (last,)
    assert [words[0] for words in said] == ["record", "train", "record", "train", "record"]
    assert all({"env=catch", "task.duration=4"} <= set(words) for words in said)
    first, second = said[2], said[4]
    assert {"labels=scripted", f"policy={tmp_path / 'round_1' / 'policy'}"} <= set(first)
    assert f"after={tmp_path / 'demonstrations'}" in first
    assert f"demonstrations={tmp_path / 'demonstrations_1'}" in said[3]
    assert f"after={tmp_path / 'demonstrations_1'}" in second
    starts = [word for words in (first, second) for word in words if word.startswith("first=")]
    assert len(set(starts)) == 2
    said.clear()
    assert five_seeds.demonstrated(tmp_path, recipe, ["task.duration=4"]) == (last,)
    assert not said
