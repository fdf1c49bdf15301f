"""Methods that others wrote, on the log and the library of effects that the diagnosis has.

STLSQ (sequentially thresholded least squares) is that of pysindy; stepwise selection by BIC takes
its regressions from statsmodels; `mujoco.sysid` fits a MuJoCo model of its own, in an interpreter
of its own, for it needs another MuJoCo than SEALS.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import ConfigError
from seals.experiments.naming_benchmark.answers import (
    Names,
    Regression,
    one_step_sparse,
    stlsq_of_pysindy,
)
from seals.logs.log import Log
from seals.schema import plain
from seals.sysid.data.robot_description import stated_robot

OURS, STLSQ, STEPWISE, MUJOCO = "SEALS", "pysindy_STLSQ", "statsmodels_stepwise", "mujoco_sysid"
NEEDS = {STLSQ: "pysindy", STEPWISE: "statsmodels"}
"""Package that a rival comes from."""
_TIMEOUT = 900.0


def _stepwise(table: Regression) -> Names:
    """Add the effect that lowers BIC most, by ordinary least squares of statsmodels.

    Every parameter of an effect counts, those of effects without a response about zero, too.
    """
    ols = importlib.import_module("statsmodels.api").OLS
    rows = float(np.log(len(table.residual)))

    def score(columns: tuple[int, ...], freedom: int) -> float:
        if not columns:
            return float(-2.0 * ols(table.residual, np.zeros((len(table.residual), 1))).fit().llf)
        fit = ols(table.residual, table.columns[:, list(columns)]).fit()
        return float(-2.0 * fit.llf + freedom * rows)

    names: list[str] = []
    columns: tuple[int, ...] = ()
    freedom, best = 0, score((), 0)
    while True:
        wider = [
            (score((*columns, *group), freedom + table.freedom[key]), key, group)
            for key, group in table.groups.items()
            if key[0] not in names
        ]
        least, key, group = min(wider, default=(np.inf, ("", ""), ()))
        if least >= best:
            return tuple(names)
        names.append(key[0])
        columns, freedom, best = (*columns, *group), freedom + table.freedom[key], least


REGRESSIONS: Mapping[str, Callable[[Regression], Names]] = {
    STLSQ: lambda table: one_step_sparse(table, stlsq_of_pysindy),
    STEPWISE: _stepwise,
}


def installed() -> list[str]:
    """Return the rivals whose packages are here."""
    return [name for name, package in NEEDS.items() if importlib.util.find_spec(package)]


def by_mujoco(log: Log, python: str) -> dict[str, Any] | None:
    """Return the answer of `mujoco.sysid`, or None for a vehicle that it is not asked about.

    Args:
        log: of a multirotor.
        python: interpreter with ``mujoco[sysid]``.

    Raises:
        ConfigError: the interpreter does not give an answer.
    """
    vehicle = stated_robot(log.meta)
    if not vehicle.get("rotors") or log.meta["environment"].get("water_level") is not None:
        return None
    script = Path(__file__).with_name("mujoco_sysid.py")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        columns = {}
        for k, v in log.columns.items():
            if k != "t":
                # without gaps: straight between samples
                t, good = log.time, np.isfinite(v)
                columns[k] = np.interp(t, t[good], v[good]) if good.any() else np.zeros(len(v))
        table = np.column_stack([log.time, *columns.values()])
        head = ",".join(("t", *columns))
        np.savetxt(place / "log.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
        told = {key: log.meta[key] for key in ("baseline", "sensors")} | {"vehicle": vehicle}
        (place / "vehicle.json").write_text(json.dumps(plain(told)), encoding="utf-8")
        words = [python, str(script), "--log", folder]
        try:
            done = subprocess.run(
                words, capture_output=True, text=True, check=False, timeout=_TIMEOUT
            )
        except (OSError, subprocess.TimeoutExpired) as cause:
            raise ConfigError(f"mujoco={python}: {cause}.\n{ADVICE}") from cause
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no words"])[-1]
        raise ConfigError(f"mujoco={python}: {last}.\n{ADVICE}")
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


ADVICE = (
    "Give an interpreter that has it: python -m venv rival && rival/bin/pip install 'mujoco[sysid]'"
)
