"""Training loop: act, observe, update, evaluate and write checkpoints.

Its tables are only appended to, row by row; a resumed training repeats none.
"""

from __future__ import annotations

import contextlib
import csv
import io
import math
import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from seals.errors import ConfigError, LogError, SealsError
from seals.learn.devices import alike_in_all, largest_of_all
from seals.learn.learner import Advised
from seals.learn.networks import actor_of
from seals.learn.policy import NetworkPolicy, save_policy
from seals.learn.starts import validation_seeds
from seals.learn.stateful import Stateful
from seals.learn.training.checkpoint import (
    FILE,
    read_checkpoint,
    remove_checkpoint,
    stored,
    write_checkpoint,
)
from seals.learn.training.schedule import TrainingSchedule
from seals.learn.training.scoring import Scores, score
from seals.learn.training.tracking import Tracker
from seals.logs.atomic import write_text
from seals.run.stopping import ending, handled
from seals.sound_numbers import refuse_not_finite
from seals.state_tree import conform
from seals.untrusted_io import MOST_BYTES, read_text

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import Batched, StepResult
    from seals.learn.learner import Agent


class Rows:
    """Append-only CSV table; a row is on disk when `append` returns.

    Args:
        path: the file.
        columns: its columns; the first is ``step``.
        keep: rows that stood there at the checkpoint that is resumed: later ones of an earlier life
            are dropped. A file that is not there begins anew.

    Attributes:
        count: rows so far.

    Raises:
        ConfigError: the file is there and does not hold the rows to keep.
    """

    def __init__(self, path: Path, columns: Sequence[str], *, keep: int = 0) -> None:
        """Write the header, or drop rows that a resumed training will repeat."""
        self.path, self.columns = path, list(columns)
        # the step does not tell: a checkpoint may stand before or behind the row of its own step
        kept = _kept(path, keep) if keep and path.is_file() else []
        self.count = len(kept)
        lines = [",".join(self.columns), *(",".join(row[c] for c in self.columns) for row in kept)]
        write_text(path, "\n".join(lines) + "\n")

    def append(self, figures: Mapping[str, Any]) -> None:
        """Append one row; missing values stay empty."""
        with self.path.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow(
                [_cell(figures.get(column)) for column in self.columns]
            )
            file.flush()
            os.fsync(file.fileno())
        self.count += 1


def _kept(path: Path, keep: int) -> list[dict[str, str]]:
    try:
        text = read_text(path, most=MOST_BYTES)
        # a row that was cut off half-way has no end of line; its last figure may look like one
        ended = io.StringIO(text[: text.rfind("\n") + 1])
        whole = [row for row in csv.DictReader(ended) if None not in row.values()][:keep]
        for row in whole:
            int(row["step"])
    except (OSError, csv.Error, ValueError, KeyError, LogError) as cause:
        raise _damaged(path, str(cause)) from cause
    if len(whole) < keep:
        raise _damaged(path, f"{len(whole)} of {keep} rows are complete")
    return whole


def _damaged(path: Path, why: str) -> ConfigError:
    return ConfigError(f"{path} is damaged: {why}.\nRestore it, or start a new training.")


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return repr(round(float(value), 9)) if isinstance(value, float) else str(value)


STOP = 2
"""What a process tells the others when it is asked to stop; 1 for a checkpoint that is due."""
POLICY = "policy"
"""Folder of the policy in that of the training."""
TRAINED = ("step", "seconds", "updates", "episodes", "success", "return", "length")


class Outcome(NamedTuple):
    """Outcome of a training.

    Args:
        step: control steps made.
        updates: updates made.
        seconds: wall time, of all lives of the training together.
        success: share of successes of the policy in the folder ``policy``, or None without an
            evaluation.
        early: whether it ended because it was good enough.
    """

    step: int
    updates: int
    seconds: float
    success: float | None
    early: bool


class Training:
    """Training that can be interrupted between updates and resumed.

    Args:
        environment: that the agent acts in.
        agent: that learns; taught before, where it needs demonstrations.
        course: how long, and what is written.
        folder: where to.
        eval_env: environment of the evaluations, or None for no evaluation.
        metadata: what the policy's metadata says beside its network.
        seed: of the first episodes.
        tell: takes the number of control steps made, or of updates where there are no steps.
        heard: takes share of successes and mean return of each evaluation.
        tracker: takes the figures of all rows, too.
    """

    def __init__(
        self,
        environment: Batched,
        agent: Agent,
        *,
        course: TrainingSchedule,
        folder: Path,
        eval_env: Batched | None = None,
        metadata: Mapping[str, Any] | None = None,
        seed: int = 0,
        tell: Callable[[int], None] = lambda _: None,
        heard: Callable[[float, float], None] = lambda *_: None,
        tracker: Tracker | None = None,
    ) -> None:
        """Set up the statistics; nothing is written yet."""
        self.environment, self.agent, self.course = environment, agent, course
        self.folder, self.eval_env, self.seed = folder, eval_env, seed
        self.metadata = dict(metadata or {})
        self._tell, self._heard = tell, heard
        self.step = self.updates = 0
        self.success: float | None = None
        self._good, self._best = 0, list[float]()
        self._seconds, self._since = 0.0, time.perf_counter()
        self._kept = time.perf_counter()
        self._next = {"log": course.log_every, "look": course.look_every}
        self._looked = [-1, -1]
        self._row_counts: dict[str, int] = {}
        self._begun = self.stop = False
        self._statistics = _EpisodeStatistics(environment.count, environment.device)
        self._observation: Any = None
        self._rows: dict[str, Rows] = {}
        self._tracker = tracker

    def run(self, *, over: bool = True) -> Outcome:
        """Train until the step budget or the target score is reached.

        Args:
            over: whether nothing comes after that, so that the checkpoint is removed.
        """
        if not self._begun:
            self._begun = True
            if self.agent.interactive:
                # a seed for each environment, all below those of evaluations
                first = (self.seed * 1_000_003 + self.step) % 900_000_000
                seeds = [first + number for number in range(self.environment.count)]
                self._observation = self.environment.reset(seeds)
            self._evaluate()
        # a training taken up may stand between two updates
        self._update()
        self._log_evaluate_save()
        while self.agent.interactive and self.step < self.course.steps and not self._enough():
            if isinstance(self.agent, Advised):
                self.agent.advise(self.environment.scripted_policy())
            action = self.agent.act(self._observation, explore=True)
            result = self.environment.step(action)
            self.agent.observe(self._observation, action, result)
            self._observation = result.observation
            self._statistics.step(result)
            self.step += self.environment.count
            self._update()
            self._log_evaluate_save()
        return self._end(over)

    def _update(self) -> None:
        """Make all updates that are due."""
        for _ in range(self.agent.due()):
            self._statistics.update(self.agent.update())
            self.updates += 1
            if not self.agent.interactive:
                self._tell(self.updates)
                if self.updates % self.course.log_every == 0:
                    self._log()
            self._checkpoint()

    def _log_evaluate_save(self) -> None:
        """Log, evaluate and write a checkpoint when each is due."""
        if self.agent.interactive:
            self._tell(self.step)
        if self.step >= self._next["log"]:
            self._next["log"] = self._later("log", self.course.log_every)
            self._log()
        if self.step >= self._next["look"]:
            self._next["look"] = self._later("look", self.course.look_every)
            self._evaluate()
        self._checkpoint()

    def _later(self, name: str, every: int) -> int:
        """Return the next multiple of ``every``; many environments may pass several in one step."""
        return self._next[name] + every * (1 + (self.step - self._next[name]) // every)

    def _enough(self) -> bool:
        return self.course.stop_at > 0.0 and self._good >= self.course.in_a_row

    def _end(self, over: bool) -> Outcome:
        early = self._enough() and self.step < self.course.steps
        if not self.agent.interactive:
            # without steps of its own, it stands where the others stand at the end
            self.step = self.course.steps
        if self._looked != [self.step, self.updates]:
            self._evaluate()
        if self.eval_env is None:
            self._save(POLICY)
        if over:
            remove_checkpoint(self.folder)
        return Outcome(self.step, self.updates, self.seconds, self.success, early)

    @property
    def seconds(self) -> float:
        """Return the wall time of this training, resumed parts included [s]."""
        return self._seconds + time.perf_counter() - self._since

    # rows

    def _place(self) -> dict[str, Any]:
        return {"step": self.step, "seconds": round(self.seconds, 3), "updates": self.updates}

    def _log(self) -> None:
        figures = {**self._place(), **self._statistics.row()}
        # stop where a reward, or what the agent reports, is no number any more
        odd = [name for name, value in figures.items() if not math.isfinite(value)]
        running = self._statistics.returns
        if not bool(running.isfinite().all()):
            odd.append("return of an unfinished episode")
        advice = (
            "The training stops. Lower the learning rate, or make the task return finite rewards."
        )
        refuse_not_finite(odd, f"by step {self.step}", advice)
        self._table("training", (*TRAINED, *self.agent.reports)).append(figures)
        self._chart("training", figures)

    def _evaluate(self) -> None:
        """Evaluate the present policy on the validation seeds, and save it."""
        self._looked = [self.step, self.updates]
        if self.eval_env is None or not self.course.best:
            self._save(POLICY)
        if self.course.keep:
            self._save(f"{POLICY}_{self.step}")
        if self.eval_env is None:
            return
        found = self._scores(self.eval_env)
        figures: dict[str, Any] = {
            **self._place(),
            "episodes": len(found.seed),
            "success": float(found.success.mean()),
            "return": float(found.returns.mean()),
            "length": float(found.length.mean()),
            **{f"final_{name}": _mean(values) for name, values in found.facts.items()},
        }
        finals = tuple(f"final_{name}" for name in sorted(found.facts))
        self._table("evaluation", (*TRAINED, *finals)).append(figures)
        self._chart("evaluation", figures)
        self._heard(figures["success"], figures["return"])
        self._good = self._good + 1 if figures["success"] >= self.course.stop_at else 0
        scored = [figures["success"], figures["return"]]
        better = scored > self._best
        if self.course.best and better:
            self._save(POLICY)
        # without that option it is the last one that stands in the folder
        if better or not self.course.best:
            self._best = scored
        self.success = self._best[0]

    def _scores(self, eval_env: Batched) -> Scores:
        network, tensors = self.agent.policy()
        actor = actor_of(network)
        actor.load_state_dict({name: tensor.cpu() for name, tensor in tensors.items()})
        actor.to(eval_env.device)
        seeds = validation_seeds(self.course.episodes)
        return score(eval_env, NetworkPolicy(actor, self.metadata), seeds)

    def _save(self, name: str) -> None:
        network, tensors = self.agent.policy()
        metadata = {**self.metadata, "step": self.step, "updates": self.updates}
        save_policy(self.folder / name, network=network, tensors=tensors, metadata=metadata)

    def _table(self, name: str, columns: tuple[str, ...]) -> Rows:
        if name not in self._rows:
            keep = self._row_counts.get(name, 0)
            self._rows[name] = Rows(self.folder / f"{name}.csv", columns, keep=keep)
        return self._rows[name]

    def _chart(self, table: str, figures: Mapping[str, Any]) -> None:
        if self._tracker is not None:
            known = {k: float(v) for k, v in figures.items() if k != "step" and v is not None}
            row = {f"{table}/{k}": v for k, v in known.items() if math.isfinite(v)}
            self._tracker.add(row, self.step)

    # keeping

    def _checkpoint(self) -> None:
        """Write a checkpoint when it is due, or when a stop is requested.

        Raises:
            KeyboardInterrupt: ``stop`` was set; here, between two updates, nothing is half done.
        """
        every = self.course.checkpoint
        due = every > 0.0 and time.perf_counter() - self._kept >= every
        # processes that learn one policy are kept, and stop, at the same place: a signal that comes
        # while they agree counts at the next one
        asked = largest_of_all(STOP if self.stop else int(due))
        if every > 0.0 and asked:
            self.write()
        if asked == STOP:
            raise KeyboardInterrupt

    def write(self) -> None:
        """Write a checkpoint now."""
        write_checkpoint(self.folder, self.state())
        self._kept = time.perf_counter()

    def state(self) -> dict[str, Any]:
        """Return the complete state."""
        import torch

        try:
            scene = self.environment.snapshot() if self.agent.interactive else None
        except NotImplementedError:
            scene = None
        return {
            "config": self.metadata.get("config_hash"),
            "agent": self.agent.state(),
            "environment": scene,
            "observation": self._observation,
            "tally": self._statistics.state(),
            "place": {
                "step": self.step,
                "updates": self.updates,
                "seconds": self.seconds,
                "success": self.success,
                "good": self._good,
                "best": list(self._best),
                "looked": list(self._looked),
                "told": {
                    **self._row_counts,
                    **{name: rows.count for name, rows in self._rows.items()},
                },
                "next": dict(self._next),
            },
            "random": torch.get_rng_state(),
        }

    def resume(self, state: Mapping[str, Any]) -> list[str]:
        """Restore a checkpoint, and return remarks on what could not be restored.

        Args:
            state: that `state` returned, in a training made of the same settings.
        """
        import torch

        remarks = []
        self.agent.load(state["agent"])
        self._statistics.load(state["tally"])
        place = state["place"]
        self.step, self.updates = place["step"], place["updates"]
        self.success, self._good, self._looked = (
            place["success"],
            place["good"],
            list(place["looked"]),
        )
        self._best = list(place.get("best", self._best))
        self._seconds, self._since = place["seconds"], time.perf_counter()
        self._next, self._row_counts, self._begun = dict(place["next"]), dict(place["told"]), True
        torch.set_rng_state(state["random"].cpu())
        if state["environment"] is not None:
            self.environment.restore(state["environment"])
            self._observation = state["observation"]
        elif self.agent.interactive:
            self._observation = self.environment.reset(
                [self.seed + self.step] * self.environment.count
            )
            self._statistics.fresh_episodes()
            remarks.append("this engine stores no state: unfinished episodes are restarted")
        return remarks


def _mean(values: Any) -> float | None:
    """Return the mean over the episodes with a value, or None without one."""
    finite = values[~np.isnan(values)]
    return float(finite.mean()) if len(finite) else None


class _EpisodeStatistics(Stateful):
    """Running sums on the device of the environments, read once per log row.

    Args:
        count: environments.
        device: theirs.
    """

    parts = ("returns", "length", "ended")
    plain = ("sums", "updates")

    def __init__(self, count: int, device: str) -> None:
        """Start with empty sums."""
        import torch

        self.returns = torch.zeros(count, dtype=torch.float64, device=device)
        self.length = torch.zeros(count, dtype=torch.float64, device=device)
        self.ended = torch.zeros(4, dtype=torch.float64, device=device)
        self.sums: dict[str, Tensor] = {}
        self.updates = 0

    def step(self, result: StepResult) -> None:
        """Accumulate one step of all environments."""
        import torch

        self.returns += result.reward.double()
        self.length += 1.0
        ended = result.terminated | result.truncated
        weight = ended.double()
        self.ended += torch.stack(
            [
                weight.sum(),
                (weight * result.success.double()).sum(),
                (weight * self.returns).sum(),
                (weight * self.length).sum(),
            ]
        )
        self.returns.masked_fill_(ended, 0.0)
        self.length.masked_fill_(ended, 0.0)

    def update(self, figures: Mapping[str, Tensor]) -> None:
        """Accumulate the statistics of one update."""
        for name, value in figures.items():
            self.sums[name] = self.sums[name] + value if name in self.sums else value
        self.updates += 1

    def row(self) -> dict[str, float | int]:
        """Return the means since the last row and reset the sums; unknown ones are left out."""
        episodes, success, returns, length = self.ended.tolist()
        found: dict[str, float | int] = {"episodes": int(episodes)}
        if episodes:
            found |= {
                "success": success / episodes,
                "return": returns / episodes,
                "length": length / episodes,
            }
        found |= {name: float(value) / self.updates for name, value in self.sums.items()}
        self.ended.zero_()
        self.sums, self.updates = {}, 0
        return found

    def fresh_episodes(self) -> None:
        """Discard the running episodes: they were interrupted."""
        self.returns.zero_()
        self.length.zero_()


GROWN = ("rows",)
"""Entries of a state below which arrays grow from step to step."""


def refuse_other_form(state: Mapping[str, Any], fresh: Mapping[str, Any]) -> None:
    """Refuse a state whose entries, kinds and shapes are not those of a fresh one.

    Args:
        state: that is to be restored.
        fresh: of the same settings, before the first step.

    Raises:
        ValueError: says where they differ.
    """
    conform(stored(state), stored(fresh), tables=GROWN)


def take_up(training: Training, *, device: str) -> list[str]:
    """Restore a training from the checkpoint in its folder, and return remarks.

    Args:
        training: of the settings that it was begun with, before its first step.
        device: of its tensors.

    Raises:
        ConfigError: there is none, it is of other settings, or it is damaged.
    """
    folder = training.folder
    state = read_checkpoint(folder, device=device)
    if state.get("config") != training.metadata.get("config_hash"):
        raise ConfigError(
            f"resume={folder}: the training was begun with other settings, or another version of "
            "robot and environment.\nStart it again, in a folder of its own."
        )
    try:
        if state.get("environment") is not None:
            # one that never began has nothing to compare with
            training.environment.reset()
        refuse_other_form(state, training.state())
        remarks = training.resume(state)
    except SealsError:
        raise
    except Exception as cause:  # parts restore themselves, and say in their own ways what is amiss
        text = " ".join(str(cause).split())[:300] or type(cause).__name__
        raise ConfigError(
            f"{folder / FILE} cannot be resumed: {text}.\n"
            "It is damaged, or was not written by seals train; start again without resume."
        ) from cause
    if not alike_in_all((training.step, training.updates)):
        raise ConfigError(
            f"resume={folder}: its processes were interrupted at different steps, this one at "
            f"{training.step}.\nStart it again, in folders of their own."
        )
    return remarks


@contextlib.contextmanager
def stopping(training: Training) -> Iterator[None]:
    """Let Ctrl-C, or a cluster's stop signal, end the training between two updates.

    The second signal stops at once; the checkpoint is then an older one.
    """

    def stop(number: int, frame: object) -> None:
        if training.stop:
            raise KeyboardInterrupt
        training.stop = True

    with handled(stop, (signal.SIGINT, *ending())):
        yield
