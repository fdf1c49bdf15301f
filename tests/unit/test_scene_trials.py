"""Trials of an experiment: the table goes on where it was cut off."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.environment.ground import ground_height
from seals.experiments import grasp_lift, sea_air_land
from seals.experiments.frames import View, draw_frames
from seals.experiments.trials import Outcome, read_rows, run_trials, summary
from seals.run.build import run_settings
from seals.run.simulation import simulate


def test_a_table_is_taken_up_again(tmp_path: Path) -> None:
    """Seeds in the table are not run again, unless their overrides have changed."""
    ran: list[str] = []

    def one(words: list[str]) -> Outcome:
        ran.append(words[0])
        if len(ran) == 3:
            raise KeyboardInterrupt
        return Outcome(success=True, measures={"height_m": 1.0})

    def words(seed: int) -> list[str]:
        return [f"seed={seed}"]

    path = tmp_path / "trials.csv"
    with pytest.raises(KeyboardInterrupt):
        run_trials(path, range(4), words, one)
    assert [row["seed"] for row in read_rows(path)] == ["0", "1"]
    rows = run_trials(path, range(4), words, one)
    assert ran == ["seed=0", "seed=1", "seed=2", "seed=2", "seed=3"]
    assert summary(rows) == "4 of 4 succeeded"
    run_trials(path, [0], lambda seed: [f"seed={seed}", "more"], one)
    assert ran[-1] == "seed=0"
    assert len(ran) == 6


def test_a_failure_is_counted_and_keeps_its_reason(tmp_path: Path) -> None:
    """The table says why a run failed."""
    path = tmp_path / "trials.csv"
    rows = run_trials(
        path, [7], lambda seed: [], lambda words: Outcome(success=False, reason="a, b")
    )
    assert summary(rows) == "0 of 1 succeeded"
    assert read_rows(path)[0]["reason"] == "a, b"


@pytest.mark.parametrize("module", [grasp_lift, sea_air_land])
def test_seeds_differ_and_compose(module: object) -> None:
    """Every seed gives another start and object; the experiment composes with them."""
    name = module.__name__.rpartition(".")[2]
    texts = {tuple(module.vary(seed)) for seed in range(5)}
    assert len(texts) == 5
    run = run_settings([f"experiment={name}", *module.vary(3)])
    assert run.objects["cube"].robot == "cube"


def test_the_robot_starts_standing_on_the_beach() -> None:
    """Every seed of the beach puts the body at its standing height above the slope, in the dry."""
    run = run_settings(["experiment=sea_air_land"])
    for seed in range(20):
        x, y, z = yaml.safe_load(sea_air_land.vary(seed)[0].partition("=")[2])
        foot = sea_air_land.STAND * np.array([-np.sin(0.2), 0.0, np.cos(0.2)])
        below = ground_height(run.environment, x - foot[0], y)
        assert below is not None
        assert below > 0.05
        assert z - foot[2] == pytest.approx(below, abs=1e-3)


def test_pictures_show_the_robot_and_its_object() -> None:
    """A frame of a run holds more than sky and sand, and two instants differ."""
    run = run_settings(
        [
            "robot=ball",
            "environment.ground_level=0",
            "initial.position=[0,0,0.5]",
            "+objects.cube={robot: cube, position: [0.2, 0, 0.3]}",
            "time.duration=0.2",
        ]
    )
    log = simulate(run).log
    first, second = draw_frames(log, run, [0.0, 0.2], View(size=(120, 90), distance=1.0))
    assert first.shape == (90, 120, 3)
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 20
    assert np.abs(first.astype(int) - second.astype(int)).max() > 30


@pytest.mark.slow
@pytest.mark.parametrize("module", [grasp_lift, sea_air_land])
def test_the_experiments_succeed(module: object) -> None:
    """The scripted policy fetches the cube."""
    name = module.__name__.rpartition(".")[2]
    outcome = module.judge(simulate(run_settings([f"experiment={name}", *module.vary(0)])))
    assert outcome.success, outcome.reason
