"""Links and strange files in run folders and sweeps of strangers: nothing outside is touched."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from seals.cli.main import main
from seals.errors import ConfigError
from seals.logs.run_folder import LOCK, MOVING, alive, held, open_own, set_aside
from seals.run.particle_snapshots import FOLDER, MOST_BYTES, Thinned
from seals.sweep.book import LOCK as JOBS_LOCK
from seals.sweep.book import TABLE, Job, claimed, opened, read_jobs
from seals.view.films.application import _folder as folder_of_frames

pytestmark = pytest.mark.usefixtures("elsewhere")

JOB = Job(1, "done", 0, 0.5, ("seed=2",), "")
SWEEP = ["run", "-m", "robot=ball", "time.step=0.01", "time.duration=0.02", "seed=1"]
SWEEP += ["initial.position=[0,0,1]", "hydra.sweep.dir=s"]


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A folder of the user's that no run may touch."""
    folder = tmp_path / "home"
    (folder / "pictures").mkdir(parents=True)
    for name in ("log.parquet", "run.json", "profile", "pictures/mine.png"):
        (folder / name).write_text("precious, without an end of line")
    return folder


def content(folder: Path) -> dict[str, str]:
    """Return every file below a folder."""
    return {str(p): p.read_text() for p in folder.rglob("*") if p.is_file()}


STRANGE: dict[str, Callable[[Path, Path], Any]] = {
    "a link": lambda path, home: path.symlink_to(home / "profile"),
    "a link to nothing": lambda path, home: path.symlink_to(home / "new"),
    "a link to a device": lambda path, home: path.symlink_to("/dev/zero"),
    "a second name": lambda path, home: os.link(home / "profile", path),
    "a pipe": lambda path, home: os.mkfifo(path),
    "a folder": lambda path, home: path.mkdir(),
    "a loop": lambda path, home: path.symlink_to(path.name),
}


@pytest.mark.parametrize("kind", STRANGE)
@pytest.mark.parametrize("name", [LOCK, JOBS_LOCK, TABLE])
def test_files_that_are_written_to_are_ordinary_ones(
    elsewhere: Path, home: Path, name: str, kind: str
) -> None:
    """Locks and the book of a sweep are opened to be written: neither leads elsewhere."""
    STRANGE[kind](elsewhere / name, home)
    before = content(home)
    users: dict[str, Callable[[], Any]] = {
        LOCK: lambda: held(elsewhere).__enter__(),
        JOBS_LOCK: lambda: opened(elsewhere).__enter__(),
        TABLE: lambda: _note(elsewhere),
    }
    with pytest.raises(ConfigError, match="not a regular file"):
        users[name]()
    assert content(home) == before


def _note(folder: Path) -> None:
    with claimed(folder, 1) as lock:
        lock.note(JOB)


@pytest.mark.parametrize(
    "place",
    [".hydra", "plots", "policy", "checkpoint", "run.json", "log.parquet", "pictures/eye", MOVING],
)
def test_links_in_a_run_folder_are_refused(elsewhere: Path, home: Path, place: str) -> None:
    """What would be written, moved or removed behind them is somebody else's."""
    path = elsewhere / "run" / place
    path.parent.mkdir(parents=True)
    path.symlink_to(home / path.name if path.name == "log.parquet" else home)
    before = content(home)
    with pytest.raises(ConfigError, match="leads outside its run folder"), held(elsewhere / "run"):
        set_aside(elsewhere / "run")
    assert content(home) == before


def _job_folder(sweep: Path, home: Path) -> None:
    (sweep / "0").symlink_to(home)


def _of_hydra(kind: str) -> Callable[[Path, Path], None]:
    def attack(sweep: Path, home: Path) -> None:
        (sweep / "multirun.yaml").unlink()
        STRANGE[kind](sweep / "multirun.yaml", home)

    return attack


def _said(sweep: Path, home: Path) -> None:
    (sweep / "0").mkdir()
    (sweep / "0" / "stdout.txt").symlink_to(home / "profile")


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Keep a sweep of one job."""
    folder = tmp_path_factory.mktemp("swept")
    before = Path.cwd()
    os.chdir(folder)
    try:
        assert main(SWEEP) == 0
    finally:
        os.chdir(before)
    return folder / "s"


@pytest.mark.parametrize(
    "attack",
    [
        _job_folder,
        *(pytest.param(_of_hydra(kind), marks=pytest.mark.thorough) for kind in STRANGE),
        _said,
    ],
)
def test_a_strangers_sweep_is_resumed_in_its_folder(
    swept: Path, elsewhere: Path, home: Path, attack: Callable[[Path, Path], None],
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """Its job is left to do; links wait for what it writes, and for what it clears before."""
    sweep = Path(shutil.copytree(swept, elsewhere / "s"))
    shutil.rmtree(sweep / "0")
    (sweep / TABLE).unlink()
    attack(sweep, home)
    before = content(home)
    assert main(["run", "resume=s"]) == 2
    assert content(home) == before
    text = capsys.readouterr().err
    assert "leads out" in text or "no ordinary file" in text or "not a regular file" in text
    assert "Traceback" not in text


def _carried(folder: Path) -> list[str]:
    world: Any = SimpleNamespace(time=1.0, step_size=0.01)
    water: Any = object()
    recorder = Thinned(0.05, water)
    recorder.restore(None, 0, folder / "cut")
    recorder.start(world, folder / "on")
    on = folder / "on" / FOLDER
    return sorted(p.name for p in on.iterdir()) if on.exists() else []


@pytest.mark.parametrize("kind", [*list(STRANGE)[:3], "a pipe", "a folder", "a loop"])
def test_instants_are_taken_over_from_the_run_alone(elsewhere: Path, home: Path, kind: str) -> None:
    """A link to a device would fill the disk, one to a file would publish it."""
    (elsewhere / "cut" / FOLDER).mkdir(parents=True)
    STRANGE[kind](elsewhere / "cut" / FOLDER / "t_000.0500.npy", home)
    with pytest.raises(ConfigError, match="is not copied"):
        _carried(elsewhere)
    assert [p for p in (elsewhere / "on").rglob("*") if p.is_file()] == []


def test_instants_of_any_name_or_size_are_not_taken_over(elsewhere: Path) -> None:
    """A name that is no time is passed by; a file of holes is not copied to the full."""
    (elsewhere / "cut" / FOLDER).mkdir(parents=True)
    for name in ("t_x.npy", "t_nan.npy", "t_1e400.npy", "t_000.0500.npy"):
        (elsewhere / "cut" / FOLDER / name).write_bytes(b"rows")
    assert _carried(elsewhere) == ["t_000.0500.npy"]
    os.truncate(elsewhere / "cut" / FOLDER / "t_000.0500.npy", MOST_BYTES + 1)
    with pytest.raises(ConfigError, match="more than 67,108,864 bytes"):
        _carried(elsewhere)


def test_frames_stay_in_the_folder_of_their_run(elsewhere: Path, home: Path) -> None:
    """The folder of a film, where none is named, is one of the run's own."""
    settings: Any = SimpleNamespace(run="run", camera="side", quality=SimpleNamespace(value="a"))
    (elsewhere / "run").mkdir()
    assert folder_of_frames(settings, "x").parts[:2] == ("run", "render")
    (elsewhere / "run" / "render").symlink_to(home)
    with pytest.raises(ConfigError, match="leads outside the folder of its run"):
        folder_of_frames(settings, "x")


FORGED = {
    "another machine": json.dumps({"pid": 1, "machine": "elsewhere", "since": "yesterday"}),
    "nobody": "",
    "no JSON": "{",
    "a list": "[1, 2]",
    "deep": "[" * 4000,
    "bytes": "\0\udcff" * 100,
    "a number": json.dumps({"pid": 10**300, "machine": None, "since": []}),
    "huge": "x" * (1 << 20),
}


@pytest.mark.parametrize("name", FORGED)
def test_what_a_stale_lock_holds_is_of_no_weight(elsewhere: Path, name: str) -> None:
    """The system knows whether a lock is held: a file that says so holds nothing."""
    (elsewhere / LOCK).write_bytes(FORGED[name].encode("utf-8", "surrogateescape"))
    assert alive(elsewhere) is False
    with held(elsewhere):
        assert alive(elsewhere)
        assert json.loads((elsewhere / LOCK).read_text())["pid"] == os.getpid()


@pytest.mark.parametrize("name", FORGED)
def test_a_holder_is_named_in_two_lines(
    elsewhere: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever holds a lock may have written anything into it."""
    monkeypatch.setattr("seals.logs.run_folder._PAUSE", 0.0)
    descriptor = open_own(elsewhere / LOCK, os.O_RDWR | os.O_CREAT)
    os.write(descriptor, FORGED[name].encode("utf-8", "surrogateescape"))
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    with pytest.raises(ConfigError, match=r"is in use: (another run|process)"), held(elsewhere):
        pass
    os.close(descriptor)


def test_a_disk_without_locks_is_said(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Some disks of a network have none: the run goes on, in words."""

    def none(*_: Any) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", none)
    with held(elsewhere) as fresh:
        assert fresh
    assert "without file locks" in capsys.readouterr().err


def test_two_processes_at_once(elsewhere: Path) -> None:
    """Of several that begin at the same moment, each folder has one at a time."""
    start = time.monotonic() + 0.2
    children = []
    for _ in range(4):
        child = os.fork()
        if child == 0:
            code = 9
            try:
                time.sleep(max(0.0, start - time.monotonic()))
                with held(elsewhere):
                    os.close(os.open(elsewhere / "in", os.O_CREAT | os.O_EXCL))
                    time.sleep(0.05)
                    (elsewhere / "in").unlink()
                code = 0
            except ConfigError:
                code = 2
            finally:
                os._exit(code)
        children.append(child)
    codes = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
    assert set(codes) <= {0, 2}
    assert 0 in codes
    assert not (elsewhere / LOCK).exists()


def test_jobs_are_noted_once_each(elsewhere: Path) -> None:
    """Processes that note their jobs at the same moment do not write over each other."""
    children = []
    for number in range(4):
        child = os.fork()
        if child == 0:
            try:
                with claimed(elsewhere, number) as lock:
                    lock.note(JOB._replace(number=number))
                os._exit(0)
            finally:
                os._exit(9)
        children.append(child)
    assert {os.waitpid(child, 0)[1] for child in children} == {0}
    assert sorted(read_jobs(elsewhere)) == [0, 1, 2, 3]
