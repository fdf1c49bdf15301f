"""``python -m seals.experiments.flight_energy``."""

from seals.experiments.command import run_main

run_main("seals.experiments.flight_energy")
