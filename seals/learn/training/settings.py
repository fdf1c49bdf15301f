"""Typed settings of ``seals train``."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles
from seals.learn.settings import LearnSettings
from seals.learn.training.schedule import TrainingSchedule
from seals.schema import setting


@roles(
    data="name learner device shuffled film", read="demonstrations varied_from", permission="track"
)
@dataclass(kw_only=True)
class TrainSettings(LearnSettings):
    """Settings of a training: environment, learner, schedule.

    Args:
        learner: plug-in that learns.
        course: how long, and what is written on the way.
        count: environments that step at once.
        judges: parallel environments of an evaluation; 0 for one per episode in the batch dynamics,
            one in a rigid-body engine.
        device: where networks, memory and twins are: ``cpu`` or ``cuda``.
        threads: threads of the processor that torch uses.
        demonstrations: folder that ``seals record`` wrote, for a learner that wants them.
        shown: number of its episodes that are used, from the first on; 0 for all.
        shuffled: whether to shuffle their actions among all steps, as a negative control.
        varied: spread of the parameters among the environments of the training, in standard
            deviations of their tolerances, drawn for each environment; batch dynamics only.
            Evaluations keep to what is configured [1].
        varied_from: folder that ``seals diagnose`` wrote: what it estimated is drawn from its
            posterior, all else from the tolerances by ``varied``; twins only.
        film: whether to save a film of the trained policy beside it, one episode from a start of
            the evaluations, drawn by ``viewer``.
        track: ``tensorboard``, ``mlflow`` or ``wandb`` to write the figures there, too.
    """

    name: str = "train"
    learner: Any = None
    course: TrainingSchedule = field(default_factory=TrainingSchedule)
    count: int = 64
    judges: int = 0
    device: str = "cpu"
    threads: int = 1
    demonstrations: str | None = None
    shown: int = 0
    shuffled: bool = False
    varied: float = setting(0.0, "1", bounds=(0.0, 10.0), source="chosen: alike")
    varied_from: str | None = None
    film: bool = False
    track: str | None = None


_SHARED = {field.name for field in dataclasses.fields(LearnSettings)}
OWN = tuple(one.name for one in dataclasses.fields(TrainSettings) if one.name not in _SHARED)
"""Keys of a training that its environment does not have."""
