"""Dives of the vehicle of `underwater` with hidden faults of its thrusters and of the sea.

    python -m benchmarks.other_simulators.rov_faults OUT [--only NAME ...]

Twenty, f01 to f20, with which the diagnosis was improved, and twenty, g01 to g20, of other paths
and sizes, which were answered once.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.other_simulators.flight_sets import cases_of, write_set
from benchmarks.other_simulators.underwater import MAPS, PATHS, RATE, ROBOTS, dive

SEED = 5101
CASES = cases_of(
    Path(__file__).with_suffix(".yaml"), PATHS, robot="rov", convert=("meta=water.yaml",), rate=RATE
)

if __name__ == "__main__":
    write_set(CASES, dive, seed=SEED, robots=ROBOTS, maps=MAPS, packages=("numpy",))
