"""``python -m seals.experiments.underwater_light``."""

from seals.experiments.command import run_main

run_main("seals.experiments.underwater_light")
