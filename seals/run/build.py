"""Build and check the settings of a run from its composed configuration."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from seals.config.build import build, typed_entries
from seals.config.checks import refuse_unknown
from seals.config.compose import compose
from seals.config.overlay import read_overlay
from seals.config.plugin_lookup import plugin_name
from seals.config.refusal import refusals
from seals.environment.settings import ObstacleSettings, check_ground, check_profiles
from seals.environment.terrain import terrain_of
from seals.errors import ConfigError, suggestion
from seals.file_names import checked_name
from seals.registry import get, names
from seals.robot.robot_file import PARTS
from seals.run.hidden import hide
from seals.run.object_settings import ObjectSettings, check_objects
from seals.run.replay_config import recalled
from seals.run.settings import SINGLE, RunSettings
from seals.schema import check_fields, check_tree

PLAIN = ("environment", "initial", "time", "robot", "optics", "sight")
_NAME = re.compile(r"\w[\w-]{0,119}")


def build_run(config: Any) -> RunSettings:
    """Build every object of a composed run and check every value.

    Args:
        config: composed configuration (a DictConfig) with the keys of ``RunSettings``.

    Raises:
        ConfigError: a value is missing, unknown, not finite or out of bounds.
        BrokenPlugin: a chosen plug-in cannot be used.
    """
    from omegaconf import OmegaConf

    for key in ("repeat", "resume"):
        if config.get(key) is not None:
            config = recalled(Path(str(config[key])), key=key)
    refuse_unknown(config, where="")
    with refusals(()):
        values: dict[str, Any] = {key: OmegaConf.to_object(config[key]) for key in PLAIN}
        values["objects"] = typed_entries(ObjectSettings, config.get("objects"), where="objects")
        obstacles = config.environment.obstacles
        values["environment"].obstacles = typed_entries(
            ObstacleSettings, obstacles, where="environment.obstacles"
        )
        values["hide"] = [str(name) for name in config.get("hide") or ()]
        every = config.get("checkpoint")
        values |= {"name": str(config.name), "seed": int(config.seed)}
        values |= {"checkpoint": None if every is None else float(every)}
        values |= {key: float(config.get(key) or 0.0) for key in ("surface", "particles")}
        if config.get("water_type") is not None:
            values["water_type"] = str(config.water_type)
            values["optics"] = replace(values["optics"], water_type=values["water_type"])
        for key in SINGLE:
            node = config.get(key)
            values[key] = None if node is None else build(node, where=key)
        for key in PARTS:
            values[key] = {
                _instance(name, key): build(node, where=f"{key}.{name}")
                for name, node in config[key].items()
            }
    settings = RunSettings(**_with_model(config, values))
    _check(settings)
    return settings


def run_settings(overrides: Sequence[str] = ()) -> RunSettings:
    """Return the settings of a run from the overrides that ``seals run`` takes.

    Args:
        overrides: such as ``["robot=ball", "time.step=0.001"]``.

    Raises:
        SealsError: an override is wrong, or a value is missing or not allowed.

    Example:
        >>> run_settings(["robot=ball", "time.step=0.001"]).time.step
        0.001
    """
    return build_run(compose(overrides))


def _instance(name: Any, section: str) -> str:
    """Return the name of an instance, which is part of columns and of folders."""
    if not _NAME.fullmatch(str(name)):
        raise ConfigError(
            f"{section}.{name!s:.80}: this name is not allowed.\n"
            "Allowed: letters, digits, '_' and '-', up to 120."
        )
    return str(name)


def _with_model(config: Any, values: dict[str, Any]) -> dict[str, Any]:
    """Add the effects of a diagnosed model to those of the run.

    Its stated values belong to the vehicle of its log, not to the robot of the run.
    """
    from omegaconf import OmegaConf

    if config.get("model") is None:
        return values
    raw: Any = OmegaConf.to_container(config.model)
    overlay = read_overlay(raw)
    overlay.refuse_withdrawn(force=bool(config.get("force")))
    out = {**values, "effects": overlay.applied(values["effects"])}
    if overlay.waves is not None:
        if type(values["wave"]) is not get("wave", "still").load():
            raise ConfigError(
                f"model '{overlay.name}' and the run both define waves.\nLeave one of them out."
            )
        out["wave"] = overlay.waves
    return out


def _check(settings: RunSettings) -> None:
    """Refuse values that the types let through."""
    for key in (*PLAIN, "objects"):
        check_tree(getattr(settings, key), where=key)
    if not settings.robot.urdf:
        raise ConfigError("robot is not given.\nChoose one: robot=NAME; see: seals list robot")
    kept = {key: getattr(settings, key) for key in ("seed", "surface", "particles", "checkpoint")}
    check_fields(RunSettings, kept, where="")
    check_profiles(settings.environment)
    check_ground(settings.environment)
    terrain_of(settings.environment.terrain)
    check_objects(settings.objects)
    checked_name(settings.name, key="name")
    acting = settings.effects.items()
    stated = [{"instance": name, "name": plugin_name("effect", type(e))} for name, e in acting]
    hide(settings.hide, stated, settings.wave)
    if settings.guide is not None and settings.controller is None:
        raise ConfigError(
            "guide is given without a controller that follows it.\nChoose one: controller=NAME.  "
            f"{suggestion('', names('controller'), label='Installed')}"
        )
