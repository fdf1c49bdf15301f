"""Metadata files (card.json) of policies and demonstrations, read as untrusted input.

A card holds a hash of the part of the configuration that defines world and task.
"""

from __future__ import annotations

import dataclasses
import enum
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seals.errors import ConfigError
from seals.schema import later_defaults
from seals.untrusted_io import read_file

CARD = "card.json"
_WRITERS = {
    "policy": "Give the folder of a policy that seals train wrote: policy=TRAINING/policy",
    "demonstrations": "Give the folder that seals record wrote: demonstrations=FOLDER",
    "task.detector": "Give the folder of a trained detector: task.detector=FOLDER",
}
"""Advice where a folder holds no metadata, by the key that named it."""
_MOST_BYTES = 1_000_000
"""Of metadata: a stranger's file is not read without a bound."""


def read_metadata(folder: Path, *, form: str, key: str) -> dict[str, Any]:
    """Read the metadata of a folder.

    Args:
        folder: that holds `CARD`.
        form: what the metadata must say that it is, as ``seals-policy``.
        key: of the command line that named the folder, ``policy`` or ``demonstrations``.

    Raises:
        ConfigError: there is no metadata, it cannot be read, or it is that of something else.
    """
    path = folder / CARD
    if not folder.is_dir() or not path.is_file() or path.is_symlink():
        below = sorted(path.parent for path in folder.glob(f"*/{CARD}"))
        advice = f"Did you mean {key}={below[0]}?" if below else _WRITERS[key]
        raise ConfigError(f"{key}={folder}: there is no {CARD}.\n{advice}")
    if path.stat().st_size > _MOST_BYTES:
        raise ConfigError(f"{path} has {path.stat().st_size} bytes.\nAllowed: {_MOST_BYTES}")
    metadata: dict[str, Any] = read_file(dict[str, Any], path, remedy="It must be JSON.")
    if metadata.get("format") != form:
        given = metadata.get("format")
        raise ConfigError(f"{path} is of the format {given!r}.\nAllowed here: '{form}'")
    if metadata.get("version") != 1:
        raise ConfigError(
            f"{path} is of version {metadata.get('version')!r}.\n"
            "This program reads version 1: update."
        )
    return metadata


def refuse_other(folder: Path, *, form: str, key: str) -> None:
    """Refuse to replace a folder that is not of a kind; one that is empty or absent may be.

    Args:
        folder: that would be replaced.
        form: what its metadata must say that it is.
        key: of the command line that names such folders.

    Raises:
        ConfigError: the path is a file, or a folder that holds anything else.
    """
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    try:
        read_metadata(folder, form=form, key=key)
    except ConfigError:
        raise ConfigError(
            f"'{folder}' is not a folder of the format {form}, so it is not overwritten.\n"
            "Choose another name."
        ) from None


def config_hash(config: Mapping[str, Any]) -> str:
    """Return a short hash of a configuration, independent of the order of its keys.

    Example:
        >>> config_hash({"a": 1, "b": 2.0}) == config_hash({"b": 2.0, "a": 1})
        True
    """
    text = json.dumps(config, sort_keys=True, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


FREE = (
    *("name", "seed", "repeat", "resume", "checkpoint", "force", "viewer", "surface", "particles"),
    *("hide", "live"),
)
"""Keys of a run that leave its world as it is."""

SEEN = ("frames", "ball")
"""Keys that mean nothing to a robot without cameras."""


FREE_OF_BACKEND = ("compiled",)
"""Keys of a backend that leave the world as it is."""
_LEG: dict[str, Any] = {"stance": []}
"""What the settings of a leg got later."""


def world_config(config: Any) -> dict[str, Any]:
    """Return the world and task of a composed configuration as plain values.

    Args:
        config: composed from any root of learning; keys of the verb itself are left out.
    """
    from omegaconf import OmegaConf

    from seals.learn.settings import LearnSettings

    shared = {field.name for field in dataclasses.fields(LearnSettings)} - set(FREE)
    kept: Any = OmegaConf.masked_copy(config, [key for key in config if key in shared])
    plain: Any = OmegaConf.to_container(kept, resolve=True, enum_to_str=True)
    # a camera is what has a field of view
    if not any("fov" in (sensor or {}) for sensor in plain.get("sensors", {}).values()):
        plain = {key: value for key, value in plain.items() if key not in SEEN}
    plain["backend"] = {k: v for k, v in plain["backend"].items() if k not in FREE_OF_BACKEND}
    # a level world has the name that it had before there were height maps
    late = later_defaults(LearnSettings)
    plain = {key: value for key, value in plain.items() if key not in late or value != late[key]}
    around = plain["environment"]
    if not around["terrain"]["file"]:
        plain["environment"] = {k: v for k, v in around.items() if k != "terrain"}
    return {str(key): _placeless(value) for key, value in plain.items()}


def _placeless(value: Any) -> Any:
    """Drop the path of the robot's folder, which differs between machines, and later fields."""
    if isinstance(value, dict):
        neutral = _later(value.get("_target_")) or (_LEG if "toe" in value else {})
        kept = {k: v for k, v in value.items() if k != "folder"}
        return {k: _placeless(v) for k, v in kept.items() if k not in neutral or v != neutral[k]}
    return value


def _later(target: str | None) -> dict[str, Any]:
    """Return the plain defaults of the fields that a plug-in's class got later, by name."""
    from hydra.utils import get_object

    cls = None if target is None else get_object(target)
    found = later_defaults(cls) if isinstance(cls, type) and dataclasses.is_dataclass(cls) else {}
    return {name: v.name if isinstance(v, enum.Enum) else v for name, v in found.items()}


def world_hash(config: Any) -> str:
    """Return a hash of world and task, equal in training, evaluation and recording."""
    return config_hash(world_config(config))
