"""House rule: names that were given up for the field's own terms do not come back."""

from __future__ import annotations

import ast
import doctest
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIST = Path(__file__).with_name("retired_names.txt")
FOLDERS = ("seals", "plugins", "robots", "animals")
OF_A_LIBRARY = {"seals/sysid/parallel.py": {"Pool"}}
"""Names of a library by the file that calls them."""


def retired() -> dict[str, str]:
    """Return the term that took the place of each retired name."""
    lines = LIST.read_text(encoding="utf-8").splitlines()
    pairs = [line.partition(" -> ") for line in lines if line and not line.startswith("#")]
    return {old: new for old, _, new in pairs}


def identifiers(tree: ast.AST) -> Iterator[str]:
    """Every name that a module defines, imports, reads or passes by keyword, examples included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and ">>> " in node.value:
            for example in doctest.DocTestParser().get_examples(node.value):
                yield from identifiers(ast.parse(example.source))
        for field in ("id", "attr", "arg", "name", "asname"):
            value = getattr(node, field, None)
            if isinstance(value, str):
                yield from value.split(".")
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from node.module.split(".")


def breaches(root: Path, folders: tuple[str, ...]) -> list[str]:
    """Find retired names in the Python files of some folders, names of modules included."""
    old, found = retired(), []
    for folder in folders:
        for path in sorted((root / folder).rglob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            names = {*identifiers(tree), path.stem}
            names -= OF_A_LIBRARY.get(path.relative_to(root).as_posix(), set())
            found += [
                f"{path.relative_to(root)}: '{name}' is now '{old[name]}'"
                for name in sorted(names & set(old))
            ]
    return found


def test_no_retired_name_comes_back() -> None:
    """No Python file of the core, the plug-ins, the robots or the animals holds one."""
    assert all((ROOT / folder).is_dir() for folder in FOLDERS)
    assert breaches(ROOT, FOLDERS) == []


def test_the_list_gives_a_term_for_each_name_once() -> None:
    """Each line has an old name, which is an identifier, and a term in its place."""
    lines = LIST.read_text(encoding="utf-8").splitlines()
    entries = [line for line in lines if line and not line.startswith("#")]
    assert len(entries) == len(retired())
    assert all(old.isidentifier() and new for old, new in retired().items())


def test_the_rule_bites(tmp_path: Path) -> None:
    """A class, a parameter, an import, an example and a file of a retired name are found."""
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "company.py").write_text(
        "from seals.nests import x\nclass Felt: ...\n"
        'def f(askew):\n    """Do it.\n\n    >>> f(Outfit())\n    """\n',
        encoding="utf-8",
    )
    assert breaches(tmp_path, ("room",)) == [
        "room/company.py: 'Felt' is now 'SensorInput'",
        "room/company.py: 'Outfit' is now 'RobotEquipment'",
        "room/company.py: 'askew' is now 'axis_misalignment'",
        "room/company.py: 'company' is now 'object_recorder'",
        "room/company.py: 'nests' is now 'pytree'",
    ]
