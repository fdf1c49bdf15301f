"""Objective of a run: the metric that a job returns to Hydra's sweeper, which searches by it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.errors import SealsError
from seals.sweep.book import DONE, read_jobs
from seals.sweep.metrics import Measures, refuse_unknown
from seals.sweep.rows import find_rows
from seals.untrusted_io import read_plain_yaml

BEST = "optimization_results.yaml"
"""File that the sweepers of Hydra leave behind."""


def objective_of(hydra: Any) -> float | tuple[float, ...] | None:
    """Return the objective of the run that has just ended; None where none is wanted.

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
