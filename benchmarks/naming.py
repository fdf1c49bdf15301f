"""Success rate of the diagnosis on new logs of the independent generator.

    python -m benchmarks.naming OUT clear:quad:50 null:auv:25 --seed 1 --processes 2

Every case leaves its log, its truth and its answer in OUT; what is there already is not done again.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import multiprocessing
import os
import sys
import time
import warnings
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import yaml

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.append(str(ROOT))

from benchmarks.wild import errors  # noqa: E402
from seals.experiments.naming_benchmark.told import beside  # noqa: E402


def jobs_of(words: list[str], seed: int) -> list[tuple[str, str, int]]:
    """Level, vehicle and seed of every case."""
    jobs = []
    for word in words:
        level, vehicle, count = word.split(":")
        jobs += [(level, vehicle, seed + k) for k in range(int(count))]
    return jobs


def run(job: tuple[Path, tuple[str, str, int]]) -> str:
    """Generate one log and diagnose it."""
    from seals.logs.native import read_native
    from seals.sysid.diagnosis import diagnose
    from tests.validation.hidden import generate

    out, (level, vehicle, seed) = job
    warnings.simplefilter("ignore")
    folder = out / f"{level}-{vehicle}-{seed}"
    answer = folder / "g001" / "diagnosis.json"
    if answer.exists():
        return f"{folder.name} there"
    words = ("--level", level, "--vehicle", vehicle, "--seed", str(seed), "--count", "1")
    with contextlib.redirect_stdout(io.StringIO()):
        generate.main([str(folder), *words])
    if not answer.parent.exists():
        return f"{folder.name} could not be made"
    begin = time.perf_counter()
    try:
        found = diagnose(read_native(answer.parent)).to_dict()
    except Exception as problem:  # one broken case must not end the others
        return f"{folder.name} FAILED: {type(problem).__name__}: {problem}"
    answer.write_text(json.dumps(found), encoding="utf-8")
    names = ", ".join(e["name"] for e in found["effects"])
    truth = yaml.safe_load((answer.parent / "truth.yaml").read_text(encoding="utf-8"))
    true = ", ".join(e["name"] for e in truth["effects"])
    taken = time.perf_counter() - begin
    return f"{folder.name} [{true}] -> {found['verdict']} [{names}] {taken:.1f} s"


def outcome(truth: dict[str, Any], found: dict[str, Any]) -> str:
    """One word for an answer: right, wrong, set, or the verdict that abstains."""
    want = {e["name"] for e in truth["effects"]} if truth["in_library"] else set()
    # a drag that is spread along the vehicle brakes its rotation, too
    names = {e["name"] for e in found["effects"]} - beside(want)
    verdict = str(found["verdict"])
    if verdict == "ambiguous":
        return "set with truth" if want <= names and want else "set without truth"
    if verdict != "named":
        return "right" if verdict == truth["expected_verdict"] else verdict
    if want and names == want:
        return "right"
    sets = [set(s) for s in found["ambiguous_with"]]
    excused = all(n in want or any(n in s and s & want for s in sets) for n in names)
    return "right within its set" if want and excused else "wrong name"


def table(out: Path) -> str:
    """Answers by level, with errors of the parameters and calibration of the confidence."""
    counts: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    off: list[float] = []
    sure: list[tuple[float, bool]] = []
    seconds = []
    for answer in sorted(out.glob("*/*/diagnosis.json")):
        found = json.loads(answer.read_text(encoding="utf-8"))
        truth = yaml.safe_load((answer.parent / "truth.yaml").read_text(encoding="utf-8"))
        counts[truth["level"]][outcome(truth, found)] += 1
        want = {e["name"] for e in truth["effects"]}
        sure += [(e["confidence"], e["name"] in want) for e in found["effects"]]
        seconds.append(found["seconds"])
        if truth["level"] == "clear":
            off += errors(truth, found)[0]
    lines = []
    for level, words in counts.items():
        total = sum(words.values())
        shares = ", ".join(f"{w} {n}" for w, n in sorted(words.items(), key=lambda x: -x[1]))
        lines.append(f"{level:16s} {total:4d}: {shares}")
    if off:
        low, high = np.percentile(off, [50, 90])
        lines.append(f"parameters (clear): median error {100 * low:.1f} %, p90 {100 * high:.1f} %")
    if sure:
        lines.append(f"calibration error of the confidence: {calibration(sure):.3f}")
    lines.append(f"seconds a log: median {np.median(seconds):.1f}, most {max(seconds):.1f}")
    return "\n".join(lines)


def calibration(sure: list[tuple[float, bool]], bins: int = 10) -> float:
    """Expected calibration error."""
    said, right = np.array([s for s, _ in sure]), np.array([float(r) for _, r in sure])
    place = np.minimum((said * bins).astype(int), bins - 1)
    parts = [place == k for k in range(bins) if (place == k).any()]
    return float(sum(p.mean() * abs(said[p].mean() - right[p].mean()) for p in parts))


def main(words: list[str] | None = None) -> int:
    """Generate and diagnose logs, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    parser.add_argument("cases", nargs="*", help="LEVEL:VEHICLE:COUNT")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    chosen = parser.parse_args(words)
    jobs = [(chosen.out, job) for job in jobs_of(chosen.cases, chosen.seed)]
    failed = 0
    with multiprocessing.Pool(chosen.processes, maxtasksperchild=4) as pool:
        for line in pool.imap_unordered(run, jobs, chunksize=1):
            print(line, flush=True)
            failed += "FAILED" in line
    print(table(chosen.out))
    if failed:
        print(f"{failed} of {len(jobs)} diagnoses failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
