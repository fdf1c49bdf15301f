"""A folder, a robot or a log is given by position or by name, to every verb alike."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals.cli.main import VERBS, main
from seals.cli.words import with_keys

PLACES = {
    "robot": ("mine", "robot.yaml"),
    "log": ("flight", "meta.yaml"),
    "run": ("flown", "run.json"),
    "repeat": ("flown", "run.json"),
    "diagnosis": ("answer", "diagnosis.json"),
    "policy": ("trained", "card.json"),
    "resume": ("cut", ".hydra/overrides.yaml"),
    "folder": ("many", "0/run.json"),
}
NAMES = {
    "robot": "ball",
    "experiment": "drop_test",
    "log": "hidden_effect/flight_a",
    "policy": "scripted",
    "learner": "sac",
    "env": "reach",
    "script": "keys.csv",
    "model": "found",
}
CASES = [(verb, key) for verb, one in VERBS.items() for key in one.takes]


@pytest.fixture
def desk(elsewhere: Path) -> Path:
    """A folder with one folder of each kind, and a model."""
    for folder, file in (*PLACES.values(), ("models", "found.yaml")):
        (elsewhere / folder / file).parent.mkdir(parents=True, exist_ok=True)
        (elsewhere / folder / file).touch()
    return elsewhere


@pytest.mark.parametrize(("verb", "key"), CASES)
@pytest.mark.usefixtures("desk")
def test_by_position_and_by_name_are_the_same(verb: str, key: str) -> None:
    """A word without its key gets the key of what it names; with it, it stays as it is."""
    takes = VERBS[verb].takes
    values = [NAMES[key]] if key in NAMES else []
    values += [PLACES[key][0]] if key in PLACES else []
    assert values
    for value in values:
        assert with_keys(verb, takes, [value, "seed=1"]) == [f"{key}={value}", "seed=1"]
        assert with_keys(verb, takes, [f"{key}={value}"]) == [f"{key}={value}"]


@pytest.mark.parametrize("verb", ["run", "render", "diagnose", "check", "runs", "export", "view"])
def test_a_flag_keeps_its_value(verb: str) -> None:
    """What follows a flag with a value is that value."""
    words = ["--config-dir", "theirs", "--cfg", "job"]
    assert with_keys(verb, VERBS[verb].takes, words) == ["--config-dir=theirs", "--cfg=job"]


def test_several_logs_are_a_list(desk: Path) -> None:
    """Flights of one vehicle, fitted together."""
    (desk / "flight 2").mkdir()
    (desk / "flight 2" / "meta.yaml").touch()
    found = with_keys("diagnose", ("log", "robot"), ["flight", "ball", "flight 2"])
    assert found == ["log=[flight,flight 2]", "robot=ball"]


def test_a_robot_is_checked_by_position(pebble: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command itself: both ways print the same."""
    said = []
    for word in (str(pebble), f"robot={pebble}"):
        assert main(["check", word]) == 0
        said.append(capsys.readouterr().out)
    assert said[0] == said[1]


@pytest.mark.parametrize("verb", sorted(VERBS))
def test_help_of_a_verb(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """``seals help VERB`` is ``seals VERB --help``; no line is longer than a hundred signs."""
    assert main(["help", verb]) == 0
    told = capsys.readouterr().out
    assert main([verb, "--help"]) == 0
    assert told == capsys.readouterr().out
    assert told.startswith(f"seals {verb}: {VERBS[verb].summary}")
    assert max(map(len, told.splitlines())) <= 100


@pytest.mark.parametrize(
    ("verb", "line"),
    [
        ("run", "time.step                 length of one step (1e-05 to 0.1 s, default 0.004)"),
        ("render", "quality                   size and samples of the frames (draft|paper, "),
        ("compare", "out                       folder of the results"),
        ("verify", "older                     further log folders of the same vehicle"),
    ],
)
def test_help_tells_unit_choices_and_default(
    verb: str, line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each key stands in a line with what it means, what it may be, and what it is."""
    assert main(["help", verb]) == 0
    assert f"\n  {line}" in capsys.readouterr().out


def test_each_key_of_help_has_a_meaning() -> None:
    """No key of a verb stands without a word."""
    from seals.cli.options import keys_of
    from seals.config.roots import VERBS as ROOTS

    assert [(verb, key.name) for verb in ROOTS for key in keys_of(verb) if not key.meaning] == []
