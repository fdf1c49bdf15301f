"""Wanted against achieved in the report of a run, and the goals that it missed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals import load_log
from seals.cli.main import main
from seals.config.compose import compose
from seals.control.protocols import Goal
from seals.errors import ConfigError
from seals.report.figures import ROUNDING
from seals.run.goals import reference_charts, result_of

TIME = np.arange(5.0)
PLACE = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0.3], [3.0, 0, 0], [3.02, 0, 0]])


def test_a_place_to_pass_is_judged_where_it_was_nearest() -> None:
    """The smallest distance and its time decide, within the tolerance."""
    near = result_of(Goal("a", np.array([2.0, 0.0, 0.0]), 0.5), TIME, PLACE)
    assert (near.reached, near.distance, near.time) == (True, pytest.approx(0.3), 2.0)
    far = result_of(Goal("a", np.array([2.0, 0.0, 0.0]), 0.2), TIME, PLACE)
    assert str(far) == "a: missed, 0.3 m away at 2 s"


def test_a_place_to_hold_is_judged_at_the_end() -> None:
    """Passing is not enough, and the time says since when it was held."""
    held = result_of(Goal("a", np.array([3.0, 0.0, 0.0]), 0.05, held=True), TIME, PLACE)
    assert (held.reached, held.time) == (True, 3.0)
    passed = result_of(Goal("a", np.array([1.0, 0.0, 0.0]), 0.05, held=True), TIME, PLACE)
    assert not passed.reached
    assert np.isnan(passed.time)


def test_rows_without_a_position_do_not_count() -> None:
    """A slow sensor of position leaves rows empty."""
    place = PLACE.copy()
    place[2:] = np.nan
    found = result_of(Goal("a", np.array([1.0, 0.0, 0.0]), held=True), TIME, place)
    assert (found.reached, found.time) == (True, 1.0)


def test_a_run_says_which_goals_it_missed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On the console and in the report, beside wanted and achieved velocity and heading."""
    monkeypatch.chdir(tmp_path)
    words = ["robot=auv", "water=fossen", "guide=waypoints", "initial.position=[0,0,-2]"]
    words += ["guide.places=[[0,0,-2.1],[9,0,-2]]", "guide.delay=0", "guide.rest=0.1"]
    assert main(["run", *words, "time.duration=1.5", "time.step=0.008", "hydra.run.dir=r"]) == 0
    said = capsys.readouterr().out
    assert "Goal place 2: missed" in said
    assert "Goal place 1" not in said
    page = (tmp_path / "r" / "report.html").read_text(encoding="utf-8")
    assert "Wanted and achieved" in page
    assert "1 of 2 goals missed: place 2" in page
    assert "Velocity along world z" in page
    assert "Heading" in page


def test_rounding_gets_no_chart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A vehicle that sinks turns and moves aside by rounding errors alone."""
    monkeypatch.chdir(tmp_path)
    words = ["robot=crazyflie", "controller=cascade", "guide=hover", "initial.velocity=[0,0,-1]"]
    assert main(["run", *words, "time.duration=0.2", "hydra.run.dir=r"]) == 0
    charts = reference_charts(load_log(tmp_path / "r"))
    assert "Velocity along world z" in [chart.title for chart in charts]
    for chart in charts:
        span = max(float(np.abs(line.y).max()) for line in chart.series)
        assert span == 0.0 or span > ROUNDING, chart.title


def test_overrides_in_one_text_are_refused() -> None:
    """A text would be taken letter by letter."""
    with pytest.raises(ConfigError, match=r"Write a list: \['robot=ball'\]"):
        compose("robot=ball")
