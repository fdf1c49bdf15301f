"""Teleoperation: keys, scripts, the guide that follows them, and what a session leaves behind."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml

from seals.cli.main import main
from seals.control import RobotState
from seals.control.key_events import (
    CONTROLS,
    Event,
    held_after,
    read_track,
    stick_of,
    table,
    write_track,
)
from seals.errors import ConfigError, LogError, MissingExtra
from seals.learn.demonstrations.episode import Who
from seals.learn.demonstrations.folder import read
from seals.logs import Log
from seals.logs.native import read_native
from seals.plugins.guides.stick import Stick, StickState
from seals.robot.limbs import Arm, Gripper
from seals.teleop.application import sampled
from seals.teleop.device import Script
from seals.teleop.person import pygame_of, settled

# Keys


def test_every_control_does_something_and_is_explained() -> None:
    """Each control changes the stick or the arm, and stands in the help."""
    words = table()
    for control in CONTROLS:
        assert stick_of({control: 1.0}) != stick_of({}) or control == "tab"
        assert f" {control}" in words


def test_opposite_keys_cancel_and_pads_add_up() -> None:
    """What is held adds up, and no share goes beyond full."""
    assert stick_of({"w": 1.0, "s": 1.0}).forward == 0.0
    assert stick_of({"w": 1.0, "axis_3": -0.5}).forward == 1.0
    assert stick_of({"axis_2": 0.25}).left == -0.25


def test_a_stick_at_rest_is_at_rest() -> None:
    """The dead middle of an axis counts as nothing; its ends are full."""
    assert [settled(x) for x in (0.0, 0.07, -0.07, 1.0, -1.0)] == [0.0, 0.0, 0.0, 1.0, -1.0]


# Scripts


def test_words_of_a_script_become_events(tmp_path: Path) -> None:
    """Hold is press and release; events are sorted by time."""
    path = tmp_path / "keys.yaml"
    entries = [
        {"t": 3, "set": "axis_0", "value": -0.5},
        {"t": 0.5, "hold": "w", "seconds": 2},
        {"t": 1, "press": "q"},
        {"t": 1.5, "release": "q"},
    ]
    path.write_text(yaml.safe_dump(entries), encoding="utf-8")
    assert read_track(path) == [
        Event(0.5, "w", 1.0),
        Event(1.0, "q", 1.0),
        Event(1.5, "q", 0.0),
        Event(2.5, "w", 0.0),
        Event(3.0, "axis_0", -0.5),
    ]


def test_events_survive_their_file_to_the_last_bit(tmp_path: Path) -> None:
    """What is written is what is read, thirds included."""
    events = [Event(1.0 / 3.0, "w", 1.0), Event(0.1 + 0.2, "axis_1", -1.0 / 3.0)]
    write_track(tmp_path / "keys.csv", events)
    assert read_track(tmp_path / "keys.csv") == sorted(events)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", "time,key\n", "first line must be: t,control,value"),
        ("a.csv", "t,control,value\n1,w\n", "line 2 has 2 cells"),
        ("a.csv", "t,control,value\n1,ww,1\n", "line 2: there is no control 'ww'"),
        ("a.csv", "t,control,value\n1,w,2\n", "-1 to 1"),
        ("a.csv", "t,control,value\n-1,w,1\n", "before the start"),
        ("a.csv", "t,control,value\nnan,w,1\n", "a finite number"),
        ("a.yaml", "t: 1", "holds no list"),
        ("a.yaml", "- {hold: w, seconds: 1}", "has no time"),
        ("a.yaml", "- {t: 1, hold: w}", "states no duration"),
        ("a.yaml", "- {t: 1, pres: w}", "Did you mean 'press'"),
        ("a.yaml", "- {t: 1}", "press, release, hold, set"),
        ("a.yaml", "- {t: 1, press: escpe}", "Did you mean 'escape'"),
        ("a.yaml", "- [", "is not valid YAML"),
    ],
)
def test_a_wrong_script_is_refused_in_words(
    tmp_path: Path, name: str, text: str, words: str
) -> None:
    """File, line and remedy are named."""
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"(?s).+\n.+") as refusal:
        read_track(tmp_path / name)
    assert words in str(refusal.value)
    assert name in str(refusal.value)


def test_a_mistyped_script_names_its_neighbour(tmp_path: Path) -> None:
    """A missing file is refused with the nearest one."""
    (tmp_path / "keys.yaml").touch()
    with pytest.raises(ConfigError, match=r"Did you mean '.*keys\.yaml'"):
        read_track(tmp_path / "kyes.yaml")


def test_a_released_control_is_no_longer_held() -> None:
    """Only what is not zero stays in what is held."""
    assert held_after({"w": 1.0, "a": 1.0}, [Event(1.0, "w", 0.0)]) == {"a": 1.0}


# The guide

ROBOT = SimpleNamespace(
    arms={
        "first": Arm(name="first", joints=(0, 1), tool=1, stowed=np.array([0.3, 0.0])),
        "second": Arm(name="second", joints=(2,), tool=2, stowed=np.zeros(1)),
    },
    grippers={
        "hand": Gripper(name="hand", joints=(3,), open=np.zeros(1), closed=np.ones(1), tips=())
    },
    lower=np.array([-1.0, -1.0, -1.0, 0.0]),
    upper=np.array([1.0, 1.0, 1.0, 1.0]),
)


def situation(time: float, position: Any = (0.0, 0.0, 1.0), yaw: float = 0.0) -> RobotState:
    """Return a robot somewhere, level."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    values = dict.fromkeys(RobotState._fields) | {
        "time": time,
        "position": np.array(position, dtype=float),
        "rotation": np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]),
    }
    return RobotState(**values)  # type: ignore[arg-type]


def flown(
    events: list[Event], until: float, *, follows: bool = True, yaw: float = 0.0, **fields: float
) -> tuple[Any, StickState]:
    """Fly events with a robot that is where it shall be, or stays where it is."""
    guide = Stick(**fields)  # type: ignore[arg-type]
    guide.use(Script(events))
    guide.bind(SimpleNamespace(robot=ROBOT))  # type: ignore[arg-type]
    memory = guide.start(situation(0.0, yaw=yaw))
    aim: Any = None
    for k in range(round(until * guide.rate) + 1):
        place = memory.place if follows else (0.0, 0.0, 1.0)
        aim, memory = guide.aim(situation(k / guide.rate, place, yaw), memory)
    return aim, memory


def test_full_stick_is_full_speed_along_the_heading() -> None:
    """Forward means along the heading, and the place moves by speed times time less the ramp."""
    fields = {"speed": 0.6, "agility": 1.5, "position_gain": 0.0}
    aim, memory = flown([Event(0.0, "w", 1.0)], 3.0, yaw=math.pi / 2, **fields)
    assert aim.velocity == pytest.approx([0.0, 0.6, 0.0], abs=1e-12)
    # the ramp of 0.4 s costs half of it
    assert memory.place == pytest.approx([0.0, 0.6 * 2.8, 1.0], abs=1e-9)


def test_the_speed_never_jumps() -> None:
    """Acceleration by the stick stays within the stated agility, and is fed forward."""
    aim, _ = flown([Event(0.0, "w", 1.0)], 0.2, agility=1.0, position_gain=0.0)
    assert aim.acceleration == pytest.approx([1.0, 0.0, 0.0])
    assert aim.velocity[0] == pytest.approx(0.2)


def test_turning_turns_at_its_rate() -> None:
    """One second of full turn is ``turn`` radians, with the rate fed forward."""
    events = [Event(0.0, "q", 1.0)]
    aim, memory = flown(events, 1.0, turn=0.7)
    assert memory.yaw == pytest.approx(0.7)
    assert aim.yaw_rate == pytest.approx(0.7)


def test_the_place_waits_for_a_robot_that_cannot_follow() -> None:
    """The wished-for place runs no farther ahead than the leash."""
    _, memory = flown([Event(0.0, "w", 1.0)], 5.0, follows=False, leash=0.4)
    assert memory.place == pytest.approx([0.4, 0.0, 1.0])


def test_keys_move_the_chosen_arm_within_its_limits() -> None:
    """The first arm at first, the second after tab; joints stop at their limits; x stows all."""
    first, _ = flown([Event(0.0, "u", 1.0)], 0.5, joint_speed=0.8)
    assert first.joints["first"] == pytest.approx([0.7, 0.0])
    assert first.joints["second"] == pytest.approx([0.0])
    events = [Event(0.0, "tab", 1.0), Event(0.02, "tab", 0.0), Event(0.1, "j", 1.0)]
    second, _ = flown(events, 5.0)
    assert second.joints["first"] == pytest.approx([0.3, 0.0])
    assert second.joints["second"] == pytest.approx([-1.0])
    stowed, _ = flown([*events, Event(3.0, "j", 0.0), Event(3.0, "x", 1.0)], 5.0)
    assert stowed.joints["second"] == pytest.approx([0.0])


def test_the_gripper_closes_gradually_and_stays() -> None:
    """Closing takes the reciprocal of its speed; released, the grip is kept."""
    aim, _ = flown([Event(0.0, "c", 1.0), Event(0.3, "c", 0.0)], 1.0, grip_speed=2.0)
    assert aim.grip == {"hand": pytest.approx(0.6)}


def test_a_tap_between_two_calls_is_not_lost() -> None:
    """Escape pressed and released within a period ends the session all the same."""
    guide = Stick()
    _, memory = flown([Event(0.501, "escape", 1.0), Event(0.502, "escape", 0.0)], 0.6)
    assert guide.finished(memory) is True
    assert guide.finished(flown([], 0.6)[1]) is None


def test_the_memory_is_not_written_to() -> None:
    """Two calls from one memory give the same aim and memory: a snapshot can be resumed."""
    guide = Stick()
    guide.use(Script([Event(0.0, "w", 1.0), Event(0.1, "u", 1.0)]))
    guide.bind(SimpleNamespace(robot=ROBOT))  # type: ignore[arg-type]
    start = guide.start(situation(0.0))
    _, memory = guide.aim(situation(0.2), start)
    once, twice = guide.aim(situation(0.3), memory), guide.aim(situation(0.3), memory)
    assert repr(once) == repr(twice)


# Sessions


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """A function that flies a script with a quadrotor and returns the run folder."""
    monkeypatch.chdir(tmp_path)
    lines = [{"t": 0.1, "hold": "w", "seconds": 0.3}, {"t": 0.6, "press": "escape"}]
    (tmp_path / "keys.yaml").write_text(yaml.safe_dump(lines), encoding="utf-8")

    def fly(folder: str, *words: str) -> Path:
        out = tmp_path / folder
        fixed = ["robot=crazyflie", f"hydra.run.dir={out}", "water=none", "guide.speed=0.3"]
        assert main(["teleop", *fixed, *words]) == 0
        return out

    return fly


def test_a_script_is_flown_and_repeats_bit_for_bit(
    session: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """The log holds state and aims and ends with the escape key; its folder repeats it."""
    one = session("one", "script=keys.yaml")
    log = read_native(one)
    # the call after the key was pressed ends it
    assert log.time[-1] == pytest.approx(0.6, abs=0.03)
    assert {"aim_velocity", "aim_yaw", "aim_yaw_rate"} <= set(log.channels())
    wanted = log.channel("aim_velocity")[:, 0]
    assert np.isfinite(wanted).all()
    assert 0.2 < wanted.max() < 0.8
    capsys.readouterr()
    assert main(["run", f"repeat={one}"]) == 0
    assert "bit for bit" in capsys.readouterr().out
    again = session("two", f"script={one / 'keys.csv'}")
    assert (again / "keys.csv").read_bytes() == (one / "keys.csv").read_bytes()
    assert np.array_equal(read_native(again).channel("position"), log.channel("position"))


def test_a_demonstration_is_sampled_at_the_guides_rate(session: Callable[..., Path]) -> None:
    """Rows are a period apart, and each action stands in the row in which it was decided."""
    log = read_native(session("one", "script=keys.yaml"))
    rows = sampled(log, rate=50.0)
    assert np.diff(rows["time"]) == pytest.approx(0.02)
    assert {"position", "orientation", "aim_velocity", "aim_yaw_rate"} <= set(rows)
    # the key goes down at 0.1 s: the aim of the row before is the last that rests
    ahead = rows["aim_velocity"][:, 0] - rows["aim_velocity"][4, 0]
    assert abs(ahead[:5]).max() < 0.01
    assert ahead[7] > 0.02


def test_a_log_without_guide_is_no_demonstration() -> None:
    """It is refused with what to run."""
    log = Log(name="drop", columns={"t": [0.0, 0.1], "position_z": [1.0, 0.9]})
    with pytest.raises(LogError, match="seals teleop"):
        sampled(log, rate=50.0)


@pytest.mark.skipif(
    importlib.util.find_spec("safetensors") is None, reason="the extra learn is not installed"
)
def test_a_demonstration_is_written_in_the_one_form(session: Callable[..., Path]) -> None:
    """A session becomes one episode, with the log's columns by name and a card that says who."""
    folder = session("one", "script=keys.yaml", "export=[safetensors]")
    demos = read(folder / "demonstration")
    rows = sampled(read_native(folder), rate=50.0)
    (episode,) = demos.episodes
    names = list(demos.origin.observation)
    assert names[:3] == ["position_x", "position_y", "position_z"]
    np.testing.assert_allclose(episode.observation[:, 2], rows["position"][:, 2], rtol=1e-6)
    forward = list(demos.origin.action).index("aim_velocity_x")
    wanted = rows["aim_velocity"][:-1, 0]
    np.testing.assert_allclose(episode.action[:, forward], wanted, rtol=1e-6)
    assert (demos.origin.who, demos.origin.rate) == (Who.scripted, 50.0)


def test_a_missing_safetensors_names_its_extra(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    absent: Callable[..., None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before anything is flown, and with no folder left behind."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "keys.yaml").write_text("- {t: 1, press: w}", encoding="utf-8")
    absent("safetensors")
    words = ["teleop", "robot=crazyflie", "script=keys.yaml", "export=[safetensors]"]
    assert main(words) == 2
    assert "aam-seals[learn]" in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()


def test_without_a_script_a_person_flies(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Left out, ``script=`` is no empty one: a window opens, and the session ends as it says."""
    pytest.importorskip("pygame", reason="the window needs aam-seals[teleop]")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    assert main(["teleop", "robot=crazyflie", "time.duration=0.2", "out=flown"]) == 0
    assert (tmp_path / "flown" / "keys.csv").exists()


def test_a_missing_pygame_names_its_extra() -> None:
    """A keyboard without pygame-ce is refused with the extra and the way round."""

    def absent(name: str) -> Any:
        raise ImportError(name)

    with pytest.raises(MissingExtra, match=r"(?s)aam-seals\[teleop\].*script="):
        pygame_of(absent)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["device=joistick", "script=keys.yaml"], "joystick"),
        (["script=kys.yaml"], "Did you mean 'keys.yaml'"),
        (["speed=0", "script=keys.yaml"], "0.01"),
        (["guide=hover", "script=keys.yaml"], "takes no keys"),
        (["script=keys.yaml", "sript=x"], "Did you mean 'script'"),
    ],
)
def test_mistyped_sessions_are_refused(
    words: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Two lines say what and what to write instead."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "keys.yaml").write_text("- {t: 1, press: w}", encoding="utf-8")
    assert main(["teleop", "robot=crazyflie", *words]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.splitlines()) == 2
