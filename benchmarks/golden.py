"""What commands answer, before and after a change that must not alter it.

    python -m benchmarks.golden record build/golden.json [JOB ...]
    python -m benchmarks.golden check build/golden.json [JOB ...]

Jobs are ``run:EXPERIMENT``, ``compare:EXPERIMENT``, ``train:NAME`` and ``name:LOG``; a word is the
beginning of a job's name, none means all. ``--logs FOLDER`` adds each log in a folder as a job of
its own. Recorded are exit code, printed text without times and folders, the columns of the log and
the ledger (root mean square and last value), what a diagnosis says, the rows of a training, and
processor seconds. Numbers are the same within 1e-7 of the largest of their kind; a machine with
another processor gives others, so both sides are run on one machine.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet

ROOT = Path(__file__).parents[1]
COMPARED = (
    "crazyflie_thrust",
    "falling_balls",
    "flume_heave",
    "impack_cone",
    "impack_entry",
    "linear_air_drag",
    "single_pendulum",
    "slocum_glider",
)
"""Experiments with measurements; all others are runs."""
TRAININGS = {
    "reach": ("learner=sac", "env=reach"),
    "hover": ("learner=sac", "env=hover"),
    "station": ("learner=sac", "env=station"),
    "crab": ("learner=sac", "env=crab_walk"),
    "many": ("learner=sac_many", "env=catch", "count=16"),
}
SAME, LEAST = 1e-7, 1e-15
"""Relative difference that counts, and what is rounding of zero."""
PASSING = re.compile(r"\d+(\.\d+)? ?(s|min|ms|MB|times real time)\b|/tmp/\S+|\d{4}-\d\d-\d\d\S*")
"""What two runs of one program print differently."""


def jobs(logs: list[Path]) -> dict[str, list[str]]:
    """Return the words of every job by name."""
    found = {}
    for path in sorted((ROOT / "conf" / "experiment").glob("*.yaml")):
        name = path.stem
        if name in COMPARED:
            found[f"compare:{name}"] = ["compare", f"experiment={name}"]
        else:
            found[f"run:{name}"] = ["run", f"experiment={name}"]
    for name, words in TRAININGS.items():
        found[f"train:{name}"] = ["train", *words, "course.steps=2000", "seed=3"]
    shipped = ROOT / "experiments" / "naming_benchmark" / "logs"
    for folder in (shipped, *logs):
        for meta in sorted(folder.glob("*/meta.yaml")):
            log = f"log={meta.parent.resolve()}"
            found[f"name:{meta.parent.name}"] = ["diagnose", log, "report=false", "plan=false"]
    return found


def answer(words: list[str], program: str) -> dict[str, Any]:
    """Run one command in an empty folder and return what it answered."""
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        process = subprocess.run(
            [program, *words, "out=out"],
            cwd=folder,
            capture_output=True,
            text=True,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "COLUMNS": "200"},
            check=False,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        out = Path(folder) / "out"
        return {
            "exit code": process.returncode,
            "printed": PASSING.sub("#", process.stdout + process.stderr).splitlines(),
            "files": sorted(str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()),
            "numbers": dict(numbers(out)),
            "said": said(out / "diagnosis.json"),
            "seconds": after.ru_utime - before.ru_utime,
        }


def numbers(out: Path) -> Iterator[tuple[str, list[float]]]:
    """Yield root mean square and last value of each column of a run's or a training's tables."""
    for path in sorted(out.glob("*.parquet")):
        for name, column in zip(*table_of(path), strict=True):
            values = np.asarray(column)
            if values.dtype.kind in "fiub" and values.size:
                real = np.nan_to_num(values.astype(float))
                yield f"{path.stem}.{name}", [math.sqrt(np.mean(real**2)), float(real[-1])]
    for path in sorted(out.glob("*.csv")):
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.reader(file):
                yield f"{path.stem}.{row[0]}", [float(v) for v in row[1:] if is_number(v)]


def table_of(path: Path) -> tuple[list[str], list[Any]]:
    """Return names and columns of a Parquet file."""
    table = pyarrow.parquet.read_table(path)
    return table.column_names, [c.to_numpy() for c in table.columns]


def is_number(text: str) -> bool:
    """Whether a cell of a table is a finite number."""
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def said(path: Path) -> dict[str, Any]:
    """Return what a diagnosis claims, without times, paths and digests."""
    if not path.is_file():
        return {}
    written = json.loads(path.read_text("utf-8"))
    return {
        key: written[key]
        for key in (
            "verdict",
            "effects",
            "confidence",
            "misfit",
            "stated_wrong",
            "channels",
            "reasons",
            "tried",
            "tried",
        )
        if key in written
    }


def differences(old: Any, new: Any, at: str = "") -> Iterator[str]:
    """Yield where two answers differ."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted({*old, *new}):
            yield from differences(old.get(key), new.get(key), f"{at}/{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        size = max((abs(v) for v in old if isinstance(v, float)), default=0.0)
        for i, (a, b) in enumerate(zip(old, new, strict=True)):
            if isinstance(a, float) and isinstance(b, float) and abs(a - b) <= SAME * size + LEAST:
                continue
            yield from differences(a, b, f"{at}[{i}]")
    elif isinstance(old, float) and isinstance(new, float):
        if abs(old - new) > SAME * abs(old) + LEAST:
            yield f"{at}: {old:.10g} -> {new:.10g}"
    elif old != new:
        yield f"{at}: {old} -> {new}"


def main() -> int:
    """Record or check; exit code 1 where a checked answer differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("verb", choices=("record", "check"))
    parser.add_argument("file", type=Path)
    parser.add_argument("jobs", nargs="*")
    parser.add_argument("--logs", type=Path, action="append", default=[])
    parser.add_argument("--seals", default=shutil.which("seals", path=Path(sys.executable).parent))
    parser.add_argument("--at-once", type=int, default=1)
    told = parser.parse_args()
    every = jobs(told.logs)
    wanted = [n for n in every if not told.jobs or n.startswith(tuple(told.jobs))]
    known = json.loads(told.file.read_text("utf-8")) if told.file.is_file() else {}
    wrong = 0
    with ThreadPoolExecutor(told.at_once) as pool:
        found = pool.map(lambda name: answer(every[name], told.seals), wanted)
        for i, (name, new) in enumerate(zip(wanted, found, strict=True), 1):
            old = known.get(name, {})
            seconds = new["seconds"] / old["seconds"] if old else 1.0
            changes = (
                []
                if told.verb == "record"
                else list(differences(old, new | {"seconds": old.get("seconds")}))
            )
            wrong += bool(changes)
            told_of = f"{len(changes)} differences, {seconds:.2f} of the time"
            print(f"[{i}/{len(wanted)}] {name}: {told_of}", flush=True)
            print(
                *(f"    {line[:300]}" for line in changes[:12]),
                sep="\n",
                end="\n" if changes else "",
            )
            if told.verb == "record":
                known[name] = new
                told.file.parent.mkdir(parents=True, exist_ok=True)
                told.file.write_text(json.dumps(known, indent=1), encoding="utf-8")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
