"""A run folder is of one living run, and what is in it is of one run."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from seals.cli.main import main
from seals.errors import ConfigError, LogError
from seals.logs.native import read_native
from seals.logs.run_folder import (
    LOCK,
    MOVING,
    PRODUCTS,
    alive,
    bring_back,
    held,
    new_id,
    set_aside,
)
from seals.registry import get
from seals.run import application
from seals.sweep.rows import find_rows
from seals.world import World

pytestmark = pytest.mark.usefixtures("elsewhere")

LINE = ["run", "experiment=drop_test", "time.step=0.004", "time.duration=0.1"]


def in_a_thread(task: Callable[[], Any]) -> Any:
    """Do something as another run would: what one thread holds is not held by another."""
    found: list[Any] = []

    def work() -> None:
        try:
            found.append(task())
        except Exception as error:  # handed over, and looked at by the test
            found.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    return found[0]


def in_a_child(task: Callable[[], Any]) -> int:
    """Do something in a forked process, and return how that ended."""
    child = os.fork()
    if child == 0:
        try:
            os._exit(int(task() or 0))
        finally:
            os._exit(99)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def killed(*_: Any, **__: Any) -> None:
    """End this process as a lack of memory would."""
    os.kill(os.getpid(), signal.SIGKILL)


def written(folder: Path) -> dict[str, bytes]:
    """Return every file below a folder."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def used(folder: Path, run: str) -> Path:
    """Make what a run leaves behind, in short."""
    (folder / ".hydra").mkdir(parents=True)
    (folder / ".hydra" / "overrides.yaml").write_text("- seed=1\n")
    (folder / "run.json").write_text(json.dumps({"state": "done", "run_id": run}, indent=1))
    (folder / "meta.yaml").write_text(f"simulated:\n  seed: 1\n  run_id: {run}\n")
    (folder / "log.parquet").write_bytes(b"rows")
    (folder / "mine.txt").write_text("of the user")
    return folder


def test_one_living_run_a_folder(elsewhere: Path) -> None:
    """A folder is held once; whoever comes second is told by whom."""
    with held(elsewhere), held(elsewhere):
        assert alive(elsewhere)
        second = in_a_thread(lambda: held(elsewhere).__enter__())
        assert isinstance(second, ConfigError)
        assert str(os.getpid()) in str(second)
    assert alive(elsewhere) is None
    assert not (elsewhere / LOCK).exists()


def test_the_dead_hold_nothing(elsewhere: Path) -> None:
    """The lock of a killed process is seen to be nobody's, and is taken."""

    def work() -> None:
        with held(elsewhere):
            killed()

    assert in_a_child(work) == -signal.SIGKILL
    assert alive(elsewhere) is False
    with held(elsewhere):
        assert alive(elsewhere)


@pytest.mark.parametrize("kind", ["pipe", "link", "folder"])
def test_a_lock_is_an_ordinary_file(elsewhere: Path, kind: str) -> None:
    """A pipe, a link or a folder in its place is refused at once."""
    path = elsewhere / LOCK
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "link":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    with pytest.raises(ConfigError, match="not a regular file"), held(elsewhere):
        pass
    assert alive(elsewhere) is None


def test_second_run_is_refused(elsewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A run into a folder in use ends with 2, and nothing in it is touched."""
    folder = used(elsewhere / "a", new_id())
    with held(folder):
        before = written(folder)
        assert in_a_thread(lambda: main([*LINE, f"hydra.run.dir={folder}"])) == 2
        assert written(folder) == before
    assert "in use" in capsys.readouterr().err


@pytest.mark.parametrize("living", [False, True])
def test_the_log_of_an_earlier_run_is_not_read_for_one_cut_off(
    elsewhere: Path, living: bool
) -> None:
    """A run that was killed, or goes on, leaves the log of the one before in a subfolder."""
    reader = get("reader", "native").load()()
    folder = elsewhere / "a"
    assert main([*LINE, f"out={folder}"]) == 0
    assert [log.name for log in reader.read(folder)] == ["a"]
    assert set_aside(folder) == folder / "earlier_1"
    with held(folder) if living else contextlib.nullcontext():
        if not living:
            (folder / LOCK).touch()
        said = "still goes on" if living else "was interrupted before it wrote one"
        with pytest.raises(LogError, match=f"{said}; that of the run before it is in .*earlier_1"):
            reader.read(folder)
    assert len(reader.read(folder / "earlier_1")) == 1


def test_earlier_products_move_aside_and_back(elsewhere: Path) -> None:
    """What an earlier run left moves as a whole; what is the user's own stays."""
    folder = used(elsewhere / "a", new_id())
    before = written(folder)
    aside = set_aside(folder)
    assert aside == folder / "earlier_1"
    assert {path.name for path in folder.iterdir()} == {"earlier_1", "mine.txt"}
    bring_back(aside)
    assert written(folder) == before
    assert set_aside(elsewhere) is None


@pytest.mark.parametrize("moves", range(5))
def test_a_cut_off_move_is_undone(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, moves: int
) -> None:
    """Killed after any number of moves, the next one to hold the folder finds it as it was."""
    folder = used(elsewhere / "a", new_id())
    before = written(folder)
    rename, done = os.rename, []

    def counting(*words: Any) -> None:
        if len(done) == moves:
            killed()
        rename(*words)
        done.append(words)

    monkeypatch.setattr(os, "rename", counting)
    monkeypatch.setattr(Path, "rename", counting)
    assert in_a_child(lambda: set_aside(folder) is None) == -signal.SIGKILL
    monkeypatch.undo()
    with held(folder):
        found = {k.removeprefix("earlier_1/"): v for k, v in written(folder).items() if k != LOCK}
    assert found == before
    assert not (folder / MOVING).exists()


def test_refused_run_leaves_the_folder_as_it_was(elsewhere: Path) -> None:
    """Words that are wrong do not move what was there."""
    folder = used(elsewhere / "a", new_id())
    before = written(folder)
    assert main([*LINE, f"hydra.run.dir={folder}", "effects.water_drag.area_x=-1"]) == 2
    assert main([*LINE, f"hydra.run.dir={folder}", "nonsense=1"]) == 2
    assert written(folder) == before


def test_interrupted_start_leaves_the_folder_as_it_was(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C before the first step: nothing says that a run goes on."""
    folder = used(elsewhere / "a", new_id())
    before = written(folder)

    def stop(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("seals.run.simulation.build_world", stop)
    assert main([*LINE, f"hydra.run.dir={folder}"]) == 130
    assert written(folder) == before
    assert main([*LINE, f"hydra.run.dir={elsewhere / 'fresh'}"]) == 130
    assert not (elsewhere / "fresh").exists()


def test_killed_run_shows_no_other_log(elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder used before, and a run in it that is killed: its row is its own."""
    folder = elsewhere / "a"
    assert main([*LINE, f"hydra.run.dir={folder}"]) == 0
    first = read_native(folder)
    monkeypatch.setattr(World, "stride", killed)
    again = [*LINE, "initial.position=[0,0,7]", f"hydra.run.dir={folder}"]
    assert in_a_child(lambda: main(again)) == -signal.SIGKILL
    assert not (folder / "log.parquet").exists()
    rows = {row.values["run"]: row for row in find_rows(folder)}
    assert rows["a"].values["state"] == "interrupted"
    assert rows["a"].words["initial.position"] == "[0,0,7]"
    assert rows["earlier_1"].values["state"] == "done"
    assert (read_native(folder / "earlier_1").time == first.time).all()


def test_a_mixed_folder_is_damaged(elsewhere: Path) -> None:
    """Notes of one run beside the log of another are neither listed as a run nor read."""
    folder = used(elsewhere / "a", new_id())
    (row,) = find_rows(folder)
    assert row.values["state"] == "done"
    (folder / "meta.yaml").write_text(f"simulated:\n  run_id: {new_id()}\n")
    (row,) = find_rows(folder)
    assert row.values["state"] == "damaged"
    assert "is of run" in row.damage
    with pytest.raises(LogError, match="mixed"):
        read_native(folder)


@pytest.mark.parametrize("place", ["write_log", "write_report", "write_end"])
def test_interrupted_writing_is_no_running(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    """Ctrl-C while the files are written: the state is told."""

    def stop(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(application, place, stop)
    assert main([*LINE, "hydra.run.dir=a"]) == 130
    facts = json.loads((elsewhere / "a" / "run.json").read_text())
    assert facts["state"] == "interrupted"
    assert "written" in facts["message"]


def test_rows_tell_the_living_from_the_dead(elsewhere: Path) -> None:
    """State "running" counts while somebody holds the folder."""
    folder = elsewhere / "a"
    folder.mkdir()
    (folder / "run.json").write_text('{"state": "running"}')
    with held(folder):
        (row,) = find_rows(folder)
        assert row.values["state"] == "running"
    (row,) = find_rows(folder)
    assert row.values["state"] == "interrupted"


def test_an_answer_without_a_record_of_a_run_is_done(elsewhere: Path) -> None:
    """A diagnosis writes its answer in the end; one that was refused has none."""
    for name in ("answered", "refused"):
        (elsewhere / name / ".hydra").mkdir(parents=True)
        (elsewhere / name / ".hydra" / "overrides.yaml").write_text("- log=flight")
    (elsewhere / "answered" / "diagnosis.json").write_text("{}")
    states = {row.values["run"]: row.values["state"] for row in find_rows(elsewhere)}
    assert states == {"answered": "done", "refused": "begun"}


def test_a_run_without_room_for_its_notes_never_began(elsewhere: Path) -> None:
    """A full disk leaves the name of Hydra's note and nothing in it: that is no damage."""
    (elsewhere / "a" / ".hydra").mkdir(parents=True)
    (elsewhere / "a" / ".hydra" / "overrides.yaml").touch()
    (row,) = find_rows(elsewhere / "a")
    assert (row.damage, row.values["state"], row.words) == ("", "begun", {})


def test_products_are_names_in_the_folder() -> None:
    """Nothing outside of a folder is ever moved or removed."""
    assert all(set(name).isdisjoint("/\\") and name not in ("", ".", "..") for name in PRODUCTS)


def test_policies_that_were_kept_are_of_the_earlier_training(tmp_path: Path) -> None:
    """They move aside with it and come back with it; what the user called alike stays."""
    for name in ("policy_0", "policy_800", "policy_best"):
        (tmp_path / name).mkdir()
    aside = set_aside(tmp_path)
    assert aside is not None
    assert sorted(path.name for path in aside.iterdir()) == ["policy_0", "policy_800"]
    assert (tmp_path / "policy_best").is_dir()
    (tmp_path / "policy_400").mkdir()
    bring_back(aside)
    names = sorted(path.name for path in tmp_path.glob("policy*"))
    assert names == ["policy_0", "policy_800", "policy_best"]
