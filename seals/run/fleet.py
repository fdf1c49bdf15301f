"""The robots of a run: one, or several with controllers, guides and sensors of their own."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.errors import ConfigError, naming
from seals.field_roles import roles
from seals.robot.robot_file import PARTS
from seals.run.hidden import WAVES
from seals.run.objects import build_parts, chosen, object_robot
from seals.run.settings import InitialSettings, RunSettings
from seals.schema import check_tree

ROBOT = "robot"
"""Name of the robot of ``robot=`` among the actors of a run."""
MOST_ROBOTS = 256
"""Largest number of robots in one run: each has a log, and a report of its own."""
APART = 1e-3
"""Distance below which two robots start at one place [m]."""
_OWN = ("sensors", "actuators", "controller", "guide", "initial")
"""Sections of a run that belong to its one robot, beside its effects."""


@roles(data="effects sensors actuators controller guide hide", read="robot")
@dataclass(kw_only=True)
class VehicleSettings:
    """Settings of one of several robots of a run, in the words of a ``robot.yaml``.

    What its folder says holds unless it is said here. The effects of the surroundings (gravity,
    buoyancy, wind, current) act on it as the run has them. Schema while a configuration is read;
    built objects after `build_robots`.

    Args:
        robot: name of an installed robot, or a robot folder.
        effects: values of the effects of its folder by name and parameter, and further ones: the
            name of an effect, or a mapping with the key ``effect`` and its values.
        sensors: likewise.
        actuators: likewise.
        controller: name of a controller, or a mapping with the key ``controller`` and its values;
            values without the key are over those of the folder.
        guide: reference generator, likewise; the robot has none unless it is said here.
        initial: state at the start.
        hide: effects that act on it but are left out of the stated model of its log.
    """

    robot: Any = ""
    effects: dict[str, Any] = field(default_factory=dict)
    sensors: dict[str, Any] = field(default_factory=dict)
    actuators: dict[str, Any] = field(default_factory=dict)
    controller: Any = None
    guide: Any = None
    initial: InitialSettings = field(default_factory=InitialSettings)
    hide: list[str] = field(default_factory=list)


def build_robots(stated: Mapping[str, VehicleSettings]) -> dict[str, VehicleSettings]:
    """Build every part of the further robots of a run.

    Raises:
        SealsError: there are too many, or a robot, a part or a value cannot be used; says which.
    """
    if len(stated) > MOST_ROBOTS:
        raise ConfigError(
            f"robots has {len(stated):,} entries.\nAllowed: up to {MOST_ROBOTS} in one run."
        )
    return {name: _built(f"robots.{name}", vehicle) for name, vehicle in stated.items()}


def _built(where: str, stated: VehicleSettings) -> VehicleSettings:
    from seals.config.source import find_robot

    check_tree(stated.initial, where=f"{where}.initial")
    with naming(where):
        found = find_robot(str(stated.robot))
        parts: dict[str, Any] = {
            key: build_parts(key, where, found, getattr(stated, key)) for key in PARTS
        }
        # what a folder says of a guide is for an object; its controller rests without one
        wanted = {"controller": "controller" in found.parts, "guide": False}
        pilot = {
            kind: chosen(kind, getattr(stated, kind), found, where=where)
            for kind, own in wanted.items()
            if own or getattr(stated, kind) is not None
        }
        return dataclasses.replace(stated, robot=object_robot(found), **parts, **pilot)


def fleet_of(settings: RunSettings) -> dict[str, RunSettings]:
    """Return the settings of a run as each of its robots has them, by the name of the robot.

    The one that ``robot=`` chooses comes first and is named `ROBOT`.

    Args:
        settings: of the run, as built.

    Example:
        >>> from seals.run.build import run_settings
        >>> both = run_settings(
        ...     ["robot=ball", "robots.low={robot: cube, initial: {position: [2, 0, 0]}}"]
        ... )
        >>> {name: own.robot.name for name, own in fleet_of(both).items()}
        {'robot': 'ball', 'low': 'cube'}
    """
    fleet = {ROBOT: settings} if settings.robot.urdf else {}
    shared = {key: effect.ambient() for key, effect in settings.effects.items()}
    around = {key: effect for key, effect in shared.items() if effect is not None}
    hidden = [name for name in settings.hide if name in around or name == WAVES]
    for name, own in settings.robots.items():
        fleet[name] = dataclasses.replace(
            settings,
            name=f"{settings.name}_{name}",
            robot=own.robot,
            effects={**around, **own.effects},
            robots={},
            model=None,
            hide=[*hidden, *own.hide],
            **{key: getattr(own, key) for key in _OWN},
        )
    return fleet


def key_of(name: str) -> str:
    """Return the key of a robot in the configuration; empty for the one of ``robot=``."""
    return "" if name == ROBOT else f"robots.{name}"


def check_fleet(settings: RunSettings) -> None:
    """Refuse runs without a robot, settings that no robot takes, and robots in one place.

    Raises:
        ConfigError: says which.
    """
    if not settings.robots and not settings.robot.urdf:
        raise ConfigError("robot is not given.\nChoose one: robot=NAME; see: seals list robot")
    both = next((name for name in settings.robots if name in settings.objects), None)
    if both is not None:
        raise ConfigError(f"{both} names a robot and an object.\nGive one another name.")
    if not settings.robot.urdf:
        _refuse_nobodys(settings)
    places: dict[str, Any] = {}
    for name, own in fleet_of(settings).items():
        place = np.asarray(own.initial.position, dtype=float)
        near = [n for n, p in places.items() if np.linalg.norm(p - place) < APART]
        if near:
            raise ConfigError(
                f"robots.{name} starts where {near[0]} does, at {place.tolist()}.\n"
                f"Give it a place of its own: robots.{name}.initial.position=[X,Y,Z]"
            )
        places[name] = place


def _refuse_nobodys(settings: RunSettings) -> None:
    """Refuse settings of ``robot=`` where it is not given: they would act on none of the robots."""
    parts: list[str] = []
    for key in _OWN:
        value = getattr(settings, key)
        if key == "initial":
            parts += [key] if value != InitialSettings() else []
        elif value:
            parts += [f"{key}.{name}" for name in value] if isinstance(value, dict) else [key]
    parts += [f"effects.{k}" for k, effect in settings.effects.items() if effect.ambient() is None]
    if parts:
        name = next(iter(settings.robots))
        raise ConfigError(
            f"{parts[0]} belongs to the robot of robot=, which is not given.\n"
            f"Give it to one of the robots: robots.{name}.{parts[0]}=..."
        )
    if settings.live is not None:
        raise ConfigError(
            "live tells of the robot of robot=, which is not given.\n"
            "Choose one of the robots so: robot=NAME; the others stay under robots."
        )
