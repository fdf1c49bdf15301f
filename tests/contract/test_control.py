"""Every installed guide and controller keeps the contract of its kind."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from seals import registry
from seals.arrays import Array
from seals.control import ActuatorCommand, Reference, RobotState
from seals.learn.task import Instant
from seals.plugins.controllers.station import Station
from seals.plugins.guides.hover import Hover
from seals.plugins.tasks.hover import TaskHover
from seals.schema import param
from seals.testing import ContractError, check_controller, check_guide, check_task

ROBOTS = {
    **{"station": "auv", "autopilot": "torpedo", "skid_steer": "amphibian"},
    **{"gait": "crab", "cpg": "crab"},
}
ALONE = ("hover", "oval", "waypoints", "los", "march", "wander", "seek", "freeze")
"""Guides that need nothing beside the robot: no object, no script."""


@pytest.mark.parametrize("name", registry.names("controller"))
def test_an_installed_controller_keeps_the_contract(name: str) -> None:
    """Equal questions get equal answers, memory is left alone, commands stay within limits."""
    assert check_controller(name, robot=ROBOTS.get(name, "aam")).calls > 20


@pytest.mark.parametrize("name", ALONE)
def test_an_installed_guide_keeps_the_contract(name: str) -> None:
    """Equal questions get equal answers, memory is left alone, aims are finite."""
    assert check_guide(name).calls > 20


@dataclass(kw_only=True)
class HoverForgetful(Hover):
    """A guide that counts its calls in itself."""

    calls: list[int] = field(default_factory=list)

    def aim(self, situation: RobotState, memory: object) -> tuple[Reference, object]:
        """Return a velocity that grows with every call."""
        self.calls.append(1)
        return Reference(velocity=np.full(3, float(len(self.calls)))), memory


@dataclass(kw_only=True)
class StationWild(Station):
    """A controller that knows no limits."""

    def command(
        self, situation: RobotState, aim: Reference, memory: object
    ) -> tuple[ActuatorCommand, object]:
        """Return twice what the thrusters can do."""
        return ActuatorCommand(2.0 * situation.limit, situation.joints), memory


def test_a_guide_with_a_memory_of_its_own_is_refused() -> None:
    """State outside the memory would not be part of a snapshot."""
    with pytest.raises(ContractError, match="different results for equal inputs"):
        check_guide(HoverForgetful)


def test_a_controller_that_commands_beyond_the_limits_is_refused() -> None:
    """The refusal tells commands and limits."""
    with pytest.raises(ContractError, match="to drives from"):
        check_controller(StationWild, robot="auv")


@pytest.mark.parametrize("name", registry.names("task"))
def test_an_installed_task_keeps_the_contract(name: str) -> None:
    """One seed draws one start; laws are pure and return a finite row an episode."""
    robot = {"walk": "crab", "station": "auv"}.get(name, "aam")
    assert check_task(name, robot=robot).observations > 3


@dataclass(kw_only=True)
class TaskCounting(TaskHover):
    """A task that counts its calls in itself."""

    calls: list[int] = field(default_factory=list)

    def reward(self, now: Instant, before: Instant, memory: Array) -> tuple[Array, Array]:
        """Return a reward that grows with every call."""
        self.calls.append(1)
        return self.distance(now) + len(self.calls), memory


@dataclass(kw_only=True)
class TaskLong(TaskHover):
    """A task whose scripted policy acts beyond 1."""

    def scripted_policy(self, now: Instant) -> Array:
        """Return twice the largest action."""
        return now.position * 0.0 + 2.0


@dataclass(kw_only=True)
class TaskHiding(TaskHover):
    """A task with a number in the place of a law."""

    effort: float = param(0.1, "1", bounds=(0.0, 1.0), tolerance=0.0, source="chosen", fit=False)  # type: ignore[assignment]


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (TaskCounting, "reward gives different results"),
        (TaskLong, "actions of size 2"),
        (TaskHiding, "a value instead of the function effort"),
    ],
)
def test_a_task_that_breaks_its_contract_is_refused(task: type, words: str) -> None:
    """State of its own, and actions beyond their range, are named."""
    with pytest.raises(ContractError, match=words):
        check_task(task)
