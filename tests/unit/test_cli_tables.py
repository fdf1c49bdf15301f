"""Lists, descriptions, help and the doctor."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import seals
from seals import registry
from seals.cli.main import VERBS, main

Install = Callable[[str, str, dict[str, str]], Path]


@pytest.mark.parametrize("words", [[], ["--help"], ["-h"], ["help"]])
def test_help_names_every_verb(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """``seals`` alone and ``seals --help`` show all verbs."""
    assert main(words) == 0
    out = capsys.readouterr().out
    assert all(f"  {verb}" in out for verb in VERBS)


@pytest.mark.parametrize("verb", sorted(VERBS))
def test_every_verb_has_help_with_an_example(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """``seals VERB --help`` shows usage and an example without composing anything."""
    assert main([verb, "--help"]) == 0
    assert f"\n  seals {verb}" in capsys.readouterr().out


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    """``seals --version`` prints the version."""
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"seals {seals.__version__}\n"


def test_list_shows_name_package_and_summary(capsys: pytest.CaptureFixture[str]) -> None:
    """``seals list effect`` has one line an effect."""
    assert main(["list", "effects"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == registry.names("effect")
    assert any("aam-seals" in line and "Quadratic drag" in line for line in lines)


def test_list_shows_learners_and_recipes_for_them_once(capsys: pytest.CaptureFixture[str]) -> None:
    """A kind that has plug-ins and recipes shows both, and is one kind."""
    assert main(["list", "learners"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    names = [line[0] for line in lines]
    assert {*registry.names("learner"), "sac_many"} <= set(names)
    assert len(names) == len(set(names))
    assert next(line for line in lines if line[0] == "sac_many")[1] == "recipe"
    assert main(["list"]) == 0
    heads = [x for x in capsys.readouterr().out.splitlines() if x and not x.startswith(" ")]
    assert len(heads) == len(set(heads))


def test_describe_shows_the_file_of_a_recipe(capsys: pytest.CaptureFixture[str]) -> None:
    """What ``learner=sac_many`` sets can be read, and where it stands."""
    assert main(["describe", "learner", "sac_many"]) == 0
    out = capsys.readouterr().out
    assert "sac_many.yaml" in out.splitlines()[0]
    assert "batch: 8192" in out


def test_describe_tells_inherited_fields_once(capsys: pytest.CaptureFixture[str]) -> None:
    """What a base class says of its fields follows, but not what the class says of them itself."""
    assert main(["describe", "controller", "gait"]) == 0
    out = capsys.readouterr().out
    own, base = out.index("    duty: share"), out.index("Fields of Walker:")
    assert own < base < out.index("    stroke: longest way")
    assert main(["describe", "effect", "wind"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n    links: ") == 1
    assert "Fields of Effect:\n    correction: True" in out


def test_list_and_help_do_not_import_hydra() -> None:
    """The quick verbs stay quick: they load no Hydra, no NumPy, nothing that is slow to load."""
    probe = (
        "import sys; from seals.cli.main import main; main(['list']); main(['--help']);"
        "slow = {'hydra', 'omegaconf', 'numpy', 'scipy', 'pandas', 'pyarrow', 'torch', 'pybullet'};"
        "assert not slow & set(sys.modules), slow & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-I", "-c", probe], check=True, stdout=subprocess.DEVNULL)


def test_describe_shows_units_bounds_and_equation(capsys: pytest.CaptureFixture[str]) -> None:
    """``seals describe`` shows a plug-in's equation and the physics of each parameter."""
    assert main(["describe", "effect", "quadratic_drag"]) == 0
    out = capsys.readouterr().out
    assert "Equation:" in out
    row = next(line for line in out.splitlines() if line.startswith("  coefficient_x "))
    assert "N s^2/m^2" in row
    assert "0 to 1e+07" in row


def test_one_broken_package_is_reported_and_stops_nothing(
    install: Install,
    pebble: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A broken plug-in is marked by the doctor, refused when chosen, harmless otherwise."""
    # those that do compose are composed by the test of a sound machine
    monkeypatch.setattr("seals.cli.doctor.experiments", lambda: {"drop_test": "run"})
    monkeypatch.setattr("seals.config.source.robot_names", lambda: ["ball"])
    install(
        "bad-reef",
        "[seals.effects]\ntidal_bore = bad_reef.effects:TidalBore\n"
        "[seals.conf]\nbad = bad_reef.missing_conf",
        {"bad_reef/__init__.py": "", "bad_reef/effects.py": "import not_there_at_all"},
    )
    assert main(["list", "effect"]) == 0
    assert main(["doctor"]) == 1
    out = capsys.readouterr().out
    assert "FAULT  effect tidal_bore" in out
    assert "not_there_at_all" in out
    assert "FAULT  conf bad" in out
    assert main(["run", f"robot={pebble}", "+effect@effects.tide=tidal_bore"]) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("BrokenPlugin: effect 'tidal_bore'")
    assert "seals doctor" in second
    assert main(["run", f"robot={pebble}", "--cfg", "job"]) == 0


@pytest.mark.thorough
def test_doctor_finds_this_machine_sound(capsys: pytest.CaptureFixture[str]) -> None:
    """With nothing broken the doctor says so and exits with 0."""
    assert main(["doctor", "full=true"]) == 0, capsys.readouterr().out
    assert "All is well." in capsys.readouterr().out
