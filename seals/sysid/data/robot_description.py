"""Description of a robot, from its folder, a run or the metadata of a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from seals.effects.effect import Effect
from seals.errors import LogError, refuse_unlisted
from seals.logs.native import read_meta
from seals.logs.run_folder import ROBOT
from seals.multibody.servo import GAINS
from seals.registry import get
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.robot.robot_file import RobotFile, robot_of
from seals.robot.settings import HullSettings, RobotSettings, ShapeSettings, ShapeType
from seals.robot.urdf import Urdf, UrdfJoint, UrdfLink, read_urdf
from seals.run.equipment_metadata import vehicle_of
from seals.run.objects import object_robot


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """A robot as its folder or a log describes it.

    Args:
        robot: links, joints, hulls.
        effects: of ``robot.yaml`` by instance name.
        actuators: of ``robot.yaml`` by instance name.
        listed: names of the movable joints in the order in which the URDF lists them.
        sea: waves of a run; None for what the log states.
        of_log: whether the metadata of a log describe it: the baseline of that log lists all its
            effects.
    """

    robot: RobotModel
    effects: Mapping[str, Effect]
    actuators: Mapping[str, Effect]
    listed: tuple[str, ...] = ()
    sea: Any = None
    of_log: bool = False


def described(config: Any) -> RobotDescription | None:
    """Return the robot of a command's configuration, or None if none is given.

    Args:
        config: composed configuration with ``robot``, ``effects`` and ``actuators``.

    Raises:
        SealsError: the robot, an effect or an actuator cannot be used.
    """
    from omegaconf import OmegaConf

    from seals.config.build import build
    from seals.config.refusal import refusals
    from seals.schema import check_tree

    if not config.robot.folder:
        return None
    with refusals(()):
        settings: Any = OmegaConf.to_object(config.robot)
    check_tree(settings, where="robot")
    made = {
        section: {
            str(n): build(node, where=f"{section}.{n}") for n, node in config[section].items()
        }
        for section in ("effects", "actuators")
    }
    return RobotDescription(
        robot=build_robot(settings),
        effects=made["effects"],
        actuators=made["actuators"],
        listed=read_urdf(settings.urdf_path).listed,
    )


def described_by(meta: Mapping[str, Any]) -> RobotDescription | None:
    """Return the robot in the folder ``robot/`` of a log; None for a log without one.

    Args:
        meta: of the log.

    Raises:
        SealsError: the robot, an effect or an actuator cannot be used.
    """
    from seals.config.build import build_from_values

    stated = meta.get(ROBOT)
    if not isinstance(stated, Mapping):
        return None
    told = {key: value for key, value in stated.items() if key != "folder"}
    found = robot_of(told, Path(str(stated["folder"])))
    # meshes are for engines: a log's folder has none but those of hulls
    urdf = read_urdf(found.settings.urdf_path, meshes=False)
    wave = dict((meta.get("environment") or {}).get("wave") or {})
    name = wave.pop("wave", None)
    sea = name and build_from_values("wave", str(name), wave, {}, where="environment.wave")
    return replace(_of_folder(found, build_robot(object_robot(found), urdf)), sea=sea)


def stated_robot(meta: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return name, mass and drives of a log's robot, as ``meta.yaml: vehicle`` states them.

    It is empty for a log that describes none.

    Raises:
        SealsError: the robot in the log's folder cannot be used.
    """
    found, stated = described_by(meta), meta.get("vehicle")
    if found is not None:
        return vehicle_of(found.robot, found.actuators)
    return stated if isinstance(stated, Mapping) else {}


def name_in(meta: Mapping[str, Any]) -> str:
    """Return the name that a log gives its robot; empty where it has none."""
    return str((meta.get(ROBOT) or meta.get("vehicle") or {}).get("name", ""))


def describe_run(folder: Path) -> RobotDescription | None:
    """Return the robot that SEALS simulated in a run, or None for any other log.

    Raises:
        SealsError: its description in the run's folder cannot be used.
        LogError: the water of the run was simulated, of which no law is known.
    """
    if not (folder / ROBOT / "robot.yaml").is_file():
        return None
    meta = read_meta(folder / "meta.yaml")
    if (meta.get("environment") or {}).get("fluid") is not None:
        raise LogError(
            f"log={folder} is a run in simulated water (fluid).\n"
            "A diagnosis needs laws: use a run without a fluid, see docs/limits.md."
        )
    return described_by(meta)


def describe_robot(robot: str) -> RobotDescription:
    """Return the description of a robot by its name or folder.

    Args:
        robot: installed name, or path of a robot folder.

    Raises:
        SealsError: there is no such robot, or it cannot be used.
    """
    from seals.config.source import find_robot

    found = find_robot(robot)
    made = _of_folder(found, build_robot(object_robot(found)))
    return replace(made, listed=read_urdf(found.settings.urdf_path).listed)


def _of_folder(found: RobotFile, robot: RobotModel) -> RobotDescription:
    """Return the description in a robot folder, its joints in the order of the model."""
    from seals.config.build import build_from_values

    effects, actuators = (
        {
            name: build_from_values(kind, plugin, values, {}, where=f"{kind}s.{name}")
            for name, (plugin, values) in found.parts[f"{kind}s"].items()
        }
        for kind in ("effect", "actuator")
    )
    return RobotDescription(robot=robot, effects=effects, actuators=actuators, listed=robot.joints)


def describe_log(spec: Mapping[str, Any]) -> RobotDescription:
    """Return the robot that a log's metadata describe.

    Args:
        spec: entry ``vehicle`` of the metadata; see docs/formats.md.

    Raises:
        SealsError: a part of it is of a kind that no robot has.
    """
    arm = spec.get("arm")
    if arm is not None and not arm.get("controller"):
        raise LogError(
            "meta.yaml: vehicle.arm states no controller: its joints swing, or their servos are "
            "unknown.\nGive the robot's folder, robot=FOLDER, or gains in arm.controller."
        )
    links = [] if arm is None else list(arm["links"])
    base = spec if arm is None else spec["base"]
    bodies = [{**base, "name": "base", "hull": spec.get("hull")}, *links]
    name = str(spec.get("name", "vehicle"))
    urdf = Urdf(
        name=name,
        links=tuple(
            UrdfLink(
                name=body["name"],
                mass=float(body["mass"]),
                centre=np.array(body["centre_of_gravity"], dtype=float),
                inertia=np.array(body["inertia"], dtype=float),
            )
            for body in bodies
        ),
        joints=_joints(links),
    )
    hulls = {body["name"]: _hull(body["hull"]) for body in bodies if body.get("hull") is not None}
    robot = build_robot(RobotSettings(name=name, hulls=hulls), urdf)
    actuators = _drives(spec)
    if arm is not None:
        actuators["servos"] = _servos(arm["controller"], robot.tree.joints)
    return RobotDescription(robot=robot, effects={}, actuators=actuators, of_log=True)


def _joints(links: Sequence[Mapping[str, Any]]) -> tuple[UrdfJoint, ...]:
    """Joints above the links of an arm, which follow each other where they state no parents."""
    made: list[UrdfJoint] = []
    # the first link hangs on the base, whatever that is called
    first = links[0]["joint"].get("parent") if links else None
    known = {"base": "base", first or "base": "base"}
    for link in links:
        joint, name = link["joint"], str(link["name"])
        parent = joint.get("parent") or (made[-1].child if made else "base")
        if parent not in known or name in known:
            raise LogError(
                f"vehicle.arm: '{name}' has the parent '{parent}', which is not a preceding "
                "link, or "
                "has the name of another link.\n"
                "List every link once, under a unique name, after its parent."
            )
        known[name] = name
        moves = bool(_MOVING & set(joint))
        # a run of SEALS states whether a joint slides by a flag, and no limit where there is none
        made.append(
            UrdfJoint(
                name=joint["name"] if moves else "",
                parent=known[parent],
                child=name,
                moves=moves,
                prismatic=joint.get("type") == "prismatic" or joint.get("prismatic") is True,
                origin=np.array(joint["origin"], dtype=float),
                rotation=np.array(joint.get("rotation", np.eye(3)), dtype=float),
                axis=np.array(joint["axis"] if moves else np.zeros(3), dtype=float),
                lower=float(joint.get("lower", -np.inf)),
                upper=float(joint.get("upper", np.inf)),
            )
        )
    return tuple(made)


_MOVING = {"name", "axis", "lower", "upper"}
"""What no fixed joint states."""
_SIZES = {"box": 3, "cylinder": 2, "sphere": 1, "capsule": 2}
"""Shapes of a hull that a log may state, and the numbers of their sizes."""


def _hull(spec: Mapping[str, Any]) -> HullSettings:
    """Hull of a link."""
    if not spec["primitives"]:
        raise LogError("vehicle.hull has no primitives.\nGive at least one, or write hull: null")
    shapes = []
    for shape in spec["primitives"]:
        kind = shape["type"]
        refuse_unlisted(kind, _SIZES, f"vehicle.hull holds a '{kind}'", error=LogError)
        shapes.append(
            ShapeSettings(
                type=ShapeType(kind),
                size=[float(x) for x in np.atleast_1d(shape["size"])[: _SIZES[kind]]],
                position=shape["position"],
                rpy=[0.0, 0.0, 0.0] if kind == "sphere" else shape["rpy"],
            )
        )
    return HullSettings(
        shapes=shapes,
        displaced_volume=float(spec["displaced_volume"]),
        centre_of_buoyancy=spec["centre_of_buoyancy"],
        plan_area=float(spec["plan_area"]),
    )


_LISTS = {
    "rotors": (
        *("position", "axis", "direction", "thrust_coefficient", "torque_coefficient"),
        *("time_constant", "radius", "max_speed"),
    ),
    "thrusters": ("position", "axis", "time_constant", "max_force"),
}
"""What a log states of every drive, as the actuator of the same name lists it."""
_OPTIONAL = ("spin_down", "reverse", "friction_torque", "copper_loss")
"""What it may state of every rotor."""


def _drives(spec: Mapping[str, Any]) -> dict[str, Effect]:
    """Rotors and thrusters."""
    made: dict[str, Effect] = {}
    for kind, keys in _LISTS.items():
        drives = spec.get(kind) or []
        optional = [k for k in _OPTIONAL if all(k in d for d in drives)]
        if drives:
            lists = {
                k: np.asarray([d[k] for d in drives], dtype=float).tolist()
                for k in (*keys, *optional)
            }
            made[kind] = get("actuator", kind).load()(**lists)
    return made


def _servos(controller: Mapping[str, Any], joints: int) -> Effect:
    """Servos of an arm, from one gain for all joints or one for each."""
    options: dict[str, Any] = {}
    for gain in GAINS:
        given = np.asarray(controller[gain], dtype=float)
        if given.ndim > 1 or given.size not in (1, joints):
            raise LogError(
                f"meta.yaml: arm.controller.{gain} has {given.size} numbers for {joints} joints.\n"
                "Give one for all joints, or one for each in the order of the links."
            )
        each = np.ravel(given).tolist()
        options |= {gain: each[0]} if len(each) == 1 else {f"{gain}_each": each}
    if "speed_limit" in controller:
        options["speed_limit"] = np.ravel(controller["speed_limit"]).astype(float).tolist()
    servos: Effect = get("actuator", "servos").load()(**options)
    return servos
