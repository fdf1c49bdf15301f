"""Flies proposed manoeuvres with the independent generator and diagnoses what comes out.

As a command: ``python -m tests.validation.replanned CASES_DIR [--seeds N]`` takes every confounded
case of a folder, plans with its log, flies the proposal with the hidden effect of its truth, and
says whether the effect is named.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import yaml

from seals.logs.native import read_native
from seals.sysid.diagnosis import Diagnosis, diagnose
from seals.sysid.experiment_design.manoeuvres import Manoeuvre
from seals.sysid.experiment_design.plan import Plan
from seals.sysid.experiment_design.ranking import propose
from seals.sysid.experiment_design.scene import Scene
from seals.sysid.predictors.problem import prepare
from tests.validation.hidden import batch, catalogue, plant, writing
from tests.validation.hidden.cases import Case, Spec
from tests.validation.hidden.catalogue import Hidden
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import Vehicle

Reference = Callable[[float], Array]
_DIFFERENCE = 0.02


def vehicle_of(meta: dict[str, Any]) -> Vehicle:
    """The generator's vehicle that a log describes (no arm)."""
    v, around = meta["vehicle"], meta["environment"]
    units = v["rotors"] or v["thrusters"]
    table = {(e["name"], e.get("medium")): e.get("parameters", {}) for e in meta["baseline"]}

    def three(name: str, medium: str, stem: str = "coefficient") -> Array:
        found = table.get((name, medium), {})
        return np.array([found.get(f"{stem}_{a}", 0.0) for a in "xyz"], dtype=float)

    rotor, hull = bool(v["rotors"]), v["hull"]
    spin = "water" if around["water_level"] is not None else "any"
    first = units[0]
    added = np.concatenate(
        [three("added_mass", "water", "mass"), three("added_mass", "water", "inertia")]
    )
    return Vehicle(
        kind=v["name"],
        mass=v["mass"],
        inertia=np.diag(v["inertia"]).astype(float),
        positions=np.array([u["position"] for u in units], dtype=float).T,
        axes=np.array([u["axis"] for u in units], dtype=float).T,
        directions=np.array([u.get("direction", 0) for u in units], dtype=float),
        thrust=first.get("thrust_coefficient", 1.0),
        torque=first.get("torque_coefficient", 0.0),
        lag=first["time_constant"],
        limit=first["max_speed" if rotor else "max_force"],
        radius=first.get("radius", 0.1),
        primitives=[] if hull is None else hull["primitives"],
        volume=0.0 if hull is None else hull["displaced_volume"],
        centre_of_buoyancy=np.zeros(3) if hull is None else np.array(hull["centre_of_buoyancy"]),
        plan_area=0.0 if hull is None else hull["plan_area"],
        air_linear=three("linear_drag", "air"),
        air_quadratic=three("quadratic_drag", "air"),
        water_quadratic=three("quadratic_drag", "water"),
        angular_linear=three("angular_drag", spin),
        angular_quadratic=three("angular_drag", spin, "quadratic"),
        added=added,
        water_ratio=table.get(("thrust_in_water", None), {}).get("ratio", 1.0),
        ground=around["ground_level"],
        water=around["water_level"] is not None,
        bottom=around["tank_bottom"],
        gust_force=meta["disturbance"]["force_sigma"],
        gust_torque=meta["disturbance"]["torque_sigma"],
    )


def hidden_of(truth: dict[str, Any], vehicle: Vehicle) -> Hidden:
    """The hidden effect of a truth file, in its true size."""
    effect = truth["effects"][0]
    name = effect["name"]
    values = {k: float(p["value"]) for k, p in effect["parameters"].items()}
    rng = np.random.default_rng(0)
    vector = np.array(list(values.values()))
    if name == "payload":
        made = catalogue.payload(vehicle, rng, 1.0, vector[1:])
        mass = values["mass"]

        def load(p: dict[str, Array]) -> None:
            p["payload_mass"] = p["payload_mass"] + mass
            p["payload_place"] = vector[1:]

        return Hidden(name, values, made.groups, load, made.facts)
    if name == "thrust_coefficient":

        def strengthen(p: dict[str, Array]) -> None:
            p["act_common"] = p["act_common"] * (1.0 + vector[0])

        return Hidden(name, values, [list(values)], strengthen)
    keys = {
        "accelerometer_scale": "imu_scale",
        "accelerometer_bias": "imu_bias",
        "linear_drag": "hidden_linear",
        "quadratic_drag": "hidden_quadratic",
        "buoyancy": "volume",
        "centre_of_gravity": "com",
        "rotor_drag": "rotor_drag",
    }

    def add(p: dict[str, Array]) -> None:
        p[keys[name]] = p[keys[name]] + (vector if len(vector) > 1 else vector[0])

    return Hidden(name, values, [list(values)], add)


def reference_of(scene: Scene, manoeuvre: Manoeuvre) -> Reference:
    """Position and heading over time as the generator wants them, shape (4,)."""
    path = manoeuvre.path
    assert path is not None

    def at(t: float) -> Array:
        asked = path(scene, np.array([max(t - batch.PREROLL, 0.0)]))
        return np.append(asked.place[0], asked.yaw[0])

    return at


@contextmanager
def guided(at: Reference, seconds: float, kind: str) -> Iterator[None]:
    """Let the generator follow a reference of ours."""

    def three(_: Any, t: float) -> tuple[Array, Array, Array]:
        h = _DIFFERENCE
        before, now, after = at(t - h), at(t), at(t + h)
        rates = (after - before) / (2.0 * h), (after - 2.0 * now + before) / h**2
        return now[:, None], rates[0][:, None], rates[1][:, None]

    with (
        mock.patch("tests.validation.hidden.control.at", three),
        mock.patch("tests.validation.hidden.references.at", three),
        mock.patch.dict("tests.validation.hidden.batch.SECONDS", {kind: seconds}),
    ):
        yield


def flown(folder: Path, case: Path, plan: Plan, manoeuvre: Manoeuvre, seed: int) -> Path:
    """Fly a manoeuvre with another specimen of a case's vehicle and its hidden effect."""
    meta = read_native(case).meta
    truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
    vehicle = vehicle_of(meta)
    rng = np.random.default_rng([seed, 77])
    without = plant.draw(vehicle, rng)
    hidden = hidden_of(truth, vehicle)
    with_it = dict(without)
    hidden.set_in(with_it)
    spec = Spec(vehicle.kind, "clear", "hover", [hidden.name], (seed,))
    made = Case(
        spec=spec,
        vehicle=vehicle,
        with_it=with_it,
        without=without,
        hidden=[hidden],
        wanted={"middle": np.zeros(4)},
        dither=0.0,
        rng=rng,
    )
    with guided(reference_of(plan.scene, manoeuvre), manoeuvre.seconds, vehicle.kind):
        flight = batch.Flight([made], seed)
        place = folder / f"{case.name}_{manoeuvre.name.replace(' ', '_')}_{seed}"
        writing.write(place, flight, 0, flight.readings())
    return place


def separated(found: Diagnosis, truth: str, twins: list[str]) -> bool:
    """Whether the truth is named and no twin stands beside it."""
    answer = found.to_dict()
    names = [e["name"] for e in answer["effects"]]
    beside = {n for group in answer["ambiguous_with"] for n in group} | set(names[1:])
    first = answer["verdict"] == "named" and names[:1] == [truth]
    return first and not beside & set(twins)


def main(argv: list[str] | None = None) -> int:
    """Plan, fly and diagnose all confounded cases of a folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path)
    parser.add_argument("--seeds", type=int, default=2)
    args = parser.parse_args(argv)
    good = total = 0
    for case in sorted(p.parent for p in args.cases.glob("*/truth.yaml")):
        truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
        if truth["level"] != "confounded":
            continue
        name, twins = truth["effects"][0]["name"], truth["twins"]
        plan = propose(prepare(read_native(case)), [name, *twins])
        best = plan.best if plan.best.manoeuvre.logs == 1 else plan.ranked[1]
        print(f"{case.name}: {name} or {twins}; '{best.manoeuvre.name}', {best.confidence:.2f}")
        for chosen in (best, plan.plain):
            for seed in range(args.seeds):
                with tempfile.TemporaryDirectory() as folder:
                    log = flown(Path(folder), case, plan, chosen.manoeuvre, seed)
                    found = diagnose(read_native(log))
                done = separated(found, name, twins)
                answer = found.to_dict()
                said = [(e["name"], round(e["confidence"], 2)) for e in answer["effects"]]
                words = f"{answer['verdict']} {said}, beside {answer['ambiguous_with']}"
                print(f"  {chosen.manoeuvre.name:16} {'separated' if done else '-':10} {words}")
                if chosen is best:
                    good, total = good + done, total + 1
    print(f"separated {good} of {total} flights")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
