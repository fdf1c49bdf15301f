"""Checkpoints of strangers: ``seals run resume=`` refuses them in words, and runs nothing."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import ConfigError
from seals.learn.training.loop import Rows
from seals.plugins.backends.pybullet import backend, trial
from seals.run import checkpoint
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.fleet import fleet_of
from seals.run.pictures import COLUMNS, Pictures
from seals.run.recorder import Moment
from seals.run.simulation import _Books
from seals.world import World
from tests.unit.stored_states import entries, forged, parts

FLIGHT = ["robot=crazyflie", "controller=cascade", "guide=hover", "initial.position=[0,0,1]"]
FLIGHT += ["time.step=0.004", "time.duration=0.2"]
STEPS = 5


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, World, _Books]]:
    """Keep a flight after some steps; the world stands as after its start."""
    settings = run_settings(FLIGHT)
    world = build_world(settings)
    books = _Books(settings, world, fleet_of(settings), 50)
    folder = tmp_path_factory.mktemp("flown") / "checkpoint"
    start, first = world.snapshot(), books.snapshot()
    for _ in range(STEPS):
        world.step()
        books.record()
    checkpoint.write_checkpoint(folder, world, books.snapshot())
    world.restore(start)
    books.restore(first, folder.parent)
    yield folder, world, books
    world.close()


@pytest.fixture
def kept(flown: tuple[Path, World, _Books], tmp_path: Path) -> Path:
    """Copy the checkpoint."""
    return Path(shutil.copytree(flown[0], tmp_path / "run" / "checkpoint"))


def take_up(kept: Path, flown: tuple[Path, World, _Books]) -> None:
    """Take a checkpoint up as `seals.run.simulation` does."""
    _, world, books = flown
    most = checkpoint.largest_state(world, books.snapshot(), 51)
    state = checkpoint.take_up(kept, world, most=most)
    with checkpoint.refusals(kept):
        books.restore(state, kept.parent)


def test_a_checkpoint_is_taken_up(kept: Path, flown: tuple[Path, World, _Books]) -> None:
    """World and books are where they were."""
    _, world, books = flown
    start, first = world.snapshot(), books.snapshot()
    take_up(kept, flown)
    assert world.time == STEPS * world.step_size
    assert books.first.rows == STEPS + 1
    assert len(world.actors["robot"].ledger.time) == STEPS
    world.restore(start)
    books.restore(first, kept.parent)


Change = Callable[[dict[str, Any]], Any]


def entry(*path: Any, value: Any) -> Change:
    """Return a forgery: another value at a place of the state."""

    def change(about: dict[str, Any]) -> None:
        entries(parts(about["state"], *path[:-1]))[path[-1]] = value

    return change


def declared(*path: Any, row: list[Any]) -> Change:
    """Return a forgery: another shape for an array, of as many bytes."""

    def change(about: dict[str, Any]) -> None:
        number = parts(about["state"], *path)["a"]
        assert about["arrays"][number] != row
        about["arrays"][number] = row

    return change


FORGERIES: dict[str, tuple[Change, str]] = {
    "other world": (entry("world", "backend", value="BackendFree"), "its world has backend"),
    "other robot": (entry("world", "actors", value={"d": {}}), "its world has actors"),
    "other step": (entry("world", "step", value=0.1), "its world has step 0.1"),
    "no world": (entry("world", value=None), "its world has actors None"),
    "different entries": (entry("more", value=1), "different entries"),
    "forged generator": (
        entry("snapshot", "random", "robot", "state", "inc", value=2),
        "random generator",
    ),
    "steps and time": (entry("snapshot", "steps", value=7), "7 steps do not end at"),
    "steps before the start": (entry("snapshot", "steps", value=-5), "do not end at"),
    "text for a number": (entry("snapshot", "time", value="soon"), "field 'time'"),
    "other snapshot": (entry("snapshot", value={"t": []}), "this simulation has"),
    "memory of another class": (
        entry("snapshot", "scene", 0, 0, 0, value={"t": []}),
        r"state.scene\[0\]\[0\]\[0\] is an entry",
    ),
    "other rows": (entry("books", "robot.recorder", "rows", value=10**9), "1 to 51"),
    "rows as text": (entry("books", "robot.recorder", "rows", value="9"), "1 to 51"),
    "more rows than there are": (
        entry("books", "robot.recorder", "rows", value=40),
        "recorded rows of",
    ),
    "turned rows": (
        declared("books", "robot.recorder", "state", row=["<f8", "C", [13, 6]]),
        "rows of",
    ),
    "turned ledger": (
        declared("ledgers", "robot", 0, row=["<f8", "C", [1, 5]]),
        "a ledger of",
    ),
    "stages without names": (entry("books", "robot.stages", value=[1.0]), "times and names"),
    "no books": (entry("books", value=None), "cannot be resumed"),
    "no scene": (entry("scene", value=None), "scene.bin is truncated or damaged"),
}


@pytest.mark.parametrize("name", FORGERIES)
def test_forged_states_of_a_run_are_refused(
    name: str, kept: Path, flown: tuple[Path, World, _Books]
) -> None:
    """The digests are right in each; the world at hand says what can be."""
    change, words = FORGERIES[name]
    forged(kept / checkpoint.STATE, change)
    with pytest.raises(ConfigError, match=words) as refusal:
        take_up(kept, flown)
    assert "run it again" in str(refusal.value)


def test_a_class_that_writes_files_is_no_part_of_a_state(
    kept: Path, flown: tuple[Path, World, _Books], tmp_path: Path
) -> None:
    """The rows of a training write when they are made: a name of SEALS alone is no pass."""
    mark = tmp_path / "mark"
    evil = {"r": "seals.learn.training.loop:Rows", "v": {"path": str(mark), "names": ["a"]}}
    forged(kept / checkpoint.STATE, entry("books", value=evil))
    with pytest.raises(ConfigError, match="not a registered record"):
        take_up(kept, flown)
    assert not mark.exists()


def test_a_file_larger_than_the_run_is_refused(
    kept: Path, flown: tuple[Path, World, _Books]
) -> None:
    """A sparse file of 4 GiB costs its maker nothing."""
    os.truncate(kept / checkpoint.STATE, 1 << 32)
    with pytest.raises(ConfigError, match="4,294,967,296 bytes; this one has at most"):
        take_up(kept, flown)


@pytest.mark.parametrize("name", [checkpoint.STATE, checkpoint.SCENE])
@pytest.mark.parametrize("kind", ["link", "pipe", "folder"])
def test_only_ordinary_files_of_the_folder_are_read(
    name: str, kind: str, kept: Path, flown: tuple[Path, World, _Books], tmp_path: Path
) -> None:
    """Nothing is read through a link, and a pipe is not waited for."""
    file = (kept / name).rename(tmp_path / "elsewhere")
    make: dict[str, Callable[[], None]] = {
        "link": lambda: (kept / name).symlink_to(file),
        "pipe": lambda: os.mkfifo(kept / name),
        "folder": (kept / name).mkdir,
    }
    make[kind]()
    with pytest.raises(ConfigError, match=r"a regular file|cannot be opened"):
        take_up(kept, flown)


def test_the_folder_is_no_link(kept: Path, flown: tuple[Path, World, _Books]) -> None:
    """What lies elsewhere is no part of the run."""
    other = kept.rename(kept.with_name("other"))
    kept.symlink_to(other)
    with pytest.raises(ConfigError, match="it is a link"):
        take_up(kept, flown)


def test_a_changed_scene_never_reaches_the_engine(
    kept: Path, flown: tuple[Path, World, _Books], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine reads it in native code: one that is not of this state is refused before."""
    raw = bytearray((kept / checkpoint.SCENE).read_bytes())
    raw[len(raw) // 2] ^= 0xFF
    (kept / checkpoint.SCENE).write_bytes(raw)
    monkeypatch.setattr(type(flown[1].backend), "recall", lambda *given: pytest.fail("it was read"))
    with pytest.raises(ConfigError, match="truncated or damaged, or belongs to another state"):
        take_up(kept, flown)
    with (kept / checkpoint.SCENE).open("r+b") as file:
        file.truncate(checkpoint.MOST_SCENE + 1)
    with pytest.raises(ConfigError, match="more than 67,108,864 bytes"):
        take_up(kept, flown)


@pytest.mark.thorough
def test_a_scene_that_kills_the_engine_is_refused(
    kept: Path, flown: tuple[Path, World, _Books], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine follows forged addresses and lengths; a copy of the process goes first."""
    raw, alive = (kept / checkpoint.SCENE).read_bytes(), []

    def survived(attempt: Callable[[], object]) -> bool:
        alive.append(trial.survived(attempt))
        # whatever the copy came through, this process shall not try it
        return False

    monkeypatch.setattr(backend, "survived", survived)
    for place in range(100, len(raw) - 64, len(raw) // 8):
        evil = raw[:place] + b"\x7f" * 64 + raw[place + 64 :]
        (kept / checkpoint.SCENE).write_bytes(evil)
        digest = hashlib.blake2b(evil, digest_size=32).hexdigest()
        forged(kept / checkpoint.STATE, entry("scene", value=digest))
        with pytest.raises(ConfigError, match="the engine crashes on"):
            take_up(kept, flown)
    assert alive.count(False) >= 2


def test_pictures_come_from_the_run_alone(tmp_path: Path) -> None:
    """A picture is no link to a file elsewhere, and their numbers are those of an index."""
    (tmp_path / "secret").write_text("secret")
    folder = tmp_path / "cut" / "pictures" / "eye"
    folder.mkdir(parents=True)
    (folder / "000000_rgb.png").symlink_to(tmp_path / "secret")
    actor: Any = type("Actor", (), {"sensor_suite": type("Suite", (), {"cameras": {"eye": None}})})
    index = {name: np.zeros(1) for name in COLUMNS}
    pictures, world = Pictures(actor), actor
    pictures.restore({"eye": index}, 1, tmp_path / "cut")
    with pytest.raises(ConfigError, match="is not copied"):
        pictures.start(world, tmp_path / "on")
    for wrong in ({**index, "number": np.array([1e30])}, {"number": np.zeros(1)}):
        with pytest.raises(ValueError, match=r"not numbered|different columns"):
            Pictures(actor).restore({"eye": wrong}, 1, tmp_path / "cut")


class _Evil:
    def __init__(self, *call: Any) -> None:
        self.call = call

    def __reduce__(self) -> Any:
        return self.call[0], tuple(self.call[1:])


class _Flags:
    """A kind of objects with the flags of numbers: bytes of a file become addresses."""

    def __reduce__(self) -> Any:
        return np.dtype, ("O8", False, True), (3, "|", None, None, None, -1, -1, 0)


class _Crash:
    """An array of that kind; reading an element of it is a segmentation fault."""

    def __reduce__(self) -> Any:
        make, *given = np.zeros(1).__reduce__()
        return make, given[0], (1, (4,), _Flags(), False, b"A" * 32)


@pytest.mark.parametrize("attack", ["writes", "crashes", "eats", "runs"])
@pytest.mark.parametrize("name", [checkpoint.OLD, checkpoint.STATE])
def test_the_old_kind_is_refused_before_it_is_opened(
    attack: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """A pickle wrote files through constructors, crashed by forged flags, asked for gigabytes."""
    monkeypatch.chdir(tmp_path)
    mark = tmp_path / "mark"
    evil = {
        "writes": pickle.dumps(_Evil(Rows, mark, ["written by a constructor"])),
        "crashes": pickle.dumps(_Crash()),
        "eats": pickle.dumps(_Evil(np.ndarray, (1 << 30,))),
        "runs": pickle.dumps(_Evil(os.mkdir, str(mark))),
    }[attack]
    words = ["robot=ball", "time.duration=0.02"]
    assert main(["run", *words, "hydra.run.dir=cut"]) == 0
    cut = tmp_path / "cut"
    facts = json.loads((cut / "run.json").read_text())
    (cut / "run.json").write_text(json.dumps({**facts, "state": "running"}))
    (cut / "checkpoint").mkdir()
    (cut / "checkpoint" / name).write_bytes(evil)
    before = sorted(tmp_path.rglob("*"))
    assert main(["run", "resume=cut", "hydra.run.dir=on"]) == 2
    text = capsys.readouterr().err
    assert "pickle" in text
    assert "repeat=FOLDER" in text
    assert "Traceback" not in text
    assert not mark.exists()
    made = {path for path in tmp_path.rglob("*") if path not in before}
    assert {path.relative_to(tmp_path).parts[0] for path in made} <= {"on"}
    assert not (tmp_path / "on" / "log.parquet").exists()


def test_a_memory_that_only_its_owner_understands_fails_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a guide remembers is first looked at by the guide, while the run goes on."""
    monkeypatch.chdir(tmp_path)
    record = checkpoint.Checkpoints.record

    def stopping(self: checkpoint.Checkpoints, moment: Moment) -> None:
        record(self, moment)
        raise KeyboardInterrupt

    monkeypatch.setattr(checkpoint.Checkpoints, "record", stopping)
    assert main(["run", *FLIGHT, "checkpoint=1e-9", "hydra.run.dir=cut"]) == 130
    monkeypatch.setattr(checkpoint.Checkpoints, "record", record)
    # where a pilot stands in a snapshot: see `seals.world.actor.Actor.snapshot`
    memory = entry("snapshot", "actors", 0, 2, 1, "guide", value="nothing that a guide left")
    forged(Path("cut") / "checkpoint" / checkpoint.STATE, memory)
    assert main(["run", "resume=cut", "hydra.run.dir=on"]) == 2
    text = capsys.readouterr().err
    assert "may be damaged or forged" in text
    assert "Traceback" not in text
