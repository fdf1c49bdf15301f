"""Loop of the endurance run: steps, periodic rows, resumption after an interruption."""

from __future__ import annotations

import csv
import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import ConfigError
from seals.experiments import trials
from seals.experiments.soak.energy import Books
from seals.experiments.soak.flight import LENGTH, Wish, tell
from seals.run import build_world
from seals.run.assembly import ROBOT
from seals.run.checkpoint import (
    FOLDER,
    checkpoint_of,
    has_checkpoint,
    take_up,
    write_checkpoint,
)
from seals.run.settings import RunSettings
from seals.world import Actor, World

TABLE = "soak.csv"
COLUMNS = (
    "step",
    "time_s",
    "height_m",
    "submersion",
    "crossings",
    "finite",
    "gap_J",
    "moved_J",
    "rss_MB",
    "wall_s",
    "process",
)
EVERY = 1000
"""Steps between two rows."""
ASK = 25
"""Steps between two looks of the pilot's guide at where it is: a tenth of a second."""
MINUTE = 60.0
"""Wall time between two checkpoints [s]."""


def soaked(
    out: Path, settings: RunSettings, steps: int, words: Sequence[str] = ()
) -> list[dict[str, float]]:
    """Fly until so many steps are done and return the rows of the table.

    Args:
        out: folder of the table and the checkpoint; a soak that was cut off goes on there.
        settings: of the run.
        steps: of the engine, from the start.
        words: overrides that made the settings what they are.

    Raises:
        SealsError: the soak in the folder began by other words, the run cannot start, or the motion
            is none any more.
    """
    out.mkdir(parents=True, exist_ok=True)
    world = build_world(settings)
    try:
        soak = _Soak(out, settings, world, sorted(words))
        for row in soak.rows(steps):
            _tell_progress(row, steps, soak.begun)
        return read_rows(out / TABLE)
    finally:
        world.close()


class _Soak:
    """World in progress with its energy balance and its table."""

    def __init__(
        self, out: Path, settings: RunSettings, world: World, words: Sequence[str]
    ) -> None:
        self.out, self.settings, self.world, self.words = out, settings, world, list(words)
        self.actor: Actor = world.actors[ROBOT]
        self.books = Books(self.actor)
        self.done, self.crossings, self.wet = 0, 0, False
        if has_checkpoint(out):
            kept = take_up(checkpoint_of(out), world)
            before = kept.get("words", self.words)
            if list(before) != list(self.words):
                raise ConfigError(
                    f"{out} holds a soak that began with: {' '.join(before) or 'no words'}.\n"
                    "Give the very same ones to go on with it, or another folder: --out FOLDER"
                )
            self.done, self.crossings, self.wet = kept["steps"], kept["crossings"], kept["wet"]
            self.books.take_up(kept["books"])
        self.begun, self.start, self._kept = self.done, time.perf_counter(), time.perf_counter()
        table = out / TABLE
        older = [row for row in read_rows(table) if row["step"] <= self.done] if self.done else []
        self.process = 1 + max((int(row["process"]) for row in older), default=0)
        with table.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(older)

    def rows(self, steps: int) -> Iterator[dict[str, float]]:
        """Step to the end; write and yield a row at intervals."""
        length = round(LENGTH / self.settings.time.step)
        while self.done < steps:
            if self.done % ASK == 0:
                number = self.done // length
                tell(self.actor, Wish.drawn(self.actor.robot, self.settings.seed, number))
            self.world.step()
            self.done += 1
            wet = float(self.actor.body.read().position[2]) < 0.0
            self.crossings += wet != self.wet
            self.wet = wet
            if self.done % EVERY == 0 or self.done == steps:
                totals, at = self.books.totals, self.actor.body.read()
                state = np.concatenate([np.ravel(part) for part in at])
                # the resident memory of this process [bytes]
                pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
                row = {
                    "step": self.done,
                    "time_s": round(self.world.time, 6),
                    "height_m": round(float(at.position[2]), 4),
                    "submersion": int(self.wet),
                    "crossings": self.crossings,
                    "finite": int(bool(np.isfinite(state).all() and np.isfinite(totals.moved))),
                    "gap_J": round(totals.gap * totals.moved, 6),
                    "moved_J": round(totals.moved, 3),
                    "rss_MB": round((pages * os.sysconf("SC_PAGE_SIZE")) / 1e6, 3),
                    "wall_s": round(time.perf_counter() - self.start, 2),
                    "process": self.process,
                }
                with (self.out / TABLE).open("a", newline="", encoding="utf-8") as file:
                    csv.DictWriter(file, COLUMNS).writerow(row)
                # the ledger of a million steps would be gigabytes
                self.actor.ledger.rewind(0)
                self._keep()
                yield row

    def _keep(self) -> None:
        now = time.perf_counter()
        if now - self._kept < MINUTE:
            return
        kept: dict[str, Any] = {"steps": self.done, "crossings": self.crossings, "wet": self.wet}
        kept |= {"words": self.words, "books": self.books.keep()}
        write_checkpoint(self.out / FOLDER, self.world, kept)
        self._kept = now


def read_rows(path: Path) -> list[dict[str, float]]:
    """Return the rows of a table; none when it does not exist."""
    return [{key: float(value) for key, value in row.items()} for row in trials.read_rows(path)]


def _tell_progress(row: dict[str, float], steps: int, begun: int) -> None:
    done = int(row["step"])
    if done % (10 * EVERY) and done != steps:
        return
    left = row["wall_s"] * (steps - done) / max(done - begun, 1)
    print(
        f"{done:,} of {steps:,} steps, {left / 60.0:.1f} min left: height {row['height_m']:.2f} m, "
        f"{row['crossings']:.0f} crossings, gap {100 * row['gap_J'] / row['moved_J']:.3f} %, "
        f"{row['rss_MB']:.1f} MB",
        file=sys.stderr,
        flush=True,
    )
