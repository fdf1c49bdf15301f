"""Reading of ``robot.yaml``, the file that describes a robot together with its URDF."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, RobotError, SealsError, suggestion
from seals.robot.settings import RobotSettings
from seals.schema import read
from seals.untrusted_io import entries, read_file, refuse_references

MOST_PARTS, MOST_ENTRIES = 500, 40_000
"""Most effects, sensors and actuators of a robot, and most values of its file."""

_NAME = re.compile(r"\w[\w-]*")
PARTS = {"effects": "effect", "sensors": "sensor", "actuators": "actuator"}
"""Sections that hold several plug-ins, of a robot and of a run, and the kind of each."""


_Section = dict[str, Any]
_Parts = dict[str, dict[str, Any] | None]


@dataclass(frozen=True, kw_only=True)
class _Written:
    """What a ``robot.yaml`` may say; values of parts are checked where those are built."""

    name: str = ""
    summary: str = ""
    urdf: str = ""
    fixed_base: bool = False
    hulls: _Section = field(default_factory=dict)
    arms: _Section = field(default_factory=dict)
    grippers: _Section = field(default_factory=dict)
    legs: _Section = field(default_factory=dict)
    effects: _Parts = field(default_factory=dict)
    sensors: _Parts = field(default_factory=dict)
    actuators: _Parts = field(default_factory=dict)
    controller: _Section | None = None
    guide: _Section | None = None


@dataclass(frozen=True, kw_only=True)
class RobotFile:
    """Content of a ``robot.yaml``, with its keys checked and its values unchecked.

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
        name: name of the robot; what the file says when left out, else that of the folder.

    Raises:
        RobotError: the file is missing, not readable, or holds keys that no robot has.
    """
    remedy = "It must be YAML text in UTF-8, in a folder with its URDF."
    raw = read_file(dict[str, Any], folder / "robot.yaml", error=RobotError, remedy=remedy)
    return robot_of(raw, folder, name=name)


def robot_of(raw: Mapping[str, Any], folder: Path, *, name: str | None = None) -> RobotFile:
    """Check the content of a ``robot.yaml``.

    Args:
        raw: its content as plain data.
        folder: of URDF and meshes.
        name: as for `read_robot`.

    Raises:
        RobotError: the URDF is not there, or there are keys that no robot has.
    """
    path = folder / "robot.yaml"
    refuse_references(raw, where=str(path))
    found = read(_Written, raw, where=f"{path}:", error=RobotError)
    urdf = found.urdf
    if not urdf or not os.path.isfile(folder / urdf):
        beside = [file.name for file in folder.glob("*.urdf")]
        raise RobotError(
            f"{path}: urdf '{urdf}' is not a file in {folder}.\n"
            f"{suggestion(urdf, beside, label='URDF files there')}"
        )
    if not (folder / urdf).resolve().is_relative_to(folder.resolve()):
        raise RobotError(
            f"{path}: urdf '{urdf}' is outside {folder}.\nKeep the URDF in the robot's folder."
        )
    settings = RobotSettings(
        name=name or found.name or folder.resolve().name,
        folder=str(folder.resolve()),
        urdf=urdf,
        fixed_base=found.fixed_base,
        summary=found.summary,
    )
    parts = {
        section: _parts(getattr(found, section), f"{path}: {section}", word)
        for section, word in PARTS.items()
    }
    for word in ("controller", "guide"):
        if getattr(found, word) is not None:
            parts[word] = _parts({word: getattr(found, word)}, f"{path}: {word}", word)
    count = sum(map(len, parts.values()))
    if count > MOST_PARTS or entries(raw) > MOST_ENTRIES:
        raise RobotError(
            f"{path} has {count:,} effects, sensors and actuators and {entries(raw):,} entries.\n"
            f"Allowed: {MOST_PARTS:,} and {MOST_ENTRIES:,}; each is checked before every run."
        )
    limbs = {"arms": found.arms, "grippers": found.grippers, "legs": found.legs}
    return RobotFile(settings=settings, hulls=found.hulls, limbs=limbs, parts=parts)


def taken_name(
    kind: str, values: dict[str, Any], where: str, error: type[SealsError] = ConfigError
) -> str:
    """Return the plug-in that an entry of a file names, and take it out of the entry.

    Raises:
        SealsError: ``error``: it names none.
    """
    plugin = values.pop(kind, None)
    if not isinstance(plugin, str):
        raise error(
            f"{where} does not name its {kind}.\n"
            f"Add the line '{kind}: NAME'; the names are shown by: seals list {kind}"
        )
    return plugin


def _parts(raw: _Parts, where: str, word: str) -> dict[str, tuple[str, dict[str, Any]]]:
    found = {}
    for name, entry in raw.items():
        if not _NAME.fullmatch(name):
            raise RobotError(
                f"{where}: '{name}' is not a valid name.\nAllowed: letters, digits, '_' and '-'"
            )
        values = dict(entry or {})
        plugin = taken_name(word, values, f"{where}.{name}", RobotError)
        hidden = [key for key in values if str(key).startswith("_")]
        if hidden:
            raise RobotError(
                f"{where}.{name}.{hidden[0]} is not allowed.\nKeys must not begin with '_'."
            )
        found[name] = (plugin, values)
    return found
