"""Reading of the configuration of an earlier run from its folder."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from seals.config.checks import refuse_growth
from seals.config.derive import schema_of
from seals.config.plugin_lookup import plugin_at
from seals.config.refusal import refusals
from seals.config.strangers import refuse_lookups
from seals.errors import ConfigError, RobotError
from seals.logs.run_folder import ROBOT
from seals.robot.robot_file import PARTS
from seals.run.provenance import noted_digest
from seals.run.settings import SINGLE, RunSettings
from seals.untrusted_io import read_file


class _Files(NamedTuple):
    """Folder of a robot, and the SHA-256 of its files by name."""

    folder: str
    files: Mapping[str, str]


class _Facts(NamedTuple):
    """What ``run.json`` notes of a run's robots."""

    robot: _Files = _Files(folder="", files={})
    objects: Mapping[str, _Files] = {}
    robots: Mapping[str, _Files] = {}
    compiled: bool | None = None


def recalled(folder: Path, *, key: str = "repeat") -> Any:
    """Return the composed configuration of an earlier run.

    Args:
        folder: the run's folder.
        key: that named it, for messages.

    Raises:
        ConfigError: the folder is not a run, or names something that is not installed.
        RobotError: the robot's files have changed since.
    """
    from omegaconf import OmegaConf

    # whom a run talked to is no part of it, and not for its folder to say
    raw = {**_read(folder, key), "live": None}
    with refusals(()):
        for part in SINGLE:
            if raw.get(part) is not None:
                raw[part] = _typed(part, raw[part], where=part)
        for section, kind in PARTS.items():
            parts = raw.get(section) or {}
            if not isinstance(parts, dict):
                raise ConfigError(f"{section}={parts} is not a mapping.\nGive the folder of a run.")
            raw[section] = {
                name: _typed(kind, node, where=f"{section}.{name}") for name, node in parts.items()
            }
        config = OmegaConf.merge(OmegaConf.structured(RunSettings), OmegaConf.create(raw))
        config.repeat = config.resume = None
    noted = _facts(folder).compiled
    if noted is not None and "compiled" in (raw.get("backend") or {}):
        # what a run of another length would decide for itself
        missing = noted and importlib.util.find_spec("llvmlite") is None
        config.backend.compiled = "auto" if missing else str(noted).lower()
    _same_robot(folder, config, key)
    return config


def _read(folder: Path, key: str) -> dict[str, Any]:
    path = folder / ".hydra" / "config.yaml"
    if not path.is_file():
        what = "there is no run in this folder" if folder.is_dir() else "there is no such folder"
        raise ConfigError(
            f"{key}={folder}: {'this is a file' if folder.is_file() else what}.\n"
            "Give the folder of a run; it contains .hydra/config.yaml and run.json."
        )
    raw: dict[str, Any] = read_file(
        dict[str, Any], path, remedy="Give the folder of a run: restore the file, or start again."
    )
    if not path.read_bytes().endswith(b"\n"):
        # what is missing at its end would become default values
        raise ConfigError(
            f"{path} is truncated.\nRestore it, or start again with the same arguments."
        )
    refuse_lookups(
        raw,
        where=str(path),
        remedy="A run stores resolved values: write the value itself, or start a new run.",
    )
    refuse_growth(raw)
    return raw


def _typed(kind: str, node: Any, *, where: str) -> Any:
    """Convert a plain node to one with the schema of the plug-in in its ``_target_``."""
    from omegaconf import OmegaConf

    target = node.get("_target_") if isinstance(node, dict) else None
    if not isinstance(target, str):
        raise ConfigError(f"{where} names no plug-in.\nGive the folder of a run of this program.")
    schema = schema_of(plugin_at(kind, target, where=where))
    return OmegaConf.merge(OmegaConf.structured(schema), OmegaConf.create(node))


def _same_robot(folder: Path, config: Any, key: str) -> None:
    """Refuse a robot whose files have changed since the run, unless the run holds them all."""
    facts = _facts(folder)
    for name, thing in facts.objects.items():
        _same_object(folder, f"the object '{name}'", thing, key)
    for name, thing in facts.robots.items():
        _same_object(folder, f"the robot '{name}'", thing, key)
    noted = facts.robot.files
    robot = Path(str(config.robot.folder))
    changed = [name for name, code in noted.items() if noted_digest(robot, name) != code]
    if not changed:
        return
    urdf = str(config.robot.urdf)
    kept = folder.resolve() / ROBOT
    if list(noted) == [urdf] and noted_digest(kept, urdf) == noted[urdf]:
        config.robot.folder = str(kept)
        return
    raise RobotError(
        f"{key}={folder}: {', '.join(changed[:3])} in {robot} changed or disappeared since the "
        "run.\n"
        "Restore the robot's files as they were, or run again."
    )


def _same_object(folder: Path, name: str, noted: _Files, key: str) -> None:
    """Refuse an object, or one of several robots, whose files have changed since the run."""
    home = Path(noted.folder)
    changed = [file for file, code in noted.files.items() if noted_digest(home, file) != code]
    if changed:
        raise RobotError(
            f"{key}={folder}: {', '.join(changed[:3])} in {home}, of {name}, "
            "changed or "
            "disappeared since the run.\nRestore the files as they were, or run again."
        )


def _facts(folder: Path) -> _Facts:
    """Return what ``run.json`` notes; nothing for a run that was interrupted."""
    path = folder / "run.json"
    if not os.path.lexists(path):
        return _Facts()
    facts: _Facts = read_file(_Facts, path, remedy="Restore it, or remove it.", extra=True)
    return facts
