"""The verb convert: a foreign log becomes a log folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals.cli.main import main
from seals.logs import read_native

TABLE = "stamp,gauge\n" + "\n".join(f"{10 * k},{50 + (7 * k) % 5}" for k in range(60)) + "\n"
MAP = "reader: csv\ncolumns: {stamp: t, gauge: depth}\nunits: {stamp: ms, gauge: cm}\n"


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a table, its map, and facts on the vehicle."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tank.csv").write_text(TABLE)
    (tmp_path / "map.yaml").write_text(MAP)
    (tmp_path / "facts.yaml").write_text("vehicle: {name: raft, mass: 2.5}\n")
    return tmp_path


def test_a_table_with_a_map_becomes_a_log_folder(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Reader, columns and units come from the map, the vehicle from meta; no run folder is left."""
    assert main(["convert", "log=tank.csv", "map=map.yaml", "meta=facts.yaml", "out=tank"]) == 0
    assert "tank: 60 rows, depth" in capsys.readouterr().out
    log = read_native(bench / "tank")
    assert log.time[:2].tolist() == [0.0, 0.01]
    assert log.columns["depth"][1] == pytest.approx(0.52)
    assert log.meta["vehicle"]["mass"] == 2.5
    assert not (bench / "runs").exists()


def test_a_folder_is_replaced_only_when_told_and_only_a_log(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without replace nothing is overwritten; with it, never a folder that is no log."""
    words = ["convert", "log=tank.csv", "map=map.yaml", "out=tank"]
    assert main(words) == 0
    assert main(words) == 2
    assert "replace=true" in capsys.readouterr().err
    assert main([*words, "replace=true"]) == 0
    assert main([*words[:-1], f"out={bench}", "replace=true"]) == 2
    assert "is not a log folder" in capsys.readouterr().err
    assert (bench / "tank.csv").exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (MAP.replace("columns", "colums"), "columns"),
        (MAP.replace("cm", "furlong"), "furlong"),
        (MAP + "_target_: os.system\n", "states _target_"),
        (MAP + "name: '${oc.env:HOME}'\n", "holds a reference"),
        (MAP.replace("reader: csv", "reader: cvs"), "csv"),
    ],
)
def test_a_wrong_map_is_refused(
    content: str, words: str, bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Unknown fields, units and readers, targets and references end in two lines."""
    (bench / "map.yaml").write_text(content)
    assert main(["convert", "log=tank.csv", "map=map.yaml", "out=tank"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 2
    assert words in " ".join(said)
    assert not (bench / "tank").exists()


def test_a_log_that_no_verb_could_use_is_not_written(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Time that runs backwards is refused before anything is written."""
    (bench / "tank.csv").write_text(TABLE.replace("\n300,", "\n3,"))
    assert main(["convert", "log=tank.csv", "map=map.yaml", "out=tank"]) == 2
    assert "backwards" in capsys.readouterr().err
    assert not (bench / "tank").exists()
