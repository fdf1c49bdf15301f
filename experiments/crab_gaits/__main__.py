"""``python -m seals.experiments.crab_gaits``."""

from seals.experiments.command import run_main

run_main("seals.experiments.crab_gaits")
