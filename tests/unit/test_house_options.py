"""Optional attributes of a plug-in are protocol fields with defaults, not guesses by name."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROOMS = ("seals", "plugins", "robots", "animals", "experiments")
ALLOWED = {
    "experiments/water_drag_loop/__init__.py": 1,
    "plugins/readers/ros_streams.py": 2,
    "seals/arrays.py": 2,
    "seals/cli/describe.py": 1,
    "seals/config/refusal.py": 7,
    "seals/effects/derived.py": 1,
    "seals/hydrostatics/octahedron.py": 1,
    "seals/isolated_reading.py": 2,
    "seals/multibody/equations.py": 1,
    "seals/multibody/kinematics.py": 1,
    "seals/registry.py": 1,
    "seals/rendering/gather.py": 1,
    "seals/report/page.py": 1,
    "seals/robot/macros_child.py": 4,
    "seals/state_file.py": 3,
    "seals/sysid/candidates/catalogue.py": 5,
    "seals/sysid/experiment_design/scene.py": 1,
    "seals/sysid/validation/writing.py": 1,
    "seals/teleop/application.py": 1,
    "seals/testing/declaration.py": 1,
    "seals/testing/hooks.py": 2,
    "seals/untrusted_io.py": 5,
}
"""Calls ``getattr(thing, "name", default)`` by file; entries are removed, never added."""


def guesses(file: Path) -> int:
    """Count the calls of getattr with a literal name and a default."""
    text = file.read_text("utf-8")
    if "getattr(" not in text:
        return 0
    calls = (n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Call))
    return sum(
        isinstance(call.func, ast.Name)
        and call.func.id == "getattr"
        and len(call.args) == 3
        and isinstance(call.args[1], ast.Constant)
        for call in calls
    )


def test_no_further_attribute_is_guessed_by_name() -> None:
    """`seals.plugin_options.options_of` completes a plug-in; what remains asks foreign objects."""
    files = (file for room in ROOMS for file in (ROOT / room).rglob("*.py"))
    found = Counter({str(file.relative_to(ROOT)): guesses(file) for file in files})
    assert dict(+(found - Counter(ALLOWED))) == {}, "give the protocol a field with a default"
    assert dict(Counter(ALLOWED) - found) == {}, "take what is gone off the list"


def test_the_search_finds_a_guess(tmp_path: Path) -> None:
    """A literal name with a default is found; one without, or a computed name, is not."""
    file = tmp_path / "some.py"
    file.write_text('a = getattr(x, "y", 0)\nb = getattr(x, "y")\nc = getattr(x, name, 0)\n')
    assert guesses(file) == 1
