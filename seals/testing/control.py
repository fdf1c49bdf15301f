"""Contract tests of guides and controllers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.contract import call_twice, require, require_storable
from seals.control import ActuatorCommand, Controller, Guide, Plant, Reference, RobotState
from seals.control.plant import build_plant
from seals.run.assembly import ROBOT, build_world
from seals.run.build import run_settings
from seals.testing.declaration import build_declared
from seals.world.pilot import Pilot

STEPS = 12
FALL = (
    "water=fossen",
    "initial.position=[0.1,0.2,0.05]",
    "initial.rpy=[0.2,-0.1,0.4]",
    "initial.angular_velocity=[0.5,0.2,-0.3]",
)
"""How the robot falls, turning, into water while guides and controllers are questioned."""


@dataclass(frozen=True, kw_only=True)
class ControlReport:
    """Result of `check_guide` or `check_controller`.

    Args:
        name: of the plug-in.
        calls: times it was called.
        rate: calls a second [Hz].
    """

    name: str
    calls: int
    rate: float

    def table(self) -> str:
        """Return the figures as text."""
        return f"{self.name}: {self.calls} calls at {self.rate:g} Hz"


def check_guide(
    guide: str | type, *, robot: str = "aam", values: Mapping[str, Any] | None = None
) -> ControlReport:
    """Check the contract of a guide.

    It must repeat itself, leave its memory as it is, keep nothing to itself between calls, and aim
    at finite velocities.

    Args:
        guide: name of an installed guide, or its class.
        robot: that it leads, an installed robot or a folder.
        values: fields of the guide.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.

    Example:
        >>> check_guide("hover", robot="hexacopter").name
        'hover'
    """
    made: Guide
    name, made, course = _bound("guide", guide, robot, values)
    memory = made.start(course[0])
    for situation in course:
        aim, after = call_twice(name, "aim", made.aim, situation, memory)
        require_storable(name, after)
        finite = all(np.all(np.isfinite(x)) for x in (aim.velocity, aim.acceleration, aim.yaw))
        require(finite, name, f"aims at {aim}", "Return finite numbers.")
        require(
            made.finished(after) in (True, False, None) and isinstance(made.stage(after), str),
            name,
            "does not state whether it is finished, or its stage",
            "Return True, False or None, and a text.",
        )
        memory = after
    return ControlReport(name=name, calls=2 * len(course), rate=made.rate)


def check_controller(
    controller: str | type, *, robot: str = "aam", values: Mapping[str, Any] | None = None
) -> ControlReport:
    """Check the contract of a controller.

    It must repeat itself, leave its memory as it is, and command no drive beyond its limits.

    Args:
        controller: name of an installed controller, or its class.
        robot: that it commands, an installed robot or a folder.
        values: fields of the controller.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.

    Example:
        >>> check_controller("cascade", robot="hexacopter").name
        'cascade'
    """
    made: Controller
    name, made, course = _bound("controller", controller, robot, values)
    memory, rng = made.start(), np.random.default_rng(0)
    for situation in course:
        aim = Reference(velocity=rng.normal(size=3), yaw=float(rng.normal()))
        order, memory = call_twice(name, "command", made.command, situation, aim, memory)
        require_storable(name, memory)
        drive, slack = order.drive, 1e-9
        inside = (drive <= situation.limit + slack) & (drive >= situation.low - slack)
        require(
            drive.shape == situation.limit.shape and bool(inside.all()),
            name,
            f"commands {drive} to drives from {situation.low} to {situation.limit}",
            "Hold the commands within the limits of the situation.",
        )
        require(
            order.joints.shape == situation.joints.shape and bool(np.isfinite(order.joints).all()),
            name,
            f"sends {order.joints} to {situation.joints.size} joints",
            "Return one finite number per joint.",
        )
    return ControlReport(name=name, calls=2 * len(course), rate=made.rate)


def _bound(
    kind: str, subject: str | type, robot: str, values: Mapping[str, Any] | None
) -> tuple[str, Any, list[RobotState]]:
    """Return the name of a plug-in, the plug-in with its robot, and situations of that robot."""
    name, made = build_declared(kind, subject, values, headings=False)
    require(made.rate > 0.0, name, f"is called {made.rate} times a second", "Give it a rate.")
    course, plant = _course(robot)
    made.bind(plant)
    return name, made, course


def _course(robot: str) -> tuple[list[RobotState], Plant]:
    """Return situations of a robot that falls, turning, into water, and its plant."""
    settings = run_settings([f"robot={robot}", *FALL])
    world = build_world(settings)
    actor = world.actors[ROBOT]
    plant = build_plant(actor.robot, actor.effects, settings.environment)
    watcher = _Watcher()
    actor.pilot = Pilot(
        plant, watcher, watcher, volume=actor.evaluator.surroundings.volume, step=settings.time.step
    )
    for _ in range(STEPS):
        world.step()
    world.close()
    return watcher.seen, plant


class _Watcher:
    """Passive guide and controller that record their inputs."""

    rate = 1e4
    sense = "truth"

    def __init__(self) -> None:
        self.seen: list[RobotState] = []

    def bind(self, plant: Plant) -> None:
        self._idle = ActuatorCommand(
            np.zeros(plant.layout.drives), np.zeros(plant.robot.tree.joints)
        )

    def start(self, situation: RobotState | None = None) -> None:
        return None

    def aim(self, situation: RobotState, memory: Any) -> tuple[Reference, Any]:
        return Reference(), memory

    def command(
        self, situation: RobotState, aim: Reference, memory: Any
    ) -> tuple[ActuatorCommand, Any]:
        self.seen.append(situation)
        return self._idle, memory

    def finished(self, memory: Any) -> bool | None:
        return None

    def stage(self, memory: Any) -> str:
        return ""
