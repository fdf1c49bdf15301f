"""Nominal model of a vehicle, built from the description of its robot and the log's baseline."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.batch.holding import EVERYWHERE
from seals.config.plugin_lookup import plugin_name
from seals.effects.binding import has_hook
from seals.effects.effect import ActuatorOptions, Effect
from seals.effects.hooks import Hook
from seals.environment.settings import EnvironmentSettings
from seals.errors import LogError, suggestion
from seals.multibody.servo import GAINS
from seals.plugin_options import options_of
from seals.registry import get
from seals.robot.fusing import fused
from seals.robot.limbs import standing
from seals.robot.model import RobotModel
from seals.schema import parameters_of
from seals.sysid.data.installed import loaded
from seals.sysid.data.known_sea import sea_laws
from seals.sysid.data.robot_description import RobotDescription

STRUCTURE = {"rotor_thrust": "rotors", "thruster_force": "thrusters", "arm": "servos"}
"""Actuators in a log's description by the names that stand for them in its baseline."""


@dataclass(frozen=True, kw_only=True)
class RobotParts:
    """The nominal model of a robot, as a diagnosis needs it.

    Args:
        robot: fixed links merged into their parents.
        effects: by the instance names of a diagnosis, actuators among them.
        written: key in ``robot.yaml`` of each instance that stands there, such as
            ``effects.water_drag``.
        lag: first-order time constants of the drives [s], shape (n,).
        fall: the same while they slow down [s], shape (n,).
        commands: channel of the drives' commands, those of the first; empty for no drives.
        servo: gains of the joint servos, and ``speed``, the largest of their commands [rad/s or
            m/s], where it is limited; shape (J,) each; empty without servos.
        columns: for each joint the index of its column in the log.
    """

    robot: RobotModel
    effects: Mapping[str, Effect]
    written: Mapping[str, str]
    lag: Floats
    fall: Floats
    commands: str
    servo: Mapping[str, Floats]
    columns: tuple[int, ...]


def parts_of(
    description: RobotDescription,
    environment: EnvironmentSettings,
    meta: Mapping[str, Any],
    still: Mapping[str, float],
) -> RobotParts:
    """Return the nominal model of a robot in the surroundings of a log.

    Args:
        description: of a robot folder, a run or the log itself.
        environment: of the log.
        meta: of the log.
        still: where the joints stand in a log in which none of them moves [rad or m]; else empty.

    Raises:
        LogError: the robot is bolted down, and no joint of it is seen to move.
    """
    model, acts = description.robot, dict(description.actuators)
    made: dict[str, Effect] = {}
    written: dict[str, str] = {}
    if description.of_log:
        # a log may command drives whose forces its baseline does not list
        model = _with_motors(acts, model)
    else:
        acts = {**acting(description, meta), **({} if _undriven(meta) else acts)}
        model, acts = _merged(model, acts, meta, still)
        model = _with_motors(description.actuators, model)
        made, written = _instances(description, acts, model, environment)
        made = _surroundings(made, model, environment, meta)
    drives = [e for e in acts.values() if has_hook(e, "drives")]
    drives.sort(key=lambda e: e.first)  # type: ignore[attr-defined]  # of actuators
    lags = [e.lag for e in drives]  # type: ignore[attr-defined]  # of actuators
    return RobotParts(
        robot=model,
        effects=_with_baseline(description, made, written, meta, environment),
        written=written,
        lag=np.concatenate([np.zeros(0), *lags]),
        fall=falls(drives),
        commands=_channel(drives[0]) if drives else "",
        servo=_servo(acts, model),
        columns=_columns(description, model, meta),
    )


def _merged(
    robot: RobotModel,
    effects: Mapping[str, Effect],
    meta: Mapping[str, Any],
    still: Mapping[str, float],
) -> tuple[RobotModel, dict[str, Effect]]:
    """Robot and effects of a log in which the joints move or are held.

    Fixed links, and all others where the log measures no joints, become part of their parents;
    links that effects name stay.
    """
    measured = "joint_position" in (meta.get("sensors", {}).get("channels") or {})
    moving = robot.joints if measured and not still else ()
    if robot.tree.fixed_base and not moving:
        seen = "all its joints stand still" if measured else "none of its joints is measured"
        raise LogError(
            f"robot '{robot.name}' is bolted to the world, and {seen} in this log.\n"
            "Only moving joints show what is missing: log joint_position while the arm moves, for "
            "instance by controller=direct guide=hover guide.arm=random."
        )
    if not moving:
        of_joints: tuple[Hook, ...] = ("joint_loads", "joint_drive")
        effects = {k: e for k, e in effects.items() if not any(has_hook(e, h) for h in of_joints)}
    stands = [still.get(n, q) for n, q in zip(robot.joints, _stowed(robot), strict=True)]
    return fused(robot, stands, _named(effects, robot), moving=moving), dict(effects)


def _with_baseline(
    description: RobotDescription,
    made: Mapping[str, Effect],
    written: Mapping[str, str],
    meta: Mapping[str, Any],
    environment: EnvironmentSettings,
) -> dict[str, Effect]:
    """Return effects with those of the log's baseline that are none of the robot's own.

    Args:
        description: of the robot.
        made: by instance.
        written: their keys in ``robot.yaml``; a run of SEALS lists the robot's own effects, too.
        meta: of the log.
        environment: of the log.
    """
    effects = dict(made)
    known = {*made, *(key.partition(".")[2] for key in written.values())}
    around = {type(effect) for effect in made.values()}
    for entry in meta.get("baseline") or []:
        name = str(entry["name"])
        if name in STRUCTURE and description.of_log:
            effects |= _listed(name, description.actuators)
        if name in STRUCTURE or name in sea_laws() or entry.get("instance") in known:
            continue
        law: type[Effect] = get("effect", name).load()
        parameters = {k: float(v) for k, v in (entry.get("parameters") or {}).items()}
        instance, effect = law.of_log(name, parameters, entry.get("medium"), environment)
        if instance not in made and law not in around:
            options = words_of(name, effect, entry.get("options") or {})
            effects[instance] = replace(effect, **options) if options else effect
    return effects


def _listed(name: str, actuators: Mapping[str, Effect]) -> dict[str, Effect]:
    """Actuator that an entry of a log's baseline stands for."""
    kind = STRUCTURE[name]
    if kind not in actuators:
        raise LogError(
            f"meta.yaml: baseline lists '{name}', but vehicle states no {kind}.\n"
            f"List them under vehicle.{'arm' if kind == 'servos' else kind}, or give the robot's "
            "folder: robot=FOLDER"
        )
    return {kind: actuators[kind]}


def falls(actuators: Iterable[Any]) -> Floats:
    """Return the spin-down time constants of the actuators [s], shape (n,)."""
    own = [(options_of(e, ActuatorOptions).fall, e.lag) for e in actuators]
    return np.concatenate([np.zeros(0), *(lag if fall is None else fall for fall, lag in own)])


def _stowed(robot: RobotModel) -> Floats:
    """Joint values at rest [rad or m], shape (J,): arms stowed, grippers open, legs in stance."""
    stands = standing(robot.legs, robot.tree.joints)
    values: Floats = np.clip(stands, robot.lower, robot.upper)
    for arm in robot.arms.values():
        values[list(arm.joints)] = arm.stowed
    for gripper in robot.grippers.values():
        values[list(gripper.joints)] = gripper.open
    return values


def _named(effects: Mapping[str, Effect], robot: RobotModel) -> set[str]:
    """Links that effects name, and all links under an effect that acts on each."""
    found = {link for e in effects.values() for link in e.links if link not in EVERYWHERE}
    spread = [e for e in effects.values() if "*" in e.links and e.ambient() is None]
    if any(has_hook(e, "loads") or has_hook(e, "inertia") for e in spread):
        found |= set(robot.links)
    return found


def _servo(effects: Mapping[str, Effect], robot: RobotModel) -> dict[str, Floats]:
    """Gains of the servos."""
    driven = [e for e in effects.values() if has_hook(e, "joint_drive")]
    joints = robot.tree.joints
    if not driven or not joints:
        return {}
    one: Any = driven[0]
    speed = one.speeds(joints) if hasattr(one, "speeds") else np.array([np.finfo(float).max])
    limited = {"speed": speed} if (speed < np.finfo(float).max).any() else {}
    return {name: np.asarray(one.of_joints(name, joints), dtype=float) for name in GAINS} | limited


def _with_motors(actuators: Mapping[str, Effect], robot: RobotModel) -> RobotModel:
    """Return the robot with the inertia of its joints' motors, driven or not."""
    armature = _servo(actuators, robot).get("armature")
    if armature is None:
        return robot
    return replace(robot, tree=replace(robot.tree, drive_inertia=tuple(armature.tolist())))


def _instances(
    description: RobotDescription,
    effects: Mapping[str, Effect],
    robot: RobotModel,
    environment: EnvironmentSettings,
) -> tuple[dict[str, Effect], dict[str, str]]:
    """Effects by their instance names in a diagnosis, and their keys in ``robot.yaml``."""
    made: dict[str, Effect] = {}
    written: dict[str, str] = {}
    for name, effect in effects.items():
        actuator = name in description.actuators
        if actuator:
            own = plugin_name("actuator", type(effect))
        else:
            own = _instance(name, effect, robot, environment)
        own = name if own in made else own
        made[own] = copy.copy(effect)
        written[own] = f"{'actuators' if actuator else 'effects'}.{name}"
    return made, written


def _instance(
    name: str, effect: Effect, robot: RobotModel, environment: EnvironmentSettings
) -> str:
    """Return the instance name of an effect, as for an entry of a log."""
    on_base = set(effect.links) <= {"root", robot.links[0]} or "*" in effect.links
    if effect.correction or not on_base:
        return name
    law = type(effect)
    medium = None if effect.medium is None else effect.medium.value
    return law.of_log(plugin_name("effect", law), {}, medium, environment)[0]


def _surroundings(
    effects: Mapping[str, Effect],
    robot: RobotModel,
    environment: EnvironmentSettings,
    meta: Mapping[str, Any],
) -> dict[str, Effect]:
    """Return effects with those that the environment adds to every robot, such as weight.

    Args:
        effects: by instance.
        robot: on which they act.
        environment: of the log.
        meta: of the log; that of a run lists all that it holds. Those that the robot brings are
            split among the links as a diagnosis needs them, where nothing is changed about them.
    """
    made = dict(effects)
    listed = {str(e["name"]) for e in meta.get("baseline") or []} if _instances_of(meta) else None
    for name, law in loaded("effect").items():
        if not issubclass(law, Effect):
            continue
        own = [k for k, e in made.items() if isinstance(e, law)]
        around = law.of_surroundings(name, robot, environment)
        if not around or (not own and listed is not None and name not in listed):
            continue
        if not own:
            made |= around
        elif len(own) == 1 and _plain(made[own[0]]):
            del made[own[0]]
            made |= around
    return made


def _plain(effect: Effect) -> bool:
    """Return true if all parameters of an effect have their defaults."""
    other = type(effect)()
    return all(getattr(effect, p) == getattr(other, p) for p in parameters_of(effect))


def _instances_of(meta: Mapping[str, Any]) -> set[str]:
    """Instances of effects that a log of SEALS lists; none in other logs."""
    return {str(e["instance"]) for e in meta.get("baseline") or [] if "instance" in e}


def _undriven(meta: Mapping[str, Any]) -> bool:
    """Return true for a simulated log without drives: the actuators stood still."""
    entries = meta.get("baseline") or []
    return bool(_instances_of(meta)) and all("instance" in e for e in entries)


def acting(description: RobotDescription, meta: Mapping[str, Any]) -> dict[str, Effect]:
    """Return the robot's effects in the nominal model of a log; of a run, those that it lists.

    Each has the form of its law that the log means.

    Raises:
        LogError: the log states a form that the law does not have.
    """
    listed = _instances_of(meta)
    kept = {k: e for k, e in description.effects.items() if not listed or k in listed}
    return {k: _as_logged(k, e, meta) for k, e in kept.items()}


def _as_logged(name: str, effect: Effect, meta: Mapping[str, Any]) -> Effect:
    """Return an effect of the robot in the form that a log's entry of it states or leaves open."""
    if not effect.log_words:
        return effect
    own = plugin_name("effect", type(effect))
    entries = [e for e in meta.get("baseline") or [] if e["name"] == own]
    entry: Mapping[str, Any] = next((e for e in entries if e.get("instance", name) == name), {})
    stated = words_of(own, effect, entry.get("options") or {})
    return replace(effect, **{**effect.log_words, **stated})


def words_of(name: str, effect: Effect, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a baseline entry that choose one word of several, by field.

    Args:
        name: under which the effect is installed.
        effect: whose fields they are, such as the form of a drag.
        given: words by field, as the log states them.

    Raises:
        LogError: there is no such field, or no such word.
    """
    known = {k: type(v) for k, v in vars(effect).items() if isinstance(v, Enum) and k != "medium"}
    for key, word in given.items():
        where = f"meta.yaml: baseline: {name}.options"
        if key not in known:
            raise LogError(f"{where}: there is no '{key}'.\n{suggestion(str(key), known)}")
        words = [member.value for member in known[key]]
        if word not in words:
            raise LogError(f"{where}.{key}={word}.\n{suggestion(str(word), words)}")
    return {key: known[key](word) for key, word in given.items()}


def _channel(actuator: Effect) -> str:
    """Channel of an actuator's commands: speeds of rotors, forces of others."""
    rotor = "reaction_coefficient" in actuator.constants()
    return "rotor_speed_cmd" if rotor else "thruster_cmd"


def _columns(
    description: RobotDescription, robot: RobotModel, meta: Mapping[str, Any]
) -> tuple[int, ...]:
    """Column of each joint, in the order of the log, else of the URDF."""
    order: Sequence[str] = meta.get("joints") or description.listed or robot.joints
    lost = [name for name in robot.joints if name not in order]
    if lost:
        raise LogError(
            f"meta.yaml lists the joints {', '.join(map(str, order))}, but not '{lost[0]}' of "
            f"robot '{robot.name}'.\nList all movable joints in the order of their columns."
        )
    return tuple(list(order).index(name) for name in robot.joints)
