"""Training of one recipe with several seeds, evaluated on held-out starts; see README.md."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from seals.errors import refuse_unlisted
from seals.experiments.command import CommandParser, show_table, whole
from seals.experiments.five_seeds.episode_tables import OWN, gather, shipped
from seals.experiments.five_seeds.outcome import table_of, write_curves
from seals.experiments.five_seeds.recipes import RECIPES, Recipe
from seals.experiments.five_seeds.shipping import ship
from seals.experiments.learning_study.arms import MOST_SEEDS, Training
from seals.experiments.learning_study.running import add_processes, run_all, run_verb

FIRST = 1_000_000
"""Seed of the first start of a round of labels, for each round before it and itself."""


def main(words: Sequence[str] | None = None) -> int:
    """Train, evaluate and report; the same command resumes an interrupted one.

    Raises:
        ConfigError: there is no such recipe.
    """
    given = _given(words)
    recipe = RECIPES[given.recipe]
    out = Path(given.out or f"runs/five_seeds/{given.recipe}")
    if given.table:
        print(table_of(shipped(given.recipe), list(recipe.elsewhere), enough=recipe.enough))
        return 0
    lessons = (*recipe.world, *recipe.lessons)
    shown = demonstrated(out, recipe, given.more)
    jobs = [
        Training(
            out / str(seed),
            (
                "train",
                *lessons,
                # tables are of the last policy where a recipe does not say otherwise
                "course.best=false",
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
    left = run_all(judgements(recipe, jobs, given.more), at_once=given.jobs, limit=0.0)
    if left:
        print(f"{left} judgements are not finished: the same command goes on.")
        return 1
    folders = [job.folder for job in jobs]
    tables = gather(folders, recipe.elsewhere)
    tables.write(out, given.recipe)
    show_table(out, table_of(tables, list(recipe.elsewhere), enough=recipe.enough))
    print(write_curves(tables, out / "seeds.png"))
    if given.ship:
        words = ["python -m seals.experiments.five_seeds", given.recipe, *given.more]
        print(ship(folders, Path(given.ship), command=" ".join(words)))
    return 0


def _given(words: Sequence[str] | None) -> Namespace:
    parser = CommandParser(prog="five_seeds", description=__doc__)
    parser.add_argument("recipe", help=", ".join(RECIPES))
    parser.add_argument("--out", default="", help="folder; runs/five_seeds/RECIPE when left out")
    add_processes(parser, at_once=1)
    seeds = whole(0, MOST_SEEDS)
    parser.add_argument("--seeds", type=seeds, default=0, help="0: as the recipe has it")
    parser.add_argument("--table", action="store_true", help="only show the table that ships")
    parser.add_argument("--ship", default="", help="folder to copy the best policy to, when judged")
    parser.add_argument("more", nargs="*", help="further overrides, as course.steps=1000")
    given = parser.parse_intermixed_args(words)
    refuse_unlisted(given.recipe, RECIPES, f"there is no recipe '{given.recipe}'")
    return given


def judgements(recipe: Recipe, jobs: Sequence[Training], more: Sequence[str]) -> list[Training]:
    """Return the evaluations of all policies on held-out starts, in each world of a recipe.

    Args:
        recipe: with its worlds.
        jobs: its trainings, done; beside the first the scripted and a random policy are judged.
        more: further overrides; those of task and engine count here, too.
    """
    told = [word for word in more if word.startswith(("task.", "backend"))]
    found = []
    for number, job in enumerate(jobs):
        for name, words in {OWN: (), **recipe.elsewhere}.items():
            beside = "[scripted,random]" if number == 0 else "[]"
            judged = ("evaluate", *recipe.world, *recipe.judged, *words, *told,
                      f"policy={job.folder / 'policy'}", f"beside={beside}",
                      "episodes=100", f"hydra.run.dir={job.folder / name}")  # fmt: skip
            found.append(Training(job.folder / name, judged))
    return found


def demonstrated(out: Path, recipe: Recipe, more: Sequence[str]) -> tuple[str, ...]:
    """Record the demonstrations of a recipe, once; return the overrides that use them.

    Args:
        out: folder of the study.
        recipe: with or without demonstrations.
        more: further overrides; those of task and engine are its lessons, too.
    """
    if not recipe.shown:
        return ()
    told = (word for word in more if word.startswith(("task.", "backend")))
    world = (*recipe.world, *recipe.lessons, *told)
    folder = out / "demonstrations"
    if not folder.exists():
        run_verb("record", *world, f"episodes={recipe.shown}", f"out={folder}")
    for number in range(1, recipe.rounds + 1):
        folder = _labelled(folder, number, recipe, world)
    return (f"demonstrations={folder}",)


def _labelled(shown: Path, number: int, recipe: Recipe, world: Sequence[str]) -> Path:
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
