"""A stranger's file sets data only: no path, no address, no permission (`seals.field_roles`)."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import typing
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from omegaconf import OmegaConf, open_dict

from seals import registry
from seals.cli.main import main
from seals.config import roots
from seals.config.compose import compose
from seals.config.foreign_values import refuse_values
from seals.environment.settings import ObstacleSettings
from seals.errors import ConfigError
from seals.field_roles import Role, parts_of, roles, roles_of
from seals.learn.evaluation.application import Variant
from seals.logs.shipped import find_log
from seals.run.object_settings import ObjectSettings

pytestmark = pytest.mark.usefixtures("elsewhere")

HEAD = "# @package _global_\ndefaults:\n- override /robot: ball\n"
FREE = (ObjectSettings, ObstacleSettings, Variant)
"""Settings of entries that no schema names."""


def schemas() -> dict[type, str]:
    """Every class of settings of all verbs and plug-ins, with where it was met."""
    found: dict[type, str] = {}
    waiting = [(roots.root_schema(name), name) for name in roots.NAMES]
    waiting += [(cls, cls.__name__) for cls in FREE]
    for kind in registry.GROUPS:
        for name in registry.names(kind):
            thing = registry.get(kind, name).load()
            if isinstance(thing, type):
                waiting.append((thing, f"{kind} {name}"))
    while waiting:
        cls, where = waiting.pop()
        if cls in found or not dataclasses.is_dataclass(cls):
            continue
        found[cls] = where
        hints = typing.get_type_hints(cls)
        for field in dataclasses.fields(cls):
            inner = [part for part in parts_of(hints[field.name]) if isinstance(part, type)]
            waiting += [(part, f"{where}.{field.name}") for part in inner]
    return found


def counted() -> Counter[str]:
    """Fields by role, each counted in the class that declares it."""
    known = {
        (base, name): role
        for cls in schemas()
        for base in cls.__mro__
        if dataclasses.is_dataclass(base)
        for name, role in roles_of(base).items()
        if name in vars(base).get("__annotations__", {})
    }
    return Counter(role.value if role else "none" for role in known.values())


def roleless() -> list[str]:
    """Fields of all settings that state no role and need one."""
    return [
        f"{where}: {cls.__name__}.{name}"
        for cls, where in schemas().items()
        for name, role in roles_of(cls).items()
        if role is None
    ]


def test_every_field_has_a_role() -> None:
    """A field that may hold text, truth or anything says what it does to the world outside."""
    assert not roleless()


@pytest.mark.parametrize(
    ("verb", "hint"),
    [("run", str), ("diagnose", bool), ("train", list[str]), ("convert", dict[str, Any])],
)
def test_a_new_field_of_a_verb_is_met(
    verb: str, hint: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever adds one to the settings of a verb, or deep inside of them, has to say its role."""
    real = roots.root_schema

    def with_field(base: Any, name: str, kind: Any) -> Any:
        field = (name, kind, dataclasses.field(default=None))
        return dataclasses.make_dataclass("More", [field], bases=(base,), kw_only=True)

    own = real(f"{verb}_schema")
    inner = with_field(object, "place", hint)
    for cls in (with_field(own, "place", hint), with_field(own, "more", dict[str, inner])):
        monkeypatch.setattr(
            roots, "root_schema", lambda name, c=cls: c if name == f"{verb}_schema" else real(name)
        )
        assert [line for line in roleless() if line.endswith("More.place")]


def test_a_field_without_role_is_found_and_refused() -> None:
    """The role of text is never guessed; that of a number is."""

    @dataclasses.dataclass(kw_only=True)
    class Bare:
        number: float = 0.0
        place: str = ""

    assert roles_of(Bare) == {"number": Role.data, "place": None}
    with pytest.raises(ConfigError, match="no field plaec"):
        roles(read="plaec")(Bare)


def test_the_page_states_how_many_there_are() -> None:
    """docs/security.md counts the fields by role."""
    page = (Path(__file__).parents[2] / "docs" / "security.md").read_text()
    stated = re.search(r"(\d+) data, (\d+) paths to read, (\d+) paths to write, (\d+) addr", page)
    assert stated is not None
    found = counted()
    names = ("data", "path to read", "path to write", "address")
    assert [int(number) for number in stated.groups()] == [found[name] for name in names]
    permissions = re.search(r"(\d+) permissions", page)
    assert permissions is not None
    assert int(permissions.group(1)) == found["permission"]


def folder(text: str, place: str = "experiment/us.yaml") -> list[str]:
    """A stranger's folder of configuration with one recipe."""
    file = Path("theirs") / place
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return ["--config-dir", "theirs", f"experiment={file.stem}"]


def others() -> Iterator[Path]:
    """What a command left behind."""
    return (path for path in Path().iterdir() if path.name not in ("theirs", "card", "sweep"))


@pytest.mark.parametrize(
    ("verb", "more", "field"),
    [
        ("run", "live:\n  listen: [unixsock-stream//tmp/x]\n", "live"),
        ("run", "live:\n  listen: [tcp/0.0.0.0:7447]\n", "live"),
        ("view", "host: 0.0.0.0\n", "host"),
        ("view", "run: /\n", "run"),
        ("compare", "out: taken\n", "out"),
        ("compare", "log: /dev/zero\n", "log"),
        ("compare", "reader: {path: /dev/zero}\n", "reader.path"),
        ("run", "objects: {a: {robot: /tmp}}\n", "objects.a.robot"),
        ("run", "objects: {a: {robot: cube, guide: {guide: stick, script: /etc/x}}}\n", "script"),
        ("run", "robot: {folder: /}\n", "robot.folder"),
        ("run", "robot: {urdf: ../../x.urdf}\n", "robot.urdf"),
        ("add", "folder: taken\nreplace: true\nname: a\ndiagnosis: /\n", "diagnosis"),
        ("calibrate", "apply: true\n", "apply"),
        ("verify", "older: [/]\n", "older"),
        ("diagnose", "log: /\n", "log"),
        ("run", "model: {name: a, file: /tmp/a.yaml}\n", "model"),
        ("verify", "model: {name: a, file: /tmp/a.yaml}\n", "model"),
    ],
)
def test_a_folder_of_configuration_sets_data_only(
    verb: str, more: str, field: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """What listens, calls, reads and writes is said on the command line."""
    head = HEAD + ("- override /live: ros2\n" if "live" in more else "")
    if verb == "compare":
        head = HEAD.replace("- override", "- override /reader: csv\n- override", 1)
    assert main([verb, *folder(head + "- _self_\n" + more)]) == 2
    said = capsys.readouterr().err
    assert re.search(rf"sets \S*{field}\S*=.* files set data only", said), said
    assert not [*others()]


def test_a_model_is_named_and_lies_in_its_folder(capsys: pytest.CaptureFixture[str]) -> None:
    """A recipe may choose models/NAME.yaml; a model elsewhere is for the command line to choose."""
    for place in ("models/mine.yaml", "elsewhere/mine.yaml"):
        Path(place).parent.mkdir()
        Path(place).write_text("effects: {more: {effect: quadratic_drag, medium: air}}\n")
    away = Path("elsewhere/mine").absolute()
    Path("models/link.yaml").symlink_to(f"{away}.yaml")
    head = HEAD.replace("- override", "- /model@model: {}\n- override")
    for name, code in (("mine", 0), (away, 2), ("link", 2)):
        text = head.format(name) + "- _self_\ntime: {duration: 0.02}\n"
        assert main(["run", *folder(text), "out=one"]) == code
        said = capsys.readouterr().err
        assert ("sets model=" in said) is (code == 2), said
    assert main(["run", *folder(text), f"model={away}", "out=two"]) == 0


def test_what_the_command_line_says_goes(capsys: pytest.CaptureFixture[str]) -> None:
    """The person may; and what they say of one field is not said of its neighbours."""
    text = HEAD + "- override /live: foxglove\n- _self_\nlive: {port: 0}\ntime: {duration: 0.02}\n"
    assert main(["run", *folder(text)]) == 2
    assert main(["run", *folder(text), "live=foxglove"]) == 2
    assert "live.port" in capsys.readouterr().err
    quick = HEAD + "- _self_\ntime: {duration: 0.02}\nenvironment: {water_level: 0.0}\n"
    assert main(["run", *folder(quick), "robot=ball"]) == 0


def test_a_card_does_not_say_where_results_go(capsys: pytest.CaptureFixture[str]) -> None:
    """Words of a policy's card set the world; a path in them is refused."""
    Path("card").mkdir()
    for verb, word in (("evaluate", "out=/tmp/x"), ("record", "hdf5=/tmp/x")):
        card = {"format": "seals-policy", "version": 1, "network": {}, "overrides": [word]}
        Path("card/card.json").write_text(json.dumps(card))
        assert main([verb, "policy=card"]) == 2
        assert "which is a path to write" in capsys.readouterr().err
    assert not [*others()]


REACHING = [
    pytest.param(name.removesuffix("_schema"), field, role, id=f"{name}.{field}")
    for name in roots.NAMES
    for field, role in roles_of(roots.root_schema(name)).items()
    if role is not Role.data
]
"""Every field of every verb that is a path, an address or a permission."""


@pytest.mark.parametrize(("verb", "field", "role"), REACHING)
def test_no_file_sets_a_field_that_reaches_out(verb: str, field: str, role: Role) -> None:
    """Whatever verb it is, and whichever of its fields."""
    config = OmegaConf.create({field: "taken"})
    with pytest.raises(ConfigError, match=rf"sets {field}=taken, which is an? {role.value}: "):
        refuse_values(config, root=verb, words=(), where="a file")
    refuse_values(config, root=verb, words=(f"{field}=taken",), where="a file")


@pytest.mark.thorough
@pytest.mark.parametrize("word", ["+live=ros2", "robot=theirs", "guide.policy=/etc", "repeat=/etc"])
def test_a_note_of_a_sweep_sets_data_only(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    """resume=SWEEP takes values from its note, and nothing that reaches out."""
    Path("sweep").mkdir()
    shutil.copytree(registry.get("robot", "ball").folder(), "theirs")
    words = ["experiment=crab_learned", "time.duration=0.01", word]
    if word == "robot=theirs":
        words = [word]
    note = {"verb": "run", "words": [w.lstrip("+") for w in words], "started": ""}
    Path("sweep/sweep.json").write_text(json.dumps(note))
    assert main(["run", "resume=sweep"]) != 0
    log = "".join(path.read_text() for path in Path("sweep").rglob("*") if path.is_file())
    assert "files set data only" in log + capsys.readouterr().err


@pytest.mark.parametrize("digest", [None, "0" * 64])
@pytest.mark.parametrize("verb", ["add", "plan"])
def test_a_diagnosis_does_not_choose_what_is_read(
    verb: str, digest: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    """The log that it notes is read where its content is the one that it notes."""
    shutil.copytree(find_log("hidden_effect/flight_a"), "private")
    note = {"path": str(Path("private").absolute()), **({"sha256": digest} if digest else {})}
    effect = {"name": "payload", "parameters": {}}
    answer = {"verdict": "named", "effects": [effect], "ambiguous_with": [["payload", "wind"]]}
    Path("theirs.json").write_text(json.dumps({**answer, "log": note}))
    more = ["name=a"] if verb == "add" else ["between=[payload,wind]"]
    Path("theirs").mkdir()
    Path("theirs.json").rename("theirs/diagnosis.json")
    assert main([verb, "diagnosis=theirs", *more]) == 2
    said = capsys.readouterr().err
    assert ("its content differs" if digest else "without its checksum") in said, said


def test_installed_things_may_be_named() -> None:
    """A recipe chooses robots and policies that are installed."""
    config = compose(["experiment=crab_learned"])
    refuse_values(config, root="run", words=(), where="a test")
    config.guide.policy = "crab/../../x"
    with pytest.raises(ConfigError, match=r"guide\.policy=crab/\.\./\.\./x, which is a path to r"):
        refuse_values(config, root="run", words=(), where="a test")


@pytest.mark.parametrize("name", ["x/../../../../VICTIM", ".hidden", "a\nb", "n" * 300, "-rf"])
def test_a_name_is_no_path(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The folder of a run is named by its name, before any verb sees it."""
    text = HEAD + f"- _self_\nname: {json.dumps(name)}\n"
    for verb in ("run", "diagnose"):
        assert main([verb, *folder(text)]) == 2
        assert "cannot be part of a folder's name" in capsys.readouterr().err
    assert not [*others()]


def test_instances_are_named_by_words() -> None:
    """The name of a camera is that of a folder of pictures."""
    from seals.run.build import build_run

    config: Any = compose(["robot=ball", "water=none"])
    with open_dict(config):
        config.effects["../../x"] = config.effects.gravity
    with pytest.raises(ConfigError, match="this name is not allowed"):
        build_run(config)
