"""Training schedule: steps, evaluations, logs and checkpoints."""

from __future__ import annotations

from dataclasses import dataclass

from seals.field_roles import roles
from seals.learn.learner import MOST
from seals.schema import count, setting


@roles(data="keep best")
@dataclass(kw_only=True)
class TrainingSchedule:
    """Schedule of a training, ``course`` in a configuration.

    Args:
        steps: total number of control steps; one step of N environments is N of them.
        look_every: control steps between two evaluations.
        episodes: number of episodes of an evaluation.
        log_every: control steps between two rows of ``training.csv``.
        stop_at: share of successes at which the training ends early; 0 for never [1].
        in_a_row: successive evaluations that must reach ``stop_at``.
        checkpoint: wall time between two checkpoints; 0 for none [s].
        keep: whether to keep the policy of every evaluation, as ``policy_STEP``.
        best: whether to keep the best policy instead of the last one: that of the evaluation with
            the most successes, among equals with the greatest return.
    """

    steps: int = count(50_000, bounds=(0, MOST))
    look_every: int = count(5_000, bounds=(1, MOST))
    episodes: int = count(20, bounds=(1, MOST))
    log_every: int = count(1_000, bounds=(1, MOST))
    stop_at: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen")
    in_a_row: int = count(2, bounds=(1, MOST))
    checkpoint: float = setting(60.0, "s", bounds=(0.0, 1e6), source="chosen")
    keep: bool = False
    best: bool = True
