"""Flights in lockstep with a stand-in for ArduPilot that shares no code with SEALS."""

from __future__ import annotations

import json
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.cli.main import main
from seals.control import RobotState
from seals.errors import ConfigError
from seals.frames import matrix_of, quaternion_of_rpy
from seals.logs.native import read_native
from seals.plugins.controllers.channels import Channels
from seals.run.assembly import ROBOT, build_world
from seals.run.build import run_settings
from seals.teleop.autopilot.ardupilot import ArduPilot
from seals.teleop.autopilot.link import FlightState, Track, flight_state, read_track

FAKE = Path(__file__).with_name("fake_ardupilot.py")
RATE = 250
FLIGHT = {
    "vehicle": "quad",
    "rate": RATE,
    "legs": [
        {"seconds": 0.2, "place": [0, 0, 0], "on": False},
        {"seconds": 2.4, "place": [0, 0, -0.6]},
        {"seconds": 2.6, "place": [0.6, 0.3, -0.8]},
        {"seconds": 2.2, "place": [0.6, 0.3, -0.1]},
        {"seconds": 0.5, "place": [0.6, 0.3, 0], "on": False},
    ],
}


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM) -> int:
    """Return a port of this machine that nobody listens on."""
    with socket.socket(socket.AF_INET, kind) as ear:
        ear.bind(("127.0.0.1", 0))
        return int(ear.getsockname()[1])


def fly(mission: dict[str, Any], folder: Path, words: list[str]) -> dict[str, Any]:
    """Let the stand-in fly a run; return what it saw."""
    port = free_port()
    fake = subprocess.Popen(
        [sys.executable, str(FAKE), str(port), json.dumps(mission)],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        fixed = [f"hydra.run.dir={folder}", f"port={port}", "speed=0", "timeout=2"]
        assert main(["autopilot", *fixed, f"time.step={1 / mission['rate']}", *words]) == 0
        seen: dict[str, Any] = json.loads(fake.communicate(timeout=30)[0])
    finally:
        fake.kill()
        fake.wait()
    return seen


@pytest.mark.thorough
def test_an_autopilot_takes_off_flies_to_a_place_and_lands(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Every frame is one step; places are reached in the autopilot's axes."""
    words = ["robot=crazyflie", "environment.ground_level=0", "initial.position=[0,0,0.016]"]
    seen = fly(FLIGHT, tmp_path / "flight", words)
    frames = 1 + round(RATE * sum(leg["seconds"] for leg in FLIGHT["legs"]))
    assert seen["frames"] == frames
    assert seen["last"] - seen["first"] == pytest.approx((frames - 1) / RATE, abs=1e-9)
    assert seen["again"]
    assert {"airspeed", "imu", "position", "quaternion", "timestamp", "velocity"} <= {
        *seen["fields"]
    }
    hover, place, low, landed = (end["position"] for end in seen["ends"][1:])
    assert hover == pytest.approx([0, 0, -0.6], abs=0.06)
    assert place == pytest.approx([0.6, 0.3, -0.8], abs=0.06)
    assert low[2] == pytest.approx(-0.1, abs=0.06)
    assert landed[2] == pytest.approx(-0.015, abs=0.01)
    # at rest on the ground an accelerometer reads gravity, upwards: z is down
    assert seen["accel"] == pytest.approx([0, 0, -9.81], abs=0.1)
    log = read_native(tmp_path / "flight")
    assert log.columns["position_y"].max() == pytest.approx(0.6, abs=0.1)
    facts = json.loads((tmp_path / "flight" / "run.json").read_text())
    assert facts["state"] == "done"
    out, err = capfd.readouterr()
    assert "the autopilot was silent for 2 s" in out
    assert "6 messages were refused" in out
    assert "a frame of a second autopilot" in err


@pytest.mark.thorough
def test_an_autopilot_holds_the_depth_of_a_vehicle_under_water(tmp_path: Path) -> None:
    """Thrusters that stand still at 1500 us push both ways; 32 channels arrive."""
    legs = [{"seconds": 5.0, "place": [0, 0, 2.0]}, {"seconds": 0.5, "place": [0, 0, 2.0]}]
    mission = {"vehicle": "diver", "rate": 100, "channels": 32, "legs": legs}
    words = ["robot=auv", "water=fossen", "controller=thruster_pulses"]
    seen = fly(mission, tmp_path / "dive", [*words, "initial.position=[0,0,-1.5]"])
    # 0.9 N of buoyancy against a spring of 40 N/m
    for end in seen["ends"]:
        assert end["position"][2] == pytest.approx(2.0 - 0.91 / 40.0, abs=0.01)
        assert end["velocity"][2] == pytest.approx(0.0, abs=0.02)
    log = read_native(tmp_path / "dive")
    assert log.columns["thruster_cmd_1"].min() < -0.2


def robot_state(**values: Any) -> RobotState:
    """Return the state of a robot at rest, with some values."""
    plain = {name: np.zeros(3) for name in RobotState._fields}
    fixed = {"time": 0.0, "step": 0.01, "rotation": np.eye(3), "readings": {}}
    return RobotState(**{**plain, **fixed, **values})


def test_axes_are_north_east_down_and_forward_right_down() -> None:
    """A robot that looks north, leans right and climbs is told so in the autopilot's axes."""
    # nose from east to north, then rolled to the right: about its own x axis by the same sign
    turn = matrix_of(quaternion_of_rpy(np.array([[0.3, 0.0, np.pi / 2]])))[0]
    now = robot_state(
        position=np.array([1.0, 2.0, 3.0]),
        velocity=np.array([0.1, 0.2, 0.3]),
        angular_velocity=np.array([0.4, 0.5, 0.6]),
        rotation=turn,
    )
    told = flight_state(now, np.array([0.0, 0.0, 10.0]), 9.81, np.array([0.0, 1.0, 0.0]))
    assert told.position.tolist() == [2.0, 1.0, -3.0]
    assert told.velocity.tolist() == [0.2, 0.1, -0.3]
    assert told.gyro.tolist() == [0.4, -0.5, -0.6]
    # heading zero is north; a roll of 0.3 to the right
    assert told.quaternion == pytest.approx([np.cos(0.15), np.sin(0.15), 0.0, 0.0], abs=1e-12)
    # 10 m/s^2 upwards felt on top of gravity, by a body that leans
    force = 9.81 + 10.0
    assert told.accelerometer == pytest.approx(
        [0.0, -force * np.sin(0.3), -force * np.cos(0.3)], abs=1e-9
    )
    # the wind comes from behind
    assert told.airspeed == pytest.approx(0.2 - 1.0)


@pytest.fixture
def link() -> Iterator[ArduPilot]:
    """Return a link that listens on a free port and waits a short while."""
    made = ArduPilot("127.0.0.1", 0, 0.2, 0.0, 0.01)
    yield made
    made.close()


def sent(link: ArduPilot, *frames: int, pulse: int = 1500) -> socket.socket:
    """Send frames of given numbers; return the socket that they came from."""
    mouth = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    mouth.settimeout(2.0)
    host, port = link.where.removeprefix("udp:").split(":")
    for count in frames:
        packet = struct.pack("<HHI16H", 18458, 100, count, pulse, *[0] * 15)
        mouth.sendto(packet, (host, int(port)))
    return mouth


def told(time: float) -> FlightState:
    """Return a state at a time."""
    return flight_state(robot_state(time=time), None, 9.81, np.zeros(3))


def test_repeated_frames_are_answered_again_without_a_step(link: ArduPilot) -> None:
    """Between two new frames the old one comes twice; channels without a pulse are none."""
    mouth = sent(link, 0, 0, 0, 1)
    link.meet()
    first = link.exchange(told(0.0))
    assert first is not None
    assert first[0] == 1500.0
    assert np.isnan(first[1:]).all()
    assert link.exchange(told(0.25)) is not None
    stamps = [json.loads(mouth.recv(4096))["timestamp"] for _ in range(3)]
    assert stamps == [0.25, 0.25, 0.25]
    assert link.frames == 2
    mouth.close()


def test_a_count_that_begins_anew_ends_the_session_and_begins_another(link: ArduPilot) -> None:
    """An autopilot that restarts, from another port, is met by its first frame."""
    mouth = sent(link, 5, 6)
    link.meet()
    assert link.exchange(told(0.0)) is not None
    assert link.exchange(told(0.01)) is not None
    again = sent(link, 0, pulse=1100)
    assert link.exchange(told(0.02)) is None
    assert link.restarted
    link.renew()
    outputs = link.exchange(told(0.0))
    assert outputs is not None
    assert outputs[0] == 1100.0
    assert link.exchange(told(0.01)) is None
    assert link.ended == "the autopilot was silent for 0.2 s"
    assert json.loads(again.recv(4096))["timestamp"] == 0.01
    mouth.close()
    again.close()


def test_a_robot_that_nothing_drives_is_refused_before_the_wait(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """A ball has nothing to command: no port is opened and nobody waits half a minute."""
    assert main(["autopilot", "robot=ball", f"out={tmp_path / 'flown'}"]) == 2
    said = capsys.readouterr()
    assert "no actuators" in said.err
    assert "listening" not in said.out


def test_an_autopilot_that_never_speaks_is_refused(link: ArduPilot) -> None:
    """The refusal says how to start one."""
    with pytest.raises(ConfigError, match=r"within 0.2 s.\n.*sim_vehicle.py"):
        link.meet()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["port=99999"], "port=99999 is not allowed"),
        (["protocol=ardupilott"], "protocol"),
        (["controller=station"], "controller=station cannot be used with an autopilot"),
        (["host=203.0.113.1"], "cannot be opened"),
        (["peer=here"], "peer=here is not an address"),
    ],
)
def test_a_mistyped_session_is_refused(
    words: list[str], expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In two lines, before it listens."""
    fixed = ["autopilot", "robot=auv", f"hydra.run.dir={tmp_path / 'run'}", "timeout=0.2"]
    assert main([*fixed, *words]) == 2
    err = capsys.readouterr().err
    assert expected in err
    assert len(err.strip().splitlines()) == 2


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"channel": [1, 2]}, "channel has 2 entries, the robot has 6 outputs"),
        ({"channel": [33]}, "Allowed: 0 to 32"),
        ({"low": [2000.0], "high": [1000.0]}, "a range is empty"),
        ({"script": "log.parquet"}, "log.parquet"),
    ],
)
def test_a_channel_map_that_does_not_fit_is_refused(
    values: dict[str, Any], expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each in words."""
    monkeypatch.chdir(tmp_path)
    Track(np.array([1.0, 1.0]), np.zeros((2, 1))).write(tmp_path / "log.parquet")
    settings = run_settings(["robot=auv", "water=fossen", "guide=external"])
    settings.controller = Channels(**values)
    with pytest.raises(ConfigError, match=expected):
        build_world(settings)


def test_channels_move_what_the_map_says(tmp_path: Path) -> None:
    """Ranges, reversal, a channel without a pulse, one that no output has."""
    path = tmp_path / "outputs.parquet"
    Track(np.array([0.0]), np.array([[1000.0, 1250.0, np.nan, 2600.0]])).write(path)
    assert read_track(path).at(-0.1) is None
    words = ["robot=auv", "water=fossen", "guide=external", "controller=channels"]
    words += ["controller.channel=[1,2,3,4,0,2]", f"controller.script={path}"]
    words += ["controller.reverse=[false,false,false,false,false,true]"]
    world = make(words)
    world.step()
    command = world.actors[ROBOT].command
    world.close()
    assert command is not None
    assert command[0].tolist() == [-40.0, -20.0, 0.0, 40.0, 0.0, 20.0]


def test_an_interrupted_flight_is_written(tmp_path: Path) -> None:
    """The signal of Ctrl-C ends the wait for the next frame; the log has what was flown."""
    link = ArduPilot("127.0.0.1", 0, 0.1, 0.0, 0.01)
    port = int(link.where.rpartition(":")[2])
    link.close()
    over = threading.Event()

    def speak() -> None:
        count, mouth = 0, socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        mouth.settimeout(0.02)
        while not over.is_set():
            packet = struct.pack("<HHI16H", 18458, 100, count, *[1500] * 16)
            mouth.sendto(packet, ("127.0.0.1", port))
            try:
                stamp = json.loads(mouth.recv(4096))["timestamp"]
            except (TimeoutError, ConnectionError):
                continue
            count += 1
            if stamp > 0.3:
                # it now waits for a frame that does not come
                over.wait(0.3)
                os.kill(os.getpid(), signal.SIGINT)
                break
        mouth.close()

    speaker = threading.Thread(target=speak)
    speaker.start()
    try:
        words = [f"hydra.run.dir={tmp_path / 'run'}", f"port={port}", "time.step=0.01"]
        assert main(["autopilot", "robot=auv", "water=fossen", *words, "timeout=60"]) == 130
    finally:
        over.set()
        speaker.join()
    assert json.loads((tmp_path / "run" / "run.json").read_text())["state"] == "interrupted"
    assert read_native(tmp_path / "run").columns["t"][-1] > 0.1
    assert (tmp_path / "run" / "outputs.parquet").is_file()


@pytest.mark.slow
def test_a_weak_rotor_of_an_autopilots_flight_is_named(tmp_path: Path) -> None:
    """The log of the flight goes through the diagnosis like any run's."""
    places = [[0, 0, -1.0], [1.5, 0.5, -1.4], [-0.5, -1.0, -0.8], [0.5, 1.0, -1.5], [0, 0, -0.6]]
    legs = [{"seconds": 2.5, "place": place} for place in places]
    fault = ["+effect@effects.weak=weak_rotor", "effects.weak.rotor=2"]
    fault += ["effects.weak.relative_loss=0.15", "hide=[weak_rotor]", "initial.position=[0,0,1]"]
    mission = {"vehicle": "quad", "rate": RATE, "legs": legs}
    fly(mission, tmp_path / "fault", ["robot=crazyflie", *fault])
    words = [
        f"log={tmp_path / 'fault'}",
        f"out={tmp_path / 'answer'}",
        "plan=false",
        "report=false",
    ]
    command = [sys.executable, "-m", "seals.cli", "diagnose", *words]
    # from elsewhere: the clone itself is no installed package
    assert subprocess.run(command, check=False, cwd=tmp_path).returncode == 10
    found = json.loads((tmp_path / "answer" / "diagnosis.json").read_text())["effects"]
    assert [effect["name"] for effect in found] == ["weak_rotor"]
    assert found[0]["parameters"]["rotor"]["value"] == 2
    assert found[0]["parameters"]["relative_loss"]["value"] == pytest.approx(0.15, abs=0.01)
