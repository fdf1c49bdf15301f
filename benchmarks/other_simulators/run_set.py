"""Answer every case of a set the newcomer's way, nothing written by hand.

    python -m benchmarks.other_simulators.run_set SET OUT [--seals seals] [--only NAME ...]

Each case is converted with the map of the set, the flight writes its own data sheet, and the log is
diagnosed. OUT/CASE gets ``diagnosis.json`` and ``steps.json`` (exit code, seconds and words of each
step); `python -m benchmarks.other_simulators.score_set SET OUT` then counts.
"""

from __future__ import annotations

import concurrent.futures
import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.other_simulators.flight_sets import cases_in, command_line, lay_out

ANSWERED = (0, 10, 11, 12, 13, 20)
"""Exit codes of an answer; others end the case."""


def answer(case: Path, out: Path, seals: list[str]) -> dict[str, int]:
    """Convert, write the data sheet and diagnose one case; return the exit codes."""
    out.mkdir(parents=True, exist_ok=True)
    steps: dict[str, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        words, sheet = lay_out(case, place)
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
    asked = command_line("set", "out", seals="seals", jobs=1)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with concurrent.futures.ThreadPoolExecutor(asked.jobs) as pool:
        jobs = {
            pool.submit(answer, c, asked.out / c.name, asked.seals.split()): c.name
            for c in cases_in(asked.set, asked.only)
        }
        for job in concurrent.futures.as_completed(jobs):
            print(jobs[job], job.result(), flush=True)


if __name__ == "__main__":
    main()
