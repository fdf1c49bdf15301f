"""Construction of the objects of a run, as further actors of the world."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seals import registry
from seals.backend import Configuration
from seals.config.build import build_from_values
from seals.control.estimate import check_sense
from seals.control.plant import build_plant
from seals.effects.binding import EffectSet, bind_effects
from seals.effects.effect import Effect
from seals.errors import ConfigError, refuse_unlisted, suggestion
from seals.fluid import Fluid
from seals.frames import matrix_of, quaternion_of_rpy
from seals.robot.build import build_robot
from seals.robot.limbs import standing
from seals.robot.model import RobotModel, Surface
from seals.robot.robot_file import PARTS, RobotFile
from seals.robot.settings import RobotSettings
from seals.run.immersed import owned, owners, stated_drag
from seals.run.object_settings import ObjectSettings, instance_name
from seals.run.settings import InitialSettings, RunSettings
from seals.schema import read
from seals.world import Actor
from seals.world.pilot import Pilot
from seals.world.servos import check_gains


def add_objects(settings: RunSettings, *, steps: int, repeats: int = 1) -> dict[str, Actor]:
    """Add the objects of a run to its open scene, in the order of the configuration.

    Args:
        settings: of the run.
        steps: of the run.
        repeats: times that they are made.

    Raises:
        SealsError: an object's robot, values or effects cannot be used.
    """
    from seals.config.source import find_robot

    actors = {}
    for name, thing in settings.objects.items():
        found = find_robot(thing.robot)
        robot, effects = build_object(name, thing, found, settings.effects, settings.fluid)
        resting = {}
        if settings.fluid is not None:
            own = build_parts("effects", f"objects.{name}", found, thing.effects)
            resting = {key: e for key, e in own.items() if owned(e, settings.fluid)}
        actor = Actor(
            robot,
            effects,
            {},
            settings.backend,
            settings.environment,
            waves=settings.wave,
            steps=steps,
            fluid=settings.fluid,
            repeats=repeats,
            stated=stated_drag(settings, resting, robot.links),
        )
        _animate(name, thing, found, settings, actor)
        actors[name] = actor
    return actors


def build_object(
    name: str,
    settings: ObjectSettings,
    found: RobotFile,
    around: Mapping[str, Effect],
    fluid: Fluid | None = None,
) -> tuple[RobotModel, EffectSet]:
    """Build one object and bind its effects.

    Args:
        name: of the object.
        settings: of the object.
        found: its robot folder.
        around: effects of the run; those of the surroundings act on the object, too.
        fluid: that the object is in; what it accounts for rests in the folder's effects.

    Raises:
        SealsError: the robot, a value or an effect cannot be used.
    """
    robot = build_robot(object_robot(found))
    ambient = {key: effect.ambient() for key, effect in around.items()}
    effects = {key: effect for key, effect in ambient.items() if effect is not None}
    own = build_parts("effects", f"objects.{name}", found, settings.effects)
    if moves(settings, found):
        own |= {
            key: build_from_values(
                "actuator", plugin, values, {}, where=f"objects.{name}.actuators.{key}"
            )
            for key, (plugin, values) in found.parts.get("actuators", {}).items()
        }
    if fluid is not None:
        own = {key: effect for key, effect in own.items() if not owned(effect, fluid)}
    effects |= own
    surface = Surface(
        friction=settings.friction,
        rolling=settings.rolling_friction,
        spinning=settings.spinning_friction,
        restitution=settings.restitution,
    )
    robot = dataclasses.replace(robot, surface=None if surface == Surface() else surface)
    if settings.mass is not None:
        ratio = settings.mass / float(robot.mass.sum())
        robot = dataclasses.replace(robot, mass=ratio * robot.mass, inertia=ratio * robot.inertia)
    return robot, bind_effects(effects, robot.links, owners(fluid))


def object_robot(found: RobotFile) -> RobotSettings:
    """Return the settings of a robot folder without overrides, typed and checked."""
    s = found.settings
    told = {"name": s.name, "folder": s.folder, "urdf": s.urdf, "fixed_base": s.fixed_base}
    values = {**told, "summary": s.summary, "hulls": found.hulls, **found.limbs}
    return read(RobotSettings, values, where=f"robot '{s.name}'")


def stated_configuration(
    where: str,
    stated: InitialSettings | ObjectSettings,
    robot: RobotModel,
    rates: Sequence[float] = (),
) -> Configuration:
    """Return the configuration in which a run, or one of its objects, starts.

    Args:
        where: key of the settings, for refusals.
        stated: the settings.
        robot: model of the robot or object.
        rates: of its joints; none for zeros [rad/s or m/s].

    Raises:
        ConfigError: the numbers of joint values and of joints differ.
    """
    position = np.asarray(stated.joint_position, dtype=float)
    rate = np.asarray(rates, dtype=float)
    joints = robot.tree.joints
    for key, values in (("joint_position", position), ("joint_velocity", rate)):
        if values.size not in (0, joints):
            raise ConfigError(
                f"{where}.{key} has {values.size} values, "
                f"robot '{robot.name}' has {joints} joints.\n"
                f"Joints in order: {', '.join(robot.joints) or '(none)'}; leave it empty for zeros."
            )
    quaternion = quaternion_of_rpy(np.asarray([stated.rpy], dtype=float))
    turn = matrix_of(quaternion)[0]
    return Configuration(
        position=np.asarray(stated.position, dtype=float),
        quaternion=quaternion[0],
        velocity=np.asarray(stated.velocity, dtype=float),
        angular_velocity=turn @ np.asarray(stated.angular_velocity, dtype=float),
        joints=position if position.size else standing(robot.legs, joints),
        joint_velocity=rate if rate.size else np.zeros(joints),
    )


def build_parts(
    section: str, where: str, found: RobotFile, given: Mapping[str, Any]
) -> dict[str, Any]:
    """Build the effects, sensors or actuators of a robot folder, with those that a run adds.

    Args:
        section: ``effects``, ``sensors`` or ``actuators``.
        where: key of the robot or object, named in every refusal.
        found: the robot folder.
        given: by the run: values by parameter, over those of the folder; for one more, its name, or
            a mapping that names it by its kind.

    Raises:
        SealsError: the folder has no such part and the run names none, or a value cannot be used.
    """
    kind, parts = PARTS[section], dict(found.parts.get(section, {}))
    more = {str(key): _values(kind, given[key], f"{where}.{section}.{key}") for key in given}
    for key, values in more.items():
        plugin = values.pop(kind, None)
        if plugin is not None:
            parts[instance_name(key, f"{where}.{section}")] = str(plugin), {}
        refuse_unlisted(
            key,
            parts,
            f"{where}.{section}.{key}: '{found.settings.name}' has no {kind} '{key}'",
        )
    return {
        key: build_from_values(
            kind, plugin, values, more.get(key, {}), where=f"{where}.{section}.{key}"
        )
        for key, (plugin, values) in parts.items()
    }


def moves(settings: ObjectSettings, found: RobotFile) -> bool:
    """Return whether an object has a guide, from the run or from its folder."""
    return settings.guide is not None or "guide" in found.parts


def _animate(
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
            f"{place}: neither the run nor '{found.settings.name}' names one.\n"
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
