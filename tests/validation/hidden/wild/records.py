"""Folders of finished cases: robot, logs, question and truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.hidden import sensors
from tests.validation.hidden.catalogue import unit_of
from tests.validation.hidden.commands import PAD
from tests.validation.hidden.plant import FULL_VOLTAGE, TOLERANCE, stated
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import GRAVITY, WATER, six
from tests.validation.hidden.wild import folder
from tests.validation.hidden.wild.cases import Case, Log
from tests.validation.hidden.wild.crew import Crew
from tests.validation.hidden.wild.manoeuvres import RELEASE
from tests.validation.hidden.writing import _columns, _commands, dump

EXPECTED = {
    "null": ["nothing_missing"],
    "outside": ["none_of_these", "cannot_tell"],
    "data_sheet": ["ambiguous", "named"],
    "calibrate": [],
}
GAP = 3.0  # seconds between the segments of a log


def meta(case: Case, log: Log, skip: int) -> dict[str, Any]:
    """The description that goes with one log."""
    v, step = case.stated.vehicle, case.spec.step
    channels = case.robot.channels | ({"battery_voltage": (0.01, 1)} if v.battery else {})
    baseline = []
    if case.robot.waves is not None:
        rate = 2.0 * np.pi / case.robot.waves["period"]
        phase = np.mod(log.phase + rate * (log.origin - skip * step), 2.0 * np.pi)
        waves = case.robot.waves | {"phase": six(phase)}
        baseline.append({"name": "waves", "medium": "water", "parameters": waves})
    out: dict[str, Any] = {
        "format": "hidden-effect-log",
        "format_version": 1,
        "environment": {
            "gravity": [0, 0, -GRAVITY],
            "water_level": 0.0 if v.water else None,
            "tank_bottom": v.bottom,
            "ground_level": v.ground,
            "air_density": 1.2,
            "water_density": WATER,
        },
        "baseline": baseline,
    }
    if v.battery:
        out["battery"] = {"full_voltage": FULL_VOLTAGE}
    out["sensors"] = {
        "imu": {"position": v.imu, "orientation": [1.0, 0.0, 0.0, 0.0]},
        "channels": {
            name: {"sigma": s, "rate": six(1.0 / (every * step)), "unit": sensors.UNITS[name]}
            for name, (s, every) in channels.items()
        },
    }
    out["tolerance"] = {
        n: {"sigma": TOLERANCE[n][0], "meaning": TOLERANCE[n][1].replace(" and the gripper", "")}
        for n in stated(v)
    }
    return out | _facts(case, log)


def _facts(case: Case, log: Log) -> dict[str, Any]:
    v = case.robot.vehicle
    out: dict[str, Any] = {
        "disturbance": {
            "kind": "unmodelled gusts or swirl, zero mean, coloured",
            "force_sigma": v.gust_force,
            "torque_sigma": v.gust_torque,
            "correlation_time": 0.35,
            "accuracy": "within a factor of two",
        },
        "known_exactly": [
            *("gravity", "clock of the log", "body frame"),
            "places and axes of rotors and thrusters",
            *(["water_level"] if v.water else []),
        ],
    }
    if v.primitives and (not v.count or case.spec.family == "boat"):
        out["disturbance"]["surface_ripple"] = "1 to 2 mm, wavelengths of 5 to 15 cm"
    if case.spec.family == "projectile":
        out["initial_state"] = [
            {
                "segment": i,
                "position": s["position"],
                "orientation": s["orientation"],
                "velocity": s["velocity"],
                "angular_velocity": s["angular_velocity"],
                "sigma": RELEASE,
            }
            for i, s in enumerate(log.starts)
        ]
    return out


def table(crew: Crew, members: list[int], readings: list[dict[str, Array]]) -> Any:
    """The columns of one log: its segments one after the other."""
    import pyarrow as pa

    parts: list[dict[str, Array]] = []
    log = crew.members[members[0]].log
    start = log.origin
    for k in members:
        logged = crew.sent.logged[PAD + crew.skip :, k]
        rows = logged.shape[0]
        columns: dict[str, Array] = {"t": start + np.arange(rows) * crew.step}
        if len(members) > 1:
            columns["segment"] = np.full(rows, crew.members[k].segment, dtype=np.int64)
        columns |= _commands(crew.cases[crew.owner[k]].robot.vehicle, logged)
        for name, value in readings[k].items():
            for i, column in enumerate(_columns(name, value.shape[1])):
                columns[column] = value[:, i]
        parts.append(columns)
        start = round(start + rows * crew.step + GAP, 3)
    whole = {c: np.concatenate([p[c] for p in parts]) for c in parts[0]}
    return pa.table(
        {c: v if c in {"t", "segment"} else v.astype(np.float32) for c, v in whole.items()}
    )


def truth(case: Case) -> dict[str, Any]:
    """What is hidden, when, and how loud it is."""
    spec = case.spec
    origins = {log.name: log.origin for log in case.logs}
    out: dict[str, Any] = {
        "level": spec.level,
        "vehicle": spec.family,
        "ask": "calibrate" if spec.level == "calibrate" else "name",
    }
    out["effects"] = [
        {
            "name": h.name,
            "parameters": {
                k: {"value": v, "unit": unit_of(h.name, k)} for k, v in h.values.items()
            },
            "scored_groups": h.groups,
            **h.facts,
            "active": {
                log: [None if t is None else round(origins[log] + t, 3) for t in span]
                for log, span in active.items()
            },
        }
        for h, active in zip(case.hidden, case.active, strict=True)
    ]
    out |= case.truth
    out["expected"] = EXPECTED.get(spec.level, ["named"])
    short = {"angular_velocity": "gyro", "specific_force": "acc", "joint_position": "joint"}
    out["check"] = {
        "misfit_over_floor": {short.get(k, k): six(v) for k, v in case.found["misfit"].items()},
        "each": [six(v) for v in case.found["each"]],
    }
    out["strength"] = six(spec.size)
    return out


def write(home: Path, crew: Crew, index: int, readings: list[dict[str, Array]]) -> None:
    """Write one case."""
    import pyarrow.parquet as pq

    case = crew.cases[index]
    folder.write(home / "robot", case.stated)
    for log in case.logs:
        place = home / ("held_out" if log.name == "h" else "logs") / log.name
        place.mkdir(parents=True, exist_ok=True)
        members = [k for k, m in enumerate(crew.members) if m.owner == index and m.log is log]
        data = table(crew, members, readings)
        pq.write_table(data, place / "log.parquet", compression="zstd", compression_level=9)
        dump(place / "meta.yaml", meta(case, log, crew.skip))
    question: dict[str, Any] = {"ask": "name"}
    if "calibration" in case.truth:
        question = {"ask": "calibrate", "parameters": list(case.truth["calibration"])}
    dump(home / "question.yaml", question)
    dump(home / "truth.yaml", truth(case))
