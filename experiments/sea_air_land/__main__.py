"""``python -m seals.experiments.sea_air_land``."""

from seals.experiments.command import run_main

run_main("seals.experiments.sea_air_land")
