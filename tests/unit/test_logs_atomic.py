"""Files that appear whole or not at all."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from pyarrow import parquet

from seals.cli.main import main
from seals.errors import SealsError
from seals.logs.atomic import (
    atomic_folder,
    atomic_path,
    write_bytes,
    write_json,
    write_table,
    write_text,
    write_yaml,
)
from seals.scaffold import robot


class _PowerCut(RuntimeError):
    pass


def _write_half(beside: Path, text: str) -> None:
    beside.write_text(text)
    raise _PowerCut


def test_interrupted_write_leaves_the_old_file(tmp_path: Path) -> None:
    """After an error in the middle the old content stands and nothing else is left."""
    file = tmp_path / "a.txt"
    file.write_text("old")
    with pytest.raises(_PowerCut), atomic_path(file) as beside:
        _write_half(beside, "half")
    assert file.read_text() == "old"
    assert [child.name for child in tmp_path.iterdir()] == ["a.txt"]


def test_the_name_appears_only_at_the_end(tmp_path: Path) -> None:
    """While the block runs there is no file of that name."""
    with atomic_path(tmp_path / "deep" / "a.txt") as beside:
        beside.write_text("whole")
        assert not (tmp_path / "deep" / "a.txt").exists()
    assert (tmp_path / "deep" / "a.txt").read_text() == "whole"


def test_a_folder_in_the_place_of_a_file_is_told_in_words(tmp_path: Path) -> None:
    """It is not removed, and the error is none of the system's."""
    (tmp_path / "a.json").mkdir()
    with pytest.raises(SealsError, match="is a folder, but a file of that name"):
        write_json(tmp_path / "a.json", {})
    assert [child.name for child in tmp_path.iterdir()] == ["a.json"]


def test_who_comes_second_replaces_nothing(tmp_path: Path) -> None:
    """Of two that make the same folder at the same time, the first one keeps it."""

    def both() -> None:
        with atomic_folder(tmp_path / "run") as second:
            (second / "log.csv").write_text("second")
            with atomic_folder(tmp_path / "run") as first:
                (first / "log.csv").write_text("first")

    with pytest.raises(SealsError, match="exists already"):
        both()
    assert (tmp_path / "run" / "log.csv").read_text() == "first"
    assert [child.name for child in tmp_path.iterdir()] == ["run"]


def test_a_new_robot_that_comes_second_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The folder of the first one stands, and the second one hears why."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.urdf").write_text(
        '<robot name="m"><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" '
        'izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    real = robot.free_name

    def outrun(*words: str, **more: str) -> Path:
        free: Path = real(*words, **more)
        free.mkdir()
        (free / "robot.yaml").write_text("first")
        return free

    monkeypatch.setattr(robot, "free_name", outrun)
    assert main(["new", "robot", "mine", "--urdf", "m.urdf"]) != 0
    assert "exists already" in capsys.readouterr().err
    assert [child.name for child in (tmp_path / "mine").iterdir()] == ["robot.yaml"]


def test_interrupted_folder_leaves_nothing(tmp_path: Path) -> None:
    """A folder that fails half-way does not appear."""
    with pytest.raises(_PowerCut), atomic_folder(tmp_path / "run") as beside:
        _write_half(beside / "log.csv", "t")
    assert list(tmp_path.iterdir()) == []


def test_folder_is_not_replaced_unasked(tmp_path: Path) -> None:
    """An existing folder is refused, and replaced as a whole when asked for."""
    target = tmp_path / "run"
    target.mkdir()
    (target / "old.txt").write_text("old")
    with pytest.raises(SealsError, match="exists already"), atomic_folder(target):
        pass
    with atomic_folder(target, replace=True) as beside:
        (beside / "new.txt").write_text("new")
    assert [child.name for child in target.iterdir()] == ["new.txt"]
    assert [child.name for child in tmp_path.iterdir()] == ["run"]


def test_interrupted_replacement_keeps_the_old_folder(tmp_path: Path) -> None:
    """An error while a replacement is written leaves the old folder as it was."""
    target = tmp_path / "run"
    target.mkdir()
    (target / "old.txt").write_text("old")
    with pytest.raises(_PowerCut), atomic_folder(target, replace=True) as beside:
        _write_half(beside / "new.txt", "half")
    assert [child.name for child in target.iterdir()] == ["old.txt"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux can exchange two names")
def test_a_folder_is_replaced_in_one_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """There is no moment without a folder of that name, in which a kill would lose it."""
    target = tmp_path / "run"
    target.mkdir()
    (target / "old.txt").write_text("old")

    def cut(*_: object) -> None:
        raise _PowerCut

    monkeypatch.setattr(os, "rename", cut)
    with atomic_folder(target, replace=True) as beside:
        (beside / "new.txt").write_text("new")
    assert [child.name for child in target.iterdir()] == ["new.txt"]
    assert [child.name for child in tmp_path.iterdir()] == ["run"]


def test_numpy_values_become_plain_data(tmp_path: Path) -> None:
    """JSON and YAML accept NumPy scalars, arrays and tuples."""
    value = {"mass": np.float64(1.5), "axis": np.array([0, 0, 1]), "size": (1, 2), "none": None}
    write_json(tmp_path / "a.json", value)
    write_yaml(tmp_path / "a.yaml", value)
    wanted = {"mass": 1.5, "axis": [0, 0, 1], "size": [1, 2], "none": None}
    assert json.loads((tmp_path / "a.json").read_text()) == wanted
    assert yaml.safe_load((tmp_path / "a.yaml").read_text()) == wanted


def test_json_refuses_nan_and_writes_nothing(tmp_path: Path) -> None:
    """NaN is not JSON: refused in words, no file."""
    with pytest.raises(SealsError, match="cannot be written as JSON"):
        write_json(tmp_path / "a.json", {"x": float("nan")})
    assert list(tmp_path.iterdir()) == []


def test_text_and_bytes_arrive_unchanged(tmp_path: Path) -> None:
    """Text is UTF-8, bytes are bytes."""
    write_text(tmp_path / "a.txt", "Größe 2 µm")
    write_bytes(tmp_path / "a.bin", b"\x00\xff")
    assert (tmp_path / "a.txt").read_bytes() == "Größe 2 µm".encode()
    assert (tmp_path / "a.bin").read_bytes() == b"\x00\xff"


def test_table_keeps_numbers_text_and_nan(tmp_path: Path) -> None:
    """A Parquet table holds numbers, NaN and text as they were."""
    write_table(tmp_path / "a.parquet", {"x": np.array([0.1, np.nan]), "name": ["a", "b"]})
    table = parquet.read_table(tmp_path / "a.parquet")
    assert table["x"].to_pylist()[0] == 0.1
    assert np.isnan(table["x"].to_pylist()[1])
    assert table["name"].to_pylist() == ["a", "b"]


def test_unequal_columns_and_other_suffixes_are_refused(tmp_path: Path) -> None:
    """A table with columns of different length, or of another kind of file, is not written."""
    with pytest.raises(SealsError, match="cannot be written"):
        write_table(tmp_path / "a.csv", {"x": [1.0], "y": [1.0, 2.0]})
    with pytest.raises(SealsError, match=r"parquet or \.csv"):
        write_table(tmp_path / "a.xlsx", {"x": [1.0]})
    assert list(tmp_path.iterdir()) == []


def test_reader_that_is_already_open_keeps_the_old_content(tmp_path: Path) -> None:
    """A file is exchanged, never rewritten: whoever has it open reads the old one whole."""
    file = tmp_path / "a.txt"
    write_text(file, "old content")
    with file.open() as reader:
        write_text(file, "new")
        assert reader.read() == "old content"
    assert file.read_text() == "new"
