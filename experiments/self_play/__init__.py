"""Self-play: hunter and prey learn in turns, with Elo over their checkpoints; see README.md."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, refuse_unlisted
from seals.experiments.command import CommandParser, checked_folder, whole
from seals.experiments.self_play.elo import (
    FULL_WORLD,
    GAMES,
    cross_table,
    draw,
    elo_table,
    full_table,
    tournament,
)
from seals.experiments.self_play.full_world import full_games
from seals.experiments.self_play.league import COUNT, TURN, play
from seals.experiments.self_play.pursuit import HUNTER, PREY
from seals.learn.learner import need_torch
from seals.logs.atomic import write_table
from seals.logs.table import read_parquet

PICTURE = "elo.webp"
STAGES = ("play", "table")
MOST = 10**9
NUMBERS = (
    ("turns", 1, 6, "of each role"),
    ("steps", COUNT, TURN, "control steps of a turn"),
    ("starts", 1, 64, "held-out starts of each pair"),
    ("full", 1, 20, "of each pair in full worlds"),
    ("seed", 0, 0, "of both trainings"),
)
"""Name, least, default and meaning of each number of the command line."""


def main(words: Sequence[str] | None = None) -> int:
    """Train and judge, or show the tables; the same command resumes an interrupted training.

    Raises:
        ConfigError: there is no such stage, or the steps are no multiple of the pursuits.
    """
    parser = CommandParser(prog="self_play", description=__doc__)
    parser.add_argument("stage", help=", ".join(STAGES))
    parser.add_argument("--out", type=Path, default=Path("runs/self_play"), help="folder")
    for name, least, usual, what in NUMBERS:
        kind = whole(least, MOST)
        parser.add_argument(f"--{name}", type=kind, default=usual, help=what)
    given = parser.parse_args(words)
    refuse_unlisted(given.stage, STAGES, f"there is no '{given.stage}'")
    if given.steps % COUNT:
        raise ConfigError(
            f"--steps={given.steps} is not allowed.\n"
            f"Allowed: a multiple of {COUNT}, the pursuits at once"
        )
    out = checked_folder(given.out)
    paths = [out / path.name for path in (GAMES, FULL_WORLD)]
    if given.stage == "play":
        _play(given, *paths)
    elif not paths[0].is_file():
        paths = [GAMES, FULL_WORLD]
    print(elo_table(read_parquet(paths[0])), cross_table(read_parquet(paths[0])), sep="\n")
    if paths[1].is_file():
        print(full_table(read_parquet(paths[1])))
    if given.stage == "play":
        print(draw(read_parquet(paths[0]), out / PICTURE, steps=given.steps))
    return 0


def _play(given: Any, games: Path, full: Path) -> None:
    """Train both, and write the tables of their games."""
    need_torch()
    import torch

    torch.set_num_threads(1)
    players = play(given.out, turns=given.turns, steps=given.steps, seed=given.seed)
    sides = [players[role].policies(given.turns) for role in (HUNTER, PREY)]
    write_table(games, tournament(*sides, starts=given.starts))
    last = given.turns
    pairs = [(0, 0), (0, last), (last, 0), (last, last)]
    write_table(full, full_games(pairs, *sides, starts=given.full))
