"""Typed settings of ``seals evaluate``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles
from seals.learn.settings import LearnSettings


@roles(data="name device film", read="policy beside", write="out", permission="grid")
@dataclass(kw_only=True)
class EvaluateSettings(LearnSettings):
    """Settings of an evaluation: an environment, and the policies to evaluate.

    Args:
        policy: folder of a policy, or ``scripted``, ``random``, ``still``.
        beside: policies that are evaluated on the same starts.
        episodes: number of starts, from those that no training has seen.
        count: environments that step at once; 0 chooses by the backend.
        device: where networks and twins compute: ``cpu`` or ``cuda``.
        grid: further worlds, by name, in which the policy is evaluated; see
            `seals.learn.evaluation.application`.
        film: whether to save a film of the policy's first episode beside the results, drawn by
            ``viewer``.
        out: folder of the results, or None for the run's folder.
    """

    name: str = "evaluate"
    policy: str = "scripted"
    beside: list[str] = field(default_factory=lambda: ["scripted", "random"])
    episodes: int = 100
    count: int = 0
    device: str = "cpu"
    grid: Any = None
    film: bool = False
    out: str | None = None
