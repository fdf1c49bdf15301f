"""``seals new effect`` and ``seals new sensor``: what they make keeps the contract as it stands."""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path

import pytest

from seals.cli.main import main
from seals.config.compose import compose
from seals.run.build import build_run
from seals.testing import check_effect, check_sensor
from seals.testing.scenes import Case

Install = Callable[[str, str, dict[str, str]], Path]


@pytest.fixture
def packaged(tmp_path: Path, install: Install, monkeypatch: pytest.MonkeyPatch) -> Install:
    """A function that makes a plug-in package and puts it on the path: kind, name."""

    def make(kind: str, name: str, _: dict[str, str] | None = None) -> Path:
        (tmp_path / "made").mkdir(exist_ok=True)
        monkeypatch.chdir(tmp_path / "made")
        assert main(["new", kind, name]) == 0
        folder = tmp_path / "made" / f"seals-{name.replace('_', '-')}"
        lines = (folder / "pyproject.toml").read_text(encoding="utf-8").splitlines()
        at = next(k for k, line in enumerate(lines) if "entry-points" in line)
        points = f"[seals.{kind}s]\n{lines[at + 1].replace(chr(34), '')}\n"
        sources = folder.glob("seals_*/*.py")
        files = {str(p.relative_to(folder)): p.read_text(encoding="utf-8") for p in sources}
        install(f"seals-{name}", points, files)
        return folder

    return make


def test_a_new_effect_keeps_its_contract(packaged: Install, pebble: Path) -> None:
    """Installed by its own entry point, it composes, and twin and simulator agree on it."""
    packaged("effect", "whirl", {})
    report = check_effect("whirl", steps=(0.004, 0.001), cases=[Case(("surface",), False)])
    assert report.scenes[0].moved > 0.02
    added = ["+effect@effects.mine=whirl", "effects.mine.strength=2"]
    assert build_run(compose([f"robot={pebble}", *added])).effects["mine"].strength == 2.0


def test_a_new_sensor_keeps_its_contract(packaged: Install) -> None:
    """It reads when due, repeats itself under one seed, and declares what it reads."""
    packaged("sensor", "speed_log", {})
    assert check_sensor("speed_log").channels == {"speed_log": 3}


@pytest.mark.parametrize("kind", ["effect", "sensor"])
def test_every_file_of_a_new_package_is_sound(packaged: Install, kind: str) -> None:
    """All Python parses and has docstrings; nothing of the template is left."""
    folder = packaged(kind, "two_words", {})
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert {path.name for path in files} >= {"pyproject.toml", "README.md", "test_two_words.py"}
    for path in files:
        text = path.read_text(encoding="utf-8")
        assert "{{" not in text
        assert "{%" not in text
        if path.suffix == ".py":
            assert ast.get_docstring(ast.parse(text))
