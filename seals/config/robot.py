"""Typed description of a robot folder: what ``robot.yaml`` may say, and how it is read.

A robot is a folder holding ``robot.yaml`` and the URDF it names; no Python is needed.
"""

from __future__ import annotations

import enum
import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from seals.config.fields import optional, vector
from seals.config.targets import refuse_references
from seals.errors import RobotError, suggestion
from seals.untrusted_io import read_plain_yaml

_KEYS = (
    "summary",
    "urdf",
    "fixed_base",
    "hulls",
    "arms",
    "grippers",
    "legs",
    "effects",
    "sensors",
    "actuators",
    "controller",
    "guide",
)
_NAME = re.compile(r"\w[\w-]*")
_PARTS = {"effects": "effect", "sensors": "sensor", "actuators": "actuator"}


class ShapeType(enum.Enum):
    """Primitive a hull is made of; names are as written in ``robot.yaml``."""

    sphere = "sphere"
    box = "box"
    cylinder = "cylinder"
    capsule = "capsule"
    mesh = "mesh"


@dataclass(kw_only=True)
class ShapeSettings:
    """One primitive of a hull, in link axes.

    Args:
        type: which primitive.
        size: sphere radius; box full edges x, y, z; cylinder and capsule radius, length [m].
        position: centre of the primitive in the link frame [m].
        rpy: roll, pitch, yaw of the primitive in the link frame [rad].
        file: mesh file beside ``robot.yaml``, for ``type: mesh`` only.
    """

    type: ShapeType = ShapeType.sphere
    size: list[float] = vector((), "m", bounds=(1e-6, 1e4), source="robot.yaml")
    position: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e4, 1e4), source="robot.yaml")
    rpy: list[float] = vector((0.0, 0.0, 0.0), "rad", bounds=(-6.3, 6.3), source="robot.yaml")
    file: str | None = None


@dataclass(kw_only=True)
class HullSettings:
    """The part of a link that displaces water.

    Args:
        shapes: primitives that together give the shape.
        displaced_volume: stated volume that rules over the sum of the shapes [m^3].
        centre_of_buoyancy: stated centroid when fully submerged, link frame [m].
        plan_area: stated projected area along body z [m^2].
    """

    shapes: list[ShapeSettings] = field(default_factory=list)
    displaced_volume: float | None = optional("m^3", bounds=(0.0, 1e6), source="robot.yaml")
    centre_of_buoyancy: list[float] | None = None
    plan_area: float | None = optional("m^2", bounds=(0.0, 1e6), source="robot.yaml")


@dataclass(kw_only=True)
class ArmSettings:
    """One arm, by the names of its parts in the URDF.

    Args:
        joints: from the base on.
        tool: the link that the arm moves.
        stowed: joint values at rest, one a joint; empty for zeros [rad or m].
    """

    joints: list[str] = field(default_factory=list)
    tool: str = ""
    stowed: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source="robot.yaml")


@dataclass(kw_only=True)
class GripperSettings:
    """One gripper, by the names of its parts in the URDF.

    Args:
        joints: of the fingers.
        open: joint values when open, one a joint [rad or m].
        closed: joint values when closed on nothing, one a joint [rad or m].
        tips: links that touch, each with a contact force of its own.
    """

    joints: list[str] = field(default_factory=list)
    open: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source="robot.yaml")
    closed: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source="robot.yaml")
    tips: list[str] = field(default_factory=list)


@dataclass(kw_only=True)
class LegSettings:
    """One leg, by the names of its parts in the URDF.

    Args:
        joints: from the body on.
        foot: the last link of the leg.
        toe: what stands on the ground, in axes of that link [m].
    """

    joints: list[str] = field(default_factory=list)
    foot: str = ""
    toe: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e3, 1e3), source="robot.yaml")


@dataclass(kw_only=True)
class RobotSettings:
    """A robot as the run sees it.

    Args:
        name: name of the robot, that of its entry point or folder.
        folder: absolute folder that holds ``robot.yaml``.
        urdf: URDF file relative to the folder.
        fixed_base: whether the base link is bolted to the world.
        hulls: what displaces water, by link name.
        arms: by name.
        grippers: by name.
        legs: by name.
        summary: one line for lists and reports.
    """

    name: str = ""
    folder: str = ""
    urdf: str = ""
    fixed_base: bool = False
    hulls: dict[str, HullSettings] = field(default_factory=dict)
    arms: dict[str, ArmSettings] = field(default_factory=dict)
    grippers: dict[str, GripperSettings] = field(default_factory=dict)
    legs: dict[str, LegSettings] = field(default_factory=dict)
    summary: str = ""

    @property
    def urdf_path(self) -> Path:
        """Return the full path of the URDF."""
        return Path(self.folder) / self.urdf


@dataclass(frozen=True, kw_only=True)
class RobotFile:
    """What one ``robot.yaml`` holds, checked for its keys but not yet for its values.

    Args:
        settings: name, folder, URDF and summary; the rest is still in ``hulls`` and ``limbs``.
        hulls: raw hull entries by link name.
        limbs: raw entries of arms, grippers and legs, by section and name.
        parts: per section (effects, sensors, actuators, controller, guide) the instance name,
            plug-in name and values; the guide is what it does as an object of a run.
    """

    settings: RobotSettings
    hulls: dict[str, Any]
    limbs: dict[str, dict[str, Any]]
    parts: dict[str, dict[str, tuple[str, dict[str, Any]]]]


def read_robot(folder: Path, *, name: str | None = None) -> RobotFile:
    """Read ``robot.yaml`` of a robot folder.

    Args:
        folder: the robot's folder.
        name: name of the robot; that of the folder when left out.

    Raises:
        RobotError: the file is missing, not readable, or holds keys that no robot has.
    """
    path = folder / "robot.yaml"
    raw = _mapping(_load(path), str(path))
    refuse_references(raw, where=str(path))
    for key in raw:
        if key not in _KEYS:
            raise RobotError(
                f"{path}: '{key}' is not a key of a robot.\n{suggestion(str(key), _KEYS)}"
            )
    urdf = str(raw.get("urdf") or "")
    if not urdf or not os.path.isfile(folder / urdf):
        beside = [file.name for file in folder.glob("*.urdf")]
        raise RobotError(
            f"{path}: urdf '{urdf}' is not a file in {folder}.\n"
            f"{suggestion(urdf, beside, label='URDF files there')}"
        )
    if not (folder / urdf).resolve().is_relative_to(folder.resolve()):
        raise RobotError(
            f"{path}: urdf '{urdf}' lies outside {folder}.\nKeep the URDF in the robot's folder."
        )
    settings = RobotSettings(
        name=name or folder.resolve().name,
        folder=str(folder.resolve()),
        urdf=urdf,
        fixed_base=_flag(raw.get("fixed_base", False), f"{path}: fixed_base"),
        summary=str(raw.get("summary") or ""),
    )
    parts = {
        section: _parts(raw.get(section), f"{path}: {section}", word)
        for section, word in _PARTS.items()
    }
    for word in ("controller", "guide"):
        if raw.get(word) is not None:
            parts[word] = _parts({word: raw[word]}, f"{path}: {word}", word)
    hulls = _mapping(raw.get("hulls"), f"{path}: hulls")
    limbs = {key: _mapping(raw.get(key), f"{path}: {key}") for key in ("arms", "grippers", "legs")}
    return RobotFile(settings=settings, hulls=hulls, limbs=limbs, parts=parts)


def _load(path: Path) -> Any:
    import yaml

    try:
        return read_plain_yaml(path)
    except FileNotFoundError as cause:
        raise RobotError(
            f"{path} does not exist.\nA robot is a folder holding robot.yaml and its URDF."
        ) from cause
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as cause:
        text = " ".join(str(cause).split())
        raise RobotError(
            f"{path} cannot be read: {text}.\nIt must be YAML text in UTF-8."
        ) from cause


def _parts(raw: Any, where: str, word: str) -> dict[str, tuple[str, dict[str, Any]]]:
    found = {}
    for name, entry in _mapping(raw, where).items():
        if not _NAME.fullmatch(str(name)):
            raise RobotError(
                f"{where}: '{name}' is not a valid name.\nAllowed: letters, digits, '_' and '-'"
            )
        values = dict(_mapping(entry, f"{where}.{name}"))
        plugin = values.pop(word, None)
        if not isinstance(plugin, str):
            raise RobotError(
                f"{where}.{name} does not say which {word} it is.\n"
                f"Add the line '{word}: NAME'; the names are shown by: seals list {word}"
            )
        hidden = [key for key in values if str(key).startswith("_")]
        if hidden:
            raise RobotError(
                f"{where}.{name}.{hidden[0]} is not allowed.\nKeys must not begin with '_'."
            )
        found[str(name)] = (plugin, values)
    return found


def _mapping(raw: Any, where: str) -> dict[str, Any]:
    if raw is None:
        return {}
    if not isinstance(raw, dict):
        raise RobotError(
            f"{where} is a {type(raw).__name__}.\nAllowed: a mapping of names to values."
        )
    return raw


def _flag(raw: Any, where: str) -> bool:
    if not isinstance(raw, bool):
        raise RobotError(f"{where}={raw} is not allowed.\nAllowed: true or false.")
    return raw
