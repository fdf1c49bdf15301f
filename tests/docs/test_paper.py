"""The page about the paper: whole, from its rows, with commands and links that exist."""

from __future__ import annotations

import importlib.util
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from seals import registry
from seals.cli.main import VERBS
from seals.config.compose import compose
from seals.config.roots import recipe_groups
from seals.errors import SealsError
from seals.experiments.water_validation import CASES

ROOT = Path(__file__).parents[2]
SECTIONS = yaml.safe_load((ROOT / "benchmarks/paper.yaml").read_text(encoding="utf-8"))
ROWS = [row for part in SECTIONS.values() for row in part]
COMMANDS = sorted({row["run"] for row in ROWS})
HYDRA = ("run", "train", "evaluate", "compare", "teleop")
BUILT = {"reference"}
"""Folders of pages that are generated when the site is built."""


def wrong_names(rest: list[str]) -> list[str]:
    """Choices of an option by name alone that are no recipe and no plug-in."""
    recipes = {(g, path.stem) for g, paths in recipe_groups().items() for path in paths}
    pairs = (word.lstrip("+").split("=", 1) for word in rest)
    return [
        f"{group}={name}"
        for group, name in pairs
        if (group, name) not in recipes
        and name not in (registry.names(group) if group in registry.GROUPS else ())
        and not (group == "robot" and name in registry.names("animal"))
    ]


def problem(command: str) -> str:
    """What is wrong with a command, without running it; empty for nothing."""
    program, *words = shlex.split(command)
    if program == "pytest":
        return ", ".join(w for w in words if not (ROOT / w).is_file())
    if program == "python":
        known = words[0] == "-m" and importlib.util.find_spec(f"{words[1]}.__main__")
        return "" if known else "no such module"
    verb, rest = words[0], [word for word in words[1:] if not re.search(r"=[A-Z]+$", word)]
    if program == "seals" and verb in ("list", "describe"):
        return ", ".join(unknown(rest))
    if program == "seals" and verb in HYDRA:
        return mistake(verb, rest)
    if program == "seals" and verb == "validate":
        return ", ".join(set(rest) - {"water", *(case.name for case in CASES)})
    return "" if program == "seals" and verb in VERBS else "no such verb"


def unknown(rest: list[str]) -> list[str]:
    """Kinds and names that nothing has."""
    names = registry.names(rest[0]) if rest and rest[0] in registry.GROUPS else ()
    return [word for word in rest if word not in names and word not in registry.GROUPS]


def mistake(verb: str, rest: list[str]) -> str:
    """What is wrong with overrides; composed only where names alone do not tell."""
    if all(re.fullmatch(r"\+?\w+=\w+", word) for word in rest):
        return ", ".join(wrong_names(rest))
    try:
        compose(rest, root=verb)
    except SealsError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_is_one(command: str) -> None:
    """Its verb, experiment, plug-in, module or test exists, and its words compose."""
    assert problem(command) == ""


@pytest.mark.parametrize(
    "command",
    [
        *("seals rum robot=aam", "seals run experiment=hover_am", "seals describe effect wnd"),
        *("python -m seals.experiments.hover_am", "pytest tests/unit/test_nothing.py"),
    ],
)
def test_a_wrong_command_is_found(command: str) -> None:
    """A mistyped verb, experiment, name, module or test."""
    try:
        found = problem(command)
    except ModuleNotFoundError as error:
        found = str(error)
    assert found != ""


def links() -> Iterator[tuple[str, str]]:
    """Targets of the rows: path and anchor."""
    for row in ROWS:
        for target in re.findall(r"\]\(([^)]+)\)", row["here"]):
            path, _, anchor = target.partition("#")
            yield path, anchor


def anchors(page: Path) -> set[str]:
    """Anchors of the headings of a page."""
    heads = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    plain = (re.sub(r"[^\w\s-]", "", head.lower()).strip() for head in heads)
    return {re.sub(r"[\s-]+", "-", head) for head in plain}


@pytest.mark.parametrize(("path", "anchor"), sorted(set(links())))
def test_a_link_of_the_page_resolves(path: str, anchor: str) -> None:
    """The page and its heading exist; those of the reference are checked when the site is built."""
    target = (ROOT / "docs" / (path or "paper.md")).resolve()
    if path.partition("/")[0] not in BUILT:
        assert target.is_file()
        assert not anchor or anchor in anchors(target)


def test_the_page_is_that_of_its_rows() -> None:
    """At least 60 rows, each with all that it needs; the page is what the command writes."""
    spec = importlib.util.spec_from_file_location("paper", ROOT / "benchmarks/paper.py")
    assert spec is not None
    assert spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert len(ROWS) >= 60
    for row in ROWS:
        assert {"paper", "shows", "run", "here", "figure", "reached"} <= row.keys()
        assert row["reached"] in module.WORDS
        assert row["reached"] == "yes" or row["gap"]
    assert (ROOT / "docs/paper.md").read_text(encoding="utf-8") == module.page()
