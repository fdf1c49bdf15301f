"""Table of all looks of a study, and its folders made again from that table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from seals.errors import LogError
from seals.experiments.learning_study.arms import ARMS
from seals.learn.comparison.runs import EVALUATION, FACTS, find_arms, read_run
from seals.logs.atomic import write_json, write_table
from seals.logs.table import read_parquet


def keep(out: Path) -> Path:
    """Write the looks of all trainings of a study as one table; return the file.

    A row for each look: ``arm`` (its number among `ARMS`), ``seed``, and the columns that all
    trainings have.

    Args:
        out: folder with ``ARM/SEED``; the table is ``looks.parquet`` beside it.
    """
    order = list(ARMS)
    runs = [
        (order.index(arm), read_run(folder, arm=arm))
        for arm, folders in find_arms({}, str(out)).items()
        for folder in folders
    ]
    common = [n for n in runs[0][1].columns if all(n in run.columns for _, run in runs)]
    lengths = [len(run.columns[common[0]]) for _, run in runs]
    columns = {
        "arm": np.repeat([number for number, _ in runs], lengths),
        "seed": np.repeat([int(run.folder.name) for _, run in runs], lengths),
        **{name: np.concatenate([run.columns[name] for _, run in runs]) for name in common},
    }
    path = out.with_name(f"{out.name}_looks.parquet")
    write_table(path, columns)
    return path


def restore(table: Path, out: Path) -> Path:
    """Write the tables of the trainings of a study from its looks; return its folder.

    Args:
        table: that `keep` wrote.
        out: folder to write ``ARM/SEED`` into.

    Raises:
        LogError: it is no such table.
    """
    columns = dict(read_parquet(table))
    order = list(ARMS)
    arms = columns.get("arm", np.array([-1.0]))
    if "seed" not in columns or not 0 <= arms.min() <= arms.max() < len(order):
        raise LogError(
            f"{table} holds no arms and seeds.\nGive the table of evaluations that a study wrote."
        )
    pairs = np.stack([columns.pop("arm"), columns.pop("seed")], axis=1).astype(int)
    for arm, seed in np.unique(pairs, axis=0):
        here = (pairs == (arm, seed)).all(axis=1)
        folder = out / order[arm] / str(seed)
        folder.mkdir(parents=True, exist_ok=True)
        write_table(folder / EVALUATION, {name: x[here] for name, x in columns.items()})
        write_json(folder / FACTS, {"seed": int(seed), "state": "done"})
    return out
