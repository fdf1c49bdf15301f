"""Comparison of SEALS with classical methods on logs with a hidden effect.

    python -m benchmarks.baselines CASES [--processes 2] [--limit N] [--ours RESULTS] [--out OUT]

CASES holds folders with a log and its truth.yaml, at any depth. The answers are those of
`seals.experiments.naming_benchmark.answers` on the engine's own linearisation, so that inference is
compared and not models. SEALS's answer is read from RESULTS/<case>/diagnosis.json, or from the case
itself; with ``--ours run`` the log is diagnosed. With ``--out`` every answer is written as
diagnosis.json, one folder a method; what is there already is not done again. Where pysindy is
installed, its sparse regression checks ours.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import multiprocessing
import os
import re
import sys
import time
import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

OURS = "SEALS"
HINDSIGHT = "STLSQ at"
CHECKED = "pysindy at"
SWEPT = (HINDSIGHT, CHECKED)
"""Beginnings of the names of sparse regression at one threshold, ours and pysindy's."""
MOST = 4
"""Names in a set of equivalent answers; a larger one says nothing."""
MEASURES = (
    ("clear", "right"),
    ("clear", "wrong"),
    ("weak", "right"),
    ("weak", "wrong"),
    ("sensor_only", "right"),
    ("sensor_only", "wrong"),
    ("null", "false alarm"),
    ("pairs", "right"),
    ("pairs", "one or both"),
    ("pairs", "wrong"),
    ("out_of_library", "none of these"),
    ("out_of_library", "wrong"),
    ("confounded", "right"),
    ("confounded", "wrong"),
    ("poor_excitation", "wrong"),
)
"""Rows of the table: level and outcome."""


class Case(NamedTuple):
    """One log with the answers of all methods.

    Args:
        name: path below the cases.
        truth: from truth.yaml.
        answers: by method, in the form of diagnosis.json.
    """

    name: str
    truth: Mapping[str, Any]
    answers: Mapping[str, Mapping[str, Any]]


def answered(cases: Path, out: Path | None, ours: str, folder: Path) -> Case:
    """Answer one case by every method."""
    warnings.simplefilter("ignore")
    name = str(folder.relative_to(cases))
    truth = yaml.safe_load((folder / "truth.yaml").read_text(encoding="utf-8"))
    kept = None if out is None else out / "baselines" / f"{name.replace('/', '-')}.json"
    if kept is not None and kept.exists():
        answers = json.loads(kept.read_text(encoding="utf-8"))
    else:
        answers = baselines(folder)
    own = None if ours == "run" else read_own(Path(ours) if ours else cases, folder, name)
    if ours == "run":
        own = answers.get(OURS) or diagnosed(folder)
    if own is not None:
        answers = {**answers, OURS: own}
    if kept is not None and out is not None:
        written(kept, answers)
        for method, answer in answers.items():
            label = re.sub(r"[^A-Za-z0-9]+", "_", method).strip("_")
            written(out / label / name / "diagnosis.json", answer)
    return Case(name, truth, answers)


def baselines(folder: Path) -> dict[str, dict[str, Any]]:
    """Run the classical methods; their times exclude the preparation of the log."""
    from seals.experiments.naming_benchmark.answers import (
        METHODS,
        THRESHOLDS,
        Question,
        sparse,
        stlsq_of_pysindy,
    )
    from seals.logs.native import read_native
    from seals.sysid.predictors.problem import prepare

    asked = Question.of(prepare(read_native(folder)))
    answers = {}
    for method, law in METHODS.items():
        begin = time.perf_counter()
        answers[method] = stated(law(asked), begin)
    for threshold in THRESHOLDS:
        begin = time.perf_counter()
        answers[f"{HINDSIGHT} {threshold:g}"] = stated(sparse(asked.table, threshold)[0], begin)
        if importlib.util.find_spec("pysindy"):
            begin = time.perf_counter()
            names = sparse(asked.table, threshold, stlsq_of_pysindy)[0]
            answers[f"{CHECKED} {threshold:g}"] = stated(names, begin)
    return answers


def stated(names: Sequence[str], begin: float) -> dict[str, Any]:
    """Names in the form of diagnosis.json."""
    return {
        "verdict": "named" if names else "nothing_missing",
        "effects": [{"name": name} for name in names],
        "ambiguous_with": [],
        "seconds": time.perf_counter() - begin,
    }


def diagnosed(folder: Path) -> dict[str, Any]:
    """Run the diagnosis of SEALS."""
    from seals.logs.native import read_native
    from seals.sysid.diagnosis import diagnose

    return diagnose(read_native(folder)).to_dict()


def read_own(results: Path, folder: Path, name: str) -> dict[str, Any] | None:
    """Read the answer of SEALS from a results folder, or from the folder of the log."""
    for path in (results / name / "diagnosis.json", folder / "diagnosis.json"):
        if path.exists():
            return json.loads(path.read_text(encoding="utf-8"))
    return None


def written(path: Path, answer: Mapping[str, Any]) -> None:
    """Write an answer."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(answer), encoding="utf-8")


def outcomes(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> set[str]:
    """Classify an answer: right, wrong, false alarm, one or both of two, none of these.

    The rules are those of the hidden-effect benchmark: a name counts as declared under the verdict
    ``named``; a wrong one is excused by a stated set of equivalent effects that holds the truth.
    """
    from seals.experiments.naming_benchmark.told import beside

    want = [e["name"] for e in truth["effects"]] if truth["in_library"] else []
    side = beside(set(want))
    names = [e["name"] for e in answer["effects"]]
    names = [n for k, n in enumerate(names) if n not in side or k == 0]
    named = answer["verdict"] in ("named", "ambiguous")
    declared = answer["verdict"] == "named" and bool(names)
    sets = [set(s) for s in answer.get("ambiguous_with") or [] if len(s) <= MOST]
    excused = {n for n in names if any(n in s and s & set(want) for s in sets)}
    strangers = set(names) - set(want)
    held = {
        "right": declared and bool(want) and sorted(names) == sorted(want),
        "wrong": declared and bool(strangers - excused),
        "false alarm": not want and named,
        "one or both": len(want) == 2
        and declared
        and bool(set(names) & set(want))
        and not strangers,
        "none of these": answer["verdict"] == "none_of_these",
    }
    return {word for word, holds in held.items() if holds}


def table(cases: Sequence[Case]) -> str:
    """Return every metric of every method, as counts and shares."""
    methods = [m for m in methods_of(cases) if not m.startswith(SWEPT)]
    best = hindsight(cases)
    methods[1:1] = [best] if best else []
    width = max(len(m) for m in methods) + 2
    lines = [f"{'level':16s} {'outcome':13s}" + "".join(f"{m:>{width}s}" for m in methods)]
    for level, word in MEASURES:
        chosen = [c for c in cases if c.truth["level"] == level]
        if chosen:
            cells = [count(chosen, m, word) for m in methods]
            lines.append(f"{level:16s} {word:13s}" + "".join(f"{c:>{width}s}" for c in cells))
    cells = [count(cases, m, "wrong") for m in methods]
    lines.append(f"{'all':16s} {'wrong':13s}" + "".join(f"{c:>{width}s}" for c in cells))
    cells = [named(cases, m) for m in methods]
    lines.append(f"{'all':16s} {'names a log':13s}" + "".join(f"{c:>{width}s}" for c in cells))
    cells = [seconds(cases, m) for m in methods]
    lines.append(f"{'all':16s} {'seconds':13s}" + "".join(f"{c:>{width}s}" for c in cells))
    return "\n".join(lines)


def methods_of(cases: Sequence[Case]) -> list[str]:
    """Return the methods with any answer."""
    return list(dict.fromkeys(m for c in cases for m in c.answers))


def hindsight(cases: Sequence[Case]) -> str:
    """Return the threshold of sparse regression with the most right answers, in hindsight."""
    swept = [m for m in methods_of(cases) if m.startswith(HINDSIGHT)]

    def rights(method: str) -> int:
        return sum("right" in outcomes(c.truth, c.answers[method]) for c in cases)

    return max(swept, key=rights, default="")


def agreement(cases: Sequence[Case]) -> str:
    """Return how often pysindy's sparse regression selects the same; empty without pysindy."""
    pairs = [
        (c.answers[m], c.answers[m.replace(CHECKED, HINDSIGHT)])
        for c in cases
        for m in c.answers
        if m.startswith(CHECKED)
    ]
    names = [[{e["name"] for e in answer["effects"]} for answer in pair] for pair in pairs]
    same = sum(a == b for a, b in names)
    return f"pysindy keeps the same effects in {same} of {len(names)} sweeps" if names else ""


def count(cases: Sequence[Case], method: str, word: str) -> str:
    """Count an outcome among the cases that a method answered."""
    found = [word in outcomes(c.truth, c.answers[method]) for c in cases if method in c.answers]
    return f"{sum(found)}/{len(found)} {100 * np.mean(found):3.0f} %" if found else "-"


def named(cases: Sequence[Case], method: str) -> str:
    """Mean number of names declared on a log."""
    found = [
        len(c.answers[method]["effects"]) * (c.answers[method]["verdict"] == "named")
        for c in cases
        if method in c.answers
    ]
    return f"{np.mean(found):.1f}" if found else "-"


def seconds(cases: Sequence[Case], method: str) -> str:
    """Median time of a method."""
    found = [c.answers[method]["seconds"] for c in cases if method in c.answers]
    return f"{np.median(found):.2f}" if found else "-"


def line(case: Case) -> str:
    """One case in one line."""
    true = "+".join(e["name"] for e in case.truth["effects"]) or "-"
    shown = []
    for method, answer in case.answers.items():
        if not method.startswith(SWEPT):
            names = [e["name"] for e in answer["effects"]]
            more = f" and {len(names) - 2} more" if len(names) > 2 else ""
            verdict = "" if answer["verdict"] == "named" else f"{answer['verdict']} "
            shown.append(f"{method}: {verdict}{', '.join(names[:2])}{more}".rstrip(": "))
    return f"{case.name} {case.truth['level']} [{true}] " + " | ".join(shown)


def chosen_cases(folder: Path, words: argparse.Namespace) -> list[Path]:
    """Return the folders with known truth, of the chosen vehicles."""
    found = sorted(path.parent for path in folder.rglob("truth.yaml"))
    if words.vehicles:
        truths = {f: yaml.safe_load((f / "truth.yaml").read_text(encoding="utf-8")) for f in found}
        found = [f for f in found if truths[f]["vehicle"] in words.vehicles.split(",")]
    return found[: words.limit]


def main(given: list[str] | None = None) -> int:
    """Run all methods and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("cases", type=Path)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--limit", type=int, help="cases at most")
    parser.add_argument("--vehicles", default="", help="comma-separated; all when left out")
    parser.add_argument("--ours", default="", help="folder of results, or run")
    parser.add_argument("--out", type=Path, help="folder for all answers")
    words = parser.parse_args(given)
    folders = chosen_cases(words.cases, words)
    if not folders:
        print(f"no truth.yaml below {words.cases}.\nGive a folder of cases with known truth.")
        return 2
    work = partial(answered, words.cases, words.out, words.ours)
    done = []
    with multiprocessing.Pool(words.processes, maxtasksperchild=8) as pool:
        for case in pool.imap_unordered(work, folders, chunksize=1):
            done.append(case)
            print(line(case), flush=True)
    print(f"\n{len(done)} logs\n{table(sorted(done))}")
    if agreement(done):
        print(agreement(done))
    return 0


if __name__ == "__main__":
    sys.exit(main())
