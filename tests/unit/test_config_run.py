"""A run composes from typed groups and robot folders, and builds checked objects."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals import registry
from seals.config.compose import compose
from seals.config.roots import experiments, recipe_groups
from seals.config.source import robot_names
from seals.errors import ConfigError, RobotError, SealsError, UnknownPlugin
from seals.robot.robot_file import read_robot
from seals.robot.settings import HullSettings, ShapeType
from seals.run.build import build_run, run_settings


def test_robot_folder_needs_no_python(pebble: Path) -> None:
    """A folder named on the command line is a robot with typed effects and hulls."""
    settings = run_settings([f"robot={pebble}", "effects.hull_drag.coefficient_y=4"])
    assert settings.robot.name == "pebble"
    assert settings.robot.urdf_path == pebble / "pebble.urdf"
    hull = settings.robot.hulls["base"]
    assert isinstance(hull, HullSettings)
    assert (hull.shapes[0].type, hull.shapes[0].size) == (ShapeType.sphere, [0.05])
    drag = settings.effects["hull_drag"]
    assert type(drag).__name__ == "DragQuadratic"
    assert (drag.coefficient_x, drag.coefficient_y, drag.links) == (3.1, 4.0, ["base"])


def test_relative_robot_folder(pebble: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A relative folder is found from the working directory, and kept as an absolute one."""
    monkeypatch.chdir(pebble.parent.parent)
    for written in ("robots_of_mine/pebble", "./robots_of_mine/pebble"):
        assert compose([f"robot={written}"]).robot.folder == str(pebble)


def test_gravity_is_always_there_and_water_brings_buoyancy(pebble: Path) -> None:
    """``water=none`` adds nothing; ``water=fossen`` adds a surface at zero and buoyancy."""
    dry = run_settings([f"robot={pebble}"])
    wet = run_settings([f"robot={pebble}", "water=fossen"])
    assert set(dry.effects) == {"gravity", "hull_drag"}
    assert dry.environment.water_level is None
    assert set(wet.effects) == {"gravity", "hull_drag", "buoyancy"}
    assert wet.environment.water_level == 0.0


def test_gravity_that_a_robot_states_besides_is_that_of_the_run(pebble: Path) -> None:
    """The folder of a robot in a log lists every effect that it was simulated with."""
    sheet = pebble / "robot.yaml"
    text = sheet.read_text(encoding="utf-8")
    assert "effects:\n" in text
    text = text.replace("effects:\n", "effects:\n  gravity: {effect: gravity}\n")
    sheet.write_text(text, encoding="utf-8")
    assert list(run_settings([f"robot={pebble}"]).effects).count("gravity") == 1


def test_missing_effect_is_one_override(pebble: Path) -> None:
    """A second drag is added by one override and has its own parameters."""
    added = ["+effect@effects.second=quadratic_drag", "effects.second.coefficient_z=2"]
    settings = run_settings([f"robot={pebble}", *added])
    assert settings.effects["second"].coefficient_z == 2.0
    assert settings.effects["hull_drag"].coefficient_z == 0.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("- a\n- b\n", "Allowed: a mapping"),
        ("urdf: [unclosed", "must be YAML text"),
        ("summary: nothing else\n", "is not a file"),
        ("urdf: elsewhere.urdf\n", "pebble.urdf"),
        ("urdf: pebble.urdf\nefects: {}\n", "Did you mean 'effects'"),
        ("urdf: pebble.urdf\nfixed_base: perhaps\n", "true or false"),
        ("urdf: pebble.urdf\neffects: {a: {coefficient_x: 1}}\n", "Add the line 'effect: NAME'"),
        (
            "urdf: pebble.urdf\neffects: {a: {effect: wind, _target_: os.system}}\n",
            "begin with '_'",
        ),
        ("urdf: pebble.urdf\neffects: {a: {effect: wnd}}\n", "Did you mean 'wind'"),
        ("urdf: pebble.urdf\neffects: {a: {effect: wind, vel: 1}}\n", "effects.a"),
        ("urdf: pebble.urdf\nhulls: {base: {shapes: [{type: bal}]}}\n", "sphere"),
        ("urdf: !!python/object:os.system {}\n", "cannot be read"),
    ],
)
def test_bad_robot_file_is_refused_in_words(pebble: Path, text: str, words: str) -> None:
    """A wrong ``robot.yaml`` is refused in two lines that say what is wrong."""
    (pebble / "robot.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(SealsError) as refusal:
        run_settings([f"robot={pebble}"])
    assert words in str(refusal.value)
    assert len(str(refusal.value).splitlines()) == 2


def test_robot_file_that_is_not_text(pebble: Path) -> None:
    """A ``robot.yaml`` of random bytes is refused in words."""
    (pebble / "robot.yaml").write_bytes(b"\xff\xfe\x00\x80" * 40)
    with pytest.raises(RobotError, match="UTF-8"):
        read_robot(pebble)


def test_folder_without_robot_file(tmp_path: Path) -> None:
    """A folder without ``robot.yaml`` is no robot."""
    with pytest.raises(UnknownPlugin, match=r"no folder .* with a robot\.yaml"):
        compose([f"robot={tmp_path / 'empty'}"])


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("environment.water_temperature=[[0,10],[0,5]]", "is not a profile"),
        ("environment.water_temperature=[[0,400]]", "-5 to 100 degC"),
        ("environment.salinity=[]", "is not a profile"),
        ("environment.salinity=[[0,salty]]", "is not a profile"),
        ("seed=-1", "a whole number from 0"),
        ("name=a/b", "folder's name"),
        ("initial.velocity=[0,0,101]", "initial.velocity[2]=101.0"),
        ("+effects.bare=1", "names no plug-in"),
        ("++time.stp=1", "Did you mean 'step'"),
        ("++tme.step=1", "'tme' is not a key"),
        ("time.step=???", "time.step has no value"),
    ],
)
def test_values_that_types_let_through_are_refused(pebble: Path, override: str, words: str) -> None:
    """Profiles, seeds, names and forced keys are checked when the run is built."""
    with pytest.raises(ConfigError) as refusal:
        run_settings([f"robot={pebble}", override])
    assert words in str(refusal.value)


@pytest.mark.thorough
def test_every_option_of_every_group_composes(pebble: Path) -> None:
    """Each installed plug-in, robot, water and experiment composes and builds."""
    for kind in ("backend", "wave"):
        for name in registry.names(kind):
            run_settings([f"robot={pebble}", f"{kind}={name}"])
    # all at once: each is a node of its own
    names = registry.names("effect")
    tried = run_settings([f"robot={pebble}", *(f"+effect@effects.a_{n}={n}" for n in names)])
    assert {f"a_{name}" for name in names} <= set(tried.effects)
    for path in recipe_groups()["water"]:
        run_settings([f"robot={pebble}", f"water={path.stem}"])
    for name in robot_names():
        assert run_settings([f"robot={name}"]).robot.name == name
    for name, root in experiments().items():
        build_run(compose([f"experiment={name}"], root=root))


def test_compare_takes_the_model_as_a_run_does(pebble: Path) -> None:
    """The comparison has a run's keys for the model, and its own for the measurement."""
    fit = "fit=[effects.hull_drag.coefficient_z]"
    config = compose([f"robot={pebble}", "reader=csv", "log=a.csv", fit], root="compare")
    assert config.reader._target_ == registry.get("reader", "csv").value.replace(":", ".")
    assert (config.log, list(config.fit)) == ("a.csv", ["effects.hull_drag.coefficient_z"])
    assert build_run(config).robot.name == "pebble"
