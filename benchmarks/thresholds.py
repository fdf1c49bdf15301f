"""Sensitivity of the answers to each threshold of the diagnosis, lowered and raised.

    python -m benchmarks.thresholds OUT LOGS... [--by 0.3] [--only NAME,...] [--jobs N]

LOGS are folders in which logs lie at any depth; a log of a case with a folder `robot` is of that
robot. Every log is diagnosed once with thresholds that tell which comparisons would turn out
otherwise; only those changes are diagnosed again, since no other can change an answer. Changes that
matter to the verdict alone repeat the verdict alone. What is in OUT already is not done again, and
OUT/thresholds.md is written at the end.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import random
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from benchmarks.traced import Change, Trace, Traced
from seals.errors import suggestion
from seals.logs.native import read_native
from seals.sysid.data.robot_description import RobotDescription, describe_robot
from seals.sysid.decision.evidence import decide
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.predictors.problem import prepare
from seals.sysid.selection.log_search import search_log

Answer: TypeAlias = list[Any]
"""Verdict and names."""
Job: TypeAlias = tuple[Path, Path, str, float, frozenset[str]]
"""Folder of results, log, change as text, size of the changes, names of the thresholds."""
ALL = frozenset(t.name for t in DecisionPolicy().thresholds())
"""Names of all thresholds."""
FIRST = "first"
"""Job of a log with the standard thresholds."""


def traced(by: float, trace: Trace, names: frozenset[str] = ALL) -> DecisionPolicy:
    """Return the standard policy with the named thresholds traced under their two changes."""
    values = {
        t.name: Traced(
            t.value, {(t.name, sign): t.value * (1.0 + sign * by) for sign in (-1, 1)}, trace
        )
        for t in DecisionPolicy().thresholds()
        if t.name in names
    }
    return DecisionPolicy(**values)


def robot_of(log: Path) -> RobotDescription | None:
    """Robot of the case that a log belongs to; None where its metadata describe the vehicle."""
    folder = log.parents[1] / "robot"
    return describe_robot(str(folder)) if folder.is_dir() else None


def answer_of(problem: Any, found: Any) -> Answer:
    """Verdict and sorted names of a search."""
    answer = decide(problem, found)
    return [answer.verdict.value, sorted(claim.name for claim in answer.claims)]


def first(log: Path, by: float, names: frozenset[str] = ALL) -> dict[str, Any]:
    """Diagnose with traced thresholds, then repeat the decision with changed thresholds."""
    trace = Trace()
    policy = traced(by, trace, names)
    trace.stage = "search"
    problem = prepare(read_native(log), policy=policy, robot=robot_of(log))
    found = search_log(problem)
    trace.stage = "verdict"
    base = answer_of(problem, found)
    searched = trace.noted.get("search", set())
    late = sorted(trace.noted.get("verdict", set()) - searched)
    trace.stage = "again"
    answers = {}
    for change in late:
        # every model of the search refers to this one object
        name, value = change[0], getattr(policy, change[0])
        object.__setattr__(policy, name, value.others[change])
        answers[key_of(change)] = answer_of(problem, found)
        object.__setattr__(policy, name, value)
    return {
        "answer": base,
        "traced": sorted(names),
        "used": sorted(trace.used),
        "search": sorted(key_of(c) for c in searched),
        "answers": answers,
    }


def again(log: Path, change: Change, by: float) -> dict[str, Any]:
    """Diagnose with one threshold changed."""
    name, sign = change
    value = getattr(DecisionPolicy(), name) * (1.0 + sign * by)
    policy = replace(DecisionPolicy(), **{name: value})
    problem = prepare(read_native(log), policy=policy, robot=robot_of(log))
    return {"answer": answer_of(problem, search_log(problem))}


def key_of(change: Change) -> str:
    """Text of a change, as ``evidence-`` or ``evidence+``."""
    return change[0] + ("+" if change[1] > 0 else "-")


def file_of(out: Path, log: Path, key: str) -> Path:
    """File of the result of one diagnosis."""
    return out / "_".join(log.parts[-2:]) / f"{key}.json"


def work(job: Job) -> str:
    """Run one job and store its result or error."""
    out, log, key, by, names = job
    warnings.simplefilter("ignore")
    path = file_of(out, log, key)
    begin = time.perf_counter()
    try:
        change = (key[:-1], 1 if key[-1] == "+" else -1)
        found = first(log, by, names) if key == FIRST else again(log, change, by)
    except Exception as problem:  # one broken case must not end the others
        found = {"error": f"{type(problem).__name__}: {problem}", "answer": ["error", []]}
    found["seconds"] = time.perf_counter() - begin
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(found), encoding="utf-8")
    part.replace(path)
    return f"{path.parent.name} {key} {found['seconds']:.1f} s {found['answer']}"


def share(jobs: Sequence[Job], processes: int, until: float) -> None:
    """Run the jobs without a result in parallel processes, until a time."""
    left = [j for j in jobs if not done(j)]
    random.Random(0).shuffle(left)
    with multiprocessing.Pool(processes) as pool:
        for k, line in enumerate(pool.imap_unordered(work, left), start=1):
            print(f"{k}/{len(left)} {line}", flush=True)
            if time.monotonic() > until:
                pool.terminate()
                break


def read(path: Path) -> dict[str, Any] | None:
    """Result of a job, if it is there."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def done(job: Job) -> bool:
    """Return true if a job has a result, a first one with all its thresholds traced."""
    found = read(file_of(job[0], job[1], job[2]))
    if found is None or job[2] != FIRST:
        return found is not None
    return "error" in found or job[4] <= set(found.get("traced", ALL))


def table(out: Path, logs: Sequence[Path], by: float, names: frozenset[str] = ALL) -> str:
    """Lines of Markdown: each named threshold, its reason, and how many answers change."""
    firsts = {log: read(file_of(out, log, FIRST)) for log in logs}
    found = {log: f for log, f in firsts.items() if f is not None and "error" not in f}
    lines = [
        f"Answers (verdict and names) of {len(found)} logs that change when one threshold is "
        f"{by:.0%} lower or higher.",
        "",
        f"| threshold | value | unit | reason | -{by:.0%} | +{by:.0%} |",
        "|---|---|---|---|---|---|",
    ]
    for t in (t for t in DecisionPolicy().thresholds() if t.name in names):
        used = any(t.name in f["used"] for f in found.values())
        cells = [_changed(out, found, key_of((t.name, sign))) if used else "-" for sign in (-1, 1)]
        lines.append(f"| `{t.name}` | {t.value:g} | {t.unit} | {t.reason} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _changed(out: Path, done: dict[Path, dict[str, Any]], key: str) -> str:
    """Cell of the table: number of answers that change, and how many were not asked again."""
    changed = missing = 0
    for log, base in done.items():
        if key in base["answers"]:
            changed += base["answers"][key] != base["answer"]
        elif key in base["search"]:
            found = read(file_of(out, log, key))
            missing += found is None
            changed += found is not None and found["answer"] != base["answer"]
    return f"{changed}" + (f" ({missing} not run)" if missing else "")


def names_of(words: str) -> frozenset[str]:
    """Names of thresholds, separated by commas."""
    names = frozenset(words.split(","))
    for name in sorted(names - ALL):
        raise argparse.ArgumentTypeError(f"no threshold '{name}'. {suggestion(name, sorted(ALL))}")
    return names


def main(words: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("logs", type=Path, nargs="+")
    parser.add_argument("--by", type=float, default=0.3)
    parser.add_argument("--only", type=names_of, default=ALL, metavar="NAME,...")
    parser.add_argument("--jobs", "--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--seconds", type=float, default=86_400.0)
    asked = parser.parse_args(words)
    until = time.monotonic() + asked.seconds
    logs = sorted({p.parent for top in asked.logs for p in top.rglob("meta.yaml")})
    share([(asked.out, log, FIRST, asked.by, asked.only) for log in logs], asked.jobs, until)
    more = []
    for log in logs:
        base = read(file_of(asked.out, log, FIRST))
        keys = [k for k in (base or {}).get("search", ()) if k[:-1] in asked.only]
        more += [(asked.out, log, key, asked.by, asked.only) for key in keys]
    if time.monotonic() < until:
        share(more, asked.jobs, until)
    text = table(asked.out, logs, asked.by, asked.only)
    (asked.out / "thresholds.md").write_text(text, encoding="utf-8")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
