"""The steps of visual_catch refuse senseless words and hostile files, and lose nothing."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.experiments import command, visual_catch
from seals.experiments.visual_catch import main, pictures
from seals.experiments.visual_catch.pictures import Pictures, load_pictures, record
from seals.learn.starts import held_out_seeds
from seals.plugins.tasks.sighting.detector import network_of, save_detector

WORDS = [
    ("record --flights 0", "'0' is not allowed", "a whole number from 1"),
    ("record --flights x", "'x' is not allowed", "a whole number from 1"),
    ("record --processes 0", "--processes", "a whole number from 1"),
    ("record --limit nan", "'nan' is not allowed", "seconds above 0"),
    ("record --limit -1", "'-1' is not allowed", "seconds above 0"),
    ("record env=reach", "env=reach is not of record", "--flights"),
    ("train --flights 3", "--flights is not of train", "--pictures"),
    ("train --updates 0", "--updates", "a whole number from 1"),
    ("train --seed -1", "--seed", "a whole number from 0"),
    ("train --device cud", "device=cud is not allowed", "cpu, cuda"),
    ("measure --detector a --detector b", "given more than once", "one after the other"),
    ("judge --episodes 0", "--episodes", "a whole number from 1"),
    ("judge", "OUT is not allowed", "ends with .parquet"),
    ("show", "OUT is not allowed", "ends with .webp or .png"),
]


def flight(count: int = 30, *, size: int = 8) -> Pictures:
    """Return black pictures without an animal."""
    return Pictures(
        np.zeros((count, size, size, 3), np.uint8),
        np.zeros((count, size, size), np.uint16),
        np.zeros(count, np.int8),
        np.zeros((count, 3), np.float32),
        np.zeros(count, np.int8),
        np.ones(count, np.float32),
    )


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> None:
    """No step does any work."""

    def begun(*words: Any, **more: Any) -> None:
        raise AssertionError("work has begun")

    for name in ("record", "load_pictures", "train", "accuracy", "judge", "show"):
        monkeypatch.setattr(visual_catch, name, begun)


@pytest.mark.usefixtures("idle")
@pytest.mark.parametrize(("line", "wrong", "advice"), WORDS)
def test_senseless_words_are_refused_before_any_work(
    line: str, wrong: str, advice: str, tmp_path: Path
) -> None:
    """Each of them ended in a traceback, in work of no use, or was passed over."""
    place = tmp_path / "out"
    with pytest.raises(ConfigError) as refused:
        main([*line.split(), "--out", str(place)])
    first, second = str(refused.value).replace(str(place), "OUT").split("\n", 1)
    assert wrong in first
    assert advice in second
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("idle")
@pytest.mark.parametrize("step", ["record", "train", "measure", "judge", "show"])
def test_a_file_in_the_way_of_the_output_is_kept(step: str, tmp_path: Path) -> None:
    """A training put its folder in the place of it, after all its work."""
    there = tmp_path / "thesis"
    there.write_text("mine")
    name = {"judge": "a.parquet", "show": "a.webp"}.get(step)
    with pytest.raises(ConfigError, match="thesis"):
        main([step, "--out", str(there / name if name else there)])
    assert there.read_text() == "mine"


def test_only_a_detector_is_replaced_by_one(tmp_path: Path) -> None:
    """A training replaced whatever folder its words named, with all that was in it."""
    mine = tmp_path / "home"
    mine.mkdir()
    (mine / "thesis.txt").write_text("mine")
    with pytest.raises(ConfigError, match="so it is not overwritten"):
        main(["train", "--out", str(mine), "--pictures", str(tmp_path)])
    with pytest.raises(ConfigError, match="so it is not overwritten"):
        save_detector(mine, network_of(), {"pixel": 1.0, "threshold": 0.5})
    assert [path.read_text() for path in mine.iterdir()] == ["mine"]
    for _ in range(2):
        save_detector(tmp_path / "new", network_of(), {"pixel": 1.0, "threshold": 0.5})


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("colour", None, "colour"),
        ("colour", np.array([None]), "Object arrays"),
        ("depth", np.zeros((30, 8), np.uint16), "colour is of shape"),
        ("depth", np.zeros((30, 12, 8), np.uint16), "colour is of shape"),
        ("label", np.full(30, 7, np.int8), "label is not from -1 to 1"),
        ("label", np.zeros(30), "label is of type float64"),
        ("water", np.full(30, 99, np.int8), "water is not from 0"),
        ("place", np.full((30, 3), np.nan), "place is not finite"),
        ("focus", np.zeros(30), "focus is not above 0"),
    ],
)
def test_pictures_that_are_none_are_refused(
    name: str, value: Any, said: str, tmp_path: Path
) -> None:
    """What is missing, of another kind, shape or range is named with its file."""
    columns = {**flight()._asdict(), name: value}
    np.savez(tmp_path / "7.npz", **{k: v for k, v in columns.items() if v is not None})
    with pytest.raises(ConfigError, match=r"7\.npz holds no pictures") as refused:
        load_pictures(tmp_path)
    assert said in str(refused.value)


@pytest.mark.parametrize("content", [b"", b"words", b"PK\x03\x04" + 40 * b"\0"])
def test_files_that_are_damaged_are_refused(content: bytes, tmp_path: Path) -> None:
    """One that an interruption left, or of another program."""
    (tmp_path / "7.npz").write_bytes(content)
    with pytest.raises(ConfigError, match=r"7\.npz holds no pictures"):
        load_pictures(tmp_path)


def test_pictures_that_swell_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small file whose arrays fill the memory is not unpacked."""
    monkeypatch.setattr(pictures, "_MOST_BYTES", 20_000)
    np.savez_compressed(tmp_path / "7.npz", **flight(100)._asdict())
    assert (tmp_path / "7.npz").stat().st_size < 20_000
    with pytest.raises(ConfigError, match="bytes are unpacked"):
        load_pictures(tmp_path)


def test_sizes_are_not_mixed_and_few_pictures_are_not_learned_from(tmp_path: Path) -> None:
    """Pictures of two cameras' sizes ended in a traceback, and so did one picture."""
    np.savez(tmp_path / "1.npz", **flight(4)._asdict())
    with pytest.raises(ConfigError, match="4 pictures are too few"):
        main(["train", "--pictures", str(tmp_path), "--out", str(tmp_path / "d")])
    np.savez(tmp_path / "2.npz", **flight(4, size=16)._asdict())
    with pytest.raises(ConfigError, match="several sizes"):
        load_pictures(tmp_path)
    (tmp_path / "1.npz").unlink()
    np.savez(tmp_path / "2.npz", **flight(4, size=9)._asdict())
    with pytest.raises(ConfigError, match="must be multiples of 4"):
        load_pictures(tmp_path)


def test_flights_that_are_there_are_not_flown_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An interrupted recording goes on; flights that judge are kept apart from those that teach."""
    flown: list[int] = []

    def fly(seed: int, *words: Any, **more: Any) -> Pictures:
        flown.append(seed)
        return flight(3)

    monkeypatch.setattr(pictures, "_flight", fly)
    work = {"processes": 1, "limit": 60.0}
    assert record(tmp_path, flights=2, held_out=False, **work) == 6
    assert record(tmp_path, flights=3, held_out=False, **work) == 9
    assert flown == [0, 1, 2]
    with pytest.raises(ConfigError, match="holds flights to learn from"):
        record(tmp_path, flights=1, held_out=True, **work)
    assert record(tmp_path / "held", flights=1, held_out=True, **work) == 3
    assert flown[3:] == held_out_seeds(1)
    with pytest.raises(ConfigError, match="holds flights that judge"):
        record(tmp_path / "held", flights=1, held_out=False, **work)


@pytest.mark.parametrize("words", [["env=reach"], ["env=catch", "backend=mujoco"]])
def test_only_what_cameras_see_is_shown(words: list[str], tmp_path: Path) -> None:
    """Environments without cameras ended in tracebacks of three kinds."""
    with pytest.raises(ConfigError, match="nothing is seen by cameras"):
        main(["show", "--out", str(tmp_path / "a.webp"), *words])


def test_errors_of_the_system_are_told_by_experiments(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk and a folder without the right to write: two lines, exit code 2."""

    def full(words: Any) -> int:
        raise OSError(28, "No space left on device", "/data/a.npz")

    assert command.ended(full) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2
    monkeypatch.setattr(command.os, "access", lambda path, mode: False)
    with pytest.raises(ConfigError, match="may not be written"):
        command.folder_of(Namespace(out=tmp_path / "a"), "a")
