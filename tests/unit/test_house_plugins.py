"""Every plug-in says what its parameters are, and every effect what its law is."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HEADINGS = (
    "Equation",
    "Args",
    "Assumptions",
    "Valid range",
    "Limitations",
    "References",
    "Example",
)
DECLARES = {"param", "setting", "optional", "vector"}


def plugin_classes(folder: Path) -> list[tuple[str, ast.ClassDef]]:
    """Return the dataclasses in a folder of plug-ins."""
    found = []
    for path in sorted(folder.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and any(
                "dataclass" in ast.dump(decorator) for decorator in node.decorator_list
            ):
                found.append((str(path.relative_to(folder)), node))
    return found


def bare_floats(folder: Path) -> list[str]:
    """Find float fields without unit, bounds and source."""
    found = []
    for path, cls in plugin_classes(folder):
        for node in cls.body:
            if not isinstance(node, ast.AnnAssign):
                continue
            annotation = ast.unparse(node.annotation)
            call = node.value.func if isinstance(node.value, ast.Call) else None
            declared = isinstance(call, ast.Name) and call.id in DECLARES
            if annotation in ("float", "float | None") and not declared:
                found.append(f"{path}: {cls.name}.{ast.unparse(node.target)} has no param()")
    return found


def missing_headings(folder: Path) -> list[str]:
    """Find effects whose docstring lacks a heading, or has them out of order."""
    found = []
    for path, cls in plugin_classes(folder):
        text = ast.get_docstring(cls) or ""
        given = [h for h in re.findall(r"^([A-Z][a-z ]+):", text, re.MULTILINE) if h in HEADINGS]
        if given != list(HEADINGS):
            missing = [heading for heading in HEADINGS if heading not in given]
            found.append(f"{path}: {cls.name} lacks {missing or 'the order of headings'}")
    return found


def test_every_float_of_a_plugin_has_its_physics() -> None:
    """A float field of a plug-in carries unit, bounds, tolerance and source."""
    kinds = ("backends", "waves", "effects", "sensors", "actuators", "fluids")
    assert [line for kind in kinds for line in bare_floats(ROOT / "plugins" / kind)] == []


@pytest.mark.parametrize(
    "folder",
    [ROOT / "plugins" / "effects", ROOT / "tests" / "thirdparty" / "coral-seals"],
    ids=lambda path: path.name,
)
def test_every_effect_states_its_law(folder: Path) -> None:
    """An effect's docstring has all headings, in order."""
    assert missing_headings(folder) == []


def test_the_plugin_rules_bite(tmp_path: Path) -> None:
    """A bare float and a docstring without equation are found."""
    (tmp_path / "bad.py").write_text(
        "from dataclasses import dataclass\n@dataclass(kw_only=True)\nclass Bad:\n"
        '    """Bad.\n\n    Args:\n        x: a [m].\n    """\n    x: float = 1.0\n    n: int = 1\n'
    )
    assert bare_floats(tmp_path) == ["bad.py: Bad.x has no param()"]
    assert "Equation" in missing_headings(tmp_path)[0]
