"""Training of one recipe with several seeds, evaluated on held-out starts; see README.md."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from seals.errors import ConfigError, suggestion
from seals.experiments.command import CommandParser
from seals.experiments.five_seeds.outcome import outcome, tell
from seals.experiments.five_seeds.recipes import RECIPES, Recipe
from seals.experiments.five_seeds.shipping import ship
from seals.experiments.learning_study.arms import Training
from seals.experiments.learning_study.running import run_all, run_verb

FIRST = 1_000_000
"""Seed of the first start of a round of labels, for each round before it and itself."""


def main(words: Sequence[str] | None = None) -> int:
    """Train, evaluate and report; the same command resumes an interrupted one.

    Raises:
        ConfigError: there is no such recipe.
    """
    parser = CommandParser(prog="five_seeds", description=__doc__)
    parser.add_argument("recipe", help=", ".join(RECIPES))
    parser.add_argument("--out", default="", help="folder; runs/five_seeds/RECIPE when left out")
    parser.add_argument("--jobs", type=int, default=1, help="trainings at once, one core each")
    parser.add_argument("--seeds", type=int, default=0, help="0: as the recipe has it")
    parser.add_argument("--limit", type=float, default=0.0, help="stop politely after so many s")
    parser.add_argument("--ship", default="", help="folder to copy the best policy to, when judged")
    parser.add_argument("more", nargs="*", help="further overrides, as course.steps=1000")
    given = parser.parse_intermixed_args(words)
    if given.recipe not in RECIPES:
        raise ConfigError(
            f"there is no recipe '{given.recipe}'.\n{suggestion(given.recipe, RECIPES)}"
        )
    recipe = RECIPES[given.recipe]
    out = Path(given.out or f"runs/five_seeds/{given.recipe}")
    lessons = (*recipe.world, *recipe.lessons)
    shown = demonstrated(out, recipe, given.more)
    jobs = [
        Training(
            out / str(seed),
            (
                "train",
                *lessons,
                *recipe.training,
                *shown,
                *given.more,
                f"seed={seed}",
                f"hydra.run.dir={out / str(seed)}",
            ),
        )
        for seed in range(given.seeds or recipe.seeds)
    ]
    left = run_all(jobs, at_once=given.jobs, limit=given.limit)
    if left:
        print(f"{left} of {len(jobs)} trainings are not finished: the same command goes on.")
        return 1
    world = [
        *recipe.world,
        *recipe.judged,
        *(word for word in given.more if word.startswith("task.")),
    ]
    for number, job in enumerate(jobs):
        judged = job.folder / "held_out"
        if not (judged / "evaluation.json").exists():
            beside = "[scripted,random]" if number == 0 else "[]"
            run_verb("evaluate", *world, f"policy={job.folder / 'policy'}", f"beside={beside}",
                     "episodes=100", f"out={judged}")  # fmt: skip
    folders = [job.folder for job in jobs]
    tell(outcome(folders), out, enough=recipe.enough)
    if given.ship:
        words = ["python -m seals.experiments.five_seeds", given.recipe, *given.more]
        print(ship(folders, Path(given.ship), command=" ".join(words)))
    return 0


def demonstrated(out: Path, recipe: Recipe, more: Sequence[str]) -> tuple[str, ...]:
    """Record the demonstrations of a recipe, once; return the overrides that use them.

    Args:
        out: folder of the study.
        recipe: with or without demonstrations.
        more: further overrides; those of the task are its lessons, too.
    """
    if not recipe.shown:
        return ()
    told = (word for word in more if word.startswith("task."))
    world = (*recipe.world, *recipe.lessons, *told)
    folder = out / "demonstrations"
    if not folder.exists():
        run_verb("record", *world, f"episodes={recipe.shown}", f"out={folder}")
    for number in range(1, recipe.rounds + 1):
        folder = labelled(folder, number, recipe, world)
    return (f"demonstrations={folder}",)


def labelled(shown: Path, number: int, recipe: Recipe, world: Sequence[str]) -> Path:
    """Label the states that a cloned policy visits with the expert's actions, once (DAgger).

    Args:
        shown: folder of the demonstrations so far.
        number: of the round, from 1 on.
        recipe: with the training and the number of episodes.
        world: words of environment and task.

    Returns:
        The folder of the demonstrations, now with those of this round.
    """
    folder = shown.with_name(f"demonstrations_{number}")
    if folder.exists():
        return folder
    trained = shown.with_name(f"round_{number}")
    learns = (*recipe.training, "course.episodes=1", f"demonstrations={shown}")
    run_verb("train", *world, *learns, f"hydra.run.dir={trained}")
    run_verb("record", *world, f"policy={trained / 'policy'}", "labels=scripted", "keep=all",
             f"episodes={recipe.labelled}", f"first={FIRST * number}", f"after={shown}",
             f"out={folder}")  # fmt: skip
    return folder
