"""Configurations of strangers that choose or hold themselves, or grow without end."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

from seals.cli.main import main
from seals.config.checks import refuse_growth
from seals.config.compose import compose
from seals.config.strangers import refuse_commands, wrong_choices
from seals.errors import ConfigError
from seals.run.replay_config import recalled

HEAD = "# @package _global_\n"
SECONDS = 10.0
"""Time that any of these refusals may take [s], on a busy machine."""


def folder(place: Path, **experiments: str) -> Path:
    """Write experiments, and return the folder of the configuration."""
    (place / "experiment").mkdir(parents=True)
    for name, text in experiments.items():
        (place / "experiment" / f"{name}.yaml").write_text(HEAD + text)
    return place


CHOICES = {
    "itself": {"a": "defaults: [a]\n"},
    "circle": {"a": "defaults: [b, _self_]\n", "b": "defaults: [/experiment: a]\n"},
    "reference": {"a": "defaults: [{/experiment@x: '${experiment}'}]\n"},
    "deep": {
        **{f"n{k}": f"defaults: [n{k + 1}]\n" for k in range(60)},
        **{"n60": "name: a\n", "a": "defaults: [n0]\n"},
    },
    "twice": {
        **{f"n{k}": f"defaults: [n{k + 1}@x, n{k + 1}@y]\n" for k in range(10)},
        **{"n10": "name: a\n", "a": "defaults: [n0]\n"},
    },
    "lists": {
        **{f"n{k}": f"defaults: [{{/experiment: [n{k + 1}, n{k + 1}.yaml]}}]\n" for k in range(10)},
        **{"n10": "name: a\n", "a": "defaults: [n0]\n"},
    },
}


SAID = {"deep": "more than 40 levels", "twice": "files read", "lists": "files read"}


@pytest.mark.parametrize("case", CHOICES)
def test_choices_have_an_end(case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Circles, long ways, and files that are read twice at each level are refused at once."""
    place, begin = folder(tmp_path / "conf", **CHOICES[case]), time.process_time()
    words = ["--config-dir", str(place), "experiment=a", f"hydra.run.dir={tmp_path / 'run'}"]
    assert main(["run", "robot=ball", *words]) == 2
    assert time.process_time() - begin < SECONDS
    said = capsys.readouterr().err
    assert SAID.get(case, "chooses itself") in said
    assert not (tmp_path / "run").exists()


def test_choices_of_a_trusted_folder_end_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A circle in one's own folder is no traceback either."""
    place = folder(tmp_path / "conf", **CHOICES["circle"])
    words = ["--config-dir", str(place), "--trust", "experiment=a"]
    assert main(["run", "robot=ball", *words, f"hydra.run.dir={tmp_path / 'run'}"]) == 2
    assert "refers to itself" in capsys.readouterr().err


def test_sound_choices_are_let_through(tmp_path: Path) -> None:
    """Other groups, packages, options that are installed, absolute places."""
    files = {
        "a": "defaults: [b, /robot: ball, override /water: none, optional c@x, {gone: null}]\n",
        "b": "defaults: [_self_]\nname: b\n",
    }
    refuse_commands(folder(tmp_path / "conf", **files))
    assert wrong_choices({"a/b": ["c", "c"], "a/c": []}) is None


GROWING: dict[str, Any] = {
    "itself": {"name": "${name}"},
    "two": {"name": "${seed}", "seed": "${name}"},
    "parent": {"meta": {"a": "${meta}"}},
    "relative": {"meta": {"a": "${..meta}"}},
    "texts": {**{f"x{k}": f"${{x{k + 1}}}${{x{k + 1}}}" for k in range(30)}, "x30": "a"},
    "parts": {
        **{f"x{k}": {"l": f"${{x{k + 1}}}", "r": f"${{x{k + 1}}}"} for k in range(16)},
        "x16": ["a" * 250],
    },
    "hidden": {
        **{f"x{k}": {"l": f"${{y{k}.l}}${{y{k}.l}}"} for k in range(30)},
        **{f"y{k}": f"${{x{k + 1}}}" for k in range(30)},
        "x30": {"l": "a"},
    },
    "row": {**{f"x{k}": f"${{x{k + 1}}}" for k in range(2000)}, "x2000": 1},
}


@pytest.mark.parametrize("tree", GROWING.values(), ids=GROWING)
def test_references_have_an_end(tree: dict[str, Any], tmp_path: Path) -> None:
    """In plain data, and in the stored configuration of a run, before anything fills them in."""
    import yaml

    with pytest.raises(ConfigError, match=r"refers to itself|in a row|after substitution"):
        refuse_growth(tree)
    (tmp_path / ".hydra").mkdir()
    (tmp_path / ".hydra" / "config.yaml").write_text(yaml.safe_dump(tree))
    with pytest.raises(ConfigError, match=r"refers to itself|in a row|after substitution"):
        recalled(tmp_path, key="repeat")


def test_a_reference_to_itself_ends_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On the command line, in a folder, and in Python."""
    for words in (["name=${name}"], ["name=${seed}", "seed=${name}"]):
        assert main(["run", "robot=ball", *words, f"hydra.run.dir={tmp_path / 'run'}"]) == 2
        assert "refers to itself" in capsys.readouterr().err
    with pytest.raises(ConfigError, match="refers to itself"):
        compose(["robot=ball", "name=${name}"])
    with pytest.raises(ConfigError, match="refers to itself"):
        refuse_commands(folder(tmp_path / "conf", a="name: ${name}\n"))


def test_usual_references_are_let_through() -> None:
    """Of every shipped root, and of values beside each other, above, or in lists."""
    refuse_growth(compose(["robot=ball"]))
    refuse_growth(
        {"a": [1, {"b": "${..[0]}", "c": "x ${d.e} ${d.e}"}], "d": {"e": 2, "f": "${.e}"}}
    )
    refuse_growth({"a": "${gone}", "b": "${oc.env:HOME}"})
