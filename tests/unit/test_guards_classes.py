"""A stranger's file names no class but an installed plug-in's, unless its reader says --trust."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from seals.cli.main import main
from seals.config.build import build
from seals.config.checks import SPECIAL
from seals.config.compose import compose
from seals.config.overlay import load_overlay
from seals.config.strangers import refuse_commands, untrusted
from seals.errors import ConfigError, RobotError
from seals.robot.robot_file import read_robot
from seals.robot.structure import expanded

pytestmark = pytest.mark.usefixtures("elsewhere")

HEAD = "# @package _global_\ndefaults:\n- override /robot: ball\n"
URDF = '<robot name="r"><link name="base"/></robot>'
WRITER = "seals.logs.atomic.write_text"
"""A function that leaves a mark, and that no list of dangerous names holds."""


def strange(text: str, place: str = "experiment/theirs.yaml") -> Path:
    """A stranger's folder of configuration with one file."""
    file = Path("theirs") / place
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return Path("theirs")


def refused(capsys: pytest.CaptureFixture[str], words: list[str]) -> str:
    """Return the words of a refusal that ran nothing."""
    assert main(words) == 2
    assert not Path("mark").exists()
    assert not Path("runs").exists()
    return capsys.readouterr().err


@pytest.mark.parametrize("inside", ["{_target_: %s, path: mark, text: a}", "[{_target_: %s}]"])
def test_a_class_deep_inside_of_a_map_is_not_made(
    inside: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Hydra would call every mapping with _target_, also below a value that may hold anything."""
    Path("map.yaml").write_text(f"meta: {{vehicle: {inside % WRITER}}}\n")
    Path("a.csv").write_text("t,depth\n" + "".join(f"{k / 100},1\n" for k in range(40)))
    words = ["convert", "log=a.csv", "reader=csv", "map=map.yaml", "out=made"]
    assert "is not allowed" in refused(capsys, words)


@pytest.mark.parametrize("key", SPECIAL)
def test_hydras_special_keys_below_a_free_value_are_refused(key: str) -> None:
    """None of them is a value."""
    node = compose(["reader=csv"], root="convert").reader
    node.meta = {"a": [{"b": {key: WRITER}}]}
    with pytest.raises(ConfigError, match=f"reader.meta.a.0..b.{key}=.* is not allowed"):
        build(node, where="reader")


def test_a_class_behind_a_reference_is_not_made() -> None:
    """A reference is followed: what it leads to would be made."""
    config = compose(["reader=csv"], root="convert")
    config.reader.meta = {"a": "${reader.columns}", "b": "${reader.meta.c}", "c": {"d": 1}}
    config.reader.meta.c = {"_target_": WRITER, "path": "mark", "text": "a"}
    with pytest.raises(ConfigError, match="is not allowed"):
        build(config.reader, where="reader")
    config.reader.meta = {"a": "${reader.meta}"}
    with pytest.raises(ConfigError):
        build(config.reader, where="reader")


@pytest.mark.parametrize(
    ("place", "text"),
    [
        ("experiment/theirs.yaml", f"hydra: {{callbacks: {{a: {{_target_: {WRITER}}}}}}}"),
        ("experiment/theirs.yaml", "hydra: {job: {env_set: {LD_PRELOAD: ./theirs.so}}}"),
        ("experiment/theirs.yaml", "hydra: {searchpath: [file:///elsewhere]}"),
        ("experiment/theirs.yaml", "defaults: [{override /hydra/launcher: joblib}]"),
        ("experiment/theirs.yaml", "defaults: [{'more@hydra.callbacks.a': b}]"),
        ("experiment/theirs.yaml", "defaults: [{'${group}': b}]"),
        ("experiment/theirs.yaml", "defaults: [/../../elsewhere/b]"),
        ("experiment/theirs.yaml", "defaults: [{/effect@effects.a: ../../elsewhere}]"),
        ("experiment/theirs.yaml", f"effects: {{a: {{_target_: {WRITER}, path: mark}}}}"),
        ("experiment/theirs.yaml", "reader: {meta: [{_args_: [1]}]}"),
        ("more/b.yaml", "# @package hydra.callbacks.a\n_target_: builtins.print\n"),
        ("more/b.yaml", "#@package\thydra.job\nname: a\n"),
        ("hydra/callbacks/b.yaml", "a: 1\n"),
        ("more/b.yaml", "a: !!python/object/apply:os.system ['true']\n"),
        ("more/b.yaml", "a: " + "[" * 5000),
    ],
)  # fmt: skip
def test_a_strangers_folder_only_sets_values(
    place: str, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever turns to Hydra, names another class, or leads out of the folder is refused."""
    strange(HEAD, "experiment/theirs.yaml")
    folder = strange(text if text.startswith("#") or "more/" in place else text + "\n", place)
    words = ["run", "--config-dir", str(folder), "experiment=theirs", "time.duration=0.05"]
    assert "if you trust it, use: --config-dir FOLDER --trust" in refused(capsys, words)


def test_a_broken_file_is_no_question_of_trust(capsys: pytest.CaptureFixture[str]) -> None:
    """It is refused in words with the trust of its user and without, its line named."""
    folder = strange("name: [x\n", "experiment/broken.yaml")
    words = ["run", "--config-dir", str(folder), "experiment=broken"]
    said = refused(capsys, words)
    assert "is not valid YAML" in said
    assert "trust" not in said
    said = refused(capsys, [*words, "--trust"])
    assert re.search(r"broken.yaml, line \d is not valid YAML: expected ','", said)


def test_links_that_lead_out_of_a_strangers_folder_are_refused() -> None:
    """A link to a folder elsewhere would bring its files in unread."""
    folder = strange(HEAD)
    Path("elsewhere").mkdir()
    (folder / "more").symlink_to(Path("elsewhere").resolve())
    with pytest.raises(ConfigError, match="link that leads outside"):
        refuse_commands(folder)


@pytest.mark.parametrize("flag", [["--config-dir", "theirs"], ["-cd", "theirs"], ["-cp", "theirs"]])
def test_every_way_to_name_a_folder_is_looked_at(flag: list[str]) -> None:
    """Long and short flags name the same folders."""
    strange("hydra: {}\n")
    with pytest.raises(ConfigError, match="has the section 'hydra'"):
        untrusted(["run", *flag])
    with pytest.raises(ConfigError, match="names folders unseen"):
        untrusted(["hydra.searchpath=[theirs]"])


def test_values_and_plug_ins_need_no_trust() -> None:
    """A folder that sets values runs as it is; a class of a plug-in may be named."""
    gravity = "_target_: seals.plugins.effects.gravity.Gravity"
    folder = strange(HEAD + "time: {duration: 0.05}\nname: theirs\n")
    strange(gravity + "\n", "more/b.yaml")
    assert main(["run", "--config-dir", str(folder), "experiment=theirs"]) == 0
    (made,) = Path("runs").glob("*/*_theirs")
    assert (made / "log.parquet").is_file()


def test_trust_lets_hydras_own_section_through() -> None:
    """With --trust a folder may say what Hydra does; without a folder there is nothing to trust."""
    folder = strange(HEAD + "hydra: {run: {dir: as_they_say}}\n")
    words = ["run", "--config-dir", str(folder), "experiment=theirs", "time.duration=0.05"]
    assert main(words) == 2
    assert not Path("as_they_say").exists()
    assert main([*words, "--trust"]) == 0
    assert Path("as_they_say/log.parquet").is_file()
    assert main(["run", "robot=ball", "--trust"]) == 2


def test_trust_makes_no_class_of_a_plug_ins_place() -> None:
    """Where a plug-in stands, no switch lets another class in."""
    folder = strange(HEAD + f"effects: {{gravity: {{_target_: {WRITER}}}}}\n")
    words = ["run", "--config-dir", str(folder), "experiment=theirs", "--trust"]
    assert main(words) == 2
    assert not Path("mark").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("urdf: r.urdf\nsummary: '${oc.env:HOME}'\n", "holds a reference"),
        ("urdf: ../r.urdf\n", "is outside"),
        ("urdf: linked.urdf\n", "is outside"),
        (
            "urdf: r.urdf\neffects: {'a@hydra.callbacks.b': {effect: gravity}}\n",
            "is not a valid name",
        ),
        ("urdf: r.urdf\neffects: {a: {effect: gravity, _target_: os.system}}\n", "begin with '_'"),
    ],
)
def test_a_robot_folder_stays_in_itself(text: str, words: str, elsewhere: Path) -> None:
    """No look at the user's surroundings, no file from outside, no place of Hydra's."""
    home = elsewhere / "theirs"
    home.mkdir()
    for place in (elsewhere, home):
        (place / "r.urdf").write_text(URDF)
    (home / "linked.urdf").symlink_to(elsewhere / "r.urdf")
    (home / "robot.yaml").write_text(text)
    with pytest.raises((RobotError, ConfigError), match=words):
        read_robot(home)


def test_a_model_looks_nothing_up() -> None:
    """A model's file holds values, no references."""
    Path("a.yaml").write_text("summary: ${oc.env:HOME}\n")
    with pytest.raises(ConfigError, match="holds a reference"):
        load_overlay(Path("a.yaml"))


@pytest.mark.parametrize(
    "expression",
    [
        "[g.gi_frame for g in [(x for x in [1])]]",
        "(lambda: ().__class__)()",
        "python.vars(python.list)",
        "python.type(1)",
        "[x for x in [().__class__.__mro__]]",
    ],
)
def test_expressions_of_a_macro_stay_arithmetic(expression: str, elsewhere: Path) -> None:
    """A xacro file computes numbers; it gets no hold of the interpreter."""
    pytest.importorskip("xacro", reason="xacro is not installed")
    file = elsewhere / "a.xacro"
    text = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="{}"/></robot>'
    file.write_text(text.format("${radians(180) + len([k for k in range(3)])}"))
    assert '"6.14' in expanded(file)
    file.write_text(text.format("${" + expression + "}"))
    with pytest.raises(RobotError, match="is not a valid name in an expression"):
        expanded(file)
