"""Training recipes, as arguments of ``seals train``."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Recipe(NamedTuple):
    """One recipe.

    Args:
        world: environment and what of it is changed, for training and judgement.
        training: learner and course.
        seeds: trainings, with the seeds 0, 1, 2 and so on.
        shown: demonstrations that the scripted expert records first, 0 for none.
        rounds: times that what was learned by then acts, and the expert says what it would do.
        labelled: episodes of such a round.
        lessons: what of the world is changed for demonstrations and training alone.
        judged: further words of a judgement.
        elsewhere: further worlds of a judgement by name, as further words.
        enough: share of its held-out starts that a seed is asked for [1].
    """

    world: tuple[str, ...]
    training: tuple[str, ...]
    seeds: int = 5
    shown: int = 0
    rounds: int = 0
    labelled: int = 0
    lessons: tuple[str, ...] = ()
    judged: tuple[str, ...] = ()
    elsewhere: Mapping[str, tuple[str, ...]] = MappingProxyType({})
    enough: float = 0.95


_SEEN = ("env=reach_seen", "backend=twin")
_SIGHTED = (
    "learner=visual_many",
    "device=cuda",
    "count=1024",
    "course.steps=300000",
    "course.look_every=100000",
    "course.log_every=20000",
    "course.episodes=100",
    "course.checkpoint=0",
)
_ON_CARD = ("device=cuda",)
"""Of judgements with pictures, which take a processor minutes."""
_NO_EYES = "learner.use_pixels=false"
# pictures that nobody looks at
_SMALL = tuple(
    f"sensors.{one}.{side}=16" for one in ("front", "belly") for side in ("width", "height")
)
_NO_TARGET = "learner.withheld=[target,drift]"
_PLACES = ("learner.pool=places", "learner.shift=1")
_CRITICS = (_NO_TARGET, "learner.critics_see=same", "learner.encoders=two")
_PROGRESS = ("task.reward_form=progress",)
# four times the pixels, so one picture in place of three: memory holds as many
_SEEN_FINE = (
    *_SEEN,
    *(f"sensors.{one}.{side}=128" for one in ("front", "belly") for side in ("width", "height")),
    "frames=1",
)
_SIGHTED_FINE = (
    *(word for word in _SIGHTED if not word.startswith(("count=", "course.look_every="))),
    "count=512",
    "course.look_every=50000",
    "course.best=true",
    *_PLACES,
    "learner.strides=[2,2,2,1]",
    "learner.capacity=150000",
)
_SHORT = ("learner=sac_reach", "course.steps=100000", "course.look_every=50000")


def _imitated(env: str, steps: int) -> Recipe:
    """Recipe of an underwater task in twins, whose scripted policy is imitated."""
    return Recipe(
        (f"env={env}",),
        (
            "learner=dagger_few",
            "count=64",
            f"course.steps={steps}",
            f"learner.settle={steps}",
            f"course.look_every={steps // 4}",
            "course.episodes=50",
            "course.best=true",
        ),
        3,
        elsewhere={"MuJoCo": ("backend=mujoco",)},
        enough=0.7,
    )


def _handled(env: str) -> Recipe:
    """Recipe of a task with contacts, in a few full worlds."""
    return Recipe(
        (f"env={env}", "task.ends=true"),
        (
            "learner=dagger_few",
            "count=8",
            "learner.ratio=16",
            "learner.led=150",
            "learner.settle=14000",
            "course.steps=14000",
            "course.look_every=7000",
            "course.episodes=12",
            "course.best=true",
        ),
        3,
        enough=0.7,
    )


RECIPES = {
    **{name: _imitated(name, 100_000) for name in ("reach_current", "reach_current_crossing")},
    **{name: _imitated(name, 250_000) for name in ("pipe", "pipe_crossing")},
    **{
        f"{name}{way}": _handled(f"{name}{way}")
        for name in ("pick", "place", "valve")
        for way in ("", "_crossing")
    },
    "reach": Recipe(
        ("env=reach",),
        (
            "learner=sac_reach",
            "course.steps=450000",
            "course.look_every=45000",
            "course.episodes=100",
        ),
    ),
    "reach_many": Recipe(
        ("env=reach",),
        (
            "learner=sac_many",
            "device=cuda",
            "count=8192",
            "course.steps=11000000",
            "course.look_every=2200000",
            "course.log_every=200000",
            "course.episodes=100",
            "course.checkpoint=0",
        ),
        elsewhere={"MuJoCo": ("backend=mujoco", "backend.compiled=true")},
    ),
    "sight_image": Recipe(
        _SEEN, (*_SIGHTED, "learner.use_state=false"), 3, judged=_ON_CARD, enough=0.6
    ),
    "sight_fine": Recipe(
        _SEEN_FINE, (*_SIGHTED_FINE, "learner.use_state=false"), 3, judged=_ON_CARD
    ),
    "sight_fine_both": Recipe(
        _SEEN_FINE, (*_SIGHTED_FINE, _NO_TARGET), 3, lessons=_PROGRESS, judged=_ON_CARD
    ),
    # nobody sees the target but in pictures, critics included; all feel their own motion
    "sight_fine_critics": Recipe(
        _SEEN_FINE,
        (*_SIGHTED_FINE, *_CRITICS),
        3,
        lessons=_PROGRESS,
        judged=_ON_CARD,
        enough=0.6,
    ),
    "sight_critics": Recipe(
        (*_SEEN, "frames=1"),
        (*_SIGHTED, *_PLACES, *_CRITICS, "learner.capacity=200000"),
        3,
        lessons=_PROGRESS,
        judged=_ON_CARD,
        enough=0.6,
    ),
    "sight_both": Recipe(_SEEN, (*_SIGHTED, _NO_TARGET), 3, judged=_ON_CARD, enough=0.6),
    "sight_pose": Recipe((*_SEEN, *_SMALL), (*_SIGHTED, _NO_EYES), 3, judged=_ON_CARD, enough=0.6),
    "sight_blind": Recipe(
        (*_SEEN, *_SMALL), (*_SIGHTED, _NO_EYES, _NO_TARGET), 3, judged=_ON_CARD, enough=0.6
    ),
    "crab_walk": Recipe(
        ("env=crab_walk",),
        (
            "learner=rlpd_walk",
            "count=4",
            "course.steps=8000",
            "course.look_every=2000",
            "course.episodes=10",
        ),
        shown=60,
        # who has arrived learns no more: episodes are half as long
        lessons=("task.duration=4",),
        enough=0.9,
    ),
    "catch": Recipe(
        ("env=catch", "task.ends=true"),
        ("learner=bc_catch", "course.episodes=10", "course.checkpoint=0"),
        seeds=1,
        shown=60,
        rounds=3,
        labelled=30,
        enough=0.7,
    ),
    # appendix of the AAM-SEALS paper: its state, reward, termination and table; it had one seed
    "reach_paper": Recipe(
        (
            "env=reach",
            "task.sight=paper",
            "task.reward_form=paper",
            "task.success_distance=0.01",
            "task.duration=40",
        ),
        (
            "learner=sacfd_paper",
            "course.steps=10000000",
            "course.look_every=500000",
            "course.log_every=50000",
            "course.episodes=100",
        ),
        seeds=10,
        # the paper does not say how many
        shown=10,
    ),
    "catch_many": Recipe(
        ("env=catch_shy", "task.ends=true"),
        (
            "learner=dagger",
            "device=cuda",
            "count=2048",
            "course.steps=2000000",
            "course.look_every=500000",
            "course.log_every=50000",
            "course.episodes=10",
            "course.checkpoint=0",
        ),
        # contacts on the card; judged in full worlds
        lessons=("backend=mujoco_warp",),
        enough=0.7,
    ),
    "reach_no_reward": Recipe(("env=reach", "task.reward_form=none"), _SHORT, 1),
    "reach_shuffled": Recipe(("env=reach", "task.shuffled=true"), _SHORT, 1),
    "reach_untrained": Recipe(("env=reach",), ("learner=sac_reach", "course.steps=0"), 1),
}
"""The recipes by name. The last three are controls: none of them can have learned to reach."""
