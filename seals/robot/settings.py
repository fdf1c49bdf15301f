"""Typed settings of a robot: hulls, arms, grippers and legs as ``robot.yaml`` gives them."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from seals.field_roles import roles
from seals.schema import optional, vector


class ShapeType(enum.Enum):
    """Primitive a hull is made of; names are as written in ``robot.yaml``."""

    sphere = "sphere"
    box = "box"
    cylinder = "cylinder"
    capsule = "capsule"
    mesh = "mesh"


@roles(read="file")
@dataclass(kw_only=True)
class ShapeSettings:
    """One primitive of a hull, in link axes.

    Args:
        type: which primitive.
        size: sphere radius; box full edges x, y, z; cylinder and capsule radius, length [m].
        position: centre of the primitive in the link frame [m].
        rpy: roll, pitch, yaw of the primitive in the link frame [rad].
        file: mesh file beside ``robot.yaml``, for ``type: mesh`` only.
    """

    type: ShapeType = ShapeType.sphere
    size: list[float] = vector((), "m", bounds=(1e-6, 1e4), source="robot.yaml")
    position: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e4, 1e4), source="robot.yaml")
    rpy: list[float] = vector((0.0, 0.0, 0.0), "rad", bounds=(-6.3, 6.3), source="robot.yaml")
    file: str | None = None


@dataclass(kw_only=True)
class HullSettings:
    """The part of a link that displaces water.

    Args:
        shapes: primitives that together give the shape.
        displaced_volume: stated volume that rules over the sum of the shapes [m^3].
        centre_of_buoyancy: stated centroid when fully submerged, link frame [m].
        plan_area: stated projected area along body z [m^2].
    """

    shapes: list[ShapeSettings] = field(default_factory=list)
    displaced_volume: float | None = optional("m^3", bounds=(0.0, 1e6), source="robot.yaml")
    centre_of_buoyancy: list[float] | None = None
    plan_area: float | None = optional("m^2", bounds=(0.0, 1e6), source="robot.yaml")


@roles(data="joints tool")
@dataclass(kw_only=True)
class ArmSettings:
    """One arm, by the names of its parts in the URDF.

    Args:
        joints: from the base on.
        tool: the link that the arm moves.
        stowed: joint values at rest, one per joint; empty for zeros [rad or m].
    """

    joints: list[str] = field(default_factory=list)
    tool: str = ""
    stowed: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source="robot.yaml")


@roles(data="joints tips")
@dataclass(kw_only=True)
class GripperSettings:
    """One gripper, by the names of its parts in the URDF.

    Args:
        joints: of the fingers.
        open: joint values when open, one per joint [rad or m].
        closed: joint values when closed on nothing, one per joint [rad or m].
        tips: links that touch, each with a contact force of its own.
    """

    joints: list[str] = field(default_factory=list)
    open: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source="robot.yaml")
    closed: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source="robot.yaml")
    tips: list[str] = field(default_factory=list)


@roles(data="joints foot")
@dataclass(kw_only=True)
class LegSettings:
    """One leg, by the names of its parts in the URDF.

    Args:
        joints: from the body on.
        foot: the last link of the leg.
        toe: what stands on the ground, in axes of that link [m].
        stance: joint values when it stands, one per joint; empty for zeros [rad or m].
    """

    joints: list[str] = field(default_factory=list)
    foot: str = ""
    toe: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e3, 1e3), source="robot.yaml")
    stance: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source="robot.yaml")


@roles(data="name fixed_base hulls arms grippers legs summary", read="folder urdf")
@dataclass(kw_only=True)
class RobotSettings:
    """Settings of a robot in a run.

    Args:
        name: name of the robot, that of its entry point or folder.
        folder: absolute folder that holds ``robot.yaml``.
        urdf: URDF file relative to the folder.
        fixed_base: whether the base link is bolted to the world.
        hulls: what displaces water, by link name.
        arms: by name.
        grippers: by name.
        legs: by name.
        summary: one line for lists and reports.
    """

    name: str = ""
    folder: str = ""
    urdf: str = ""
    fixed_base: bool = False
    hulls: dict[str, HullSettings] = field(default_factory=dict)
    arms: dict[str, ArmSettings] = field(default_factory=dict)
    grippers: dict[str, GripperSettings] = field(default_factory=dict)
    legs: dict[str, LegSettings] = field(default_factory=dict)
    summary: str = ""

    @property
    def urdf_path(self) -> Path:
        """Return the full path of the URDF."""
        return Path(self.folder) / self.urdf


@roles(data="effects sensors actuators controller")
@dataclass(kw_only=True)
class LogRobotSettings:
    """Robot of a log, for commands that read logs; it describes a vehicle that the log does not.

    Args:
        robot: folder or name of the robot.
        effects: of the robot, by instance name.
        sensors: of the robot; the log's own metadata rule.
        actuators: of the robot, by instance name.
        controller: of the robot, without use here.
    """

    robot: RobotSettings = field(default_factory=RobotSettings)
    effects: dict[str, Any] = field(default_factory=dict)
    sensors: dict[str, Any] = field(default_factory=dict)
    actuators: dict[str, Any] = field(default_factory=dict)
    controller: Any = None
