"""A short form of the soak: random commands in waves, across the surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.experiments import soak
from seals.experiments.soak import running
from seals.experiments.soak.flight import OVERRIDES, Wish
from seals.experiments.soak.running import read_rows, soaked
from seals.robot.build import build_robot
from seals.run.build import run_settings


@pytest.mark.thorough
@pytest.mark.parametrize("steps", [2000, pytest.param(5000, marks=pytest.mark.slow)])
def test_thousands_of_steps_break_nothing(tmp_path: Path, steps: int) -> None:
    """The energy balance closes within 1 %, every state is finite, memory does not grow."""
    out = tmp_path / "soak"
    assert soak.main(["--steps", str(steps), "--out", str(out)]) == 0
    rows = read_rows(out / "soak.csv")
    assert [row["step"] for row in rows] == list(range(1000, steps + 1, 1000))
    found = soak.figures(rows)
    # a robot that hung in the air would close its books as well
    assert found["crossings of the surface"] >= 2.0
    assert found["energy moved [kJ]"] > 0.3
    assert abs(found["gap of the energy balance, by the energy moved [%]"]) < 0.1
    assert (out / "figure.png").stat().st_size > 1000
    assert f"| steps | {steps} |" in (out / "table.md").read_text(encoding="utf-8")


@pytest.mark.thorough
def test_a_soak_goes_on_where_it_was_cut_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A soak in two pieces, from the checkpoint of the first, is the soak in one."""
    settings = [*OVERRIDES, "seed=5"]
    monkeypatch.setattr(running, "EVERY", 200)
    monkeypatch.setattr(running, "MINUTE", 0.0)
    whole = soaked(tmp_path / "whole", run_settings(settings), 600)
    soaked(tmp_path / "cut", run_settings(settings), 400)
    rows = soaked(tmp_path / "cut", run_settings(settings), 600)
    assert [row["process"] for row in rows] == [1.0, 1.0, 2.0]
    for key in ("step", "time_s", "height_m", "crossings", "gap_J", "moved_J"):
        assert [row[key] for row in rows] == [row[key] for row in whole], key


def test_a_soak_goes_on_by_its_own_words_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Others are refused before the table is touched; killed between two renames it goes on."""
    monkeypatch.setattr(running, "EVERY", 50)
    monkeypatch.setattr(running, "MINUTE", 0.0)
    settings, words = run_settings([*OVERRIDES, "seed=5"]), ["seed=5"]
    soaked(tmp_path, settings, 100, words)
    before = (tmp_path / "soak.csv").read_bytes()
    other = run_settings([*OVERRIDES, "seed=6"])
    with pytest.raises(ConfigError, match="began with: seed=5"):
        soaked(tmp_path, other, 150, ["seed=6"])
    assert (tmp_path / "soak.csv").read_bytes() == before
    (tmp_path / "checkpoint").rename(tmp_path / ".checkpoint.before")
    rows = soaked(tmp_path, settings, 150, words)
    assert [row["process"] for row in rows] == [1.0, 1.0, 2.0]


def test_a_leak_and_a_gap_are_found() -> None:
    """Memory that grows by 3 %, a gap of 2 % and a state that is not a number break the bounds."""
    good = {"process": 1.0, "finite": 1.0, "time_s": 0.0, "crossings": 0.0, "wall_s": 0.0}
    rows = [
        {**good, "step": step, "rss_MB": 100.0, "gap_J": 0.0, "moved_J": 1.0 + step}
        for step in (1000.0, 30_000.0, 60_000.0)
    ]
    assert soak.kept(soak.figures(rows))
    for change in ({"rss_MB": 103.0}, {"gap_J": 1300.0}, {"finite": 0.0}):
        assert not soak.kept(soak.figures([*rows[:2], {**rows[2], **change}]))


def test_commands_are_the_same_for_the_same_seed() -> None:
    """A stretch's command depends on seed and number alone, and stays within the joints' range."""
    robot = build_robot(run_settings(list(OVERRIDES)).robot)
    one, again, other = Wish.drawn(robot, 3, 7), Wish.drawn(robot, 3, 7), Wish.drawn(robot, 3, 8)
    assert np.array_equal(one.place, again.place)
    assert not np.array_equal(one.place, other.place)
    for name, values in one.joints.items():
        columns = list(robot.arms[name].joints)
        assert np.all(values > robot.lower[columns])
        assert np.all(values < robot.upper[columns])
