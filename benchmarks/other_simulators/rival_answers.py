"""Answers of methods that others wrote, or that anybody would write first, to a set of flights.

    python -m benchmarks.other_simulators.rival_answers SET OUT [--only NAME ...] [--jobs 2]

Every case goes the newcomer's way to its data sheet. The methods of
`seals.experiments.naming_benchmark.answers` then see the samples and the effects of the diagnosis;
only the inference differs. STLSQ of pysindy and stepwise regression by statsmodels are among them
where these are installed. OUT/METHOD/CASE holds an answer as ``diagnosis.json``, so that
`benchmarks.other_simulators.score_set SET OUT/METHOD` counts it as it counts ours.
"""

from __future__ import annotations

import contextlib
import io
import json
import multiprocessing
import os
import tempfile
import time
import warnings
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.other_simulators.flight_sets import cases_in, command_line, lay_out

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def answer(out: Path, case: Path) -> str:
    """Answer one case by every method."""
    warnings.simplefilter("ignore")
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        try:
            found = methods(prepared(case, Path(folder)))
        except SystemExit as end:
            found = {}
            print(f"{case.name}: refused with exit code {end.code}")
    for method, names in found.items():
        place = out / method.replace(" ", "_") / case.name
        place.mkdir(parents=True, exist_ok=True)
        told = {"verdict": "named" if names else "nothing_missing", "stated_wrong": []}
        told["effects"] = [{"name": n, "parameters": {}} for n in names]
        (place / "diagnosis.json").write_text(json.dumps(told), encoding="utf-8")
    return f"{case.name} {time.perf_counter() - begin:.0f} s"


def prepared(case: Path, place: Path) -> Any:
    """Convert a log, let it write its data sheet, and set up its identification."""
    from seals.cli.main import main as seals
    from seals.config.compose import compose
    from seals.sysid.predictors.problem import prepare
    from seals.sysid.report.given_logs import given_logs

    steps = lay_out(case, place)
    os.chdir(place)
    for step in steps:
        with contextlib.redirect_stdout(io.StringIO()):
            code = seals(step)
        if code:
            raise SystemExit(code)
    log, robot = given_logs(compose(["log=flight", "robot=robot"], root="diagnose")).read()
    return prepare(log, robot=robot)


def methods(problem: Any) -> dict[str, tuple[str, ...]]:
    """Return the names that every method declares."""
    from seals.experiments.naming_benchmark.answers import METHODS, Question
    from seals.experiments.naming_benchmark.rivals import REGRESSIONS, installed

    asked = Question.of(problem)
    found = {name: law(asked) for name, law in METHODS.items()}
    return found | {name: REGRESSIONS[name](asked.table) for name in installed()}


def main() -> None:
    """Answer the cases that were asked for."""
    asked = command_line("set", "out", jobs=1)
    run = partial(answer, asked.out.resolve())
    with multiprocessing.get_context("spawn").Pool(asked.jobs, maxtasksperchild=1) as pool:
        for said in pool.imap_unordered(run, cases_in(asked.set, asked.only)):
            print(said, flush=True)


if __name__ == "__main__":
    main()
