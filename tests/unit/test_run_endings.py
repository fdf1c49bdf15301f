"""However a run ends, what it had is kept, and no file is half."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from seals.cli.main import main
from seals.logs.native import read_native
from seals.logs.table import read_parquet
from seals.world import World

pytestmark = pytest.mark.usefixtures("elsewhere")

LINE = ["run", "experiment=drop_test", "time.step=0.004"]
WHOLE = {
    "run.json",
    "log.parquet",
    "meta.yaml",
    "robot",
    "ledger.parquet",
    "report.html",
    ".hydra",
    "plots",
}


def stop_at(monkeypatch: pytest.MonkeyPatch, count: int, error: BaseException) -> None:
    """Make a certain step raise."""
    stride = World.stride

    def stepping(world: World, most: int) -> int:
        if round(world.time / world.step_size) == count:
            raise error
        return stride(world, most)

    monkeypatch.setattr(World, "stride", stepping)


def only_run(folder: Path) -> Path:
    """Return the one run folder below a folder."""
    (found,) = folder.glob("runs/*/*")
    return found


def test_interrupt_keeps_the_log(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ctrl-C after 20 steps leaves 21 rows, 20 rows of loads, and the exit code 130."""
    stop_at(monkeypatch, 20, KeyboardInterrupt())
    assert main(LINE) == 130
    run = only_run(elsewhere)
    facts = json.loads((run / "run.json").read_text())
    assert (facts["state"], facts["steps"]) == ("interrupted", 20)
    assert read_native(run).rows == 21
    assert read_parquet(run / "ledger.parquet")["t"].size == 20
    assert {path.name for path in run.iterdir()} <= WHOLE
    assert "interrupted at 0.08 s" in capsys.readouterr().out


def test_physics_error_keeps_the_log(elsewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A robot that becomes too fast fails with two lines; log, loads and report are there."""
    # falling at 98 m/s, the limit of 99 m/s is passed after 0.1 s, that is after 25 steps
    words = ["run", "robot=impactor", "initial.position=[0,0,500]", "initial.velocity=[0,0,-98]"]
    assert main([*words, "hydra.run.dir=fall"]) == 2
    out, err = capsys.readouterr()
    assert err.startswith("PhysicsError: ")
    assert len(err.splitlines()) == 2
    run = elsewhere / "fall"
    facts = json.loads((run / "run.json").read_text())
    assert facts["state"] == "failed"
    assert facts["message"].startswith("PhysicsError: robot 'impactor' moves at")
    assert 20 < read_native(run).rows < 30
    assert "failed" in (run / "report.html").read_text(encoding="utf-8").partition("<main")[0]
    assert "report: fall/report.html" in out


def test_a_bug_keeps_the_log_and_is_not_hidden(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An unexpected error is raised as it is, after the log has been written."""
    stop_at(monkeypatch, 5, ZeroDivisionError("no luck"))
    with pytest.raises(ZeroDivisionError, match="no luck"):
        main(LINE)
    facts = json.loads((only_run(elsewhere) / "run.json").read_text())
    assert (facts["state"], facts["message"]) == ("failed", "ZeroDivisionError: no luck")
    assert read_native(only_run(elsewhere)).rows == 6


def test_refusal_at_the_start_leaves_nothing(elsewhere: Path) -> None:
    """A run that cannot start leaves no folder."""
    assert main([*LINE, "initial.joint_position=[1]"]) == 2
    assert list(elsewhere.iterdir()) == []


def start(folder: Path) -> subprocess.Popen[str]:
    """Start a long run in a process of its own and wait until it steps."""
    code = "import sys; from seals.cli.main import main; sys.exit(main())"
    words = [*LINE, "time.duration=2000", "time.step=0.001", f"hydra.run.dir={folder}"]
    process = subprocess.Popen(
        [sys.executable, "-c", code, *words], text=True, env=os.environ.copy()
    )
    for _ in range(600):
        if (folder / "run.json").exists() or process.poll() is not None:
            break
        time.sleep(0.05)
    time.sleep(1.5)
    return process


@pytest.mark.thorough
def test_polite_kill_keeps_the_log(elsewhere: Path) -> None:
    """SIGTERM ends a run like Ctrl-C."""
    process = start(elsewhere / "long")
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=60) == 130
    facts = json.loads((elsewhere / "long" / "run.json").read_text())
    assert facts["state"] == "interrupted"
    assert read_native(elsewhere / "long").rows == facts["steps"] + 1 > 1


@pytest.mark.thorough
def test_hard_kill_leaves_no_half_file(elsewhere: Path) -> None:
    """SIGKILL leaves the note that a run was going on, and whole files only."""
    process = start(elsewhere / "long")
    process.kill()
    process.wait(timeout=60)
    left = {path.name for path in (elsewhere / "long").iterdir()}
    assert left == {".hydra", "run.json", ".run.lock"}
    assert json.loads((elsewhere / "long" / "run.json").read_text())["state"] == "running"
