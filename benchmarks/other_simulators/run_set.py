"""Answer every case of a set the newcomer's way, nothing written by hand.

    python -m benchmarks.other_simulators.run_set SET OUT [--seals seals] [--only NAME ...]

Each case is converted with the map of the set, the flight writes its own data sheet, and the log is
diagnosed. OUT/CASE gets ``diagnosis.json`` and ``steps.json`` (exit code, seconds and words of each
step); `python -m benchmarks.other_simulators.score_set SET OUT` then counts.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import gzip
import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

ANSWERED = (0, 10, 11, 12, 13, 20)
"""Exit codes of an answer; others end the case."""


def answer(case: Path, robots: Path, out: Path, seals: list[str]) -> dict[str, int]:
    """Convert, write the data sheet and diagnose one case; return the exit codes."""
    truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
    out.mkdir(parents=True, exist_ok=True)
    steps: dict[str, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        shutil.copytree(robots / "robots" / truth["robot"], place / "robot")
        (place / "log.csv").write_bytes(gzip.decompress((case / "log.csv.gz").read_bytes()))
        for chart in sorted(robots.glob("*.yaml")):
            shutil.copy(chart, place)
        words = [
            "convert",
            "log=log.csv",
            f"map={truth.get('map', 'map.yaml')}",
            "robot=robot",
            "out=flight",
        ]
        words += [f"rate={truth.get('rate', 100)}", *truth.get("convert", [])]
        sheet = ["new", "datasheet", "log=flight", "robot=robot"]
        for name, asked in (
            ("convert", words),
            ("sheet", sheet),
            ("diagnose", ["diagnose", "log=flight", "robot=robot", "out=answer"]),
        ):
            steps[name] = called([*seals, *asked], place)
            if steps[name]["rc"] not in ANSWERED:
                break
        found = place / "answer" / "diagnosis.json"
        if found.exists():
            shutil.copy(found, out)
    (out / "steps.json").write_text(json.dumps(steps, indent=1), encoding="utf-8")
    return {name: step["rc"] for name, step in steps.items()}


def called(words: list[str], place: Path) -> dict[str, Any]:
    """Run a command in a folder; return exit code, seconds and the end of what it said."""
    begin = time.perf_counter()
    try:
        done = subprocess.run(
            words,
            cwd=place,
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
            stdin=subprocess.DEVNULL,
        )
        code, said = done.returncode, done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        code, said = 124, "timeout"
    return {"rc": code, "seconds": round(time.perf_counter() - begin, 1), "say": said[-3000:]}


def main() -> None:
    """Answer the cases that were asked for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("set", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seals", default="seals")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    cases = sorted(p.parent for p in asked.set.glob("cases/*/truth.yaml"))
    cases = [c for c in cases if not asked.only or c.name in asked.only]
    with concurrent.futures.ThreadPoolExecutor(asked.jobs) as pool:
        jobs = {
            pool.submit(answer, c, asked.set, asked.out / c.name, asked.seals.split()): c.name
            for c in cases
        }
        for job in concurrent.futures.as_completed(jobs):
            print(jobs[job], job.result(), flush=True)


if __name__ == "__main__":
    main()
