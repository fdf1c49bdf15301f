"""What a run was told in vain is said, and experiments refuse in words."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from seals.api import make
from seals.cli.main import main
from seals.errors import ConfigError
from seals.experiments.command import ended
from seals.run.build import run_settings
from seals.run.settings_remarks import find_conflicts, find_left_out, find_unused


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["robot=aam", "controller=cascade"], ["The controller is idle"]),
        (["robot=aam", "controller=cascade", "guide=hover"], []),
        (["robot=aam"], []),
        (["robot=auv", "guide=hover"], ["controller=station requires a robot supported by water"]),
        (["robot=auv", "guide=hover", "water=fossen"], []),
        (["robot=crab"], ["The legs of crab are idle"]),
        (["robot=crab", "guide=march", "guide.speed=0"], []),
        (["robot=ball", "wave=airy"], ["The wave has no effect"]),
        (["robot=ball", "wave=airy", "water=fossen"], []),
        (["robot=ball", "wave=airy", "environment.water_level=0"], []),
        (["robot=ball"], []),
    ],
)
def test_what_has_no_effect_is_said(words: list[str], said: list[str]) -> None:
    """A controller without a guide and a wave without water; nothing else."""
    found = find_unused(run_settings(words), words)
    assert [remark.split(":")[0].split(", but")[0] for remark in found] == said
    assert all(len(remark.splitlines()) == 2 for remark in found)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["robot=crazyflie"], []),
        (["robot=crazyflie", "water=fossen"], ["The rotors have the same thrust"]),
        (["robot=crazyflie", "water=fossen", "+effect@effects.m=rotor_medium"], []),
        (["robot=auv", "water=fossen"], []),
        (
            ["robot=auv", "water=fossen", "~effects.thruster_medium"],
            ["The thrusters have the same force"],
        ),
        (["robot=aam", "water=fossen"], []),
        (["robot=aam", "water=fossen", "wave=airy"], ["Waves radiated by the robot"]),
        (["robot=aam", "+effect@effects.breeze=wind"], []),
        (
            ["robot=aam", "+effect@effects.breeze=wind", "~effects.air_drag"],
            ["The wind has no effect"],
        ),
        (["robot=ball", "water=fossen", "~effects.water_drag"], ["The water does not slow"]),
    ],
)
def test_what_the_robot_does_not_feel_is_said(words: list[str], said: list[str]) -> None:
    """Air, water and waves that act on nothing of the robot, each with what to add."""
    found = find_left_out(run_settings(words))
    assert [remark[: len(start)] for remark, start in zip(found, said, strict=True)] == said
    assert all(len(remark.splitlines()) == 2 for remark in found)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["wave=airy"], []),
        (["wave=airy", "environment.gravity=1.62"], ["wave.gravity=1.62"]),
        (["wave=airy", "wave.amplitude=0.02", "environment.gravity=1.62", "wave.gravity=1.62"], []),
        (["wave=airy", "wave.period=2", "environment.tank_bottom=-4"], []),
        (["wave=airy", "wave.period=4", "environment.tank_bottom=-4"], ["wave=sea wave.depth=4"]),
        (["wave=sea", "wave.period=4", "environment.tank_bottom=-4"], ["wave=sea wave.depth=4"]),
        (["wave=sea", "wave.depth=4", "environment.tank_bottom=-4"], []),
        (["wave=sea", "wave.depth=5", "environment.tank_bottom=-4"], ["wave.depth=4"]),
        (
            ["+effect@effects.cushion=ground_effect", "environment.ground_level=5"],
            ["effects.cushion.ground_level=5"],
        ),
        (
            [
                "+effect@effects.cushion=ground_effect",
                "environment.ground_level=5",
                "effects.cushion.ground_level=5",
            ],
            [],
        ),
    ],
)
def test_what_is_told_twice_and_differently_is_said(words: list[str], said: list[str]) -> None:
    """Gravity, levels and depth of the water stand in two places; what to write follows."""
    found = find_conflicts(run_settings(["robot=ball", "water=fossen", *words]))
    assert [remark.splitlines()[1].split(", ")[0] for remark in found] == [
        f"Use {words}" for words in said
    ]


def test_an_experiment_refuses_in_two_lines(capsys: pytest.CaptureFixture[str]) -> None:
    """A refusal ends an experiment with exit code 2 and no traceback."""

    def refused(arguments: Sequence[str] | None) -> int:
        assert arguments is None
        raise ConfigError("guide.frquency is wrong.\nDid you mean 'frequency'?")

    assert ended(refused) == 2
    expected = "ConfigError: guide.frquency is wrong.\nDid you mean 'frequency'?\n"
    assert capsys.readouterr().err == expected


def test_an_experiment_that_is_told_to_end_cleans_up(capsys: pytest.CaptureFixture[str]) -> None:
    """SIGTERM ends it as Ctrl-C does: what it began is ended by those who began it."""
    cleaned = []

    def ordered(_: Sequence[str] | None) -> int:
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(5.0)
        finally:
            cleaned.append(True)
        return 0

    assert (ended(ordered), cleaned) == (130, [True])
    assert capsys.readouterr().err == "Interrupted.\n"


def test_multirun_may_stand_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The flag between two overrides runs every value all the same."""
    monkeypatch.chdir(tmp_path)
    line = ["run", "robot=ball", "--multirun", "initial.position=[0,0,1],[0,0,2]"]
    assert main([*line, "time.duration=0.02"]) == 0
    assert len(list(tmp_path.rglob("report.html"))) == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("robot=aam", "guide=grasp"), "needs the sensor 'locator'"),
        (("robot=ball", "guide=hover", "controller=cascade"), "has no rotors and no thrusters"),
        (("robot=auv", "guide=hover", "initial.drives=carrying"), "a robot with rotors"),
    ],
)
def test_what_cannot_fly_is_refused(words: tuple[str, ...], said: str) -> None:
    """A guide without its sensors, a controller without drives, thrusters asked to carry."""
    with pytest.raises(ConfigError, match=said):
        make(list(words))


def test_a_refused_sweep_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether composing or building refuses, nothing stays behind."""
    monkeypatch.chdir(tmp_path)
    for words in (["robot=bal,box"], ["robot=ball", "time.duration=-1,-2"]):
        assert main(["run", "--multirun", *words]) == 2
        assert list(tmp_path.iterdir()) == []
