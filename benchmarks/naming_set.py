"""Logs with a hidden effect that ship as `seals.experiments.naming_benchmark`.

    python -m benchmarks.naming_set OUT

The independent simulator of `tests.validation.hidden` flies them. Beside log, description and truth
each gets ``regions.csv``: how far the hidden effect moves what a sensor reads, over the noise of
the sensor, for every half second of the flight and every axis of accelerometer and gyroscope. Both
replays of a window start in its true state, with the effect and without it.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from tests.validation.hidden import equivalents, generate, sensors, writing
from tests.validation.hidden.batch import Flight
from tests.validation.hidden.cases import Spec, build
from tests.validation.hidden.rotation import Array

SEED = 470
SPECS = (
    ("quad_calm", "quad", "null", "sines", ()),
    ("quad_drag", "quad", "clear", "sines", ("linear_drag",)),
    ("quad_payload", "quad", "clear", "sines", ("payload",)),
    ("quad_rotor", "quad", "clear", "sines", ("weak_rotor",)),
    ("quad_wind_lag", "quad", "pairs", "sines", ("wind", "rotor_lag")),
    ("quad_magnet", "quad", "out_of_library", "sines", ("magnet",)),
    ("auv_calm", "auv", "null", "sines", ()),
    ("auv_drag", "auv", "clear", "sines", ("quadratic_drag",)),
    ("auv_current", "auv", "clear", "sines", ("current",)),
    ("crossing_thrust", "crossing", "clear", "sines", ("thrust_in_water",)),
)
"""Name, vehicle, level, pattern and hidden effects."""
AXES = tuple(f"{name}_{a}" for name in ("specific_force", "angular_velocity") for a in "xyz")


def replayed(flight: Flight, index: int) -> tuple[Array, Array]:
    """Return start of every window after the first row [s], and differences (windows, 6)."""
    member, first, rows = flight.layout()
    mine = flight.owner[member] == index
    member, first = member[mine], first[mine]
    one = flight.replay(flight.with_it, flight.sent, member, first, rows)
    two = flight.replay(flight.without, flight.sent.obeyed(), member, first, rows)
    kind = flight.cases[0].spec.body
    found = sensors.differences(one, two, sensors.CHANNELS[kind])
    both = np.concatenate([found["specific_force"], found["angular_velocity"]], axis=1)
    # the first rows lack the past that a late sensor reads
    size: Array = np.sqrt((both[4:rows] ** 2).mean(axis=0)).T
    return (first - flight.skip) * flight.step, size


def written(folder: Path, flight: Flight, index: int, readings: dict[str, Array]) -> None:
    """Write one log with its truth."""
    case = flight.cases[index]
    generate.judge(case)
    writing.write(folder, flight, index, readings)
    start, size = replayed(flight, index)
    with (folder / "regions.csv").open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file)
        out.writerow(("t", *AXES))
        for t, row in zip(case.found["first"] + start, size, strict=True):
            out.writerow((f"{t:.2f}", *(f"{value:.3f}" for value in row)))


def main() -> None:
    """Fly the vehicles of each kind together, and write their logs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    asked = parser.parse_args()
    for kind in dict.fromkeys(vehicle for _, vehicle, *_ in SPECS):
        chosen = [(n, s) for n, s in enumerate(SPECS) if s[1] == kind]
        cases = [build(Spec(kind, s[2], s[3], list(s[4]), (SEED, n))) for n, s in chosen]
        flight = Flight(cases, SEED)
        equivalents.settle(flight)
        flight.excess()
        readings = flight.readings()
        for index, (_, spec) in enumerate(chosen):
            written(asked.out / spec[0], flight, index, readings)
            print(spec[0], flight.cases[index].found["detectability"]["excess_max"], flush=True)


if __name__ == "__main__":
    main()
