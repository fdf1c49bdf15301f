"""Writing of a run folder: log, ledger, ``run.json``, report; every file atomically."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

from seals.logs.atomic import write_json, write_table, write_yaml
from seals.logs.native import write_native
from seals.logs.run_folder import FACTS, ROBOT
from seals.run.settings import RunSettings
from seals.run.simulation import Ending, Record

LOG_FILES = ("meta.yaml", ROBOT, "log.parquet")
"""Files of the log, the table last: where it is, the others are."""


def write_start(folder: Path, facts: dict[str, Any]) -> None:
    """Write to ``run.json`` that the run is in progress."""
    write_json(folder / FACTS, {"state": "running", **facts})


def write_cut(folder: Path, facts: dict[str, Any], cause: BaseException) -> None:
    """Write to ``run.json`` that the run ended before all files were written."""
    stopped = isinstance(cause, KeyboardInterrupt)
    words = "while its files were written" if stopped else f"{type(cause).__name__}: {cause}"
    state = (Ending.interrupted if stopped else Ending.failed).value
    write_json(folder / FACTS, {"state": state, "message": words, **facts})


def write_log(folder: Path, record: Record, settings: RunSettings) -> None:
    """Write log and ledger into the run's folder."""
    # a table of an earlier life never stands beside the notes of this one
    (folder / LOG_FILES[-1]).unlink(missing_ok=True)
    beside = folder / ".log"
    try:
        write_native(record.log, beside, replace=True)
        shutil.rmtree(folder / ROBOT, ignore_errors=True)
        for name in LOG_FILES:
            os.replace(beside / name, folder / name)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    columns = record.ledger.columns()
    for name, ledger in record.objects.items():
        more = {f"{name}/{column}": values for column, values in ledger.columns().items()}
        columns |= {key: values for key, values in more.items() if key != f"{name}/t"}
    write_table(folder / "ledger.parquet", columns)
    if record.fluid:
        write_table(folder / "fluid.parquet", {"t": record.log.time, **record.fluid})


def write_end(folder: Path, facts: dict[str, Any], record: Record, remarks: list[str]) -> None:
    """Write to ``run.json`` how the run ended and how long it took."""
    error = record.error
    message = "" if error is None else f"{type(error).__name__}: {error}".strip(": ")
    log = record.log
    end = {
        "state": record.ending.value,
        "message": message if record.ending is Ending.failed else "",
        "remarks": remarks,
        "steps": record.steps,
        "simulated_seconds": float(log.time[-1]),
        "seconds": round(record.seconds, 6),
        "steps_per_second": round(record.rate, 1),
    }
    write_json(folder / FACTS, {**end, **facts})


def write_config(folder: Path, config: Any) -> None:
    """Replace a configuration that repeats another run by the full one."""
    from omegaconf import OmegaConf

    write_yaml(folder / ".hydra" / "config.yaml", OmegaConf.to_container(config, enum_to_str=True))
