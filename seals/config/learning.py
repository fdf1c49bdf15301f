"""Typed settings of an environment of learning: a run with a task in place of a guide's plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from seals.config.build import build
from seals.config.run import RunSettings, build_run
from seals.errors import ConfigError, suggestion
from seals.registry import names
from seals.schema import param


@dataclass(kw_only=True)
class LearnSettings(RunSettings):
    """A run whose robot does what a learner says.

    Args:
        task: what is to be learned: starts, observation, reward, success.
        frames: control steps whose pictures lie in one observation, where there are cameras.
        ball: radius of the ball that shows the target to cameras [m].
    """

    task: Any = None
    frames: int = 3
    ball: float = param(
        0.05,
        "m",
        bounds=(1e-3, 10.0),
        tolerance=0.0,
        source="chosen: opening of the hand",
        fit=False,
    )


def build_learning(config: Any) -> tuple[RunSettings, Any]:
    """Build the run and the task of a composed environment, the task bound to the robot.

    Args:
        config: composed configuration with the keys of ``LearnSettings``.

    Raises:
        ConfigError: there is no task, or the guide is none that takes orders.
        SealsError: a value cannot be used, or the robot cannot do the task.
    """
    from seals.robot.build import build_robot

    if config.get("task") is None:
        raise ConfigError(
            "task is not given.\nChoose an environment: env=reach, or a task: task=NAME.  "
            f"{suggestion('', names('task'), label='Installed')}"
        )
    settings = build_run(config)
    if not hasattr(settings.guide, "tell"):
        raise ConfigError(
            "an environment of learning needs a guide that takes orders.\nSay guide=commanded"
        )
    task = build(config.task, where="task")
    task.bind(build_robot(settings.robot))
    return settings, task
