"""``python -m seals.experiments.wave_impact``."""

from seals.experiments.command import run_main

run_main("seals.experiments.wave_impact")
