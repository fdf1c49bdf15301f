"""Training schedule: steps, evaluations, logs and checkpoints."""

from __future__ import annotations

from dataclasses import dataclass

from seals.learn.learner import whole
from seals.schema import setting


@dataclass(kw_only=True)
class TrainingSchedule:
    """Schedule of a training, ``course`` in a configuration.

    Args:
        steps: control steps in all; one step of N environments is N of them.
        look_every: control steps between two evaluations.
        episodes: of an evaluation.
        log_every: control steps between two rows of ``training.csv``.
        stop_at: share of successes at which the training ends early; 0 for never [1].
        in_a_row: evaluations in a row that must reach it.
        checkpoint: wall time between two checkpoints; 0 for none [s].
        keep: whether the policy of every evaluation stays, as ``policy_STEP``.
    """

    steps: int = 50_000
    look_every: int = 5_000
    episodes: int = 20
    log_every: int = 1_000
    stop_at: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen")
    in_a_row: int = 2
    checkpoint: float = setting(60.0, "s", bounds=(0.0, 1e6), source="chosen")
    keep: bool = False

    def __post_init__(self) -> None:
        """Refuse numbers out of range.

        Raises:
            ConfigError: one is too small.
        """
        whole(
            "course",
            steps=(self.steps, 0),
            look_every=(self.look_every, 1),
            episodes=(self.episodes, 1),
            log_every=(self.log_every, 1),
            in_a_row=(self.in_a_row, 1),
        )
