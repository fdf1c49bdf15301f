"""``python -m seals.experiments.posterior``."""

from seals.experiments.command import run_main

run_main("seals.experiments.posterior")
