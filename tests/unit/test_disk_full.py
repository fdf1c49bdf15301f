"""A full disk is told in words, loses nothing that was finished, and stops no run on its way."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.cli.of_system import explained
from seals.errors import ConfigError, DiskFull, MissingExtra, OutOfMemory, optional_import
from seals.logs import room
from seals.logs.atomic import atomic_folder, atomic_path, write_text
from seals.logs.table import read_parquet
from seals.plugins.backends.pybullet.backend import whole
from seals.run import checkpoint
from seals.run.recorder import Moment

pytestmark = pytest.mark.usefixtures("elsewhere")

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "some/file")
DROP = [
    *("run", "robot=ball", "water=fossen", "environment.tank_bottom=-0.2", "time.duration=0.4"),
    *("initial.position=[0,0,0.2]", "time.step=0.004"),
]


def _half(beside: Path, error: Exception) -> None:
    beside.write_text("half")
    raise error


@pytest.mark.parametrize("error", [FULL, OSError(errno.EDQUOT, "quota"), ValueError("short write")])
def test_the_old_file_stands(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    """Said by the system, or only to be seen in the room that is left: it is told in one way."""
    write_text("a.txt", "old")
    if isinstance(error, ValueError):
        empty: Any = type("Statvfs", (), {"f_bavail": 3, "f_frsize": 4096})
        monkeypatch.setattr(os, "statvfs", lambda place: empty)
    told = pytest.raises(DiskFull, match=r"no space left on the disk for a\.txt")
    with told, atomic_path("a.txt") as beside:
        _half(beside, error)
    assert Path("a.txt").read_text() == "old"
    with pytest.raises(DiskFull), atomic_folder("b") as folder:
        _half(folder / "c", error)
    assert [path.name for path in Path().iterdir()] == ["a.txt"]


def test_another_error_stays_what_it_is() -> None:
    """With room left, an error of a writer is no full disk."""
    with pytest.raises(ValueError, match="short write"), atomic_path("a.txt") as beside:
        _half(beside, ValueError("short write"))
    assert not room.told_full(PermissionError(errno.EACCES, "no"))


def test_a_checkpoint_without_room_stops_no_run(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The run goes on to its end, and the checkpoint before it can still be taken up."""
    write, count = checkpoint._write, [0]

    def full_later(beside: Path, *parts: Any) -> None:
        count[0] += 1
        write(beside, *parts)
        if count[0] == 30:
            raise KeyboardInterrupt
        if count[0] > 10:
            (beside / checkpoint.STATE).write_bytes(b"half")
            raise FULL

    monkeypatch.setattr(checkpoint, "_write", full_later)
    assert main([*DROP, "checkpoint=1e-9", "hydra.run.dir=cut"]) == 130
    said = capsys.readouterr().err
    assert "no checkpoint at 0.044 s: there is no space left" in said
    # and not again at each of the next twenty
    assert said.count("no checkpoint at") == 1
    monkeypatch.undo()
    monkeypatch.chdir(elsewhere)
    assert sorted(p.name for p in Path("cut").glob("*checkpoint*")) == ["checkpoint"]
    assert main(["run", "resume=cut", "hydra.run.dir=on"]) == 0
    assert main([*DROP, "hydra.run.dir=alone"]) == 0
    one, other = (read_parquet(Path(name) / "log.parquet") for name in ("alone", "on"))
    assert {k: v.tobytes() for k, v in one.items()} == {k: v.tobytes() for k, v in other.items()}


def test_a_scene_cut_short_is_not_taken_up(capsys: pytest.CaptureFixture[str]) -> None:
    """The engine writes to a full disk, and reads half a file, without a word."""
    with pytest.MonkeyPatch.context() as patch:
        record = checkpoint.Checkpoints.record

        def stopping(self: checkpoint.Checkpoints, moment: Moment) -> None:
            record(self, moment)
            raise KeyboardInterrupt

        patch.setattr(checkpoint.Checkpoints, "record", stopping)
        assert main([*DROP, "checkpoint=1e-9", "hydra.run.dir=cut"]) == 130
    scene = Path("cut") / checkpoint.FOLDER / checkpoint.SCENE
    assert whole(scene)
    raw = scene.read_bytes()
    for cut in (0.3, 0.9, 0.999):
        scene.write_bytes(raw[: int(cut * len(raw))])
        assert main(["run", "resume=cut"]) == 2, cut
        assert "is truncated" in capsys.readouterr().err, cut


@pytest.mark.parametrize("stage", ["old", "gone", "new"])
def test_a_checkpoint_is_whole_at_every_moment(stage: str) -> None:
    """Killed between two renames, the run finds the checkpoint before."""
    run = Path("run")
    places = {
        "old": [run / "checkpoint", run / ".checkpoint.new"],
        "gone": [run / ".checkpoint.before", run / ".checkpoint.new"],
        "new": [run / "checkpoint", run / ".checkpoint.before"],
    }[stage]
    for place in places:
        place.mkdir(parents=True)
        (place / checkpoint.STATE).write_bytes(b"")
    assert checkpoint.checkpoint_of(run) == places[0]
    (places[0] / checkpoint.STATE).unlink()
    with pytest.raises(ConfigError, match="there is no checkpoint"):
        checkpoint.checkpoint_of(run)


def test_the_command_says_it_in_two_lines(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, no traceback, whoever was writing."""
    from seals.run import application

    def full(*_: object) -> None:
        raise FULL

    monkeypatch.setattr(application, "write_log", full)
    assert main([*DROP, "hydra.run.dir=cut"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert said[-2] == "DiskFull: there is no space left on the disk for some/file."
    assert "Free some space" in said[-1]


def test_the_library_of_policies_tells_of_it_in_words_of_its_own(tmp_path: Path) -> None:
    """Its error holds the system's number as text alone; here a file is larger than allowed."""
    pytest.importorskip("safetensors")
    resource = pytest.importorskip("resource")
    from seals.learn.tensor_file import write_tensors

    target, limit = tmp_path / "folder", resource.RLIMIT_FSIZE
    least, most = resource.getrlimit(limit)
    resource.setrlimit(limit, (20_000, most))
    try:
        with pytest.raises(DiskFull, match="no space left"), atomic_folder(target) as beside:
            write_tensors(beside / "weights.safetensors", {"w": np.zeros(10_000)})
    finally:
        resource.setrlimit(limit, (least, most))
    assert list(tmp_path.glob("*folder*")) == []


_MAPPED = "a.so: failed to map segment from shared object: Cannot allocate memory"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError(), "OutOfMemory: the memory"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "OutOfMemory: the memory"),
        (ImportError(_MAPPED), "OutOfMemory: the memory"),
        (RuntimeError("can't start new thread"), "OutOfMemory: the memory"),
        (MissingExtra("PyTorch is not installed.\nInstall it."), "MissingExtra: PyTorch is not"),
        (OSError(errno.EIO, os.strerror(errno.EIO), "a/b"), "'a/b' could not be read or written"),
        (OSError("error closing file"), "a file could not be read or written: error closing file"),
    ],
)
def test_other_wants_of_the_system_are_told(
    error: Exception,
    words: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """No memory, or a disk that fails: exit code 2, two lines, whoever met it."""
    from seals.run import application

    def fails(*_: object) -> None:
        raise error

    monkeypatch.setattr(application, "write_log", fails)
    assert main([*DROP, "hydra.run.dir=cut"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert words in said[-2]


def test_a_library_that_cannot_be_loaded_for_want_of_memory_is_not_absent() -> None:
    """The advice to install it would be no help."""
    with pytest.raises(MissingExtra) as absent, optional_import("a needs b", "Install it."):
        raise ImportError(_MAPPED)
    assert isinstance(explained(absent.value), OutOfMemory)
    assert explained(ValueError("negative mass")) is None


def test_an_error_for_which_there_is_no_room_for_words_is_one_of_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What explains it cannot be loaded any more."""
    monkeypatch.setitem(sys.modules, "seals.logs.room", None)
    assert isinstance(explained(KeyError("half a library")), OutOfMemory)


def test_a_link_to_itself_is_told_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Until Python 3.13 looking one up is an error of no kind that names a file."""
    monkeypatch.chdir(tmp_path)
    Path("loop").symlink_to("loop")
    assert main(["diagnose", "log=loop", "out=made"]) == 2
    said = capsys.readouterr().err
    assert "loop" in said
    assert "Traceback" not in said
    error = RuntimeError("Symlink loop from '/a/b.obj'")
    assert "'/a/b.obj' is a link to itself" in str(explained(error))
