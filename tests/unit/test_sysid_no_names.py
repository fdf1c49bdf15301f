"""System identification knows no effect by name: what an effect needs, its class says."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from seals import registry
from seals.sysid.candidates.catalogue import wave_laws

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "seals" / "sysid"
OTHER_MEANING = {
    "data/robot_description.py": {
        "centre_of_buoyancy",
        "centre_of_gravity",
        "inertia",
        "thrust_coefficient",
    },
    "experiment_design/flight.py": {"inertia"},
    "experiment_design/scene.py": {"thrust_coefficient"},
    # the mean thrusts of flights are compared with four laws in a form of their own
    "healthy_flights/comparison.py": {"payload", "thrust_coefficient"},
    "healthy_flights/explanations.py": {
        "centre_of_gravity",
        "payload",
        "thrust_coefficient",
        "weak_rotor",
    },
    "report/application.py": {"formula"},
    "residual_force/dependence.py": {"battery"},
    "residual_force/formula.py": {"lift"},
    "residual_force/laws.py": {"lift"},
    "residual_force/localisation.py": {"formula"},
    "residual_force/terms.py": {"lift"},
    "validation/answer.py": {"formula"},
    "data/known_sea.py": {"gravity"},
    "data/vehicle.py": {"battery", "gravity", "inertia"},
}
"""Words that are names of effects and mean a key of a log, a hook, an answer or a term there, or
that a comparison knows."""
INSTANCE = re.compile(r"(_(air|water|any))?(_change|_shape)?$")
"""Endings by which instances of an effect differ."""
WAVES = {"airy", *(law.candidate for law in wave_laws())}
"""Names of waves that a diagnosis may find missing, and names under which it reports them."""


def literals(path: Path) -> set[str]:
    """Return the string literals of a source, docstrings left out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    prose = {n.value for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    constants = {n for n in ast.walk(tree) if isinstance(n, ast.Constant)} - prose
    return {n.value for n in constants if isinstance(n.value, str)}


def known(path: Path) -> set[str]:
    """Return the effects that a source names, alone or as the head of ``instance.parameter``."""
    heads = {INSTANCE.sub("", text.partition(".")[0]) for text in literals(path)}
    return heads & {*registry.names("effect"), *WAVES}


def sources() -> list[str]:
    """Return all sources of system identification, relative to its folder."""
    return sorted(p.relative_to(FOLDER).as_posix() for p in FOLDER.rglob("*.py"))


@pytest.mark.parametrize("name", sources())
def test_no_effect_is_known_by_name(name: str) -> None:
    """No source holds the name of an installed effect but where it means something else."""
    allowed = OTHER_MEANING.get(name, set())
    assert known(FOLDER / name) - allowed == set()


@pytest.mark.parametrize("name", sorted(OTHER_MEANING))
def test_the_exceptions_are_needed(name: str) -> None:
    """An exception that a source no longer needs is struck from the lists."""
    allowed = OTHER_MEANING.get(name, set())
    assert allowed - known(FOLDER / name) == set()


def test_a_name_would_be_found(tmp_path: Path) -> None:
    """The search sees names in tuples and as heads of keys, not in docstrings."""
    text = '"""wind"""\nA = ("payload", "tether.length", "linear_drag_water_change.x")\n'
    (tmp_path / "source.py").write_text(text, encoding="utf-8")
    assert known(tmp_path / "source.py") == {"payload", "tether", "linear_drag"}
