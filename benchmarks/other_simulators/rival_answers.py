"""Answers of methods that others wrote, or that anybody would write first, to a set of flights.

    python -m benchmarks.other_simulators.rival_answers SET OUT [--only NAME ...] [--jobs 2]

Every case goes the newcomer's way to its data sheet. The methods of
`seals.experiments.naming_benchmark.answers` then see the samples and the effects of the diagnosis;
only the inference differs. STLSQ of pysindy and stepwise regression by statsmodels are among them
where these are installed. OUT/METHOD/CASE holds an answer as ``diagnosis.json``, so that
`benchmarks.other_simulators.score_set SET OUT/METHOD` counts it as it counts ours.
"""

from __future__ import annotations

import argparse
import contextlib
import gzip
import io
import json
import multiprocessing
import os
import shutil
import tempfile
import time
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import yaml

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

    truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
    given = case.parents[1]
    shutil.copytree(given / "robots" / truth["robot"], place / "robot")
    (place / "log.csv").write_bytes(gzip.decompress((case / "log.csv.gz").read_bytes()))
    for chart in given.glob("*.yaml"):
        shutil.copy(chart, place)
    os.chdir(place)
    words = ["log=log.csv", f"map={truth.get('map', 'map.yaml')}", "robot=robot", "out=flight"]
    words += [f"rate={truth.get('rate', 100)}", *truth.get("convert", [])]
    for step in (["convert", *words], ["new", "datasheet", "log=flight", "robot=robot"]):
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
    parser = argparse.ArgumentParser()
    parser.add_argument("set", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    cases = sorted(p.parent.resolve() for p in asked.set.glob("cases/*/truth.yaml"))
    cases = [c for c in cases if not asked.only or c.name in asked.only]
    run = partial(answer, asked.out.resolve())
    with multiprocessing.get_context("spawn").Pool(asked.jobs, maxtasksperchild=1) as pool:
        for said in pool.imap_unordered(run, cases):
            print(said, flush=True)


if __name__ == "__main__":
    main()
