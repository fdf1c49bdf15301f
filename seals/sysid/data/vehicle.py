"""Vehicle of a log: stated model, sensors and tolerances."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Annotated, Any

import numpy as np

from seals.arrays import Floats
from seals.batch.holding import EVERYWHERE
from seals.config.plugin_lookup import plugin_name
from seals.control.actuator_response import JITTER
from seals.control.limbs import stowed
from seals.effects.binding import EffectSet, bind_effects, has_hook
from seals.effects.effect import ActuatorOptions, Effect, number_lists
from seals.effects.hooks import Hook
from seals.effects.identification import Subject
from seals.environment.seawater import FRESH_WATER
from seals.environment.settings import EnvironmentSettings
from seals.errors import LogError, refuse_unlisted
from seals.frames import matrix_of
from seals.multibody.servo import GAINS
from seals.plugin_options import options_of
from seals.registry import get
from seals.robot.fusing import fused
from seals.robot.model import RobotModel
from seals.schema import Within, parameters_of, read
from seals.sysid.data.installed import loaded
from seals.sysid.data.known_sea import known_sea, sea_laws
from seals.sysid.data.robot_description import RobotDescription, describe_log, described_by

_STRUCTURE = {"rotor_thrust": "rotors", "thruster_force": "thrusters", "arm": "servos"}
"""Actuators in a log's description by the names that stand for them in its baseline."""
_Volts = Annotated[float, Within(0.0, 1e4, above=True)] | None
"""Voltage of a battery [V], up to ten times that of any ship."""
READ = (
    "position",
    "orientation",
    "velocity",
    "angular_velocity",
    "specific_force",
    "depth",
    "joint_position",
    "battery_voltage",
)
"""Channels that a diagnosis reads; readings of other sensors are carried along."""


@dataclass(frozen=True, kw_only=True)
class Vehicle(Subject):
    """Vehicle of a log: stated model, and the accuracy of its properties and sensors.

    Args:
        gust: level of unmodelled force [N] and torque [N m], shape (2,).
        gust_time: correlation time of the gusts [s].
        imu_position: of the inertial sensor, body axes [m], shape (3,).
        imu_turn: from body to sensor axes, shape (3, 3).
        initial_state: of each segment, when stated.
        columns: for each joint the index of its column in the log; empty for their own order.
        written: key in ``robot.yaml`` of each effect that stands there.
        sea: known waves; None for calm water.
        fall: time constants of the actuators while they slow down [s], shape (n,); None for
            ``lag``.
        command_latency: mean time from the row of a command to its effect [s].
        assumed: whether the data sheet says of a tolerance that it is a rule of thumb.
    """

    gust: Floats
    gust_time: float
    imu_position: Floats
    imu_turn: Floats
    initial_state: tuple[Mapping[str, Any], ...] = ()
    columns: tuple[int, ...] = ()
    written: Mapping[str, str] = field(default_factory=dict)
    sea: Any = None
    fall: Floats | None = None
    command_latency: float = JITTER
    assumed: bool = False

    @property
    def name(self) -> str:
        """Name of the vehicle."""
        return self.robot.name

    @property
    def bound(self) -> EffectSet:
        """Effects of the stated model on their links."""
        return bind_effects(self.effects, self.robot.links)


def read_vehicle(
    meta: Mapping[str, Any],
    robot: RobotDescription | None = None,
    *,
    still: Mapping[str, float] | None = None,
) -> Vehicle:
    """Build the stated model from the metadata of a log, and the robot's folder where given.

    Args:
        meta: of the log, or of several joined ones.
        robot: of the folder; it replaces the entry ``vehicle`` of the metadata.
        still: where the joints stand in a log in which none of them moves [rad or m].

    Raises:
        LogError: something needed is missing or of an unknown kind.
    """
    try:
        return _vehicle_of(meta, robot, still or {})
    except (AttributeError, LookupError, TypeError, ValueError, ArithmeticError) as cause:
        said = " ".join(f"{type(cause).__name__}: {cause}".split())[:200]
        raise LogError(
            f"meta.yaml contains no valid description of a vehicle ({said}).\n"
            "Give the robot, robot=NAME or robot=FOLDER, or correct the file: docs/formats.md"
        ) from cause


def _vehicle_of(
    meta: Mapping[str, Any], robot: RobotDescription | None, still: Mapping[str, float]
) -> Vehicle:
    description = robot or described_by(meta) or describe_log(_part(meta, "vehicle"))
    around = _part(meta, "environment")
    environment = EnvironmentSettings(
        gravity=-float(around.get("gravity", [0.0, 0.0, -9.81])[2]),
        air_density=float(around.get("air_density", 1.2)),
        water_level=_maybe(around.get("water_level")),
        tank_bottom=_maybe(around.get("tank_bottom")),
        ground_level=_maybe(around.get("ground_level")),
        water_density=float(around.get("water_density", FRESH_WATER)),
    )
    model, acts, effects, written = _nominal(description, environment, meta, still)
    drives: list[Any] = [e for e in acts.values() if has_hook(e, "drives")]
    drives.sort(key=lambda e: e.first)
    step = (meta.get("simulated") or {}).get("step")
    sea, beside = known_sea(meta, environment)
    if sea is None and meta["environment"].get("wave") is not None:
        sea = description.sea
    imu = meta.get("sensors", {}).get("imu", {})
    channels = meta.get("sensors", {}).get("channels", {})
    gust = meta.get("disturbance") or {}
    w, x, y, z = (float(c) for c in imu.get("orientation", [1.0, 0.0, 0.0, 0.0]))
    given = ((meta["vehicle"] if description.of_log else meta).get("battery") or {}).get(
        "full_voltage"
    )
    found: float | None = read(_Volts, given, where="battery.full_voltage", error=LogError)
    return Vehicle(
        robot=model,
        effects={**effects, **beside},
        environment=environment,
        lag=np.concatenate([np.zeros(0), *(d.lag for d in drives)]),
        fall=_falls(drives),
        commands=_channel(drives[0]) if drives else "",
        servo=_servo(acts, model),
        # joints of a log that describes them stand in its own order
        columns=() if description.of_log else _columns(description, model, meta),
        written=written,
        full_voltage=found,
        sigma={k: float(v["sigma"]) for k, v in channels.items() if k in READ},
        tolerance={k: float(v["sigma"]) for k, v in meta.get("tolerance", {}).items()},
        assumed=any(v.get("source") == "assumed" for v in meta.get("tolerance", {}).values()),
        gust=np.array([gust.get("force_sigma", 0.0), gust.get("torque_sigma", 0.0)], dtype=float),
        gust_time=float(gust.get("correlation_time", 0.35)),
        imu_position=np.asarray(imu.get("position", [0.0, 0.0, 0.0]), dtype=float),
        imu_turn=matrix_of(np.array([[x, y, z, w]]))[0].T,
        initial_state=tuple(meta.get("initial_state", ())),
        sea=sea,
        # a run of SEALS states its step, and its commands act at the time of their row
        command_latency=JITTER if step is None else 0.0,
        simulated_step=None if step is None else float(step),
    )


def _nominal(
    description: RobotDescription,
    environment: EnvironmentSettings,
    meta: Mapping[str, Any],
    still: Mapping[str, float],
) -> tuple[RobotModel, dict[str, Effect], dict[str, Effect], dict[str, str]]:
    """Return the stated model of a robot in the surroundings of a log.

    These are the robot, what acts of its folder or is commanded by the log, all effects by their
    instance names in a diagnosis, and the keys of those that stand in ``robot.yaml``.
    """
    model, acts, listed = description.robot, dict(description.actuators), None
    if description.of_log or _instances_of(meta):
        listed = {str(e["name"]) for e in meta.get("baseline") or []}
    if description.of_log:
        # a log may command drives whose forces its baseline does not list
        made = _with_baseline(description, {}, {}, meta, environment)
        if -1 in model.tree.joint[1:]:
            rest = [0.0] * model.tree.joints
            model = fused(model, rest, _named(made, model), moving=model.joints)
        model = _with_motors(acts, model)
        if any(model.hulls[1:]):
            made = _surroundings(made, model, environment, listed=listed)
        return model, acts, made, {}
    # all entries of a simulated log without drives are effects: the actuators stood still
    driven = listed is None or any("instance" not in e for e in meta["baseline"])
    acts = {**acting(description, meta), **(acts if driven else {})}
    model, acts = _merged(model, acts, meta, still)
    model = _with_motors(description.actuators, model)
    made, written = _instances(description, acts, model, environment)
    made = _surroundings(made, model, environment, listed=listed)
    return model, acts, _with_baseline(description, made, written, meta, environment), written


def _part(meta: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    part = meta.get(name)
    if not isinstance(part, Mapping):
        raise LogError(
            f"meta.yaml holds no '{name}'.\nGive the robot, robot=NAME or robot=FOLDER, or state "
            "vehicle, environment, baseline, sensors and tolerance in it: docs/formats.md"
        )
    return part


def _maybe(value: Any) -> float | None:
    return None if value is None else float(value)


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
        seen = "none of its joints moves" if measured else "none of its joints is measured"
        raise LogError(
            f"robot '{robot.name}' is bolted to the world, and {seen} in this log.\n"
            "Missing effects show only in moving joints: log joint_position while the arm "
            "moves, for "
            "instance by controller=direct guide=hover guide.arm=random."
        )
    if not moving:
        of_joints: tuple[Hook, ...] = ("joint_loads", "joint_drive")
        effects = {k: e for k, e in effects.items() if not any(has_hook(e, h) for h in of_joints)}
    stands = [still.get(n, q) for n, q in zip(robot.joints, stowed(robot), strict=True)]
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
        if name in _STRUCTURE and description.of_log:
            actuators = description.actuators
            kind = _STRUCTURE[name]
            if kind not in actuators:
                raise LogError(
                    f"meta.yaml: baseline lists '{name}', but vehicle states no {kind}.\n"
                    f"List them under vehicle.{'arm' if kind == 'servos' else kind}, or give the "
                    "robot's folder: robot=FOLDER"
                )
            effects |= {kind: actuators[kind]}
        if name in _STRUCTURE or name in sea_laws() or entry.get("instance") in known:
            continue
        law: type[Effect] = get("effect", name).load()
        parameters = {k: float(v) for k, v in (entry.get("parameters") or {}).items()}
        instance, effect = law.of_log(name, parameters, entry.get("medium"), environment)
        if description.of_log:
            instance, effect = _on_links(instance, effect, entry, description.robot)
        if instance not in made and law not in around:
            options = _words_of(name, effect, entry.get("options") or {})
            effects[instance] = replace(effect, **options) if options else effect
    return effects


def _on_links(
    instance: str, effect: Effect, entry: Mapping[str, Any], robot: RobotModel
) -> tuple[str, Effect]:
    """Instance name and effect on the links that its entry in a run's baseline lists."""
    known = {*robot.links[1:], *EVERYWHERE}
    # the base has no name in a description
    links = [str(n) if n in known else "root" for n in entry.get("links") or []]
    if len(robot.links) == 1 or not links or set(links) == {"root"}:
        return instance, effect
    name = instance if "*" in links else str(entry.get("instance", instance))
    return name, replace(effect, links=links)


def _falls(actuators: Sequence[Any]) -> Floats:
    """Spin-down time constants of the actuators [s], shape (n,)."""
    own = [(options_of(e, ActuatorOptions).fall, e.lag) for e in actuators]
    return np.concatenate([np.zeros(0), *(lag if fall is None else fall for fall, lag in own)])


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
            # the instance name as for an entry of a log
            on_base = set(effect.links) <= {"root", robot.links[0]} or "*" in effect.links
            if effect.correction or not on_base:
                own = name
            else:
                law = type(effect)
                medium = None if effect.medium is None else effect.medium.value
                own = law.of_log(plugin_name("effect", law), {}, medium, environment)[0]
        own = name if own in made else own
        made[own] = copy.copy(effect)
        written[own] = f"{'actuators' if actuator else 'effects'}.{name}"
    return made, written


def _surroundings(
    effects: Mapping[str, Effect],
    robot: RobotModel,
    environment: EnvironmentSettings,
    *,
    listed: set[str] | None,
) -> dict[str, Effect]:
    """Return effects with those that the environment adds to every robot, such as weight.

    Args:
        effects: by instance.
        robot: on which they act.
        environment: of the log.
        listed: names of what the log lists, where it holds no others; those that the robot brings
            are split among the links as a diagnosis needs them, where nothing is changed about
            them. None for a log that lists what is beside the robot's own.
    """
    made = dict(effects)
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


def acting(description: RobotDescription, meta: Mapping[str, Any]) -> dict[str, Effect]:
    """Return the robot's effects in the stated model of a log; of a run, those that it lists.

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
    stated = _words_of(own, effect, entry.get("options") or {})
    return replace(effect, **{**effect.log_words, **stated})


def _words_of(name: str, effect: Effect, given: Mapping[str, Any]) -> dict[str, Any]:
    """Options of a baseline entry: one word of several, such as the form of a drag, or numbers."""
    known = {k: type(v) for k, v in vars(effect).items() if isinstance(v, Enum) and k != "medium"}
    lists = number_lists(effect)
    for key, word in given.items():
        where = f"meta.yaml: baseline: {name}.options"
        refuse_unlisted(str(key), (*known, *lists), f"{where}: there is no '{key}'", error=LogError)
        if key in known:
            words = [member.value for member in known[key]]
            refuse_unlisted(str(word), words, f"{where}.{key}={word}", error=LogError)
    return {
        key: known[key](word) if key in known else np.asarray(word, dtype=float).tolist()
        for key, word in given.items()
    }


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
