"""Build and check the settings of a run from its composed configuration."""

from __future__ import annotations

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
from seals.errors import ConfigError, naming, suggestion
from seals.file_names import checked_name
from seals.registry import get, names
from seals.robot.robot_file import PARTS
from seals.run.fleet import VehicleSettings, build_robots, check_fleet, fleet_of, key_of
from seals.run.hidden import hide
from seals.run.object_settings import ObjectSettings, check_named, instance_name
from seals.run.replay_config import recalled
from seals.run.settings import SINGLE, RunSettings
from seals.schema import check_fields, check_tree

PLAIN = ("environment", "initial", "time", "robot", "optics", "sight")


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
        for key, cls in (("objects", ObjectSettings), ("robots", VehicleSettings)):
            values[key] = typed_entries(cls, config.get(key), where=key, lone="robot")
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
                instance_name(name, key): build(node, where=f"{key}.{name}")
                for name, node in config[key].items()
            }
    check_named("objects", values["objects"], example="cube")
    check_named("robots", values["robots"], example="hexacopter")
    kind: Any = OmegaConf.get_type(config)
    one = isinstance(kind, type) and issubclass(kind, RunSettings) and not kind.several
    if values["robots"] and one:
        raise ConfigError(
            f"robots.{next(iter(values['robots']))}: this command is for one robot.\n"
            "Choose it: robot=NAME; several are for: seals run, seals view"
        )
    with refusals(()):
        values["robots"] = build_robots(values["robots"])
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
    check_fleet(settings)
    kept = {key: getattr(settings, key) for key in ("seed", "surface", "particles", "checkpoint")}
    check_fields(RunSettings, kept, where="")
    check_profiles(settings.environment)
    check_ground(settings.environment)
    terrain_of(settings.environment.terrain)
    checked_name(settings.name, key="name")
    for name, own in fleet_of(settings).items():
        with naming(key_of(name)):
            acting = own.effects.items()
            stated = [
                {"instance": name, "name": plugin_name("effect", type(e))} for name, e in acting
            ]
            hide(own.hide, stated, own.wave)
            if own.guide is not None and own.controller is None:
                raise ConfigError(
                    "guide is given without a controller that follows it.\n"
                    "Choose one: controller=NAME.  "
                    f"{suggestion('', names('controller'), label='Installed')}"
                )
