"""Tables of judged episodes and of the looks of trainings, as they ship with SEALS."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import SealsError
from seals.experiments.trials import read_rows
from seals.learn.evaluation.page import EPISODES
from seals.logs.atomic import write_table
from seals.logs.table import read_parquet

OWN = "held_out"
"""Folder of the judgement of a training in the world of its recipe."""
BESIDE = {"scripted": -1, "random": -2}
"""Numbers of the policies that are judged beside those of the seeds."""
CURVE = ("step", "seconds", "success", "return")
"""Columns of the looks that are kept."""
_KEYS = ("policy", "world", "start")


class Tables(NamedTuple):
    """What is kept of all trainings of a recipe.

    Args:
        episodes: a row for each judged episode: ``policy`` (seed of the training, or a number of
            `BESIDE`), ``world`` (0 for that of the recipe, k for the k-th other one), ``start``
            (its seed) and the facts of the episode, each of shape (episodes,).
        looks: a row for each look at the validation starts of a training: ``seed``, ``step``,
            ``seconds``, ``success``, ``return``, each of shape (looks,).
    """

    episodes: dict[str, Floats]
    looks: dict[str, Floats]

    def write(self, folder: Path, name: str) -> list[Path]:
        """Write both tables as Parquet, in single precision but for the starts."""
        paths = _paths(folder, name)
        for path, columns in zip(paths, self, strict=True):
            write_table(path, {k: _small(k, values) for k, values in columns.items()})
        return paths


def gather(folders: Sequence[Path], worlds: Iterable[str]) -> Tables:
    """Read the judged episodes and the looks of trainings.

    Args:
        folders: of the trainings, called by their seeds.
        worlds: folders of the judgements in other worlds.

    Raises:
        SealsError: nothing was judged.
    """
    episodes: list[dict[str, float]] = []
    looks: list[dict[str, float]] = []
    for folder in folders:
        seed = int(folder.name)
        for number, world in enumerate((OWN, *worlds)):
            for row in read_rows(folder / world / EPISODES):
                policy = BESIDE.get(row.pop("policy"), seed)
                start = row.pop("seed")
                keys = zip(_KEYS, (policy, number, float(start)), strict=True)
                facts = {k: float(v or "nan") for k, v in row.items() if k not in _KEYS}
                episodes.append({**dict(keys), **facts})
        for row in read_rows(folder / "evaluation.csv"):
            looks.append({"seed": seed, **{name: float(row[name]) for name in CURVE}})
    if not episodes:
        raise SealsError("nothing was judged.\nRun the complete recipe first.")
    return Tables(_columns(episodes), _columns(looks))


def shipped(name: str) -> Tables:
    """Read the tables of a recipe that ship with SEALS.

    Raises:
        SealsError: there are none.
    """
    folder = Path(str(files("seals.experiments.five_seeds"))) / "tables"
    paths = _paths(folder, name)
    if not all(path.is_file() for path in paths):
        known = sorted(x.stem for x in folder.glob("*.parquet") if not x.stem.endswith("_looks"))
        raise SealsError(
            f"no table of '{name}' comes along.\n"
            f"Those that do: {', '.join(known) or 'none'}. Without --table the recipe is run."
        )
    return Tables(*(dict(read_parquet(path)) for path in paths))


def _paths(folder: Path, name: str) -> list[Path]:
    return [folder / f"{name}.parquet", folder / f"{name}_looks.parquet"]


def _columns(rows: Sequence[Mapping[str, float]]) -> dict[str, Floats]:
    names = list(dict.fromkeys(name for row in rows for name in row))
    return {name: np.array([row.get(name, np.nan) for row in rows], dtype=float) for name in names}


def _small(name: str, values: Floats) -> Any:
    whole = np.isfinite(values).all() and (values == np.round(values)).all()
    return values.astype(np.int64) if whole else values.astype(np.float32)
