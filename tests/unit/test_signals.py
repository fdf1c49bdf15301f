"""Ctrl-C, the stop of a process manager and a closed terminal: words, no half file, exit code 130.

Signals are sent to this very process from inside of a command, at chosen places.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from seals.child_process import SAFE
from seals.cli import __main__ as entry
from seals.cli import listing
from seals.cli.main import main
from seals.logs import atomic
from seals.logs.run_folder import alive
from seals.logs.shipped import shipped_logs
from seals.run import application, simulation
from seals.run.stopping import stoppable
from seals.sweep.rows import find_rows
from seals.sysid.report.given_logs import sources
from seals.view.films.files import Frames
from seals.world import World

pytestmark = [
    pytest.mark.usefixtures("elsewhere"),
    pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="no such signals on this system"),
]
SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]
LINE = ["run", "robot=ball", "time.step=0.01", "time.duration=0.04", "initial.position=[0,0,1]"]


@pytest.fixture(autouse=True)
def nobody() -> Iterator[None]:
    """A signal that no handler of the program takes fails the test, and does not end all tests."""

    def lost(number: int, frame: Any) -> None:
        raise AssertionError(f"signal {number} would have ended the process")

    before = {number: signal.signal(number, lost) for number in SIGNALS[1:]}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def sends(function: Callable[..., Any], number: int) -> Callable[..., Any]:
    """Return a function that first sends a signal to this process."""

    def sending(*words: Any, **more: Any) -> Any:
        os.kill(os.getpid(), number)
        return function(*words, **more)

    return sending


@pytest.fixture
def send(monkeypatch: pytest.MonkeyPatch) -> Callable[[Any, str, int], None]:
    """Let a function of a module or class be interrupted as it begins."""

    def at(owner: Any, name: str, number: int) -> None:
        monkeypatch.setattr(owner, name, sends(getattr(owner, name), number))

    return at


@pytest.mark.parametrize("number", SIGNALS)
def test_each_signal_interrupts_and_handlers_come_back(number: int) -> None:
    """What stood there before stands there after."""
    before = [signal.getsignal(one) for one in SIGNALS]
    with pytest.raises(KeyboardInterrupt), stoppable(), stoppable():
        os.kill(os.getpid(), number)
    assert [signal.getsignal(one) for one in SIGNALS] == before


@pytest.mark.parametrize("number", SIGNALS[1:])
def test_what_is_ignored_stays_ignored(number: int) -> None:
    """``nohup`` has a command outlive its terminal."""
    before = signal.signal(number, signal.SIG_IGN)
    try:
        with stoppable():
            os.kill(os.getpid(), number)
    except KeyboardInterrupt:
        pytest.fail("it was not left alone")
    finally:
        signal.signal(number, before)


PLACES = {
    "at the start": (simulation, "build_world"),
    "in a step": (World, "stride"),
    "in the first file": (atomic, "_sync"),
}


@pytest.mark.parametrize(("place", "number"), list(zip(PLACES, SIGNALS, strict=False)))
def test_a_run_is_interrupted(
    elsewhere: Path, send: Callable[..., None], place: str, number: int,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """Nothing is left, or the folder of a run that says so; nobody holds it."""
    owner, name = PLACES[place]
    send(owner, name, number)
    assert main([*LINE, "hydra.run.dir=a"]) == 130
    _is_interrupted(elsewhere / "a")
    assert "Traceback" not in capsys.readouterr().err


def _is_interrupted(folder: Path) -> None:
    assert not alive(folder)
    if not folder.exists():
        return
    rows = find_rows(folder)
    assert [row.values["state"] for row in rows] in (["interrupted"], [])
    assert not list(folder.glob(".*-*"))
    assert not (folder / ".log").exists()


def test_three_signals_quickly(elsewhere: Path, send: Callable[..., None]) -> None:
    """The later ones end the writing, too: the lock tells, where the file has no time to."""
    send(World, "stride", signal.SIGTERM)
    send(application, "write_log", signal.SIGINT)
    send(application, "write_cut", signal.SIGHUP)
    assert main([*LINE, "hydra.run.dir=a"]) == 130
    _is_interrupted(elsewhere / "a")


def test_a_sweep_is_interrupted(
    elsewhere: Path, send: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    """Its first job keeps what it has, and the words to go on are said."""
    send(World, "stride", signal.SIGHUP)
    assert main([*LINE, "-m", "seed=1,2", "hydra.sweep.dir=s"]) == 130
    assert "--resume" in capsys.readouterr().err
    assert not (elsewhere / "s" / "1").exists()
    _is_interrupted(elsewhere / "s" / "0")


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Keep the folder of a run."""
    folder = tmp_path_factory.mktemp("flown") / "a"
    assert main([*LINE, f"hydra.run.dir={folder}"]) == 0
    return folder


def commands(elsewhere: Path, flown: Path) -> dict[str, list[str]]:
    """Make what some commands need; return their words."""
    answer = {
        "verdict": "named",
        "effects": [{"name": "wind", "confidence": 0.98, "parameters": {
            "velocity_x": {"value": 1.5, "low90": 1.4, "high90": 1.6}}}],
        "models": {"wind": {"effects": {"wind": {"effect": "wind", "velocity_x": 1.5}}}},
        "log": sources([Path(shipped_logs()["hidden_effect/flight_a"])]),
    }  # fmt: skip
    (elsewhere / "diagnosis.json").write_text(json.dumps(answer))
    (elsewhere / "a.csv").write_text("t,depth\n" + "".join(f"{k / 9},1\n" for k in range(99)))
    render = ["render", f"run={flown}", "viewer@renderer=raycast", "width=16", "height=12"]
    return {
        "add": ["add", "diagnosis=diagnosis.json", "name=found", "folder=out"],
        "convert": ["convert", "log=a.csv", "reader=csv", "out=out"],
        "render": [*render, "film=false", "out=out", "fps=25"],
    }


@pytest.mark.parametrize(
    ("verb", "number"), list(zip(["add", "convert", "render"], SIGNALS, strict=False))
)
def test_other_commands_leave_nothing_half(
    elsewhere: Path, flown: Path, send: Callable[..., None], verb: str, number: int,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """Interrupted in their first file: it is not there, nor what it was to become."""
    words = commands(elsewhere, flown)[verb]
    monkeypatch.setattr(sys, "argv", ["seals", *words])
    monkeypatch.setenv(SAFE, "1")
    send(Frames, "write", number) if verb == "render" else send(atomic, "_sync", number)
    assert main() == 130
    assert capsys.readouterr().err.splitlines()[-1] == "Interrupted."
    left = [p.name for p in (elsewhere / "out").rglob("*")] if (elsewhere / "out").exists() else []
    assert left == (["render.json"] if verb == "render" else [])
    assert not list(elsewhere.glob(".*-*"))
    shutil.rmtree(elsewhere / "runs", ignore_errors=True)


@pytest.mark.parametrize("number", SIGNALS)
def test_every_verb_is_interrupted(
    number: int, send: Callable[..., None], monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """Those that write nothing, too, when they are those of the process itself."""
    send(listing, "list_installed", number)
    monkeypatch.setattr(sys, "argv", ["seals", "list"])
    monkeypatch.setenv(SAFE, "1")
    assert main() == 130
    assert capsys.readouterr().err == "Interrupted.\n"


@pytest.mark.parametrize("number", SIGNALS)
def test_a_training_ends_between_two_updates(number: int) -> None:
    """The first signal asks, the second one ends at once."""
    pytest.importorskip("torch", reason="PyTorch is not installed")
    from seals.learn.training.loop import stopping

    training: Any = SimpleNamespace(stop=False)
    before = [signal.getsignal(one) for one in SIGNALS]
    with stopping(training):
        os.kill(os.getpid(), number)
        assert training.stop
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), number)
    assert [signal.getsignal(one) for one in SIGNALS] == before


def test_nothing_is_said_before_the_program_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    """While modules are imported, Ctrl-C ends the process without a traceback."""
    seen = []

    class Slow(SimpleNamespace):
        def __getattr__(self, name: str) -> Any:
            seen.append(signal.getsignal(signal.SIGINT))
            return lambda: 7

    monkeypatch.setitem(sys.modules, "seals.cli.main", Slow())
    assert entry.main() == 7
    assert set(seen) == {signal.SIG_DFL}
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_experiment_whose_reader_leaves_ends_without_a_word() -> None:
    """``python -m seals.experiments.NAME | head`` prints no traceback."""
    words = [sys.executable, "-m", "seals.experiments.self_play", "table"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as shown:
        assert shown.stdout is not None
        assert shown.stderr is not None
        shown.stdout.close()
        said = shown.stderr.read()
    assert (shown.returncode, said) == (0, b"")
