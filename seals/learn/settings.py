"""Typed settings of a learning environment: a run with a task in place of a guide."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

from seals.field_roles import roles
from seals.run.settings import RunSettings
from seals.schema import check_fields, setting


@roles(data="task")
@dataclass(kw_only=True)
class LearnSettings(RunSettings):
    """Settings of a run whose robot a learner controls.

    Args:
        task: learning task: starts, observation, reward, success.
        frames: pictures of successive control steps in one observation, where there are cameras.
        ball: radius of the ball that shows the target to cameras [m].
    """

    task: Any = None
    frames: int = 3
    ball: float = setting(0.05, "m", bounds=(1e-3, 10.0), source="chosen: opening of the hand")

    several: ClassVar[bool] = False


def check_own(config: Any, kind: type) -> None:
    """Refuse numbers out of bounds among the keys that a verb of learning adds to an environment.

    Args:
        config: composed.
        kind: settings of the verb.

    Raises:
        ConfigError: a number is not allowed; the message names its key.
    """
    shared = {field.name for field in dataclasses.fields(LearnSettings)}
    own = [field.name for field in dataclasses.fields(kind) if field.name not in shared]
    check_fields(kind, {name: config[name] for name in own}, where="")
