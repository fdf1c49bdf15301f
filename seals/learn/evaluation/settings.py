"""Typed settings of ``seals evaluate``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals import schema
from seals.field_roles import roles
from seals.learn.learner import MOST
from seals.learn.settings import LearnSettings


@roles(data="name device film", read="policy beside", write="out", permission="grid")
@dataclass(kw_only=True)
class EvaluateSettings(LearnSettings):
    """Settings of an evaluation: an environment, and the policies to evaluate.

    Args:
        policy: folder of a policy, or ``scripted``, ``random``, ``still``.
        beside: policies to evaluate on the same starts.
        episodes: number of held-out starts.
        count: number of parallel environments; 0 depends on the backend.
        device: device of networks and twins: ``cpu`` or ``cuda``.
        grid: further worlds, by name, in which to evaluate the policy; see
            `seals.learn.evaluation.application`.
        film: whether to save a film of the policy's first episode beside the results, drawn by
            ``viewer``.
        out: folder of the results, or None for the run's folder.
    """

    name: str = "evaluate"
    policy: str = "scripted"
    beside: list[str] = field(default_factory=lambda: ["scripted", "random"])
    episodes: int = schema.count(100, bounds=(1, MOST))
    count: int = schema.count(0, bounds=(0, MOST))
    device: str = "cpu"
    grid: Any = None
    film: bool = False
    out: str | None = None
