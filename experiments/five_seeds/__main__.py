"""``python -m seals.experiments.five_seeds``."""

from seals.experiments.command import run_main

run_main("seals.experiments.five_seeds")
