"""Files of strangers: nothing in them is run, nothing outside their folder is read."""

from __future__ import annotations

import json
import socket
from pathlib import Path

import pytest
import yaml

from seals.cli.main import main
from seals.config.build import build
from seals.config.compose import compose
from seals.config.overrides import refuse_dangerous
from seals.errors import ConfigError, RobotError
from seals.hydrostatics.meshes import hull_from_mesh, refuse_strange_format
from seals.robot.urdf import read_urdf
from seals.scaffold.resources import find_resource
from seals.untrusted_io import plain_yaml
from seals.view.settings import ViewSettings

ENTITY = (
    '<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a SYSTEM "file:///etc/hostname">]>'
    '<robot name="r"><link name="&a;"/></robot>'
)


@pytest.mark.parametrize("coding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_entities_of_a_urdf_are_refused_in_any_coding(coding: str, tmp_path: Path) -> None:
    """UTF-16 without its mark looks like UTF-8 with zero bytes, and a parser would expand it."""
    file = tmp_path / "robot.urdf"
    file.write_bytes(ENTITY.encode(coding))
    with pytest.raises(RobotError, match=r"DOCTYPE or an ENTITY|not UTF-8"):
        read_urdf(file)


@pytest.mark.parametrize("coding", ["utf-8", "utf-16-le"])
def test_entities_of_a_mesh_are_refused(coding: str, tmp_path: Path) -> None:
    """COLLADA is XML, too."""
    file = tmp_path / "hull.dae"
    file.write_bytes('<!DOCTYPE c [<!ENTITY a "b">]><COLLADA>&a;</COLLADA>'.encode(coding))
    with pytest.raises(RobotError, match="DOCTYPE or an ENTITY"):
        hull_from_mesh(file)


@pytest.mark.parametrize("name", ["hull.zip", "hull.3mf", "hull.json", "hull.pkl", "hull"])
def test_only_plain_meshes_are_opened(name: str, tmp_path: Path) -> None:
    """The mesh library opens archives as well; a robot needs none."""
    (tmp_path / name).write_bytes(b"PK\3\4")
    with pytest.raises(RobotError, match="is not a mesh file"):
        refuse_strange_format(tmp_path / name, "mesh")
    with pytest.raises(RobotError, match="is not a mesh file"):
        hull_from_mesh(tmp_path / name)


def test_a_manifest_with_entities_declares_nothing(tmp_path: Path) -> None:
    """A package.xml is believed only without declarations."""
    package = tmp_path / "named"
    (package / "urdf" / "deep").mkdir(parents=True)
    (package / "meshes").mkdir()
    (package / "meshes" / "a.stl").write_bytes(b"solid")
    text = "<package><name>{}</name></package>"
    (package / "package.xml").write_text(text.format("other"))
    arguments = ("package://other/meshes/a.stl", package / "urdf" / "deep" / "r.urdf", {})
    assert find_resource(*arguments) == (package / "meshes" / "a.stl").resolve()
    declared = '<!DOCTYPE p [<!ENTITY a "other">]>' + text.format("&a;")
    (package / "package.xml").write_text(declared)
    with pytest.raises(RobotError):
        find_resource(*arguments)


@pytest.mark.parametrize(
    "word",
    [
        "+hydra.callbacks.a={_target_:os.system}",
        "hydra/launcher=joblib",
        "hydra={}",
        "learner._target_=os.system",
        "name=${oc.env:HOME}",
        "--config-dir=/elsewhere",
        "env",
    ],
)
def test_words_of_a_file_only_set_values(word: str, tmp_path: Path) -> None:
    """A training's own record of its words must not turn to Hydra or name classes."""
    with pytest.raises(ConfigError, match="which no training writes"):
        refuse_dangerous([word], where="card", remedy="")
    (tmp_path / ".hydra").mkdir()
    (tmp_path / ".hydra" / "overrides.yaml").write_text(yaml.safe_dump([word]))
    assert main(["train", f"resume={tmp_path}"]) == 2
    from seals.cli.train import _begun

    with pytest.raises(ConfigError, match="which no training writes"):
        _begun(tmp_path)
    refuse_dangerous(["env=reach", "course.steps=5"], where="card", remedy="")


def test_a_target_must_be_that_of_the_plug_in() -> None:
    """No class is made but the one behind the chosen plug-in."""
    node = compose(["robot=ball"]).effects.gravity
    node["_target_"] = "os.system"
    with pytest.raises(ConfigError, match="is not allowed"):
        build(node, where="effects.gravity")


LAUGHS = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12)
)
ITSELF = "a: &a [*a]\n"
DEEP = "a: " + "[" * 5000
OBJECT = "a: !!python/object/apply:os.system ['true']\n"


@pytest.mark.parametrize(
    "text", [LAUGHS, ITSELF, DEEP, OBJECT, "a: 2020-99-99\n", "a: .nan\n" + LAUGHS]
)
@pytest.mark.parametrize("name", ["robot.yaml", "model.yaml", "experiment.yaml", "keys.yaml"])
def test_yaml_that_unfolds_without_end_is_refused(
    text: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Repeated aliases, lists in themselves, deep nesting and Python objects end in words."""
    with pytest.raises(yaml.YAMLError):
        plain_yaml(text)
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(text)
    words = {
        "robot.yaml": ["check", f"robot={tmp_path}"],
        "model.yaml": ["run", "robot=ball", "+model=model"],
        "experiment.yaml": ["run", "experiment=experiment.yaml"],
        "keys.yaml": ["teleop", "robot=ball", "script=keys.yaml"],
    }[name]
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "model.yaml").write_text(text)
    assert main(words) == 2


def test_the_page_is_for_this_machine_alone() -> None:
    """The viewer listens on the loopback address unless a person names another one."""
    assert ViewSettings().host == "127.0.0.1"
    assert compose([], root="view").host == "127.0.0.1"
    assert socket.inet_aton(ViewSettings().host)[0] == 127


def test_a_policy_card_is_data(tmp_path: Path) -> None:
    """A card that asks for classes is refused before anything is composed."""
    from seals.cli.evaluate import with_card

    card = {"format": "seals-policy", "version": 1, "network": {}, "overrides": ["env=reach"]}
    (tmp_path / "card.json").write_text(json.dumps(card))
    assert with_card([f"policy={tmp_path}"])[0] == "env=reach"
    card["overrides"] = ["env._target_=os.system"]
    (tmp_path / "card.json").write_text(json.dumps(card))
    with pytest.raises(ConfigError, match="which no training writes"):
        with_card([f"policy={tmp_path}"])
