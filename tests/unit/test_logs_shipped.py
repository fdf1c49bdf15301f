"""Logs are found by path or short name, and a folder that is no log is refused in words."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

from seals.cli.main import main
from seals.errors import ConfigError
from seals.logs.check_meta import check_meta
from seals.logs.log import Log
from seals.logs.shipped import find_log, shipped_logs

pytestmark = pytest.mark.usefixtures("elsewhere")

NAME = "hidden_effect/flight_a"


@pytest.fixture
def flight(elsewhere: Path) -> Path:
    """A copy of a shipped log that a test may spoil."""
    return Path(shutil.copytree(shipped_logs()[NAME], elsewhere / "flight"))


def test_a_short_name_finds_the_shipped_log() -> None:
    """Without such a folder the short name stands for the log of the package."""
    assert (find_log(NAME) / "log.parquet").is_file()


def test_a_folder_goes_before_a_short_name(elsewhere: Path) -> None:
    """A folder of that name is meant when there is one."""
    (elsewhere / NAME).mkdir(parents=True)
    assert find_log(NAME) == Path(NAME)


@pytest.mark.parametrize(
    ("given", "advice"),
    [
        ("hidden_efect/flight_a", "Did you mean 'hidden_effect/flight_a'"),
        ("fligth", "Did you mean 'flight'"),
        ("no/where", "Give a log folder.  Shipped: hidden_effect/flight_a"),
        ("", "Give a log folder"),
        ("a\0b", "Give a log folder"),
        ("x" * 5000, "Give a log folder"),
    ],
)
def test_a_path_of_nothing_names_the_nearest(given: str, advice: str, flight: Path) -> None:
    """The nearest shipped log or neighbour on disk is named."""
    with pytest.raises(ConfigError) as refusal:
        find_log(given)
    assert advice in str(refusal.value)


@pytest.mark.parametrize(
    ("line", "advice"),
    [
        ("diagnose log=hidden_effct/flight_b", "Did you mean 'hidden_effect/flight_b'"),
        ("diagnose lgo=x", "Did you mean 'log'"),
        ("diagnose log=", "log= has no value"),
        ("add diagnosis=. log=hidden_effect/fight_b", "Did you mean 'hidden_effect/flight_b'"),
        ("plan effects=[wind] log=hidden/flight_a", "Did you mean 'hidden_effect/flight_a'"),
        ("diagnose log=two", "holds 2 logs"),
    ],
)
def test_every_verb_refuses_alike(
    line: str, advice: str, flight: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two lines, exit code 2, no run folder left behind."""
    for name in ("one", "other"):
        shutil.copytree(flight, elsewhere / "two" / name)
    assert main(line.split()) == 2
    said = capsys.readouterr().err
    assert advice in said
    assert len(said.strip().splitlines()) == 2
    assert not (elsewhere / "runs").exists()


def spoil(flight: Path, how: str) -> None:
    """Damage a log in one way."""
    table, meta = flight / "log.parquet", flight / "meta.yaml"
    if how == "no table":
        table.unlink()
    elif how == "no meta":
        meta.unlink()
    elif how == "truncated":
        table.write_bytes(table.read_bytes()[:60_000])
    elif how == "no vehicle":
        meta.write_text("format: hidden-effect-log\nformat_version: 1\n", encoding="utf-8")
    else:
        content = yaml.safe_load(meta.read_text(encoding="utf-8"))
        content["vehicle"]["mass"] = how
        meta.write_text(yaml.safe_dump(content), encoding="utf-8")


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("no table", "holds neither log.parquet nor log.csv"),
        ("no meta", "'flight' holds no meta.yaml beside log."),
        ("truncated", "not a valid Parquet file"),
        ("no vehicle", "meta.yaml holds no 'vehicle'"),
        ("heavy", "vehicle.mass: meta.yaml says 'heavy'; give a number above 0"),
    ],
)
def test_a_damaged_log_is_bad_data(
    how: str, words: str, flight: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 20, the reason in words, and a diagnosis that says so."""
    spoil(flight, how)
    assert main(["diagnose", "log=flight", "out=answer"]) == 20
    assert words in capsys.readouterr().out
    assert '"bad_data"' in Path("answer/diagnosis.json").read_text(encoding="utf-8")


def findings(change: dict[str, Any], part: str = "vehicle") -> list[str]:
    """What the check says of the shipped description with one part changed."""
    text = (shipped_logs()[NAME] / "meta.yaml").read_text(encoding="utf-8")
    meta = yaml.safe_load(text)
    meta[part] = {**meta[part], **change}
    return [f.channel for f in check_meta(Log(name="a", columns={"t": [0.0]}, meta=meta))]


@pytest.mark.parametrize(
    ("change", "part", "place"),
    [
        ({"mass": 0.0}, "vehicle", "vehicle.mass"),
        ({"mass": True}, "vehicle", "vehicle.mass"),
        ({"mass": None}, "vehicle", "vehicle.mass"),
        ({"inertia": [1.0, 1.0, 1.0]}, "vehicle", "vehicle.inertia"),
        ({"centre_of_gravity": [0, "a", 0]}, "vehicle", "vehicle.centre_of_gravity"),
        ({"rotors": "four"}, "vehicle", "vehicle.rotors[0]"),
        ({"hull": {"displaced_volume": -1}}, "vehicle", "vehicle.hull.displaced_volume"),
        ({"gravity": 9.81}, "environment", "environment.gravity"),
        ({"mass": {"sigma": "small"}}, "tolerance", "tolerance.mass.sigma"),
    ],
)
def test_an_impossible_description_is_found(change: dict[str, Any], part: str, place: str) -> None:
    """The entry at fault is named."""
    assert place in findings(change, part)


def test_a_sound_description_passes() -> None:
    """The shipped logs are sound; a measurement without a model of its own need not state one."""
    assert findings({}) == []
    bare = Log(name="a", columns={"t": [0.0]}, meta={"vehicle": {"name": "ball"}, "baseline": []})
    assert check_meta(bare) == []
