"""A session of looking: sliders, runs that they start, the door it listens at, refusals."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from omegaconf import OmegaConf

from seals.cli.main import main
from seals.errors import ConfigError, MissingExtra
from seals.plugins.viewers.browser.server import open_server
from seals.run.replay_config import recalled
from seals.view.session import Session
from seals.view.sliders import Slider, sliders_of

DRAG = "effects.water_drag.coefficient_x"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short fall of a ball towards water."""
    folder = tmp_path_factory.mktemp("view") / "run"
    words = ["robot=ball", "water=fossen", "initial.position=[0,0,2]", "time.duration=0.06"]
    assert main(["run", *words, f"hydra.run.dir={folder}"]) == 0
    return folder


def test_a_run_offers_its_drag_first(run: Path) -> None:
    """From nothing to four times the value that the robot's folder says, in round steps."""
    first = sliders_of(recalled(run), ())[0]
    assert (first.key, first.value, first.low) == (DRAG, 1.84, 0.0)
    assert first.high == pytest.approx(7.36)
    assert first.unit == "N s^2/m^2"
    assert first.step == pytest.approx(0.02)


def test_sliders_are_named_with_their_range(run: Path) -> None:
    """Any number of the run, within what is said, or a multiple of what it is."""
    words = ["initial.position.2:0.5:4", DRAG]
    height, drag = sliders_of(recalled(run), words)
    assert height == Slider("initial.position.2", 0.5, 4.0, 2.0, "")
    assert drag.key == DRAG


@pytest.mark.parametrize(
    ("word", "words"),
    [
        ("effects.water_drag.coeficient_x", "Did you mean 'effects.water_drag.coefficient_x'"),
        ("initial.position.2", "Give it: initial.position.2:LOW:HIGH"),
        ("initial.position.2:3:1", "LOW below HIGH"),
        ("initial.position.2:a:b", "LOW below HIGH"),
        ("initial.position.2:3:4", "does not include the value of the run,"),
        ("name", "not a numeric setting"),
    ],
)
def test_a_slider_that_cannot_be_is_refused(run: Path, word: str, words: str) -> None:
    """Unknown keys, text, and ranges that are none."""
    with pytest.raises(ConfigError, match=words.replace("(", r"\(")):
        sliders_of(recalled(run), [word])


@pytest.mark.thorough
def test_a_turned_value_starts_another_run(run: Path, tmp_path: Path) -> None:
    """The ball starts from the new height, in a folder of its own; the first stays."""
    config = recalled(run)
    slider = Slider("initial.position.2", 0.5, 4.0, 2.0, "m")
    session = Session(config, [slider], tmp_path / "looks")
    session.start()
    session.turn({"initial.position.2": 3.0})
    try:
        end = time.monotonic() + 60.0
        while session.live is not None and time.monotonic() < end:
            session.follow()
            time.sleep(0.05)
    finally:
        session.close()
    assert session.note == "run 2: initial.position.2 = 3"
    assert [folder.name for folder in session.made] == ["looks", "looks_2"]
    poses = session.poses(0.0)
    assert poses is not None
    assert np.asarray(poses.position)[0, 0].tolist() == [0.0, 0.0, 3.0]
    assert session.end == pytest.approx(0.06)
    assert OmegaConf.select(config, "initial.position")[2] == 2.0


@pytest.mark.parametrize("value", [0.4, 4.1, float("nan")])
def test_a_page_cannot_leave_the_range(run: Path, tmp_path: Path, value: float) -> None:
    """What a page sends is checked like what a person writes."""
    session = Session(recalled(run), [Slider("a", 0.5, 4.0, 2.0, "")], tmp_path / "looks")
    with pytest.raises(ConfigError, match=r"Allowed: 0\.5 to 4"):
        session.turn({"a": value})
    with pytest.raises(ConfigError, match="no slider"):
        session.turn({"name": 1.0})
    assert not session.made


def test_the_door_is_open_to_this_machine_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The default address is the loopback, and no page can have it shared."""
    viser = pytest.importorskip("viser")
    # a tunnel needs a network; whether one is asked for does not
    tunnels: list[bool] = []
    monkeypatch.setattr(
        viser.ViserServer, "request_share_url", lambda _, verbose=True: tunnels.append(verbose)
    )
    server = open_server("127.0.0.1", 0)
    try:
        assert isinstance(server, viser.ViserServer)
        assert server.get_host() == "127.0.0.1"
        server.request_share_url()
        assert not tunnels
        with pytest.raises(ConfigError, match=r"in use.*\n.*port=0"):
            open_server("127.0.0.1", server.get_port())
    finally:
        server.stop()


def test_an_address_of_another_machine_is_refused() -> None:
    """The words say what an address may be."""
    pytest.importorskip("viser")
    # TEST-NET-1, which belongs to nobody
    for host in ("192.0.2.1", "no.such.host.invalid"):
        with pytest.raises(ConfigError, match=r"Allowed: 127\.0\.0\.1"):
            open_server(host, 0)


def test_a_missing_extra_is_named(absent: Callable[..., None]) -> None:
    """Without viser the refusal says what to install."""
    absent("viser")
    with pytest.raises(MissingExtra, match=r"aam-seals\[view\]"):
        open_server("127.0.0.1", 0)


Words = Callable[[Path], list[str]]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (lambda run: ["replay=nowhere"], "there is no such folder"),
        (lambda run: [str(run), "time.duration=3"], "cannot be combined with time.duration=3"),
        (lambda run: [f"replay={run}", "port=70000"], "Allowed: 1024 to 65535"),
        (
            lambda run: [f"run={run}", "sliders=[a:0:1]"],
            "a is not a numeric setting",
        ),
        (lambda run: [], "no run is given"),
        (lambda run: ["viewer@show=tiny"], "cannot show live runs"),
    ],
)
def test_the_command_refuses_in_two_lines(
    run: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: Words,
    said: str,
) -> None:
    """Exit code 2, words, and no folder left behind."""
    monkeypatch.chdir(tmp_path)
    assert main(["view", *words(run)]) == 2
    error = capsys.readouterr().err.strip()
    assert said in error
    assert len(error.splitlines()) == 2
    assert not (tmp_path / "runs").exists()


def test_a_port_in_use_is_said(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another program has it: the command says so and ends."""
    pytest.importorskip("viser")
    monkeypatch.chdir(tmp_path)
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert main(["view", str(run), f"port={port}"]) == 2
    assert f"port={port} is in use" in capsys.readouterr().err


def test_what_rests_is_not_offered(run: Path) -> None:
    """In simulated water the robot's own coefficients rest: turning them would do nothing."""
    keys = [s.key for s in sliders_of(recalled(run), (), idle=("water_drag", "spin_drag"))]
    assert keys
    assert not {key.split(".")[1] for key in keys} & {"water_drag", "spin_drag", "gravity"}
