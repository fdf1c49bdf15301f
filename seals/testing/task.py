"""Contract tests of learning tasks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from seals.learn.environments.build import equip
from seals.learn.task import Task, require_laws, require_task
from seals.robot.build import build_robot
from seals.run.build import run_settings
from seals.testing.declaration import build_declared


@dataclass(frozen=True, kw_only=True)
class TaskReport:
    """Result of `check_task`.

    Args:
        name: of the task.
        actions: number of components of an action.
        observations: of an observation.
    """

    name: str
    actions: int
    observations: int

    def table(self) -> str:
        """Return the figures as text."""
        return f"{self.name}: {self.actions} actions, {self.observations} observations"


def check_task(
    task: str | type, *, robot: str = "aam", values: Mapping[str, Any] | None = None
) -> TaskReport:
    """Check the contract of a task on a batch of states.

    One seed must draw one start; every law must return one finite row an episode, repeat itself and
    leave its inputs as they are; observations and actions must have the components that are named,
    actions of the scripted policy within -1 to 1.

    Args:
        task: name of an installed task, or its class.
        robot: that does it, an installed robot or a folder.
        values: fields of the task.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.

    Example:
        >>> check_task("hover", robot="hexacopter").name
        'hover'
    """
    made: Task
    name, made = build_declared("task", task, values, headings=False)
    # before a field in the place of a law is called
    require_laws(name, made)
    settings = run_settings([f"robot={robot}"])
    model = build_robot(settings.robot)
    made.bind(model)
    equip(made, settings)
    require_task(name, made, model)
    actions, seen = len(made.action_names), len(made.observation_names)
    return TaskReport(name=name, actions=actions, observations=seen)
