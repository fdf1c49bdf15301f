"""Configuration: schemas, composed runs, and files that grow without end."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from omegaconf import OmegaConf
from omegaconf.errors import ConfigAttributeError, ValidationError

from seals import registry
from seals.cli.main import main
from seals.config.build import build
from seals.config.checks import refuse_growth
from seals.config.compose import compose
from seals.config.derive import derive, schema_of
from seals.config.roots import experiments, recipe_groups
from seals.config.source import robot_names
from seals.config.strangers import refuse_commands, wrong_choices
from seals.errors import BrokenPlugin, ConfigError, RobotError, SealsError, UnknownPlugin
from seals.robot.robot_file import read_robot
from seals.robot.settings import HullSettings, ShapeType
from seals.run.build import build_run, run_settings
from seals.run.replay_config import recalled
from seals.schema import optional, param, vector

Install = Callable[[str, str, dict[str, str]], Path]


class Colour(enum.Enum):
    """A closed set."""

    red = "red"
    blue = "blue"


@dataclass(frozen=True, kw_only=True)
class Spring:
    """A nested, frozen part."""

    stiffness: float = param(5.0, "N/m", bounds=(0.0, 10.0), tolerance=0.1, source="chosen")


@dataclass(frozen=True, kw_only=True)
class Gadget:
    """A plug-in with a field of every allowed type."""

    mass: float = param(1.0, "kg", bounds=(0.1, 9.0), tolerance=0.1, source="chosen")
    depth: float | None = optional("m", bounds=(0.0, 10.0), source="chosen")
    axis: list[float] = vector((0.0, 0.0, 1.0), "1", bounds=(-1.0, 1.0), source="chosen")
    size: tuple[float, float] = (1.0, 2.0)
    count: int = 3
    colour: Colour = Colour.red
    spring: Spring = field(default_factory=Spring)
    springs: dict[str, Spring] = field(default_factory=dict)
    links: list[str] = field(default_factory=lambda: ["root"])
    places: list[list[float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Refuse what bounds cannot say."""
        if self.count == 13:
            raise ConfigError("count=13 brings bad luck.\nAllowed: any other number")


def node(**values: object) -> object:
    """Compose a node of Gadget's schema under the key that a run would use."""
    root = OmegaConf.create({"effects": {"gadget": OmegaConf.structured(derive(Gadget))}})
    for key, value in values.items():
        OmegaConf.update(root, f"effects.gadget.{key}", value, merge=True, force_add=True)
    return root.effects.gadget


def test_built_object_is_the_plugin_itself() -> None:
    """Types survive the way through the configuration: enum, tuple, nested frozen dataclass."""
    built = build(
        node(colour="blue", size=[3, 4], springs={"left": {"stiffness": 2}}), where="effects.gadget"
    )
    expected = Gadget(colour=Colour.blue, size=(3.0, 4.0), springs={"left": Spring(stiffness=2.0)})
    assert built == expected


def test_whole_numbers_are_numbers_in_rows_too() -> None:
    """Rows of numbers may hold whole ones, beside others."""
    built = build(node(places=[[0, 0, -3], [1, 0.5, -3]]), where="effects.gadget")
    assert built.places == [[0.0, 0.0, -3.0], [1.0, 0.5, -3.0]]
    assert all(type(number) is float for row in built.places for number in row)


def test_schema_is_open_to_change_although_the_class_is_frozen() -> None:
    """A frozen plug-in class does not make its configuration read-only."""
    config = OmegaConf.structured(derive(Gadget))
    config.mass = 2
    config.spring.stiffness = 3
    assert (config.mass, config.spring.stiffness) == (2.0, 3.0)


def test_schema_refuses_unknown_keys_and_wrong_types() -> None:
    """The derived schema is typed."""
    config = OmegaConf.structured(derive(Gadget))
    with pytest.raises(ConfigAttributeError):
        config.mss = 2
    with pytest.raises(ValidationError):
        config.mass = "heavy"


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"mass": 0.0}, "effects.gadget.mass=0.0"),
        ({"mass": float("nan")}, "effects.gadget.mass=nan"),
        ({"mass": float("inf")}, "effects.gadget.mass=inf"),
        ({"depth": -1.0}, "effects.gadget.depth=-1.0"),
        ({"axis": [0.0, 0.0, 2.0]}, "effects.gadget.axis[2]=2.0"),
        ({"axis": [0.0, 1.0]}, "effects.gadget.axis=[0.0, 1.0] has 2 numbers"),
        ({"size": [1.0, 2.0, 3.0]}, "effects.gadget.size=[1.0, 2.0, 3.0] has 3 entries"),
        ({"size": [1.0, float("nan")]}, "effects.gadget.size[1]=nan"),
        ({"spring": {"stiffness": 11.0}}, "effects.gadget.spring.stiffness=11.0"),
        ({"springs": {"left": {"stiffness": -1.0}}}, "effects.gadget.springs.left.stiffness=-1.0"),
        ({"mss": 1.0}, "effects.gadget.mss"),
        ({"places": [[0, 1], [0, "x"]]}, "effects.gadget.places[1][1]=x is not allowed"),
        ({"count": 13}, "brings bad luck"),
        ({"mass": "???"}, "effects.gadget.mass has no value"),
        ({"_target_": "os.system"}, "effects.gadget._target_=os.system is not allowed"),
    ],
)
def test_refusal_names_the_full_key(values: dict[str, object], key: str) -> None:
    """Bounds, finiteness, length and unknown keys are refused with the full key."""
    with pytest.raises(ConfigError) as refusal:
        build(node(**values), where="effects.gadget")
    assert key in str(refusal.value)
    assert len(str(refusal.value).splitlines()) == 2


def test_node_without_schema_is_refused() -> None:
    """A hand-written _target_ is not a plug-in."""
    bare = OmegaConf.create({"_target_": "os.getcwd"})
    with pytest.raises(ConfigError, match="without the schema of a plug-in"):
        build(bare, where="effects.bare")
    with pytest.raises(ConfigError, match="names no plug-in"):
        build(3, where="effects.bare")


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("class Tide:\n    pass", "is not a dataclass"),
        (
            "from dataclasses import dataclass\n@dataclass\nclass Tide:\n    height: float = 1.0",
            "fields height are not keyword-only",
        ),
        (
            "from __future__ import annotations\nfrom dataclasses import dataclass\n"
            "@dataclass(kw_only=True)\nclass Tide:\n    height: Unknown = 1.0",
            "Unknown",
        ),
    ],
)
def test_unfit_class_is_a_broken_plugin(install: Install, source: str, reason: str) -> None:
    """A plug-in that is no keyword-only typed dataclass is refused in words."""
    install("tide-reef", "[seals.effects]\ntide = tide_reef:Tide", {"tide_reef.py": source})
    with pytest.raises(BrokenPlugin, match=reason):
        schema_of(registry.get("effect", "tide"))


def test_every_installed_class_has_a_schema() -> None:
    """Every installed plug-in yields a schema that OmegaConf accepts."""
    for kind in registry.GROUPS:
        if kind in registry.FOLDER_KINDS:
            continue
        for name, plugin in registry.plugins(kind).items():
            assert "_target_" in OmegaConf.structured(schema_of(plugin)), f"{kind} {name}"


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


HEAD = "# @package _global_\n"
SECONDS = 10.0
"""Time that any of these refusals may take [s], on a busy machine."""


def folder(place: Path, **experiments: str) -> Path:
    """Write experiments, and return the folder of the configuration."""
    (place / "experiment").mkdir(parents=True)
    for name, text in experiments.items():
        (place / "experiment" / f"{name}.yaml").write_text(HEAD + text)
    return place


CHOICES = {
    "itself": {"a": "defaults: [a]\n"},
    "circle": {"a": "defaults: [b, _self_]\n", "b": "defaults: [/experiment: a]\n"},
    "reference": {"a": "defaults: [{/experiment@x: '${experiment}'}]\n"},
    "deep": {
        **{f"n{k}": f"defaults: [n{k + 1}]\n" for k in range(60)},
        **{"n60": "name: a\n", "a": "defaults: [n0]\n"},
    },
    "twice": {
        **{f"n{k}": f"defaults: [n{k + 1}@x, n{k + 1}@y]\n" for k in range(10)},
        **{"n10": "name: a\n", "a": "defaults: [n0]\n"},
    },
    "lists": {
        **{f"n{k}": f"defaults: [{{/experiment: [n{k + 1}, n{k + 1}.yaml]}}]\n" for k in range(10)},
        **{"n10": "name: a\n", "a": "defaults: [n0]\n"},
    },
}


SAID = {"deep": "more than 40 levels", "twice": "files read", "lists": "files read"}


@pytest.mark.parametrize("case", CHOICES)
def test_choices_have_an_end(case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Circles, long ways, and files that are read twice at each level are refused at once."""
    place, begin = folder(tmp_path / "conf", **CHOICES[case]), time.process_time()
    words = ["--config-dir", str(place), "experiment=a", f"hydra.run.dir={tmp_path / 'run'}"]
    assert main(["run", "robot=ball", *words]) == 2
    assert time.process_time() - begin < SECONDS
    said = capsys.readouterr().err
    assert SAID.get(case, "chooses itself") in said
    assert not (tmp_path / "run").exists()


def test_choices_of_a_trusted_folder_end_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A circle in one's own folder is no traceback either."""
    place = folder(tmp_path / "conf", **CHOICES["circle"])
    words = ["--config-dir", str(place), "--trust", "experiment=a"]
    assert main(["run", "robot=ball", *words, f"hydra.run.dir={tmp_path / 'run'}"]) == 2
    assert "refers to itself" in capsys.readouterr().err


def test_sound_choices_are_let_through(tmp_path: Path) -> None:
    """Other groups, packages, options that are installed, absolute places."""
    files = {
        "a": "defaults: [b, /robot: ball, override /water: none, optional c@x, {gone: null}]\n",
        "b": "defaults: [_self_]\nname: b\n",
    }
    refuse_commands(folder(tmp_path / "conf", **files))
    assert wrong_choices({"a/b": ["c", "c"], "a/c": []}) is None


GROWING: dict[str, Any] = {
    "itself": {"name": "${name}"},
    "two": {"name": "${seed}", "seed": "${name}"},
    "parent": {"meta": {"a": "${meta}"}},
    "relative": {"meta": {"a": "${..meta}"}},
    "texts": {**{f"x{k}": f"${{x{k + 1}}}${{x{k + 1}}}" for k in range(30)}, "x30": "a"},
    "parts": {
        **{f"x{k}": {"l": f"${{x{k + 1}}}", "r": f"${{x{k + 1}}}"} for k in range(16)},
        "x16": ["a" * 250],
    },
    "hidden": {
        **{f"x{k}": {"l": f"${{y{k}.l}}${{y{k}.l}}"} for k in range(30)},
        **{f"y{k}": f"${{x{k + 1}}}" for k in range(30)},
        "x30": {"l": "a"},
    },
    "row": {**{f"x{k}": f"${{x{k + 1}}}" for k in range(2000)}, "x2000": 1},
}


@pytest.mark.parametrize("tree", GROWING.values(), ids=GROWING)
def test_references_have_an_end(tree: dict[str, Any], tmp_path: Path) -> None:
    """In plain data, and in the stored configuration of a run, before anything fills them in."""
    import yaml

    with pytest.raises(ConfigError, match=r"refers to itself|in a row|after substitution"):
        refuse_growth(tree)
    (tmp_path / ".hydra").mkdir()
    (tmp_path / ".hydra" / "config.yaml").write_text(yaml.safe_dump(tree))
    with pytest.raises(ConfigError, match=r"refers to itself|in a row|after substitution"):
        recalled(tmp_path, key="repeat")


def test_a_reference_to_itself_ends_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On the command line, in a folder, and in Python."""
    for words in (["name=${name}"], ["name=${seed}", "seed=${name}"]):
        assert main(["run", "robot=ball", *words, f"hydra.run.dir={tmp_path / 'run'}"]) == 2
        assert "refers to itself" in capsys.readouterr().err
    with pytest.raises(ConfigError, match="refers to itself"):
        compose(["robot=ball", "name=${name}"])
    with pytest.raises(ConfigError, match="refers to itself"):
        refuse_commands(folder(tmp_path / "conf", a="name: ${name}\n"))


def test_usual_references_are_let_through() -> None:
    """Of every shipped root, and of values beside each other, above, or in lists."""
    refuse_growth(compose(["robot=ball"]))
    refuse_growth(
        {"a": [1, {"b": "${..[0]}", "c": "x ${d.e} ${d.e}"}], "d": {"e": 2, "f": "${.e}"}}
    )
    refuse_growth({"a": "${gone}", "b": "${oc.env:HOME}"})
