"""Typed settings of ``seals train``."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

from seals import schema
from seals.field_roles import roles
from seals.learn.learner import MOST
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
        course: length of the training, evaluations and checkpoints.
        count: number of parallel environments.
        judges: parallel environments of an evaluation; 0 for one per episode in the batch dynamics,
            one in a rigid-body engine.
        device: device of networks, memory and twins: ``cpu`` or ``cuda``.
        threads: number of processor threads for torch.
        demonstrations: folder written by ``seals record``, for a learner that uses it.
        shown: number of demonstrated episodes to use, beginning with the first; 0 for all.
        shuffled: whether to shuffle the demonstrated actions over all steps, as a negative control.
        varied: spread of the parameters over the training environments, in standard
            deviations of their tolerances, drawn for each environment; batch dynamics only.
            Evaluations use the configured values [1].
        varied_from: folder written by ``seals diagnose``: estimated parameters are drawn from its
            posterior, all others from the tolerances by ``varied``; twins only.
        film: whether to save a film of the trained policy beside it, one episode from a start of
            the evaluations, drawn by ``viewer``.
        track: tracker that also receives the figures: ``tensorboard``, ``mlflow`` or ``wandb``.
    """

    name: str = "train"
    learner: Any = None
    course: TrainingSchedule = field(default_factory=TrainingSchedule)
    count: int = schema.count(64, bounds=(1, MOST))
    judges: int = schema.count(0, bounds=(0, MOST))
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
