"""``python -m seals.experiments.water_compare``."""

from seals.experiments.command import run_main

run_main("seals.experiments.water_compare")
