"""A run that was killed goes on from its last checkpoint and comes out as if it had not been."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from seals.cli.main import main
from seals.errors import ConfigError
from seals.logs.table import read_parquet
from seals.run import checkpoint
from seals.run.build import run_settings
from seals.run.recorder import Moment

BALL = [
    "run",
    "robot=ball",
    "water=fossen",
    "environment.tank_bottom=-0.2",
    "effects.buoyancy.volume_change=-0.0004",
    "initial.position=[0,0,0.3]",
    "initial.velocity=[0.3,0,0]",
    "time.duration=3",
    "time.step=0.001",
    "seed=3",
]
TANK = [
    "run",
    "robot=ball",
    "water=particles",
    "fluid.spacing=0.04",
    "fluid.size=[0.32,0.32,0.24]",
    "fluid.freeboard=0.3",
    "fluid.physics.deterministic=true",
    "environment.tank_bottom=-0.24",
    "initial.position=[0,0,0.15]",
    "time.duration=0.4",
    "time.step=0.004",
]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def same(one: Path, other: Path, *tables: str) -> None:
    """Two run folders hold the same bits."""
    for table in tables:
        a, b = read_parquet(one / table), read_parquet(other / table)
        assert list(a) == list(b)
        for name in a:
            assert a[name].tobytes() == b[name].tobytes(), name


def kill_when_kept(where: Path, words: list[str]) -> None:
    """Start a run in a process of its own and kill it hard once it has kept a checkpoint."""
    code = "import sys; from seals.cli.main import main; sys.exit(main())"
    line = [sys.executable, "-c", code, *words, f"hydra.run.dir={where}"]
    with subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as child:
        begin = time.monotonic()
        while not (where / checkpoint.FOLDER / checkpoint.STATE).exists():
            assert child.poll() is None, "it ended before it was killed"
            assert time.monotonic() - begin < 120.0
            time.sleep(0.01)
        os.kill(child.pid, signal.SIGKILL)
        child.wait()


@pytest.mark.thorough
def test_a_killed_run_goes_on_bit_for_bit(elsewhere: Path) -> None:
    """Kill -9 in the middle; the run taken up has the log and ledger of one never killed."""
    whole, cut, on = elsewhere / "whole", elsewhere / "cut", elsewhere / "on"
    kill_when_kept(cut, [*BALL, "checkpoint=0.1"])
    assert json.loads((cut / "run.json").read_text())["state"] == "running"
    assert not (cut / "log.parquet").exists()
    assert main(["run", f"resume={cut}", f"hydra.run.dir={on}"]) == 0
    assert main([*BALL, f"hydra.run.dir={whole}"]) == 0
    same(whole, on, "log.parquet", "ledger.parquet")
    assert json.loads((on / "run.json").read_text())["resume_of"] == str(cut)
    assert not (on / checkpoint.FOLDER).exists()


@pytest.mark.thorough
@pytest.mark.parametrize("backend", ["pybullet", "mujoco", "free"])
def test_an_interrupted_flight_goes_on_bit_for_bit(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, backend: str
) -> None:
    """Guide, controller and drives go on where they were, with every backend."""
    if backend != "free":
        pytest.importorskip(backend)
    flight = ["run", "robot=crazyflie", "controller=cascade", "guide=hover", f"backend={backend}"]
    flight += ["initial.position=[0,0,1]", "time.duration=0.6", "time.step=0.004"]
    interrupted(flight, elsewhere, monkeypatch)
    same(elsewhere / "whole", elsewhere / "on", "log.parquet", "ledger.parquet")


@pytest.mark.thorough
def test_an_interrupted_run_in_particles_goes_on_bit_for_bit(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Water, ball, ledger and the books of the fluid go on where they were."""
    # the ball meets the water at 0.14 s, and is cut off at 0.18 s
    interrupted([*TANK, "time.duration=0.22"], elsewhere, monkeypatch, after=45)
    whole, on = elsewhere / "whole", elsewhere / "on"
    same(whole, on, "log.parquet", "ledger.parquet", "fluid.parquet")
    assert len(read_parquet(on / "log.parquet")["t"]) == 56


def interrupted(
    words: list[str], elsewhere: Path, monkeypatch: pytest.MonkeyPatch, *, after: int = 70
) -> None:
    """Make three run folders: one cut off after some steps, the one that goes on, and a whole one.

    Args:
        words: of the run.
        elsewhere: folder to work in.
        monkeypatch: undone before the run goes on.
        after: steps before the interruption.
    """
    whole, cut, on = elsewhere / "whole", elsewhere / "cut", elsewhere / "on"
    record, steps = checkpoint.Checkpoints.record, [0]

    def stopping(self: checkpoint.Checkpoints, moment: Moment) -> None:
        record(self, moment)
        steps[0] += 1
        if steps[0] == after:
            raise KeyboardInterrupt

    monkeypatch.setattr(checkpoint.Checkpoints, "record", stopping)
    assert main([*words, "checkpoint=1e-9", f"hydra.run.dir={cut}"]) == 130
    monkeypatch.undo()
    monkeypatch.chdir(elsewhere)
    assert main(["run", f"resume={cut}", f"hydra.run.dir={on}"]) == 0
    assert main([*words, "checkpoint=0", f"hydra.run.dir={whole}"]) == 0


@pytest.mark.slow
def test_a_killed_run_in_particles_goes_on_bit_for_bit(elsewhere: Path) -> None:
    """Kill -9 in the middle of a run in particles."""
    whole, cut, on = elsewhere / "whole", elsewhere / "cut", elsewhere / "on"
    kill_when_kept(cut, [*TANK, "checkpoint=0.3"])
    assert main(["run", f"resume={cut}", f"hydra.run.dir={on}"]) == 0
    assert main([*TANK, f"hydra.run.dir={whole}"]) == 0
    same(whole, on, "log.parquet", "ledger.parquet", "fluid.parquet")


def test_a_state_that_cannot_be_kept_is_said(tmp_path: Path) -> None:
    """A backend without a format on disk is refused at the start; without checkpoints it runs."""
    settings = run_settings(["robot=ball", "checkpoint=5"])
    assert checkpoint.interval_of(settings) == 5.0
    bare = replace(settings, backend=object())
    with pytest.raises(ConfigError, match="cannot be saved"):
        checkpoint.interval_of(bare)
    assert checkpoint.interval_of(replace(bare, checkpoint=None)) == 0.0


def test_a_damaged_checkpoint_is_refused(
    elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Half a file, no file at all, and other words beside it are said in words."""
    cut = elsewhere / "cut"
    kill_when_kept(cut, [*BALL, "checkpoint=0.1"])
    state = cut / checkpoint.FOLDER / checkpoint.STATE
    state.write_bytes(state.read_bytes()[:1000])
    assert main(["run", f"resume={cut}"]) == 2
    assert "cannot be resumed" in capsys.readouterr().err
    state.unlink()
    assert main(["run", f"resume={cut}"]) == 2
    assert "there is no checkpoint" in capsys.readouterr().err
    assert main(["run", f"resume={cut}", "time.duration=9"]) == 2
    assert "cannot be combined with time.duration=9" in capsys.readouterr().err
