"""The public interface: every name resolves, is documented, typed and imported only when used."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seals
from seals.errors import ConfigError, LogError, SealsError, UnknownPlugin
from tests.unit.test_house_imports import HEAVY

ROOT = Path(__file__).parents[2]
ALIASES = {"Array", "Parameters"}
"""Public type aliases: they carry no docstring of their own."""


def test_importing_the_package_imports_nothing_else() -> None:
    """``import seals`` loads neither another module of SEALS nor a third party's package."""
    program = (
        "import sys; before = set(sys.modules); import seals; dir(seals);"
        "print(*sorted({m.split('.')[0] for m in set(sys.modules) - before}),"
        "*[m for m in sys.modules if m.startswith('seals.')])"
    )
    run = subprocess.run(
        [sys.executable, "-S", "-c", f"import sys; sys.path[:] = {sys.path!r}; {program}"],
        capture_output=True,
        text=True,
        check=True,
    )
    # an editable installation finds the package through a module of its own
    found = {word for word in run.stdout.split() if not word.startswith("__editable__")}
    assert "seals" in found
    assert found - {"seals"} <= set(sys.stdlib_module_names)
    assert not found & (HEAVY | {"numpy", "scipy", "hydra"})


@pytest.mark.parametrize("name", seals.__all__)
def test_a_public_name_is_there_and_documented(name: str) -> None:
    """It resolves, says in a sentence what it is, and shows an example."""
    found = getattr(seals, name)
    assert name in dir(seals)
    if name != "__version__" and name not in ALIASES:
        text = inspect.getdoc(found) or ""
        summary = text.partition("\n")[0]
        assert ">>> " in text
        assert summary[:1].isupper(), summary
        assert summary[-1] in ".:", summary


def test_a_law_on_joints_needs_public_names_alone() -> None:
    """What the laws of a stranger's package use is public, the joints among it."""
    used = {"Joints", "by_joint", "Identification", "namespace", "columns", "Effect", "param"}
    assert used <= set(seals.__all__)
    still = np.zeros((2, 3))
    column = np.arange(6.0)[:, None]
    assert seals.by_joint(column, seals.Joints(still, still)).tolist() == [[0, 2, 4], [1, 3, 5]]


def test_a_type_checker_sees_the_same_names() -> None:
    """The imports for type checking are those of the table, from the same modules."""
    tree = ast.parse((ROOT / "seals" / "__init__.py").read_text(encoding="utf-8"))
    guarded = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {}
    for node in guarded.body:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                shown = alias.asname or alias.name
                seen[shown] = f"{node.module}:{alias.name}" if shown != alias.name else node.module
    assert seen == seals._HOMES
    assert set(seals.__all__) == {"__version__", *seen}


def test_a_name_that_is_not_public_is_refused() -> None:
    """A misspelt name is an AttributeError, and an ImportError in ``from seals import``."""
    with pytest.raises(AttributeError, match="no attribute 'Wrold'"):
        _ = seals.Wrold
    with pytest.raises(ImportError):
        exec("from seals import Wrold")


def test_the_reference_page_has_exactly_the_public_names() -> None:
    """Chapters of the page and the list of public names are the same set."""
    sys.path.append(str(ROOT / "docs" / "building"))
    from public_page import CHAPTERS, page

    names = [name for chapter in CHAPTERS.values() for name in chapter]
    assert sorted(names) == sorted(set(seals.__all__) - {"__version__"})
    text = page()
    assert all(f"### `{name}`" in text for name in names)


def test_one_of_several_logs_is_chosen_by_its_name(tmp_path: Path) -> None:
    """A folder of two logs needs ``only``; a wrong one names those that are there."""
    for name in ("first", "second"):
        log = seals.Log(name=name, columns={"t": [0.0, 0.1], "position_z": [1.0, 0.9]})
        seals.write_log(log, tmp_path / name)
    assert [log.name for log in seals.load_logs(tmp_path)] == ["first", "second"]
    assert seals.load_log(tmp_path, only="sec*").name == "second"
    with pytest.raises(LogError, match=r"holds 2 logs named '\*', not one"):
        seals.load_log(tmp_path)
    with pytest.raises(LogError, match="Did you mean 'second'"):
        seals.load_log(tmp_path, only="secnd")


def test_a_log_whose_name_does_not_tell_its_reader_is_refused(tmp_path: Path) -> None:
    """Content of no reader asks for one, a field that the reader lacks is named."""
    place = tmp_path / "flight.xyz"
    place.write_bytes(bytes(64))
    with pytest.raises(ConfigError, match="does not show which reader to use"):
        seals.load_log(place)
    place.write_text("t,position_z\n0,1\n0.1,0.9\n", encoding="utf-8")
    assert seals.load_log(place).rows == 2
    with pytest.raises(ConfigError, match="'colums' is not a field of the reader 'csv'"):
        seals.load_log(place, reader="csv", colums={})
    with pytest.raises(UnknownPlugin, match="Did you mean 'csv'"):
        seals.load_log(place, reader="cvs")


def test_a_run_from_python_is_that_of_the_command_line(tmp_path: Path) -> None:
    """The folder can be read again and repeated; one that is not empty is refused."""
    words = ["robot=ball", "initial.position=[0, 0, 2]", "time.duration=0.1"]
    log = seals.simulate(words, tmp_path / "fall")
    assert (tmp_path / "fall" / ".hydra" / "config.yaml").is_file()
    assert seals.load_log(tmp_path / "fall").rows == log.rows
    again = seals.make(["repeat=" + str(tmp_path / "fall")])
    # z = 2 m - g t^2 / 2, which leapfrog steps meet exactly; drag of air is below 0.5 %
    for _ in range(25):  # of 4 ms
        again.step()
    fallen = 2.0 - again.actors["robot"].body.read().position[2]
    assert fallen == pytest.approx(9.81 * 0.1**2 / 2, rel=0.005)
    again.close()
    with pytest.raises(ConfigError, match="already exists"):
        seals.simulate(words, tmp_path / "fall")
    with pytest.raises(SealsError, match="Did you mean 'ball'"):
        seals.make(["robot=bal"])


@pytest.mark.parametrize("overrides", [None, 5, [5], {"robot=ball": 1}])
def test_overrides_that_are_no_list_of_texts_are_refused(overrides: Any) -> None:
    """In words, from every function that takes them."""
    with pytest.raises(ConfigError, match="not a list of texts"):
        seals.make(overrides)


@pytest.mark.parametrize("batch", [0, -1, 1.5, "a", True, 10**9])
def test_a_batch_is_a_number_of_robots(batch: Any) -> None:
    """What is none is refused before memory is taken."""
    with pytest.raises(ConfigError, match=r"batch=.* is not allowed"):
        seals.make_batch(["robot=ball"], batch=batch)


@pytest.mark.parametrize("source", [None, 5, ["flight"]])
def test_a_log_is_read_from_a_path(source: Any) -> None:
    """Anything else is refused in words, and what is expected is shown."""
    with pytest.raises(ConfigError, match="a log is read from a path, not from"):
        seals.load_log(source)
