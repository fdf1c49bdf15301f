"""Study of learning with and without a diagnosis of the real world; see README.md."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from seals.errors import ConfigError, refuse_unlisted
from seals.experiments.command import CommandParser, show_table, whole
from seals.experiments.learning_study.arms import MOST_SEEDS, Training
from seals.experiments.learning_study.running import VerbFailed, add_processes, run_all, run_verb
from seals.experiments.posterior.outcome import EPISODES, gather, kept, tell
from seals.experiments.posterior.tasks import (
    ARMS,
    TASKS,
    RealTask,
    stated_of,
    trainings,
    write_stated,
)
from seals.learn.learner import MOST

NAMED = 10
"""Exit code of a diagnosis that names what is missing."""
STAGES = ("fly", "train", "judge", "tell")


def main(words: Sequence[str] | None = None) -> int:
    """Run a stage of the experiment; the same command resumes an interrupted one.

    Raises:
        ConfigError: there is no such task or stage.
    """
    parser = CommandParser(prog="posterior", description=__doc__)
    parser.add_argument("task", help=", ".join(TASKS))
    parser.add_argument("stage", help=", ".join(STAGES))
    parser.add_argument("--out", type=Path, help="folder; runs/posterior/TASK when left out")
    parser.add_argument("--answers", type=Path, help="what the arms know; that which comes along")
    seeds = whole(1, MOST_SEEDS)
    parser.add_argument("--seeds", type=seeds, default=5, help="trainings of an arm")
    add_processes(parser, at_once=2)
    parser.add_argument("--part", default="1/1", help="which share of the trainings, such as 2/4")
    starts = "held-out starts of a judgement"
    parser.add_argument("--episodes", type=whole(1, MOST), default=100, help=starts)
    parser.add_argument("--device", default="cpu", help="of the trainings: cpu or cuda")
    parser.add_argument("more", nargs="*", help="further overrides of a training")
    given = parser.parse_intermixed_args(words)
    for value, known in ((given.task, TASKS), (given.stage, STAGES)):
        refuse_unlisted(value, known, f"there is no '{value}'")
    out = given.out or Path("runs/posterior") / given.task
    task, answers = TASKS[given.task], given.answers or shipped(given.task)
    if given.stage == "fly":
        return fly(task, out)
    if given.stage == "tell":
        name = given.task
        if any((out / arm).is_dir() for arm in ARMS):
            table = gather(out)
        else:
            table = out / EPISODES
            table = kept(table if table.exists() else shipped(name).parents[1] / f"{name}.parquet")
        show_table(out, tell(table, out))
        return 0
    jobs = trainings(
        out, task, answers.resolve(), seeds=given.seeds, device=given.device, more=tuple(given.more)
    )
    jobs = share_of(jobs, given.part)
    if given.stage == "judge":
        jobs = judgements(jobs, task, episodes=given.episodes)
    left = run_all(jobs, at_once=given.jobs, limit=given.limit)
    if left:
        print(f"{left} of {len(jobs)} processes are not finished: the same command goes on.")
    return 1 if left else 0


def shipped(name: str) -> Path:
    """Return the folder that ships with SEALS: effects known to each arm of a task."""
    return Path(str(files("seals.experiments.posterior"))) / "answers" / name


def share_of(jobs: Sequence[Training], part: str) -> list[Training]:
    """Return every n-th training, starting with the k-th.

    Args:
        jobs: all trainings.
        part: ``k/n``, from 1/n to n/n.

    Raises:
        ConfigError: it is no such part.

    Example:
        >>> [job.words for job in share_of([Training(Path(), (x,)) for x in "abc"], "2/2")]
        [('b',)]
    """
    first, _, every = part.partition("/")
    if not (first.isdecimal() and every.isdecimal() and 1 <= int(first) <= int(every)):
        raise ConfigError(f"--part {part} is no part.\nAllowed: k/n with k from 1 to n.")
    return list(jobs[int(first) - 1 :: int(every)])


def fly(task: RealTask, out: Path) -> int:
    """Fly in the real world, diagnose the log, and write the effects that each arm knows.

    Args:
        task: with its hidden effects.
        out: folder; the log goes to ``out/log``, what the arms know to ``out/answers/ARM``.
    """
    answers = out / "answers"
    hidden = f"hide=[{','.join(task.kinds.values())}]"
    run_verb("run", *task.flight, *task.real, hidden, f"hydra.run.dir={out / 'log'}")
    try:
        run_verb("diagnose", f"log={out / 'log'}", f"out={answers / 'posterior'}")
    except VerbFailed as ended:
        if ended.code != NAMED:
            raise
    for arm, values in stated_of(task).items():
        write_stated(task, values, answers / arm)
    return 0


def judgements(jobs: Sequence[Training], task: RealTask, *, episodes: int) -> list[Training]:
    """Return one job per stored policy: its evaluation in the real world.

    Args:
        jobs: the trainings.
        task: with its hidden effects.
        episodes: held-out starts of each.
    """
    world = ("evaluate", *task.task, *task.real, "beside=[]", f"episodes={episodes}")
    found = []
    for job in jobs:
        for policy in sorted(job.folder.glob("policy_*")):
            folder = job.folder / "judged" / policy.name.removeprefix("policy_")
            words = (*world, f"policy={policy}", f"hydra.run.dir={folder}")
            found.append(Training(folder, words))
    return found
