"""Hash of the part of a configuration that defines world and task."""

from __future__ import annotations

import dataclasses
from typing import Any

from seals.learn.metadata import config_hash

FREE = (
    *("name", "seed", "repeat", "resume", "checkpoint", "force", "viewer", "surface", "particles"),
    "hide",
)
"""Keys of a run that leave its world as it is."""

NEUTRAL = {"thrust_change": 0.0}
"""Parameters that came later, by the value that changes nothing: worlds made before keep their
hash."""

_EFFECTS = "seals.plugins.effects"
NEUTRAL_OF: dict[str, dict[str, Any]] = {
    f"{_EFFECTS}.quadratic_drag.DragQuadratic": {
        **{"form": "per_axis", "axis": "x"},
        **{f"{stem}_{axis}": 0.0 for stem in ("size", "position") for axis in "xyz"},
    },
    f"{_EFFECTS}.added_mass.AddedMass": {"floating": [], "floating_fraction": 0.5},
}
"""The same of one plug-in, by its class."""

SEEN = ("frames", "ball")
"""Keys that mean nothing to a robot without cameras."""


FREE_OF_BACKEND = ("fused",)
"""Keys of a backend that leave the world as it is."""


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
    """Drop neutral values, and the path of the robot's folder, which differs between machines."""
    if isinstance(value, dict):
        neutral = NEUTRAL | NEUTRAL_OF.get(str(value.get("_target_")), {})
        kept = {k: v for k, v in value.items() if k != "folder"}
        return {k: _placeless(v) for k, v in kept.items() if k not in neutral or v != neutral[k]}
    return value


def world_hash(config: Any) -> str:
    """Return a hash of world and task, equal in training, evaluation and recording."""
    return config_hash(world_config(config))
