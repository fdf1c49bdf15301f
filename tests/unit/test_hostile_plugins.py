"""Installed packages whose entry points, modules or results are not what a plug-in has."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from seals import registry
from seals.cli.doctor import plug_ins
from seals.cli.main import main
from seals.errors import BrokenPlugin, SealsError
from seals.logs.reader import logs_by

Install = Callable[[str, str, dict[str, str]], Path]

MODULES = {
    "ends the program": "raise SystemExit(3)",
    "ends the program at once": "import sys; sys.exit()",
    "is interrupted by itself": "raise BaseException('boo')",
    "ends a generator": "raise GeneratorExit",
    "calls itself": "def f(): f()\nf()",
    "is no Python": "class X(",
    "holds nothing": "",
    "opens a thousand brackets": "X = " + "(" * 1000 + "1" + ")" * 1000,
    "imports itself": "from reef_law import X",
    "takes no memory": "raise MemoryError",
    "raises what has no words": "class E(Exception):\n def __str__(s): return ''\nraise E",
}


@pytest.mark.parametrize("name", MODULES)
def test_a_module_that_cannot_be_imported_is_a_broken_plug_in(name: str, install: Install) -> None:
    """Whatever it raises: lists, the doctor and every other plug-in go on."""
    install("reef", "[seals.effects]\nreef = reef_law:X\n", {"reef_law.py": MODULES[name]})
    with pytest.raises(BrokenPlugin, match=r"effect 'reef' \(reef_law:X\) of reef 1\.0"):
        registry.get("effect", "reef").load()
    with pytest.raises(BrokenPlugin):
        _ = registry.get("effect", "reef").summary
    assert registry.get("effect", "gravity").load().__name__ == "Gravity"


def test_an_interruption_is_no_fault_of_a_plug_in(install: Install) -> None:
    """Ctrl-C during an import ends the command."""
    files = {"reef_law.py": "raise KeyboardInterrupt"}
    install("reef", "[seals.effects]\nreef = reef_law:X\n", files)
    with pytest.raises(KeyboardInterrupt):
        registry.get("effect", "reef").load()


LISTS = ["[seals.effects]\nreef\n", "[seals.effects]\n= x\nreef", "[seals.effects]\nreef = a\n\xff"]


@pytest.mark.parametrize("points", LISTS, ids=ascii)
def test_a_damaged_list_of_one_package_hides_no_other(points: str, install: Install) -> None:
    """Every command ended in a traceback; the doctor names the package."""
    site = install("reef", "", {})
    (site / "reef-1.0.dist-info" / "entry_points.txt").write_bytes(points.encode("latin-1"))
    registry.refresh()
    assert "gravity" in registry.names("effect")
    assert registry.get("effect", "gravity").origin.startswith("aam-seals")
    assert len(registry.plugins("effect")) > 20, "no name counts twice"
    told = [remark for remark in plug_ins() if remark[1] == "package reef"]
    assert [state for state, _, _ in told] == ["FAULT"]
    assert "entry_points.txt is damaged" in told[0][2]


VALUES = ["os:system", "os", "nowhere:X", ":X", "a b:c", "reef_law:X.y", "builtins:int", "..x:Y"]


@pytest.mark.parametrize("value", VALUES)
def test_what_is_no_plug_in_is_not_made(value: str, install: Install) -> None:
    """An entry point may name anything: only a data class of its kind is made."""
    install("reef", f"[seals.effects]\nreef = {value}\n", {"reef_law.py": "X = 5"})
    words = ["run", "robot=ball", "+effect@effects.more=reef", "time.duration=0.01", "out=made"]
    try:
        assert main(words) == 2
    except BaseException as fault:
        pytest.fail(f"{type(fault).__name__}: {fault}")


@pytest.mark.parametrize("name", ["../../x", "a b", "\x1b[2J", "a" * 5000, "$(x)"], ids=len)
def test_odd_names_of_plug_ins_are_listed(
    name: str, install: Install, capsys: pytest.CaptureFixture[str]
) -> None:
    """They steer no terminal, and every other name is there."""
    install("reef", f"[seals.effects]\n{name} = reef_law:X\n", {"reef_law.py": "class X:\n 'doc'"})
    assert main(["list", "effects"]) == 0
    said = capsys.readouterr().out
    assert "gravity" in said
    assert "\x1b" not in said


@pytest.mark.parametrize("found", [[5], [None], "ab", None, ({},), {"a": 1}], ids=repr)
def test_a_reader_returns_logs(found: Any) -> None:
    """``diagnose``, ``convert`` and ``compare`` told an attribute of int in a traceback."""

    class Reef:
        def read(self, source: Any = None) -> Any:
            return found

    with pytest.raises(BrokenPlugin, match=r"Reef returns a \w+, not logs"):
        logs_by(Reef(), "a")


def test_a_folder_of_a_package_may_end_the_program(install: Install) -> None:
    """The package of a robot is imported to find its folder."""
    install("reef", "[seals.robots]\nreef = reef_robot\n", {"reef_robot/__init__.py": "exit(4)"})
    with pytest.raises(SealsError, match="robot 'reef'"):
        _ = registry.get("robot", "reef").summary
