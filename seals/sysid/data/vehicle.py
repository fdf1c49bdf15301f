"""Nominal model, sensors and tolerances of a vehicle, read from its log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control.actuator_response import JITTER
from seals.effects.effect import Effect
from seals.environment.seawater import FRESH_WATER
from seals.environment.settings import EnvironmentSettings
from seals.errors import LogError, suggestion
from seals.hydrostatics import Hull, HullBox, HullCapsule, HullCompound, HullCylinder, HullSphere
from seals.multibody.tree import Tree
from seals.registry import get
from seals.robot.model import RobotModel
from seals.sysid.data.known_sea import known_sea, sea_laws
from seals.sysid.data.robot_description import RobotDescription
from seals.sysid.data.robot_vehicle import falls, parts_of, words_of

_STRUCTURE = {"rotor_thrust": "rotors", "thruster_force": "thrusters", "arm": "servos"}
"""Names in the baseline that stand for actuators."""


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """Nominal model of a vehicle and the accuracy of its properties.

    Args:
        name: of the vehicle.
        robot: links, masses, hulls.
        effects: of the nominal model by name, actuators among them.
        environment: air, water, ground.
        lag: first-order time constants of the actuators [s], shape (n,).
        commands: channel of the actuators' commands; empty for none.
        full_voltage: of the battery [V]; None when not known.
        sigma: white noise of each channel, 1-sigma, in the channel's unit.
        tolerance: 1-sigma uncertainty of each nominal property, by name.
        gust: level of unmodelled force [N] and torque [N m], shape (2,).
        gust_time: correlation time of the gusts [s].
        imu_position: of the inertial sensor, body axes [m], shape (3,).
        imu_turn: from body to sensor axes, shape (3, 3).
        initial_state: of each segment, when stated.
        servo: gains of the joint servos, shape (J,) each; empty without an arm.
        columns: for each joint the index of its column in the log; empty for their own order.
        written: key in ``robot.yaml`` of each effect that stands there.
        sea: known waves; None for calm water.
        fall: time constants of the actuators while they slow down [s], shape (n,); None for
            ``lag``.
        command_latency: mean time from the row of a command to its effect [s].
        simulated_step: step of the simulation that made the log [s]; None for another log.
    """

    name: str
    robot: RobotModel
    effects: Mapping[str, Effect]
    environment: EnvironmentSettings
    lag: Floats
    commands: str
    full_voltage: float | None
    sigma: Mapping[str, float]
    tolerance: Mapping[str, float]
    gust: Floats
    gust_time: float
    imu_position: Floats
    imu_turn: Floats
    initial_state: tuple[Mapping[str, Any], ...] = ()
    servo: Mapping[str, Floats] = field(default_factory=dict)
    columns: tuple[int, ...] = ()
    written: Mapping[str, str] = field(default_factory=dict)
    sea: Any = None
    fall: Floats | None = None
    command_latency: float = JITTER
    simulated_step: float | None = None

    @property
    def hull(self) -> Hull | None:
        """Hull of the base."""
        return self.robot.hulls[0]

    @property
    def has_water(self) -> bool:
        """True where there is water and the base has a hull."""
        return self.environment.water_level is not None and self.hull is not None

    @property
    def mass(self) -> float:
        """Mass of the whole vehicle [kg]."""
        return float(self.robot.mass.sum())


def read_vehicle(
    meta: Mapping[str, Any],
    robot: RobotDescription | None = None,
    *,
    still: Mapping[str, float] | None = None,
) -> Vehicle:
    """Build the nominal model from the metadata of a log, and the robot's folder where given.

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
            f"meta.yaml describes no vehicle that can be understood ({said}).\n"
            "See the description of the native log format, or give the robot: robot=FOLDER"
        ) from cause


def _vehicle_of(
    meta: Mapping[str, Any], robot: RobotDescription | None, still: Mapping[str, float]
) -> Vehicle:
    if robot is None:
        _part(meta, "vehicle")
    environment = _environment(_part(meta, "environment"))
    entries = [e for e in meta.get("baseline") or [] if e["name"] not in sea_laws()]
    made = (
        _of_meta(meta, environment, entries)
        if robot is None
        else _of_robot(meta, environment, entries, robot, still)
    )
    step = (meta.get("simulated") or {}).get("step")
    sea, beside = known_sea(meta, environment)
    if sea is None and robot is not None and (meta["environment"].get("wave") is not None):
        sea = robot.sea
    made["effects"] = {**made["effects"], **beside}
    imu = meta.get("sensors", {}).get("imu", {})
    channels = meta.get("sensors", {}).get("channels", {})
    gust = meta.get("disturbance") or {}
    return Vehicle(
        **made,
        environment=environment,
        sigma={k: float(v["sigma"]) for k, v in channels.items() if k in READ},
        tolerance={k: float(v["sigma"]) for k, v in meta.get("tolerance", {}).items()},
        gust=np.array([gust.get("force_sigma", 0.0), gust.get("torque_sigma", 0.0)], dtype=float),
        gust_time=float(gust.get("correlation_time", 0.35)),
        imu_position=np.asarray(imu.get("position", [0.0, 0.0, 0.0]), dtype=float),
        imu_turn=_turn(imu.get("orientation", [1.0, 0.0, 0.0, 0.0])),
        initial_state=tuple(meta.get("initial_state", ())),
        sea=sea,
        # a run of SEALS states its step, and its commands act at the time of their row
        command_latency=JITTER if step is None else 0.0,
        simulated_step=None if step is None else float(step),
    )


def _of_meta(
    meta: Mapping[str, Any], environment: EnvironmentSettings, entries: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Build the vehicle that the metadata describe."""
    spec = _part(meta, "vehicle")
    arm = spec.get("arm")
    if arm is not None and not arm.get("controller"):
        raise LogError(
            "meta.yaml: vehicle.arm states no controller: its joints swing, or nobody says how "
            "they are held.\nGive the robot's folder, robot=FOLDER, or gains in arm.controller."
        )
    robot = _robot(spec, arm)
    actuators, lag, commands = _actuators(spec)
    effects: dict[str, Effect] = {}
    for entry in entries:
        effects |= _effect(entry, actuators, environment, arm)
    return {
        "name": str(spec.get("name", "vehicle")),
        "robot": robot,
        "effects": effects,
        "lag": lag,
        "fall": falls(actuators.values()),
        "commands": commands,
        "full_voltage": _full_voltage(spec),
        "servo": {} if arm is None else {k: _gain(arm["controller"], k, robot) for k in _GAINS},
    }


def _full_voltage(spec: Mapping[str, Any]) -> float | None:
    """Return the voltage of the full battery in a description [V]; None where it says nothing.

    Raises:
        LogError: it is no voltage.
    """
    found = (spec.get("battery") or {}).get("full_voltage")
    if found is None:
        return None
    number = isinstance(found, int | float) and not isinstance(found, bool)
    if not number or not 0.0 < found <= _MOST_VOLTS:
        raise LogError(
            f"battery.full_voltage={found!r:.60} is not allowed.\n"
            f"Allowed: a number above 0, up to {_MOST_VOLTS:g} [V]"
        )
    return float(found)


def _of_robot(
    meta: Mapping[str, Any],
    environment: EnvironmentSettings,
    entries: Sequence[Mapping[str, Any]],
    description: RobotDescription,
    still: Mapping[str, float],
) -> dict[str, Any]:
    """Build the vehicle from a robot's folder; the metadata may add flows."""
    parts = parts_of(description, environment, meta, still)
    effects = dict(parts.effects)
    known = {key.partition(".")[2] for key in parts.written.values()}
    around = {type(effect) for effect in effects.values()}
    for entry in entries:
        # a run of SEALS lists the robot's own effects, too
        if entry["name"] in _STRUCTURE or entry.get("instance") in {*known, *effects}:
            continue
        more = _effect(entry, {}, environment, None)
        effects |= {k: e for k, e in more.items() if k not in effects and type(e) not in around}
    return {
        "name": parts.robot.name,
        "robot": parts.robot,
        "effects": effects,
        "lag": parts.lag,
        "fall": parts.fall,
        "commands": parts.commands[0] if parts.commands else "",
        "full_voltage": _full_voltage(meta),
        "servo": parts.servo,
        "columns": parts.columns,
        "written": parts.written,
    }


_MOST_VOLTS = 1e4
"""Largest voltage of a battery [V]: ten times that of any ship."""
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

_GAINS = ("kp", "kd", "torque_limit", "armature")


def _gain(controller: Mapping[str, Any], name: str, robot: RobotModel) -> Floats:
    """Gain of every joint: one number for all of them, or a list in their order."""
    given = np.asarray(controller[name], dtype=float)
    joints = robot.tree.joints
    if given.ndim > 1 or given.size not in (1, joints):
        raise LogError(
            f"meta.yaml: arm.controller.{name} has {given.size} numbers for {joints} joints.\n"
            "Give one for all joints, or one for each in the order of the links."
        )
    return np.full(joints, given) if given.size == 1 else given


def _part(meta: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    part = meta.get(name)
    if not isinstance(part, Mapping):
        raise LogError(
            f"meta.yaml holds no '{name}'.\nA diagnosis needs vehicle, environment, baseline, "
            "sensors and tolerance; see the description of the native log format."
        )
    return part


def _environment(around: Mapping[str, Any]) -> EnvironmentSettings:
    return EnvironmentSettings(
        gravity=-float(around.get("gravity", [0.0, 0.0, -9.81])[2]),
        air_density=float(around.get("air_density", 1.2)),
        water_level=_maybe(around.get("water_level")),
        tank_bottom=_maybe(around.get("tank_bottom")),
        ground_level=_maybe(around.get("ground_level")),
        water_density=float(around.get("water_density", FRESH_WATER)),
    )


def _maybe(value: Any) -> float | None:
    return None if value is None else float(value)


def _turn(wxyz: Any) -> Floats:
    from seals.frames import matrix_of

    w, x, y, z = (float(c) for c in wxyz)
    turned: Floats = matrix_of(np.array([[x, y, z, w]]))[0].T
    return turned


def _robot(spec: Mapping[str, Any], arm: Mapping[str, Any] | None) -> RobotModel:
    base = spec if arm is None else spec["base"]
    links = [] if arm is None else list(arm["links"])
    joints = [link["joint"] for link in links]
    count = len(links)
    _refuse_branches(links)
    tree = Tree(
        parent=(-1, *range(count)),
        joint=(-1, *range(count)),
        prismatic=tuple(j.get("type") == "prismatic" for j in joints),
        axis=np.array([j["axis"] for j in joints], dtype=float).reshape(-1, 3),
        origin=np.array([[0.0, 0.0, 0.0], *(j["origin"] for j in joints)], dtype=float),
        rotation=np.repeat(np.eye(3)[None], count + 1, axis=0),
        fixed_base=False,
        drive_inertia=() if arm is None else _armature(arm["controller"]["armature"], count),
    )
    bodies = [base, *links]
    return RobotModel(
        name=str(spec.get("name", "vehicle")),
        urdf="",
        links=("base", *(link["name"] for link in links)),
        joints=tuple(j["name"] for j in joints),
        tree=tree,
        mass=np.array([float(b["mass"]) for b in bodies]),
        centre=np.array([b["centre_of_gravity"] for b in bodies], dtype=float),
        inertia=np.array([b["inertia"] for b in bodies], dtype=float),
        lower=np.array([float(j["lower"]) for j in joints]),
        upper=np.array([float(j["upper"]) for j in joints]),
        hulls=(_hull(spec.get("hull")), *(None for _ in links)),
        has_collision=(False,) * (count + 1),
    )


def _armature(given: Any, count: int) -> tuple[float, ...]:
    each = np.ravel(np.asarray(given, dtype=float)).tolist()
    return tuple(each * count) if len(each) == 1 else tuple(each)


def _refuse_branches(links: list[Mapping[str, Any]]) -> None:
    """Raise where the links are no serial chain of moving joints."""
    last = None
    for link in links:
        joint, name = link["joint"], str(link["name"])
        parent = joint.get("parent")
        if "axis" not in joint or (last is not None and parent not in (None, last)):
            raise LogError(
                f"vehicle.arm: '{name}' hangs on '{parent or 'the base'}' "
                f"{'by a fixed joint' if 'axis' not in joint else 'beside other links'}.\n"
                "A diagnosis knows one arm whose links follow each other, all by moving joints; "
                "grippers and fixed links are to be part of the last link or of the base."
            )
        last = name


def _hull(spec: Mapping[str, Any] | None) -> Hull | None:
    if spec is None:
        return None
    parts: list[Hull] = []
    for shape in spec["primitives"]:
        size = [float(x) for x in np.atleast_1d(shape["size"])]
        place: dict[str, Any] = {"position": shape["position"]}
        if shape["type"] != "sphere":
            place["rpy"] = shape["rpy"]
        if shape["type"] == "box":
            parts.append(HullBox(size=size, **place))
        elif shape["type"] == "sphere":
            parts.append(HullSphere(radius=size[0], **place))
        elif shape["type"] in ("cylinder", "capsule"):
            made = HullCylinder if shape["type"] == "cylinder" else HullCapsule
            parts.append(made(radius=size[0], length=size[1], **place))
        else:
            kinds = ("box", "cylinder", "sphere", "capsule")
            raise LogError(
                f"vehicle.hull holds a '{shape['type']}'.\n{suggestion(shape['type'], kinds)}"
            )
    return HullCompound(
        parts=parts,
        displaced_volume=float(spec["displaced_volume"]),
        centre_of_buoyancy=spec["centre_of_buoyancy"],
        plan_area=float(spec["plan_area"]),
    )


def _actuators(spec: Mapping[str, Any]) -> tuple[dict[str, Effect], Floats, str]:
    """Actuators by name, time constants, and the channel of their commands."""
    rotors, thrusters = spec.get("rotors") or [], spec.get("thrusters") or []
    made: dict[str, Effect] = {}
    lag = np.array([float(a["time_constant"]) for a in (*rotors, *thrusters)])
    if rotors:
        keys = ("position", "axis", "direction", "thrust_coefficient", "torque_coefficient")
        table = {k: [r[k] for r in rotors] for k in (*keys, "time_constant", "radius", "max_speed")}
        table["direction"] = [float(d) for d in table["direction"]]
        if all("spin_down" in r for r in rotors):
            table["spin_down"] = [r["spin_down"] for r in rotors]
        made["rotors"] = get("actuator", "rotors").load()(**_floats(table))
    if thrusters:
        own = ("position", "axis", "time_constant", "max_force")
        made["thrusters"] = get("actuator", "thrusters").load()(
            **_floats({k: [r[k] for r in thrusters] for k in own})
        )
    commands = "rotor_speed_cmd" if rotors else "thruster_cmd" if thrusters else ""
    return made, lag, commands


def _floats(table: Mapping[str, list[Any]]) -> dict[str, Any]:
    return {k: np.asarray(v, dtype=float).tolist() for k, v in table.items()}


def _effect(
    entry: Mapping[str, Any],
    actuators: Mapping[str, Effect],
    environment: EnvironmentSettings,
    arm: Mapping[str, Any] | None,
) -> dict[str, Effect]:
    """Effects of one baseline entry by instance name."""
    name = str(entry["name"])
    if name in _STRUCTURE and _STRUCTURE[name] != "servos":
        kind = _STRUCTURE[name]
        if kind not in actuators:
            raise LogError(
                f"meta.yaml: baseline lists '{name}', but vehicle states no {kind}.\n"
                f"List them under vehicle.{kind}, or give the robot's folder: robot=FOLDER"
            )
        return {kind: actuators[kind]}
    if name == "arm" and arm is not None:
        gains = arm["controller"]
        options: dict[str, Any] = {}
        for gain in ("kp", "kd", "torque_limit"):
            each = np.ravel(np.asarray(gains[gain], dtype=float)).tolist()
            options |= {gain: each[0]} if len(each) == 1 else {f"{gain}_each": each}
        return {"servos": get("actuator", "servos").load()(**options)}
    law: type[Effect] = get("effect", name).load()
    parameters = {k: float(v) for k, v in (entry.get("parameters") or {}).items()}
    instance, effect = law.of_log(name, parameters, entry.get("medium"), environment)
    options = words_of(name, effect, entry.get("options") or {})
    return {instance: replace(effect, **options) if options else effect}
