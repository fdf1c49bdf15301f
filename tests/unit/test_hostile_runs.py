"""Run folders and recipes of a stranger: nothing is looked up, nothing hangs, nothing leads out."""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from seals.cli.main import main
from seals.errors import ConfigError, SealsError
from seals.run.replay_config import recalled
from seals.sweep.rows import find_rows

SECRET = "mother's maiden name"
HEAD = "# @package _global_\ndefaults:\n  - override /robot: ball\n  - _self_\n"
SHORT = ["time.step=0.01", "time.duration=0.03", "initial.position=[0,0,1]"]
LOOKUPS = [
    "${oc.env:SECRET}",
    "a${oc.env:SECRET}b",
    "${oc.decode:${oc.env:SECRET}}",
    "${${x}:SECRET}",
    "${now:%Y}",
    "${hydra:runtime.cwd}",
    "${hydra.runtime.cwd}",
    "${oc.create:{a: 1}}",
]
FEW = [*LOOKUPS[:3], *(pytest.param(text, marks=pytest.mark.thorough) for text in LOOKUPS[3:])]
"""The others are refused by the same words; make thorough tries them."""
MORE_LOOKUPS = [
    "${oc.env:SECRET,a}",
    "${oc.env: SECRET}",
    "${ oc.env:SECRET }",
    "${oc.env:'SECRET'}",
    "${seed}${oc.env:SECRET}",
    "${oc.select:robot.name}",
    "${oc.dict.values:robot}",
    "${oc.deprecated:robot.name}",
    "${oc.decode:'${oc.env:SECRET}'}",
    "${oc.${x}:SECRET}",
    "${python:os}",
    ["${oc.env:SECRET}"],
    {"a": {"b": "${oc.env:SECRET}"}},
]
BAD = ["pipe", "endless", "deep", "list", "half", "folder", "huge"]
MORE_BAD: dict[str, bytes | str] = {
    "noise": "/dev/urandom",
    "memory": "/proc/self/mem",
    "itself": "run.json",
    "nothing behind": "absent",
    "UTF-16": '{"state": "done"}'.encode("utf-16"),
    "half a pair": b'{"state": "\\ud800"}',
    "long number": b'{"seed": ' + b"9" * 100_000 + b"}",
    "many entries": b"[" + b"0," * 2_000_001 + b"0]",
    "mappings in mappings": b'{"a":' * 100_000,
    "zero bytes": bytes(1000),
    "two": b"{}{}",
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run, made once."""
    folder = tmp_path_factory.mktemp("whole") / "a"
    assert main(["run", "robot=ball", *SHORT, f"hydra.run.dir={folder}"]) == 0
    return folder


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder, with something to find in the environment."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SECRET", SECRET)
    return tmp_path


@pytest.fixture
def received(whole: Path, elsewhere: Path) -> Path:
    """The run as it came from a stranger."""
    shutil.copytree(whole, elsewhere / "received")
    return elsewhere / "received"


def leaks(folder: Path) -> Iterator[Path]:
    """Yield the files in which the secret stands."""
    for path in folder.rglob("*"):
        if path.is_file() and SECRET.encode() in path.read_bytes():
            yield path


@pytest.mark.parametrize("text", FEW)
def test_a_strangers_recipe_looks_nothing_up(elsewhere: Path, text: str) -> None:
    """It is refused in words; with the trust of its user it may."""
    place = elsewhere / "theirs" / "experiment"
    place.mkdir(parents=True)
    (place / "x.yaml").write_text(f"{HEAD}name: {json.dumps(text)}\n")
    words = ["run", "--config-dir", "theirs", "experiment=x", *SHORT]
    assert main(words) == 2
    assert not list(leaks(elsewhere))


def test_a_trusted_recipe_does(elsewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What was looked up stands in the configuration, so that a repeat needs it no more."""
    place = elsewhere / "theirs" / "experiment"
    place.mkdir(parents=True)
    (place / "x.yaml").write_text(HEAD + "name: ${oc.env:SECRET}\n")
    words = ["run", "--config-dir", "theirs", "experiment=x", *SHORT, "hydra.run.dir=a"]
    assert main(words) == 2
    assert "if you trust it" in capsys.readouterr().err
    assert main([*words, "--trust"]) == 0
    assert recalled(Path("a")).name == SECRET


@pytest.mark.parametrize("text", FEW)
def test_a_strangers_run_looks_nothing_up(received: Path, text: str) -> None:
    """Neither when it is repeated nor resumed nor replayed."""
    config = received / ".hydra" / "config.yaml"
    config.write_text(config.read_text() + f"water_type: {json.dumps(text)}\n")
    for key in ("repeat", "resume", "replay"):
        with pytest.raises(ConfigError, match="looks something up"):
            recalled(received, key=key)


@pytest.mark.parametrize("value", MORE_LOOKUPS, ids=repr)
def test_no_way_to_write_a_lookup_is_followed(received: Path, value: object) -> None:
    """With a default, blanks, quotes, inside of others, in lists and mappings."""
    config = received / ".hydra" / "config.yaml"
    config.write_text(config.read_text() + f"water_type: {json.dumps(value)}\n")
    with pytest.raises(ConfigError):
        recalled(received)


@pytest.mark.parametrize("name", MORE_BAD)
def test_no_note_is_waited_for_or_trusted(received: Path, name: str) -> None:
    """What lies in the place of a note is answered by every reader of run folders."""
    content, note = MORE_BAD[name], received / "run.json"
    note.unlink()
    note.symlink_to(content) if isinstance(content, str) else note.write_bytes(content)
    start = time.perf_counter()
    (row,) = find_rows(received)
    assert row.damage
    with pytest.raises(SealsError, match=r"run\.json"):
        recalled(received)
    assert time.perf_counter() - start < 10.0


def test_a_reference_to_a_key_is_no_lookup(received: Path) -> None:
    """What stays inside of the configuration may be said."""
    config = received / ".hydra" / "config.yaml"
    config.write_text(config.read_text().replace("name: run\n", "name: ${robot.name}\n", 1))
    assert recalled(received).name == "ball"


@pytest.mark.parametrize("name", ["../../../out", "a/../../../../out"])
def test_a_name_leads_nowhere(elsewhere: Path, name: str) -> None:
    """The folder of a run is below the folder of runs."""
    (elsewhere / "in").mkdir()
    os.chdir(elsewhere / "in")
    assert main(["run", "robot=ball", *SHORT, f"name={name}"]) == 2
    assert list(elsewhere.rglob("*")) == [elsewhere / "in"]


def spoil(path: Path, how: str) -> None:
    """Put something in the place of a note."""
    path.unlink(missing_ok=True)
    if how == "pipe":
        os.mkfifo(path)
    elif how == "endless":
        path.symlink_to("/dev/zero")
    elif how == "deep":
        path.write_text("[" * 100_000)
    elif how == "list":
        path.write_text("[1]")
    elif how == "half":
        path.write_text('{"state": "do')
    elif how == "folder":
        path.mkdir()
    else:
        with path.open("wb") as file:
            file.truncate(1 << 40)


@pytest.mark.parametrize("how", BAD)
def test_strange_notes_are_answered_at_once(
    received: Path, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """``runs``, ``repeat``, ``resume`` and ``plan`` answer in words, whatever lies there."""
    spoil(received / "run.json", how)
    start = time.perf_counter()
    assert main(["runs", str(received)]) == 0
    assert ("damaged" in capsys.readouterr().out) or how == "list"
    assert main(["run", f"repeat={received}", "hydra.run.dir=b"]) == 2
    assert main(["run", f"resume={received}", "hydra.run.dir=b"]) == 2
    assert "run.json" in capsys.readouterr().err
    assert time.perf_counter() - start < 30.0


@pytest.mark.parametrize("how", BAD)
def test_strange_answers_are_refused_at_once(elsewhere: Path, how: str) -> None:
    """``add`` and ``plan`` read the answer of a diagnosis."""
    from seals.sysid.validation.answer import load_answer, read_answer

    spoil(elsewhere / "diagnosis.json", how)
    for read in (load_answer, lambda place: read_answer(place, choose=None)):
        with pytest.raises(ConfigError):
            read(elsewhere)
