"""Diagnosis of hidden effects on every shipped robot and animal, in all media.

    python -m benchmarks.shipped OUT [--robots auv box] [--effects none payload] [--most 2]
    python -m benchmarks.shipped OUT --table-only

Every case is two runs with the same hidden effect, or with none. The first is diagnosed by what
a robot carries: a measured pose, inertial sensors, joints and the battery's voltage, with noise.
What is found is added, and verified on the second. Each case leaves a folder in OUT and is not done
again; after each of them the table in OUT is written anew, as `shipped.md` and `shipped.json`.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import shutil
import sys
import time
import traceback
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shipped_runs import SCENES, Scene, hidden, truth
from benchmarks.wild import judged

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
NONE = "none"
RATE = 100.0
"""Rate of pose and inertial sensors [Hz]."""
SENSORS = (
    "+sensor@sensors.odometry=odometry",
    f"sensors.odometry.rate={RATE}",
    f"sensors.imu.rate={RATE}",
)
MEASURED = {
    "estimated_position": ("position", "xyz", "position_noise"),
    "estimated_orientation": ("orientation", "wxyz", "attitude_noise"),
    "angular_velocity": ("angular_velocity", "xyz", ""),
    "specific_force": ("specific_force", "xyz", ""),
}
"""Readings of a run, the channel each measures, its letters, and its noise where not stated."""
NOISE = {"position_noise": 1e-3, "attitude_noise": 2e-3}
SETTLED = 1.0
"""Time from which on a flight is recorded: drives and joints have found their place [s]."""
ENCODER = 1e-3
"""Noise of measured joints [rad]."""
VOLTS = 0.02
"""Noise of the battery's voltage [V]."""

Row = dict[str, Any]


def main(words: Sequence[str] | None = None) -> int:
    """Run the cases that have no answer yet, then print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--robots", nargs="*", help="robots, or a robot and a medium: aam_water")
    parser.add_argument("--effects", nargs="*", help="hidden effects, 'none' among them")
    parser.add_argument("--most", type=int, default=5, help="effects of each robot and medium")
    parser.add_argument("--seconds", type=float, default=6.0, help="length of a run")
    parser.add_argument("--table-only", action="store_true")
    chosen = parser.parse_args(words)
    chosen.out.mkdir(parents=True, exist_ok=True)
    for scene in () if chosen.table_only else SCENES:
        if chosen.robots and not {scene.robot, scene.name} & set(chosen.robots):
            continue
        for effect in (NONE, *scene.effects[: chosen.most]):
            if chosen.effects and effect not in chosen.effects:
                continue
            place = chosen.out / f"{scene.name}_{effect}"
            if not (place / "row.json").exists():
                row = case(scene, effect, place, seconds=chosen.seconds)
                print(" ".join((*_cells(row), str(row.get("refused", "")))), flush=True)
                table(chosen.out)
    print(table(chosen.out), end="")
    return 0


def case(scene: Scene, effect: str, place: Path, *, seconds: float) -> Row:
    """Simulate, diagnose, add and verify one case; leave its row in its folder."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    warnings.simplefilter("ignore")
    begin = time.perf_counter()
    row: Row = {"robot": scene.robot, "medium": scene.medium, "effect": effect}
    try:
        row |= _found(scene, effect, place, seconds)
    except Exception:  # one broken case must not end the others
        (place / "failed.txt").write_text(traceback.format_exc(), encoding="utf-8")
        last = traceback.format_exc().strip().splitlines()[-1]
        row |= {"word": "failed", "verdict": "-", "names": [], "refused": last}
    row["seconds"] = time.perf_counter() - begin
    (place / "row.json").write_text(json.dumps(row, indent=1), encoding="utf-8")
    return row


def _found(scene: Scene, effect: str, place: Path, seconds: float) -> Row:
    more = [] if effect == NONE else hidden(scene, effect)
    logs = []
    for seed, (name, course) in enumerate((("first", scene.first), ("second", scene.second))):
        run = place / name
        words = [*scene.words, *SENSORS, *course, *more, f"seed={seed}"]
        code, said = seals("run", *words, f"time.duration={seconds}", f"hydra.run.dir={run}")
        if code:
            return {"word": "no run", "verdict": "-", "names": [], "refused": said}
        logs.append(measured(run, place / f"{name}_measured", seed))
        shutil.rmtree(run)
    begin = time.perf_counter()
    code, said = seals(
        "diagnose", f"log={logs[0]}", f"out={place / 'answer'}", "report=false", "processes=1",
        "plan=false",
    )  # fmt: skip
    if code == 2:
        return {"word": "refused", "verdict": "-", "names": [], "refused": said}
    if not (place / "answer" / "diagnosis.json").is_file():
        return {"word": "failed", "verdict": "-", "names": [], "refused": f"exit {code}: {said}"}
    answer = json.loads((place / "answer" / "diagnosis.json").read_text(encoding="utf-8"))
    row = scored(scene, effect, answer)
    row["diagnosis_seconds"] = time.perf_counter() - begin
    if row["verdict"] == "named":
        row |= _verified(place, logs[1])
    return row


def _verified(place: Path, second: Path) -> Row:
    """Add what was named, and verify it on the run that no fit saw."""
    model = place / "model.yaml"
    folder = [f"folder={place}", "name=model"]
    code, said = seals("add", f"diagnosis={place / 'answer'}", *folder)
    if code:
        return {"refused": f"add: {said}"}
    code, said = seals("verify", f"log={second}", f"model={model}", f"out={place / 'proof'}")
    if code == 2:
        return {"refused": f"verify: {said}"}
    proof = json.loads((place / "proof" / "verify.json").read_text(encoding="utf-8"))
    steps = [float(v["misfit"]) for v in proof["rungs"]]
    return {"before": steps[0], "after": steps[-1], "verified": code == 0}


def scored(scene: Scene, effect: str, answer: Row) -> Row:
    """Return verdict, names and parameter error of an answer."""
    want = [] if effect == NONE else [{"name": effect, "parameters": {}}]
    names = [e["name"] for e in answer["effects"]]
    row: Row = {
        "word": judged({"level": "clear" if want else "null", "effects": want}, answer, {}),
        "verdict": answer["verdict"],
        "names": names,
        "reasons": answer.get("reasons", []),
    }
    true = {} if effect == NONE else truth(scene, effect)
    found = next((e["parameters"] for e in answer["effects"] if e["name"] == effect), {})
    both = [k for k in true if k in found and k != "rotor"]
    if both:
        off = [found[k]["value"] - true[k] for k in both]
        row["off"] = float(np.linalg.norm(off) / np.linalg.norm([true[k] for k in both]))
    if answer["verdict"] == "bad_data":
        row |= {"word": "refused", "refused": "; ".join(row["reasons"])}
    return row


def measured(run: Path, place: Path, seed: int) -> Path:
    """Write the measured log of a run: what is measured, with noise, without true values."""
    from seals.logs.native import read_native, write_native

    log, rng = read_native(run), np.random.default_rng(seed)
    # rows as often as there are readings and commands
    log = log.select(slice(None, None, max(1, round(1.0 / (RATE * _step(log))))))
    if any("_cmd" in k for k in log.columns):
        log = log.select(log.time >= SETTLED)
    columns = {k: v for k, v in log.columns.items() if k == "t" or "_cmd" in k}
    told = log.meta["sensors"]["channels"]
    channels: Row = {}
    for reading, (name, letters, noise) in MEASURED.items():
        for letter in letters:
            columns[f"{name}_{letter}"] = log.columns[f"{reading}_{letter}"]
        sigma = NOISE[noise] if noise else told[reading]["sigma"]
        channels[name] = {"rate": RATE, "sigma": sigma}
    joints = [k for k in log.columns if k.startswith("joint_position_") and "_cmd" not in k]
    for key in joints:
        columns[key] = log.columns[key] + ENCODER * rng.standard_normal(log.rows)
        channels["joint_position"] = {"rate": 1.0 / _step(log), "sigma": ENCODER}
    if "battery_voltage" in log.columns:
        noise = VOLTS * rng.standard_normal(log.rows)
        columns["battery_voltage"] = log.columns["battery_voltage"] + noise
        channels["battery_voltage"] = {"rate": 1.0 / _step(log), "sigma": VOLTS}
    sensors = {**log.meta["sensors"], "channels": channels}
    meta = {k: v for k, v in log.meta.items() if k not in ("known_exactly", "sensors")}
    write_native(replace(log, columns=columns, meta={**meta, "sensors": sensors}), place)
    shutil.copytree(run / ".hydra", place / ".hydra")
    shutil.copy(run / "run.json", place / "run.json")
    return place


def _step(log: Any) -> float:
    return float(np.median(np.diff(log.time)))


def seals(*words: str) -> tuple[int, str]:
    """Return the exit code of a command and its standard error output."""
    from seals.cli.main import main as command

    said, told = io.StringIO(), io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(told):
        code = int(command(list(words)) or 0)
    lines = [line for line in said.getvalue().replace("\r", "\n").splitlines() if "Error" in line]
    return code, " ".join(lines or said.getvalue().split()[-30:])


def table(out: Path) -> str:
    """Write the table of all cases in a folder, and return it."""
    rows = [json.loads(p.read_text(encoding="utf-8")) for p in out.glob("*/row.json")]
    rank = {s.name: k for k, s in enumerate(SCENES)}
    rows.sort(key=lambda r: (rank[f"{r['robot']}_{r['medium']}"], r["effect"] != NONE, r["effect"]))
    (out / "shipped.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")
    head = ("robot", "medium", "hidden", "answer", "names", "word", "off", "error of another run")
    lines = [f"| {' | '.join((*head, 's'))} |", "|" + "---|" * (len(head) + 1)]
    lines += [f"| {' | '.join(_cells(r))} |" for r in rows]
    words = [r["word"] for r in rows]
    asked = [w for w in words if w not in ("refused", "no run")]
    shares = ", ".join(
        f"{w} {100 * asked.count(w) / max(len(asked), 1):.0f} %"
        for w in ("right", "half", "wrong", "abstained", "failed")
    )
    lines += ["", f"{len(asked)} answers: {shares}; {len(words) - len(asked)} refused.", ""]
    refused = {(r["robot"], r["medium"], r["refused"]) for r in rows if r.get("refused")}
    lines += [f"- {robot}, {medium}: {said}" for robot, medium, said in sorted(refused)]
    text = "\n".join(lines) + "\n"
    (out / "shipped.md").write_text(text, encoding="utf-8")
    return text


def _cells(r: Row) -> list[str]:
    off = f"{100 * r['off']:.0f} %" if "off" in r else ""
    fell = f"{r['before']:.3g} -> {r['after']:.3g}" if "before" in r else ""
    fell += " withdrawn" if r.get("verified") is False else ""
    names = "+".join(r["names"])
    return [r["robot"], r["medium"], r["effect"], r["verdict"], names, r["word"], off, fell,
            f"{r['seconds']:.0f}"]  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
