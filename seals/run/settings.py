"""Typed settings of a run: schema of its configuration, and values of a built run."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any, ClassVar

from seals.environment.settings import EnvironmentSettings
from seals.field_roles import roles
from seals.rendering.optics import Optics
from seals.rendering.settings import SightSettings
from seals.robot.settings import RobotSettings
from seals.schema import LATER, count, optional, setting, vector


class DriveStart(enum.Enum):
    """State of the rotors at the start: ``rest``, or ``carrying`` the robot in the air."""

    rest = "rest"
    carrying = "carrying"


@dataclass(kw_only=True)
class InitialSettings:
    """State at the start of a run.

    Args:
        position: body origin in the world [m].
        rpy: roll, pitch, yaw of the body in the world [rad].
        velocity: velocity of the body origin in the world [m/s].
        angular_velocity: angular velocity in body axes [rad/s].
        joint_position: joint angles or travels in URDF order; empty means zeros, and the
            stance of legs [rad or m].
        joint_velocity: joint rates in URDF order; empty means zeros [rad/s or m/s].
        drives: rotors at the start: at rest, so that a flight begins with a drop of some 0.1 m, or
            carrying the robot; only with a guide, in the air.
    """

    position: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e5, 1e5), source="chosen")
    rpy: list[float] = vector((0.0, 0.0, 0.0), "rad", bounds=(-6.3, 6.3), source="chosen")
    # the rigid-body engine clamps speeds at 100 silently: refuse before it does
    velocity: list[float] = vector((0.0, 0.0, 0.0), "m/s", bounds=(-100, 100), source="chosen")
    angular_velocity: list[float] = vector(
        (0.0, 0.0, 0.0), "rad/s", bounds=(-100, 100), source="chosen"
    )
    joint_position: list[float] = vector((), "rad or m", bounds=(-1e3, 1e3), source="chosen")
    joint_velocity: list[float] = vector((), "rad/s or m/s", bounds=(-100, 100), source="chosen")
    drives: DriveStart = DriveStart.rest


@dataclass(kw_only=True)
class TimeSettings:
    """Time base of a run.

    Args:
        step: length of one step [s].
        duration: simulated time [s].
    """

    step: float = setting(0.004, "s", bounds=(1e-5, 0.1), source="chosen: 250 steps a second")
    duration: float = setting(2.0, "s", bounds=(1e-4, 1e6), source="chosen")


SINGLE = ("backend", "wave", "fluid", "controller", "guide", "viewer", "live")
"""Sections of a run that are one plug-in each, of the kind of their name."""


@roles(
    data="name backend wave fluid effects sensors actuators controller guide objects viewer "
    "robots water_type model force hide",
    read="repeat resume",
    permission="live",
)
@dataclass(kw_only=True)
class RunSettings:
    """Settings of a run: schema while Hydra composes, built objects after ``build_run``.

    Args:
        name: name of the run, part of its folder's name.
        seed: seed of every random number of the run.
        robot: name of a robot, or its folder.
        robots: further robots by name, each with its own controller, guide and sensors: the name
            of a robot, or a mapping, see `seals.run.fleet.VehicleSettings`.
        backend: rigid-body backend.
        wave: water surface.
        fluid: simulated water, or None.
        environment: surroundings of the robot.
        effects: physical effects by instance name, in order of declaration.
        sensors: sensors by instance name.
        actuators: actuators by instance name.
        controller: controller of the actuators, or None; it is idle unless there is a guide.
        guide: reference generator that the controller follows, or None.
        initial: state at the start.
        objects: further bodies in the scene, by name.
        time: time base.
        repeat: folder of an earlier run to repeat exactly, or None.
        resume: folder of an interrupted run to continue from its last checkpoint, or None.
        surface: simulated time between two saved meshes of the particle water [s], 0 for none;
            needs the extra ``render``.
        particles: simulated time between two saved sets of particles, for viewing [s], 0 for none.
        checkpoint: wall time between two checkpoints [s], 0 for none; absent, a minute with a
            fluid and none without.
        viewer: renderer that draws for cameras, or None.
        optics: light in water and noise of cameras.
        water_type: Jerlov type of the water for cameras, instead of that in ``optics``;
            absent to keep it.
        sight: how the scene is drawn for cameras.
        model: model overlay written by ``seals add``, as a name or a file, or None.
        force: whether to use a model that was withdrawn.
        hide: effects that act in the run but are left out of the stated model of its log: names of
            instances or of effects, ``waves`` for the waves.
        live: output to other programs during the run, or None.
    """

    name: str = "run"
    seed: int = count(0, bounds=(0, 2**63 - 1))
    robot: RobotSettings = field(default_factory=RobotSettings)
    backend: Any = None
    wave: Any = None
    fluid: Any = None
    environment: EnvironmentSettings = field(default_factory=EnvironmentSettings)
    effects: dict[str, Any] = field(default_factory=dict)
    sensors: dict[str, Any] = field(default_factory=dict)
    actuators: dict[str, Any] = field(default_factory=dict)
    controller: Any = None
    guide: Any = None
    initial: InitialSettings = field(default_factory=InitialSettings)
    objects: dict[str, Any] = field(default_factory=dict)
    robots: dict[str, Any] = field(default_factory=dict, metadata=LATER)
    time: TimeSettings = field(default_factory=TimeSettings)
    repeat: str | None = None
    resume: str | None = None
    surface: float = setting(0.0, "s", bounds=(0.0, 1e6), source="chosen: none")
    particles: float = setting(0.0, "s", bounds=(0.0, 1e6), source="chosen: none")
    checkpoint: float | None = optional("s", bounds=(0.0, 1e6), source="chosen")
    viewer: Any = None
    optics: Optics = field(default_factory=Optics)
    water_type: str | None = None
    sight: SightSettings = field(default_factory=SightSettings)
    model: Any = None
    force: bool = False
    hide: list[str] = field(default_factory=list)
    live: Any = None

    several: ClassVar[bool] = True
    """Whether there may be more robots than one: a batch and a person steer one."""
