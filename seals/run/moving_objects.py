"""Actively moving objects: guide and controller of an animal in the scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from seals import registry
from seals.config.build import build_from_values
from seals.control.estimate import check_sense
from seals.control.plant import build_plant
from seals.errors import ConfigError, suggestion
from seals.robot.robot_file import RobotFile
from seals.run.object_settings import ObjectSettings
from seals.run.settings import RunSettings
from seals.world import Actor
from seals.world.pilot import Pilot
from seals.world.servos import check_gains


def moves(settings: ObjectSettings, found: RobotFile) -> bool:
    """Return whether an object has a guide, from the run or from its folder."""
    return settings.guide is not None or "guide" in found.parts


def animate(
    name: str, thing: ObjectSettings, found: RobotFile, settings: RunSettings, actor: Actor
) -> None:
    """Attach guide and controller to an object that has a guide.

    Raises:
        SealsError: guide or controller are not there, or cannot work with this body.
    """
    if not moves(thing, found):
        return
    check_gains(actor.robot, actor.effects, settings.time.step)
    where = f"objects.{name}"
    guide = chosen("guide", thing.guide, found, where=where)
    controller = chosen("controller", thing.controller, found, where=where)
    check_sense(controller.sense, {})
    actor.pilot = Pilot(
        build_plant(actor.robot, actor.effects, settings.environment),
        controller,
        guide,
        volume=actor.evaluator.surroundings.volume,
        step=settings.time.step,
    )


def chosen(kind: str, wanted: Any, found: RobotFile, *, where: str) -> Any:
    """Build the guide or the controller of an object.

    Args:
        kind: ``guide`` or ``controller``.
        wanted: of the run: a name; a mapping that names it by ``kind`` and gives values; values
            alone, over those of the folder; None for what the folder says.
        found: the robot folder.
        where: key of the object, named in every refusal.

    Raises:
        ConfigError: neither run nor folder names one.
        SealsError: it is not installed, or a value cannot be used.
    """
    place = f"{where}.{kind}"
    given = _values(kind, wanted, place)
    name, values = next(iter(found.parts.get(kind, {}).values()), (None, {}))
    asked = given.pop(kind, name)
    if asked is None:
        raise ConfigError(
            f"{place}: neither the run nor '{found.settings.name}' says which.\n"
            f"{suggestion('', registry.names(kind), label='Installed')}"
        )
    # values of the folder belong to the plug-in that the folder names
    return build_from_values(kind, str(asked), values if asked == name else {}, given, where=place)


def _values(kind: str, wanted: Any, where: str) -> dict[str, Any]:
    if wanted is None:
        return {}
    if isinstance(wanted, str):
        return {kind: wanted}
    if isinstance(wanted, Mapping):
        return {str(key): value for key, value in wanted.items()}
    raise ConfigError(
        f"{where}={wanted} is a {type(wanted).__name__}.\n"
        f"Allowed: the name of a {kind}, or {{{kind}: NAME, VALUE: ...}}."
    )
