"""Arms of the study, with equal steps, updates and networks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from seals.errors import ConfigError, refuse_unlisted

RATIO = 0.5
"""Updates per control step of all arms, pretraining counted in."""
RANDOM = 1000
"""Control steps with random actions at first."""
PRETRAIN = 1000
"""Updates on demonstrations before the first step, of the arms that have them."""
MOST_SEEDS = 100_000
COMMON = (
    "env=reach",
    "count=16",
    "course.look_every=2500",
    "course.episodes=50",
    "course.best=false",
    f"learner.random_steps={RANDOM}",
    "learner.gamma=0.98",
    "learner.learning_rate=0.001",
    "learner.hidden=[128,128]",
    "learner.batch=256",
)
"""Of every arm that practises; gamma and learning rate were chosen for SAC, on other seeds."""


class _Arm(NamedTuple):
    """One arm.

    Args:
        words: overrides of the learner.
        seeds: trainings, with the seeds 0, 1, 2 and so on: pairs across arms.
        pretrain: updates before the first step.
        shown: whether it sees demonstrations.
    """

    words: tuple[str, ...]
    seeds: int = 10
    pretrain: int = 0
    shown: bool = True


_SACFD = ("learner=sacfd", "learner.steps=3")
_PRE = (f"learner.pretrain={PRETRAIN}",)
ARMS = {
    "sac": _Arm(("learner=sac",), shown=False),
    "sac_demonstrations": _Arm(("learner=sac", "learner.demonstrations=buffer")),
    "sacfd": _Arm((*_SACFD, *_PRE), pretrain=PRETRAIN),
    "rlpd": _Arm(("learner=rlpd", "learner.critics=2")),
    "bc": _Arm(("learner=bc",)),
    "sacfd_no_priorities": _Arm((*_SACFD, *_PRE, "learner.alpha=0.0"), 5, PRETRAIN),
    "sacfd_one_step": _Arm(("learner=sacfd", "learner.steps=1", *_PRE), 5, PRETRAIN),
    "sacfd_no_pretraining": _Arm((*_SACFD, "learner.pretrain=0"), 5),
    "sacfd_shuffled": _Arm((*_SACFD, *_PRE, "shuffled=true"), 5, PRETRAIN),
}
"""All arms by name; the last is the negative control, whose demonstrations have wrong actions."""

COMPARISONS = {
    "learners": ("sac", "sac_demonstrations", "sacfd", "rlpd", "bc"),
    "ablations": (
        "sacfd",
        "sacfd_no_priorities",
        "sacfd_one_step",
        "sacfd_no_pretraining",
        "sacfd_shuffled",
    ),
}
"""What is held against what: the first arm of each is the reference."""


class Training(NamedTuple):
    """One training: its folder, and the arguments of ``seals``."""

    folder: Path
    words: tuple[str, ...]


def trainings(
    out: Path, shown: Path, *, arms: Sequence[str], steps: int, seeds: int = 0
) -> list[Training]:
    """Return all trainings, seed by seed: an interrupted study then has complete pairs.

    Args:
        out: folder of the study; trainings go to ``out/ARM/SEED``.
        shown: folder of demonstrations.
        arms: names.
        steps: control steps of each.
        seeds: of each arm; 0 for as declared.

    Raises:
        ConfigError: an arm does not exist, or there are too few steps for its pretraining.

    Example:
        >>> one = trainings(Path("out"), Path("shown"), arms=["sac"], steps=2000, seeds=1)
        >>> one[0].folder.as_posix(), "learner.ratio=0.5" in one[0].words
        ('out/sac/0', True)
    """
    for name in arms:
        refuse_unlisted(name, ARMS, f"there is no arm '{name}'")
    most = max(seeds or ARMS[name].seeds for name in arms)
    return [
        _training(out, shown, name, seed, steps)
        for seed in range(most)
        for name in arms
        if seed < (seeds or ARMS[name].seeds)
    ]


def _training(out: Path, shown: Path, name: str, seed: int, steps: int) -> Training:
    arm, folder = ARMS[name], out / name / str(seed)
    practises = "learner=bc" not in arm.words
    common = COMMON if practises else tuple(w for w in COMMON if not w.startswith("learner."))
    words = [*arm.words, *common, f"seed={seed}", f"course.steps={steps}"]
    if practises:
        # the updates of pretraining are taken from those of practice
        updates = RATIO * (steps - RANDOM) - arm.pretrain
        if updates <= 0.0:
            least = round(RANDOM + (arm.pretrain + 1) / RATIO)
            raise ConfigError(f"--steps {steps} are too few for {name}.\nAllowed: from {least} on.")
        words.append(f"learner.ratio={updates / (steps - RANDOM):.6g}")
    if arm.shown:
        words.append(f"demonstrations={shown}")
    return Training(folder, ("train", *words, f"hydra.run.dir={folder}"))
