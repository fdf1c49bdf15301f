"""Hash of the part of a configuration that defines world and task."""

from __future__ import annotations

import dataclasses
import enum
from typing import Any

from seals.learn.metadata import config_hash
from seals.schema import later_defaults

FREE = (
    *("name", "seed", "repeat", "resume", "checkpoint", "force", "viewer", "surface", "particles"),
    *("hide", "live"),
)
"""Keys of a run that leave its world as it is."""

SEEN = ("frames", "ball")
"""Keys that mean nothing to a robot without cameras."""


FREE_OF_BACKEND = ("fused", "compiled")
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
