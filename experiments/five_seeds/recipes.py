"""What is trained, as words of ``seals train``."""

from __future__ import annotations

from typing import NamedTuple


class Recipe(NamedTuple):
    """One recipe.

    Args:
        world: environment and what of it is changed, for training and judgement.
        training: learner and course.
        seeds: trainings, with the seeds 0, 1, 2 and so on.
    """

    world: tuple[str, ...]
    training: tuple[str, ...]
    seeds: int = 5


_SHORT = ("learner=sac_reach", "course.steps=100000", "course.look_every=50000")
RECIPES = {
    "reach": Recipe(
        ("env=reach",),
        (
            "learner=sac_reach",
            "course.steps=450000",
            "course.look_every=45000",
            "course.episodes=100",
        ),
    ),
    "reach_no_reward": Recipe(("env=reach", "task.reward_form=none"), _SHORT, 1),
    "reach_shuffled": Recipe(("env=reach", "task.shuffled=true"), _SHORT, 1),
    "reach_untrained": Recipe(("env=reach",), ("learner=sac_reach", "course.steps=0"), 1),
}
"""The recipes by name. The last three are controls: none of them can have learned to reach."""
