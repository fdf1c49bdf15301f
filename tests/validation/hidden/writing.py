"""Folders of finished cases: the table, the description, the truth and the arm's model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.validation.hidden import sensors
from tests.validation.hidden.batch import Flight
from tests.validation.hidden.cases import VERDICT, Case
from tests.validation.hidden.catalogue import unit_of
from tests.validation.hidden.commands import PAD
from tests.validation.hidden.plant import FULL_VOLTAGE, TOLERANCE, stated
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import GRAVITY, WATER, Vehicle

RELEASE_SIGMA = {
    "position": 0.005,
    "orientation": 0.01,
    "velocity": 0.02,
    "angular_velocity": 0.02,
}


def _plain(value: Any) -> Any:
    """Arrays and numpy numbers as plain lists and numbers."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    return value


def dump(path: Path, content: dict[str, Any]) -> None:
    """Write a YAML file in the order of the mapping."""
    text = yaml.safe_dump(_plain(content), sort_keys=False, default_flow_style=None, width=140)
    path.write_text(text, encoding="utf-8")


def _xyz(stem: str, value: Array) -> dict[str, float]:
    return {f"{stem}_{a}": float(x) for a, x in zip("xyz", value, strict=True)}


def baseline(vehicle: Vehicle) -> list[dict[str, Any]]:
    """Effects of the stated model with their parameters."""
    out: list[dict[str, Any]] = [{"name": "gravity"}]
    if vehicle.rotor:
        law = "T = k_T * omega^2, first-order lag on omega"
        out.append({"name": "rotor_thrust", "law": law})
    elif vehicle.count:
        out.append({"name": "thruster_force", "law": "F = cmd with first-order lag"})
    for name, value in (
        ("linear_drag", vehicle.air_linear),
        ("quadratic_drag", vehicle.air_quadratic),
    ):
        if value.any():
            out.append({"name": name, "medium": "air", "parameters": _xyz("coefficient", value)})
    if vehicle.water:
        out.append({"name": "buoyancy", "medium": "water"})
    if vehicle.kind == "crossing":
        out.append({"name": "thrust_in_water", "parameters": {"ratio": vehicle.water_ratio}})
    if vehicle.water_quadratic.any():
        drag = _xyz("coefficient", vehicle.water_quadratic)
        out.append({"name": "quadratic_drag", "medium": "water", "parameters": drag})
    if vehicle.angular_linear.any():
        spin = _xyz("coefficient", vehicle.angular_linear)
        if vehicle.angular_quadratic.any():
            spin |= _xyz("quadratic", vehicle.angular_quadratic)
        medium = "water" if vehicle.water else "any"
        out.append({"name": "angular_drag", "medium": medium, "parameters": spin})
    if vehicle.added.any():
        mass = _xyz("mass", vehicle.added[:3]) | _xyz("inertia", vehicle.added[3:])
        out.append({"name": "added_mass", "medium": "water", "parameters": mass})
    if vehicle.arm is not None:
        law = (
            "multibody dynamics of the arm, position controller, armature inertia, "
            "no friction, no backlash"
        )
        out.append({"name": "arm", "law": law})
    return out


def _actuators(vehicle: Vehicle) -> tuple[list[Any], list[Any]]:
    rotors, thrusters = [], []
    for i in range(vehicle.count):
        place = {"position": vehicle.positions[:, i], "axis": vehicle.axes[:, i]}
        if vehicle.rotor:
            rotors.append(
                place
                | {
                    "direction": int(vehicle.directions[i]),
                    "thrust_coefficient": vehicle.thrust,
                    "torque_coefficient": vehicle.torque,
                    "time_constant": vehicle.lag,
                    "max_speed": vehicle.limit,
                    "radius": vehicle.radius,
                }
            )
        else:
            thrusters.append(place | {"time_constant": vehicle.lag, "max_force": vehicle.limit})
    return rotors, thrusters


def _vehicle_entry(v: Vehicle) -> dict[str, Any]:
    """The vehicle's part of the description."""
    rotors, thrusters = _actuators(v)
    hull = None
    if v.primitives:
        hull = {
            "primitives": v.primitives,
            "displaced_volume": v.volume,
            "centre_of_buoyancy": v.centre_of_buoyancy,
            "plan_area": v.plan_area,
        }
    vehicle: dict[str, Any] = {
        "name": v.kind,
        "mass": v.mass,
        "inertia": np.diag(v.inertia),
        "centre_of_gravity": [0, 0, 0],
        "rotors": rotors,
        "thrusters": thrusters,
        "hull": hull,
        "arm": None if v.arm is None else v.arm.describe(),
        "battery": {"full_voltage": FULL_VOLTAGE} if v.battery else None,
    }
    if v.arm is not None:
        vehicle |= v.arm.base_entry()
    return vehicle


def describe(case: Case) -> dict[str, Any]:
    """The description that goes with a log."""
    v = case.vehicle
    out: dict[str, Any] = {
        "format": "hidden-effect-log",
        "format_version": 1,
        "vehicle": _vehicle_entry(v),
        "environment": {
            "gravity": [0, 0, -GRAVITY],
            "water_level": 0.0 if v.water else None,
            "tank_bottom": v.bottom,
            "ground_level": v.ground,
            "air_density": 1.2,
            "water_density": WATER,
        },
        "baseline": baseline(v),
        "sensors": {
            "imu": {"position": [0.0, 0.0, 0.0], "orientation": [1.0, 0.0, 0.0, 0.0]},
            "channels": {
                name: {"sigma": sigma, "rate": rate, "unit": sensors.UNITS[name]}
                for name, (sigma, rate) in sensors.CHANNELS[case.spec.kind].items()
            },
        },
        "tolerance": {
            name: {"sigma": TOLERANCE[name][0], "meaning": TOLERANCE[name][1]} for name in stated(v)
        },
    }
    return out | _facts(case)


def _facts(case: Case) -> dict[str, Any]:
    v = case.vehicle
    disturbance: dict[str, Any] = {
        "kind": "unmodelled gusts or swirl, zero mean, coloured",
        "force_sigma": v.gust_force,
        "torque_sigma": v.gust_torque,
        "correlation_time": 0.35,
        "accuracy": "within a factor of two",
    }
    if v.kind in {"drop", "crossing"}:
        disturbance["surface_ripple"] = "1 to 2 mm, wavelengths of 5 to 15 cm"
    known = ["gravity", "clock of the log", "body frame", "rotor and thruster positions and axes"]
    out: dict[str, Any] = {
        "disturbance": disturbance,
        "known_exactly": known + (["water_level"] if v.water else []),
    }
    if case.starts:
        out["initial_state"] = [
            {
                "segment": i,
                "position": s["position"],
                "orientation": s["orientation"],
                "velocity": [0.0, 0.0, 0.0],
                "angular_velocity": s["angular_velocity"],
                "sigma": RELEASE_SIGMA,
            }
            for i, s in enumerate(case.starts)
        ]
    return out


def truth(case: Case) -> dict[str, Any]:
    """What is hidden and how well a log can show it."""
    spec = case.spec
    out: dict[str, Any] = {
        "level": spec.level,
        "vehicle": spec.kind,
        "expected_verdict": VERDICT.get(spec.level, "named"),
        "in_library": spec.level != "out_of_library",
        "pattern": spec.pattern,
    }
    if spec.twin is not None:
        out["twins"] = [spec.twin]
    out["effects"] = [
        {
            "name": h.name,
            "parameters": {
                k: {"value": v, "unit": unit_of(h.name, k)} for k, v in h.values.items()
            },
            "scored_groups": h.groups,
            **_active(case),
            **h.facts,
        }
        for h in case.hidden
    ]
    out["detectability"] = case.found.get("detectability", {"excess_max": 0.0})
    out["accepted_by_level_rule"] = case.found.get("accepted", True)
    return out


def _active(case: Case) -> dict[str, Any]:
    """First and last moment of the effect in the column t, where it does not act throughout."""
    if case.active == (None, None):
        return {}
    first = case.found["first"]
    return {"active": [None if x is None else round(first + x, 4) for x in case.active]}


def table(flight: Flight, index: int, readings: dict[str, Array]) -> Any:
    """The log of one case as a data frame."""
    import pandas as pd

    case = flight.cases[index]
    rng = case.rng
    frames = []
    start = round(float(rng.uniform(0.0, 45.0)), 2)
    case.found["first"] = start
    for segment, member in enumerate(np.flatnonzero(flight.owner == index)):
        rows = flight.track.rows.shape[0] - flight.skip
        columns: dict[str, Array] = {"t": start + np.arange(rows) * flight.step}
        if case.starts:
            columns["segment"] = np.full(rows, float(segment))
        logged = flight.sent.logged[PAD + flight.skip :, member]
        columns |= _commands(case.vehicle, logged)
        values = {k: v[..., member] for k, v in readings.items()}
        rate = round(1.0 / flight.step)
        for name, value in sensors.measured(
            values, sensors.CHANNELS[case.spec.kind], rate, rng
        ).items():
            for i, column in enumerate(_columns(name, value.shape[1])):
                columns[column] = value[:, i]
        frames.append(pd.DataFrame(columns))
        start = round(start + rows * flight.step + float(rng.uniform(3.0, 8.0)), 2)
    out = pd.concat(frames, ignore_index=True)
    kinds = {c: "float32" for c in out.columns if c != "t"}
    if "segment" in kinds:
        kinds["segment"] = "int64"
    return out.astype(kinds)


def _commands(vehicle: Vehicle, logged: Array) -> dict[str, Array]:
    stem = "rotor_speed_cmd" if vehicle.rotor else "thruster_cmd"
    out = {f"{stem}_{i + 1}": logged[:, i] for i in range(vehicle.count)}
    for i in range(logged.shape[1] - vehicle.count):
        out[f"joint_position_cmd_{i + 1}"] = logged[:, vehicle.count + i]
    return out


def _columns(name: str, axes: int) -> list[str]:
    if name in {"depth", "battery_voltage"}:
        return [name]
    letters = "wxyz" if name == "orientation" else "xyz"
    if name == "joint_position":
        return [f"{name}_{i + 1}" for i in range(axes)]
    return [f"{name}_{a}" for a in letters]


def write(folder: Path, flight: Flight, index: int, readings: dict[str, Array]) -> None:
    """Write one case."""
    case = flight.cases[index]
    folder.mkdir(parents=True, exist_ok=True)
    table(flight, index, readings).to_parquet(folder / "log.parquet", index=False)
    dump(folder / "meta.yaml", describe(case))
    dump(folder / "truth.yaml", truth(case))
    if case.vehicle.arm is not None:
        (folder / "vehicle.urdf").write_text(case.vehicle.arm.urdf(case.vehicle), encoding="utf-8")
