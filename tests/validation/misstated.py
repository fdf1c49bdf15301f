"""Logs of the independent simulator whose data sheet is wrong by a known factor."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from seals.logs.log import Log
from seals.logs.native import read_native
from tests.validation.hidden import cases, generate

MOST = 0.5
"""Largest error of what is stated, as a share."""


def made(folder: Path, vehicle: str, count: int, seed: int) -> list[tuple[Log, dict[str, float]]]:
    """Simulate vehicles with nothing hidden; return their logs and true numbers by name.

    Args:
        folder: where the logs are written.
        vehicle: kind: ``quad`` or ``auv``.
        count: of vehicles.
        seed: of the set.
    """
    specs = generate.plan(count, seed, level="null", vehicle=vehicle, effect=None)
    assert generate.produce(specs, folder, seed, gains=False) == count
    return [
        (read_native(folder / f"g{k + 1:03d}"), _truth(cases.build(spec)))
        for k, spec in enumerate(specs)
    ]


def _truth(case: cases.Case) -> dict[str, float]:
    """True numbers of a case by their names in a calibration."""
    plant, vehicle = case.with_it, case.vehicle
    out = {"mass": float(plant["mass"])}
    for i, axis in enumerate("xyz"):
        out[f"inertia_{axis}{axis}"] = float(plant["inertia"][i])
        if vehicle.rotor:
            out[f"effects.linear_drag_air.coefficient_{axis}"] = float(plant["air_linear"][i])
        else:
            drag = float(plant["water_quadratic"][i])
            out[f"effects.quadratic_drag_water.coefficient_{axis}"] = drag
            out[f"effects.added_mass_water.mass_{axis}"] = float(plant["added"][i])
    if vehicle.rotor:
        torque = np.abs(plant["act_torque"]).mean()
        out["actuators.rotors.thrust_coefficient"] = float(
            plant["act_common"] * plant["act_gain"].mean()
        )
        out["actuators.rotors.torque_coefficient"] = float(torque)
    else:
        out["hulls.base.displaced_volume"] = float(plant["volume"])
    return out


def misstated(log: Log, factors: Mapping[str, float]) -> Log:
    """Return a log whose data sheet states some numbers times a factor.

    Args:
        log: with a data sheet within its tolerances.
        factors: by the name of the number in a calibration.
    """
    meta: dict[str, Any] = copy.deepcopy(dict(log.meta))
    vehicle = meta["vehicle"]
    for name, factor in factors.items():
        section, _, rest = name.partition(".")
        if name == "mass":
            vehicle["mass"] *= factor
        elif name.startswith("inertia_"):
            i = "xyz".index(name[-1])
            vehicle["inertia"][i][i] *= factor
        elif section == "hulls":
            vehicle["hull"]["displaced_volume"] *= factor
        elif section == "actuators":
            kind, _, field = rest.partition(".")
            for one in vehicle[kind]:
                one[field] *= factor
        else:
            instance, _, field = rest.partition(".")
            entries = [e for e in meta["baseline"] if f"{e['name']}_{e.get('medium')}" == instance]
            entries[0]["parameters"][field] *= factor
    return replace(log, meta=meta)


def drawn(truth: Mapping[str, float], rng: np.random.Generator, count: int) -> dict[str, float]:
    """Draw some numbers and the factors by which they are misstated.

    The true number differs from what is stated by up to half of the stated one.
    """
    names = [n for n, value in truth.items() if value]
    chosen = rng.choice(names, size=count, replace=False)
    error = rng.uniform(0.15, MOST, count) * rng.choice([-1.0, 1.0], count)
    return {str(n): float(1.0 / (1.0 + e)) for n, e in zip(chosen, error, strict=True)}
