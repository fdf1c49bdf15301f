"""Models that a diagnosis made: read, refused in words, used by a run."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.api import make
from seals.cli.main import main
from seals.config.compose import compose
from seals.config.overlay import load_overlay, read_overlay
from seals.control.actuator_response import respond
from seals.effects.binding import bind_effects
from seals.errors import ConfigError
from seals.registry import get
from seals.run.assembly import ROBOT
from seals.run.build import run_settings
from seals.sysid.validation.writing import withdraw, write_overlay
from seals.world.drivetrain import Drivetrain

MODEL = """
summary: drag that was missing
effects:
  tail: {effect: quadratic_drag, medium: water, coefficient_z: 4.0}
changes:
  lift: {effect: buoyancy, volume_change: 1.0e-05}
nominal:
  mass.mass: {value: 0.01, sd: 0.002, alone: 0.03}
"""


@pytest.fixture
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with one model."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "models"
    folder.mkdir()
    (folder / "tail.yaml").write_text(MODEL, encoding="utf-8")
    return folder


def test_a_model_adds_its_effects_to_a_run(models: Path) -> None:
    """The run's robot keeps its own effects; the model's come on top, and its changes are made."""
    words = ["robot=ball", "water=fossen"]
    plain, more = (run_settings([*words, *w]) for w in ([], ["+model=tail"]))
    assert set(more.effects) - set(plain.effects) == {"tail"}
    assert more.effects["tail"].coefficient_z == 4.0
    assert more.effects["tail"].correction
    assert plain.effects["buoyancy"].volume_change == 0.0
    assert more.effects["buoyancy"].volume_change == 1e-5


def test_the_added_drag_slows_the_robot(models: Path) -> None:
    """A ball with the model's drag sinks less far."""
    words = ["robot=ball", "water=fossen", "initial.position=[0,0,-1]"]
    words += ["initial.velocity=[0,0,-2]", "time.duration=0.4"]
    depths = []
    for extra in ([], ["+model=tail"]):
        world = make([*words, *extra])
        for _ in range(100):
            world.step()
        depths.append(float(world.actors[ROBOT].body.read().position[2]))
        world.close()
    assert depths[1] > depths[0] + 0.02


def test_a_run_with_a_model_can_be_repeated(
    models: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The run folder holds the model: the file may be gone."""
    words = ["robot=ball", "water=fossen", "time.duration=0.05", "hydra.run.dir=first"]
    assert main(["run", *words, "+model=tail"]) == 0
    (models / "tail.yaml").unlink()
    assert main(["run", "repeat=first"]) == 0
    assert "bit for bit" in capsys.readouterr().out


def test_without_any_model_it_is_said_how_one_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An empty list of names helps nobody."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match="seals add diagnosis=FOLDER"):
        compose(["robot=ball", "+model=nosuch"])


def test_a_model_is_chosen_by_path_as_well(models: Path) -> None:
    """``model=folder/name.yaml`` and ``model=folder/name`` are the same model."""
    (models / "tail.yaml").rename(models.parent / "other.yaml")
    for word in ("+model=./other", f"+model={models.parent}/other.yaml"):
        assert "tail" in run_settings(["robot=ball", "water=fossen", word]).effects


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("coefficient_z: 4.0", "coefficent_z: 4.0", "Did you mean 'coefficient_z'"),
        ("coefficient_z: 4.0", "coefficient_z: -4.0", "Allowed: a finite number from 0"),
        ("coefficient_z: 4.0", "coefficient_z: .nan", "Allowed: a finite number"),
        ("coefficient_z: 4.0", "coefficient_z: much", "number"),
        ("quadratic_drag", "quadratic_darg", "Did you mean 'quadratic_drag'"),
        ("medium: water", "medium: milk", "water"),
        ("volume_change", "volume", "Did you mean 'volume_change'"),
        ("effect: buoyancy", "effect: angular_drag", "not a parameter of angular_drag"),
        ("effects:", "efects:", "Did you mean 'effects'"),
        ("effect: quadratic_drag, ", "", "does not name its effect"),
        ("sd: 0.002", "sigma: 0.002", "'sigma' is not allowed here"),
        ("value: 0.01", "value: heavy", "Allowed: a finite number"),
        ("summary: drag", "summary: [drag", "cannot be read"),
    ],
)
def test_a_slip_of_the_hand_is_refused_in_words(
    models: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, words: str
) -> None:
    """Two lines, exit code 2, no traceback, no run folder."""
    assert old in MODEL
    (models / "tail.yaml").write_text(MODEL.replace(old, new, 1), encoding="utf-8")
    assert main(["run", "robot=ball", "water=fossen", "+model=tail", "time.duration=0.01"]) == 2
    said = capsys.readouterr().err.strip()
    assert words in said
    assert len(said.splitlines()) == 2
    assert not (models.parent / "runs").exists()


def test_a_change_without_its_effect_is_refused(models: Path) -> None:
    """Without water there is no buoyancy to change."""
    with pytest.raises(ConfigError, match="no effect of the kind 'buoyancy'"):
        run_settings(["robot=ball", "+model=tail"])


def test_an_unknown_model_is_refused_with_the_nearest_name(
    models: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Run and verify name the models that there are."""
    assert main(["run", "robot=ball", "+model=tial"]) == 2
    assert "Did you mean 'tail'" in capsys.readouterr().err
    assert main(["verify", "log=nowhere", "model=tial"]) == 2
    assert "Did you mean 'tail'" in capsys.readouterr().err
    assert main(["verify", "log=nowhere", "model=tail"]) == 2
    assert "log=nowhere" in capsys.readouterr().err


def test_a_written_model_reads_back(models: Path) -> None:
    """What is written is what is read, and a withdrawal keeps the rest of the file."""
    content = yaml.safe_load(MODEL)
    write_overlay(models / "again.yaml", "again", content)
    first, second = (
        read_overlay(load_overlay(models / f"{name}.yaml")) for name in ("tail", "again")
    )
    assert first.effects == second.effects
    assert first.changes == second.changes
    assert first.nominal == second.nominal
    before = (models / "again.yaml").read_text(encoding="utf-8")
    for reason in ("it: did 'not' fall", "again"):
        withdraw(models / "again.yaml", reason)
        text = (models / "again.yaml").read_text(encoding="utf-8")
        assert text.startswith(before)
        assert read_overlay(load_overlay(models / "again.yaml")).withdrawn == reason


LAW = {
    "text": "F = c (world), c = (0.1, 0, 0) N",
    "effect": {"name": "formula", "medium": "any", "parameters": {"hold_x": 0.1}},
}
ANSWER = {
    "verdict": "ambiguous",
    "effects": [
        {"name": "wind", "confidence": 0.6, "parameters": {}},
        {"name": "tether", "confidence": 0.4, "parameters": {}},
    ],
}


@pytest.mark.parametrize(
    ("change", "words", "said"),
    [
        ({}, [], "choose=wind"),
        ({}, ["choose=wnid"], "Did you mean 'wind'"),
        ({}, ["choose=wind"], "does not name its log"),
        ({"verdict": "none_of_these"}, [], "no effect of the library explains"),
        ({"verdict": "none_of_these", "formula": LAW}, [], "accept=formula: F = c (world)"),
        ({"verdict": "none_of_these"}, ["accept=formula"], "holds no formula"),
        ({"formula": LAW}, ["accept=formula"], "its verdict is ambiguous"),
        ({"verdict": "none_of_these", "formula": LAW}, ["accept=it"], "Allowed: accept=formula"),
        ({"verdict": "nothing_missing"}, [], "nothing is missing"),
        ({"verdict": "cannot_tell", "reasons": ["too still"]}, [], "too still"),
        ({"verdict": "named"}, ["name="], "name"),
        ({"verdict": "named"}, ["base=old"], "does not name its log"),
        ({"verdict": "named"}, ["colour=red"], "'colour' is not a key"),
    ],
)
def test_what_cannot_be_added_is_refused_in_words(
    models: Path,
    capsys: pytest.CaptureFixture[str],
    change: dict[str, object],
    words: list[str],
    said: str,
) -> None:
    """Each refusal says why, and what to do, in two lines."""
    (models.parent / "diagnosis.json").write_text(json.dumps({**ANSWER, **change}))
    assert main(["add", "diagnosis=.", "name=new", *words]) == 2
    error = capsys.readouterr().err.strip()
    assert said in error
    assert len(error.splitlines()) == 2
    assert not (models / "new.yaml").exists()


def test_an_existing_model_is_not_written_over(
    models: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only replace=true writes over a model."""
    (models.parent / "diagnosis.json").write_text(json.dumps(ANSWER))
    assert main(["add", "diagnosis=.", "name=tail"]) == 2
    assert "exists already" in capsys.readouterr().err


def test_the_replayed_drives_are_those_of_the_drivetrain() -> None:
    """Over a whole log at once or step by step: one law."""
    rotors = get("actuator", "rotors").load()(
        position=[[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]],
        direction=[1.0, -1.0],
        time_constant=[0.03, 0.05],
        spin_down=[0.06, 0.05],
    )
    delay = get("effect", "command_delay").load()(delay=0.0125)
    train = Drivetrain(bind_effects({"rotors": rotors, "late": delay}, ("base",)), 0)
    command = np.random.default_rng(0).uniform(200.0, 600.0, (40, 2))
    lags = {"lag": np.array([0.03, 0.05]), "fall": np.array([0.06, 0.05])}
    whole = respond(command, 0.01, **lags, delay=train.response.delay, parts=4)
    state = command[:1].copy()
    for k in range(160):
        state = train.drive(k * 0.0025, command[k // 4][None], state)
        # until the first command arrives, the first one was held for ever
        assert state == pytest.approx(whole[k // 4, k % 4][None], abs=1e-6)
