"""Metrics of a run by name: a recorded number, or a statistic of a table column."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, LogError, SealsError, suggestion
from seals.logs.table import read_csv_columns, read_parquet
from seals.sweep.book import DONE, read_jobs
from seals.sweep.rows import RUN, Row, find_rows
from seals.untrusted_io import read_json, read_plain_yaml

STATISTICS: Mapping[str, Callable[[Floats], float]] = {
    "first": lambda x: float(x[0]),
    "last": lambda x: float(x[-1]),
    "min": lambda x: float(x.min()),
    "max": lambda x: float(x.max()),
    "mean": lambda x: float(x.mean()),
    "rms": lambda x: float(np.sqrt((x * x).mean())),
    "std": lambda x: float(x.std()),
    "range": lambda x: float(x.max() - x.min()),
}
"""Statistics of a column; rows without a value are left out."""
USUAL = ("simulated_seconds", "step", "success")
"""Numbers of ``run.json`` that are shown when nothing is asked for."""
_LOG = "log"
BEST = "optimization_results.yaml"
"""File that the sweepers of Hydra leave behind."""


class Measures:
    """Metrics of one run; each table is read once.

    Args:
        row: of the run.
    """

    def __init__(self, row: Row) -> None:
        self._row = row
        self._tables: dict[str, dict[str, Floats]] = {}

    def value(self, name: str) -> float | None:
        """Return a metric; None where this run does not have it.

        Args:
            name: a key of ``run.json``, ``FILE.KEY`` of another JSON file, ``COLUMN.STATISTIC`` of
                the log or ``TABLE.COLUMN.STATISTIC`` of another table in the run's folder.

        Raises:
            ConfigError: a file is damaged.
        """
        found = _below(self._row.facts, name)
        file, _, key = name.partition(".")
        path = self._row.folder / f"{file}.json"
        if found is None and key and _plain(file) and path.is_file():
            found = _below(_content(read_json, path), key)
        if found is not None:
            return found
        column, _, statistic = name.rpartition(".")
        if statistic not in STATISTICS:
            return None
        table, _, rest = column.partition(".")
        for file, key in ((_LOG, column), (table, rest)):
            values = self.columns(file).get(key) if key else None
            whole = values[np.isfinite(values)] if values is not None else None
            if whole is not None and whole.size:
                return STATISTICS[statistic](whole)
        return None

    def columns(self, table: str) -> dict[str, Floats]:
        """Return the numeric columns of a table in the run's folder; none if there is none."""
        readers = {".parquet": read_parquet, ".csv": read_csv_columns}
        for suffix, read in readers.items():
            path = self._row.folder / f"{table}{suffix}"
            if table not in self._tables and _plain(table) and path.is_file():
                self._tables[table] = _content(read, path)
        return self._tables.get(table, {})


def _content(read: Callable[[Path], Any], path: Path) -> Any:
    """Return the content of a file; a damaged one is a wrong choice of the user."""
    try:
        return read(path)
    except LogError as cause:
        raise ConfigError(str(cause)) from cause


def _plain(name: str) -> bool:
    """Return whether a file name stays inside the run's folder."""
    return bool(name) and not set(name) & set("/\\\0") and name != ".."


def _below(facts: Any, key: str) -> float | None:
    """Return the number at a dotted key of nested mappings and lists."""
    for part in key.split("."):
        if isinstance(facts, list) and part.isdecimal() and int(part) < len(facts):
            facts = facts[int(part)]
            continue
        if not isinstance(facts, dict) or part not in facts:
            return None
        facts = facts[part]
    return float(facts) if isinstance(facts, int | float) else None


def refuse_unknown(name: str, measures: Measures, row: Row, *, key: str = "metric") -> NoReturn:
    """Refuse a metric that no run has, listing those of the first run.

    Args:
        name: of the metric.
        measures: of the first run.
        row: of the first run.
        key: that named the metric.

    Raises:
        ConfigError: always.
    """
    column, _, statistic = name.rpartition(".")
    table, columns = _LOG, measures.columns(_LOG)
    first, _, rest = column.partition(".")
    if column not in columns and rest and measures.columns(first):
        table, column, columns = first, rest, measures.columns(first)
    if statistic in STATISTICS and not columns:
        files = [p.stem for p in row.folder.glob("*.*") if p.suffix in (".parquet", ".csv")]
        hint = suggestion(first, files, label=f"Tables in {row.values[RUN]}")
    elif column in columns and statistic not in STATISTICS:
        hint = suggestion(statistic, STATISTICS, label="Statistics")
    elif statistic in STATISTICS:
        hint = suggestion(column, columns, label=f"Columns of {table} in {row.values[RUN]}")
    else:
        numbers = [key for key, value in row.facts.items() if isinstance(value, int | float)]
        hint = suggestion(name, numbers, label="Noted") + "; or a column: position_z.min"
    raise ConfigError(f"{key}={name}: no run has this metric.\n{hint}")


def objective_of(hydra: Any) -> float | tuple[float, ...] | None:
    """Return the objective of the run that has just ended; None if none is wanted.

    Args:
        hydra: Hydra's part of the configuration; ``callbacks.sweep.objective`` names one metric, as
            ``seals runs metric=`` takes it, or a list of several.

    Raises:
        ConfigError: the run has no such metric.
        SealsError: the job failed.
    """
    names = hydra.callbacks.sweep.get("objective")
    if names is None:
        return None
    folder = Path(hydra.runtime.output_dir)
    number = hydra.job.get("num")
    job = None if number is None else read_jobs(Path(hydra.sweep.dir)).get(int(number))
    if job is not None and job.state != DONE:
        raise SealsError(f"job {job.number} has no objective: {job.message}")
    row = next(r for r in find_rows(folder) if r.folder == folder)
    measures, found = Measures(row), []
    for name in [names] if isinstance(names, str) else names:
        value = measures.value(str(name))
        if value is None:
            refuse_unknown(str(name), measures, row, key="objective")
        found.append(value)
    return found[0] if isinstance(names, str) else tuple(found)


def best_of(folder: Path) -> str:
    """Return the line on the best job of a search; empty where no sweeper left one."""
    path = folder / BEST
    found = read_plain_yaml(path) if path.is_file() else None
    if not isinstance(found, dict):
        return ""
    best = found.get("best_params", found.get("best_evaluated_params"))
    if not isinstance(best, dict):
        return f"best of several objectives: {path}\n"
    value = found.get("best_value", found.get("best_evaluated_result"))
    return f"best {value:.6g}: {' '.join(f'{k}={v}' for k, v in best.items())}\n"
