"""Success rate of diagnosis and calibration on cases with robot folders and several logs.

    python -m benchmarks.wild CASES OUT --processes 2 [--level clear] [--limit 12]
    python -m benchmarks.wild CASES OUT --score-only [--scorer SCRIPT]

Every case leaves its answer in OUT; what is there already is not done again. The table counts as
the contract of the cases does; `--scorer` runs a script of the same purpose over the same answers.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import subprocess
import sys
import time
import traceback
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
LEVELS = ("null", "clear", "onset", "pairs", "data_sheet", "outside", "calibrate")
MOST = 4
"""Names in a set that still says something."""
WITHIN = 0.3
"""Error of a start or an end that counts as found [s]."""

Case = dict[str, Any]


def run(job: tuple[Path, Path]) -> str:
    """Diagnose or calibrate one case."""
    case, out = job
    warnings.simplefilter("ignore")
    question = yaml.safe_load((case / "question.yaml").read_text(encoding="utf-8"))
    name = "calibration.json" if question["ask"] == "calibrate" else "diagnosis.json"
    place = out / case.name
    if (place / name).exists():
        return f"{case.name} there"
    place.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    try:
        answer = answered(case, question)
    except Exception:  # one broken case must not end the others
        (place / "failed.txt").write_text(traceback.format_exc(), encoding="utf-8")
        return f"{case.name} FAILED: {traceback.format_exc().strip().splitlines()[-1]}"
    taken = time.perf_counter() - begin
    answer["seconds_per_log"] = taken / len(list((case / "logs").iterdir()))
    (place / name).write_text(json.dumps(answer), encoding="utf-8")
    (place / "failed.txt").unlink(missing_ok=True)
    names = ", ".join(e["name"] for e in answer.get("effects", []))
    return f"{case.name} {answer.get('verdict', 'calibrated')} [{names}] {taken:.1f} s"


def answered(case: Path, question: dict[str, Any]) -> dict[str, Any]:
    """The answer of the package to one case."""
    from seals.logs.native import read_native
    from seals.sysid.data.robot_description import describe_robot
    from seals.sysid.diagnosis import diagnose

    robot = describe_robot(str(case / "robot"))
    logs = [read_native(p) for p in sorted((case / "logs").iterdir())]
    if question["ask"] != "calibrate":
        return diagnose(logs, robot=robot).to_dict()
    from seals.sysid.calibration.calibration import calibrated

    held = read_native(case / "held_out" / "h")
    return calibrated(logs, question["parameters"], robot=robot, held_out=held).to_dict()


def read(path: Path) -> dict[str, Any]:
    """Read an answer; empty where there is none."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def judged(truth: Case, found: Case, calibration: Case) -> str:
    """One word for the answer to a naming case: right, half, wrong, abstained or missing."""
    verdict = found.get("verdict")
    if verdict is None:
        return "missing"
    names = [e["name"] for e in found["effects"]] if verdict in {"named", "ambiguous"} else []
    sets = [set(s) for s in found.get("ambiguous_with") or [] if len(s) <= MOST]
    if truth["level"] == "null":
        alarm = verdict in {"named", "ambiguous", "none_of_these"}
        return "right" if verdict == "nothing_missing" else "wrong" if alarm else "abstained"
    if truth["level"] == "outside":
        return {"none_of_these": "right", "cannot_tell": "right", "bad_data": "abstained"}.get(
            verdict, "wrong"
        )
    if truth["level"] == "data_sheet":
        return _sheet(truth, verdict, names, sets, calibration)
    return _named([e["name"] for e in truth["effects"]], verdict, names, sets)


def _sheet(
    truth: Case, verdict: str, names: list[str], sets: list[set[str]], calibration: Case
) -> str:
    accept, allow = set(truth["accept"]), set(truth["allow"])
    if any(_found(calibration, key, value) for key, value in truth["sheet"].items()):
        return "right"
    claimed = set(names).union(*(s for s in sets if s & set(names)))
    if not names:
        return "wrong" if verdict == "nothing_missing" else "abstained"
    single = verdict == "named" and claimed == set(names)
    if single:
        good = set(names) <= allow and bool(set(names) & accept)
        best = "right" if truth.get("single_name_ok") else "half"
        return best if good else "wrong"
    if not claimed & accept or len(claimed) > MOST:
        return "wrong"
    return "right" if claimed <= allow else "half"


def _found(calibration: Case, key: str, value: float) -> bool:
    """Whether a calibration holds the true number, near enough."""
    got = calibration.get("parameters", {}).get(key)
    near = bool(got) and abs(got["value"] - value) <= 0.05 * abs(value)
    return near and bool(got["low90"] <= value <= got["high90"])


def _named(want: list[str], verdict: str, names: list[str], sets: list[set[str]]) -> str:
    from seals.experiments.naming_benchmark.told import beside

    aside = beside(set(want))
    claimed = {n for i, n in enumerate(names) if i == 0 or n not in aside}
    if verdict == "named" and claimed:
        if claimed == set(want):
            return "right"
        excused = set(want).union(*(s for s in sets if s & set(want)))
        return "half" if claimed <= excused else "wrong"
    if verdict == "ambiguous":
        whole = claimed.union(*sets)
        return "half" if set(want) <= whole and len(claimed) <= MOST else "abstained"
    return "wrong" if verdict == "nothing_missing" else "abstained"


def errors(truth: Case, found: Case) -> tuple[list[float], list[bool]]:
    """Relative errors of the scored groups of named effects, and whether the intervals hold."""
    off, held = [], []
    if found.get("verdict") in {"named", "ambiguous"}:
        named = {e["name"]: e["parameters"] for e in reversed(found["effects"])}
        for effect in truth["effects"]:
            got = named.get(effect["name"], {})
            for group in effect["scored_groups"] or []:
                if not set(group) <= set(got):
                    continue
                true = {p: effect["parameters"][p]["value"] for p in group}
                gap = [got[p]["value"] - true[p] for p in group]
                off.append(float(np.linalg.norm(gap) / np.linalg.norm(list(true.values()))))
                held += [got[p]["low90"] <= true[p] <= got[p]["high90"] for p in group]
    return off, held


def onsets(truth: Case, found: Case) -> list[float]:
    """Error of every start and end in a fitted log [s]; infinite where none was found."""
    out = []
    named = {e["name"]: e for e in reversed(found.get("effects") or [])}
    for effect in truth["effects"]:
        said = {a["log"]: a for a in named.get(effect["name"], {}).get("active") or []}
        for log, span in (effect.get("active") or {}).items():
            for key, true in zip(("start", "end"), span, strict=True):
                if true is None or log == "h":
                    continue
                got = (said.get(log) or {}).get(key)
                out.append(abs(got["value"] - true) if got else float("inf"))
    return out


def calibrated_errors(truth: Case, found: Case) -> tuple[list[float], list[bool]]:
    """Relative errors of the asked parameters, and whether the intervals hold."""
    off, held = [], []
    for name, entry in truth["calibration"].items():
        got = found.get("parameters", {}).get(name)
        off.append(abs(got["value"] / entry["value"] - 1.0) if got else float("inf"))
        if got:
            held.append(got["low90"] <= entry["value"] <= got["high90"])
    return off, held


def lines(cases: Iterable[Path], out: Path, *, every: bool) -> list[str]:
    """The table by level; with `every`, a line for each case first."""
    rows: list[Case] = []
    for case in cases:
        truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
        answer = read(out / case.name / "diagnosis.json")
        numbers = read(out / case.name / "calibration.json")
        row: Case = {"case": case.name, "level": truth["level"], "vehicle": truth["vehicle"]}
        if truth["level"] == "calibrate":
            off, held = calibrated_errors(truth, numbers)
            word = "right" if all(x <= 0.1 for x in off) else "wrong" if numbers else "missing"
            times: list[float] = []
        else:
            word = judged(truth, answer, numbers)
            (off, held), times = errors(truth, answer), onsets(truth, answer)
        said = [e["name"] for e in answer.get("effects", [])]
        want = [e["name"] for e in truth["effects"]] or list(truth.get("calibration", {}))
        row |= {"word": word, "off": off, "held": held, "times": times, "want": want, "said": said}
        row["verdict"] = answer.get("verdict", "-")
        row["seconds"] = (answer or numbers).get("seconds_per_log")
        rows.append(row)
    text = [_line(r) for r in rows] if every else []
    return text + [
        _level(n, [r for r in rows if n in {r["level"], "all"}]) for n in (*LEVELS, "all")
    ]


def _line(r: Case) -> str:
    said = "+".join(r["said"]) or "-"
    far = " ".join(f"{100 * x:.1f}%" for x in r["off"]) + " ".join(f" {t:.2f}s" for t in r["times"])
    head = f"{r['case']} {r['level']:10s} {r['vehicle']:10s} {'+'.join(r['want']) or '-':34s}"
    return f"{head} {r['verdict']:15s} {said:34s} {r['word']:9s} {far}"


def _level(name: str, rows: list[Case]) -> str:
    if not rows:
        return f"{name:10s}   0"
    words = [r["word"] for r in rows]
    shares = " ".join(
        f"{w} {100 * words.count(w) / len(words):5.1f} %"
        for w in ("right", "half", "wrong", "abstained", "missing")
    )
    off = [x for r in rows for x in r["off"]]
    held = [x for r in rows for x in r["held"]]
    times = [x for r in rows for x in r["times"]]
    seconds = [r["seconds"] for r in rows if r["seconds"]]
    parts = [f"{name:10s} {len(rows):3d}  {shares}"]
    if off:
        parts.append(f"off {100 * np.median(off):.1f} %, covered {100 * np.mean(held):.0f} %")
    if times and name != "clear":
        parts.append(f"times within {WITHIN} s {100 * np.mean(np.array(times) <= WITHIN):.0f} %")
    if seconds:
        parts.append(f"{np.median(seconds):.1f} s a log, most {max(seconds):.1f}")
    return " | ".join(parts)


def main(words: list[str] | None = None) -> int:
    """Answer the cases that have no answer yet, then print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("cases", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--level", nargs="*", choices=LEVELS)
    parser.add_argument("--vehicle", nargs="*")
    parser.add_argument("--limit", type=int, help="most cases of each level")
    parser.add_argument("--score-only", action="store_true")
    parser.add_argument("--every", action="store_true", help="a line for each case")
    parser.add_argument("--scorer", type=Path, help="script to run over the same answers")
    chosen = parser.parse_args(words)
    cases, count = [], dict.fromkeys(LEVELS, 0)
    for place in sorted(p.parent for p in chosen.cases.glob("*/truth.yaml")):
        truth = yaml.safe_load((place / "truth.yaml").read_text(encoding="utf-8"))
        level, vehicle = truth["level"], truth["vehicle"]
        if level not in (chosen.level or LEVELS) or vehicle not in (chosen.vehicle or [vehicle]):
            continue
        count[level] += 1
        if chosen.limit is None or count[level] <= chosen.limit:
            cases.append(place)
    if not chosen.score_only:
        with multiprocessing.Pool(chosen.processes, maxtasksperchild=2) as pool:
            for line in pool.imap_unordered(run, [(c, chosen.out) for c in cases], chunksize=1):
                print(line, flush=True)
    print("\n".join(lines(cases, chosen.out, every=chosen.every)))
    if chosen.scorer is not None:
        command = [sys.executable, str(chosen.scorer), str(chosen.cases), str(chosen.out)]
        return subprocess.run([*command, "--cases"], check=False).returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
