"""``seals new``: the plug-ins that it makes keep the contract of their kind as they stand."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from seals import registry
from seals.cli.main import main
from seals.errors import ConfigError
from seals.logs.reader import logs_by, reader_of
from seals.run.build import run_settings
from seals.run.goals import goal_results
from seals.run.simulation import simulate
from seals.testing import (
    check_controller,
    check_effect,
    check_guide,
    check_reader,
    check_sensor,
    check_task,
)
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
    assert run_settings([f"robot={pebble}", *added]).effects["mine"].strength == 2.0


def test_the_printed_steps_install_what_they_call(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """SEALS itself needs no pytest: the printed installation brings it before it is called."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "effect", "whirl"]) == 0
    steps = [line.strip() for line in capsys.readouterr().out.splitlines()]
    install = steps.index("pip install -e './seals-whirl[test]'")
    assert install < steps.index("pytest seals-whirl")
    made = (tmp_path / "seals-whirl" / "pyproject.toml").read_text(encoding="utf-8")
    extra = made.partition("[project.optional-dependencies]\n")[2].partition("\n\n")[0]
    assert ast.literal_eval(extra.removeprefix("test = ")) == ["pytest>=8"]


def test_a_new_sensor_keeps_its_contract(packaged: Install) -> None:
    """It reads when due, repeats itself under one seed, and declares what it reads."""
    packaged("sensor", "speed_log", {})
    assert check_sensor("speed_log").channels == {"speed_log": 3}


def test_a_new_reader_knows_its_files(
    packaged: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It keeps its contract, and a file is read without its name; one that is damaged is told."""
    packaged("reader", "tin_can", {})
    file = tmp_path / "dive.dat"
    rows = "".join(
        f"{0.01 * k:.2f} 0 0 1 0 0 {90 * math.cos(0.1 * k) * math.cos(k)}\n" for k in range(400)
    )
    file.write_text(f"# tin_can 1\n{rows}", encoding="utf-8")
    report = check_reader("tin_can", file)
    assert (report.rows, report.channels) == (400, ("angular_velocity", "specific_force"))
    (log,) = logs_by(registry.get("reader", reader_of(file)).load()(), file)
    assert log.channel("specific_force")[0].tolist() == [0.0, 0.0, 9.80665]
    assert log.channel("angular_velocity")[0, 2] == pytest.approx(math.pi / 2)
    file.write_text("# tin_can 1\n0 0 0\n", encoding="utf-8")
    assert main(["convert", str(file), f"out={tmp_path / 'log'}"]) == 2
    assert "Allowed: seven numbers a row" in capsys.readouterr().err


def test_a_broken_reader_of_a_stranger_hinders_no_other(tmp_path: Path, install: Install) -> None:
    """A package whose module ends in an error is passed over where a kind of file is looked for."""
    points = "[seals.readers]\nshaky = shaky_seals:Reader\n"
    install("shaky-seals", points, {"shaky_seals.py": "raise ImportError('no luck')\n"})
    file = tmp_path / "flight.bin"
    file.write_bytes(b"\xa3\x95\x80" + bytes(200))
    assert reader_of(file) == "dataflash"
    file.write_bytes(b"\x01\x02 something else")
    with pytest.raises(ConfigError, match="does not show which reader"):
        reader_of(file)


@pytest.mark.parametrize(
    ("kind", "check"),
    [("controller", check_controller), ("guide", check_guide), ("task", check_task)],
)
def test_a_new_plugin_of_control_keeps_its_contract(
    packaged: Install, kind: str, check: Callable[..., Any]
) -> None:
    """Installed by its own entry point, it passes the check that its own test calls."""
    folder = packaged(kind, "circling", {})
    assert (
        f'check_{kind}("circling", robot="auv")' in (folder / "tests/test_circling.py").read_text()
    )
    assert check("circling", robot="auv").name == "circling"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("controller", ["controller=my_own", "guide=hover", "guide.position=[0.5,0,-2.2]"]),
        ("guide", ["guide=my_own", "controller=station", "guide.period=20"]),
    ],
)
def test_a_new_plugin_of_control_flies(packaged: Install, kind: str, words: list[str]) -> None:
    """Beside one that ships, the guide's circle and the controller's place come within 10 cm."""
    packaged(kind, "my_own", {})
    around = ["robot=auv", "water=fossen", "initial.position=[0,0,-2]", "time.duration=12"]
    record = simulate(run_settings([*words, *around, "time.step=0.008"]))
    assert record.error is None
    (result,) = goal_results(record)
    assert result.distance < 0.1, str(result)


@pytest.mark.thorough
def test_a_new_task_is_trained(
    packaged: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the command that was printed: a field of the task hid one of its laws."""
    packaged("task", "my_own", {})
    line = next(text for text in capsys.readouterr().out.splitlines() if "seals train" in text)
    few = [
        "course.steps=300",
        "learner.random_steps=100",
        "course.episodes=2",
        f"out={tmp_path}/trained",
    ]
    assert main([*line.split()[1:], *few]) == 0


@pytest.mark.parametrize("kind", ["effect", "sensor", "controller", "guide", "task", "reader"])
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
