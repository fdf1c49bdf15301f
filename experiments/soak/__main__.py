"""``python -m seals.experiments.soak``."""

from seals.experiments.command import run_main

run_main("seals.experiments.soak")
