"""``python -m seals.experiments.open_sea``."""

from seals.experiments.command import run_main

run_main("seals.experiments.open_sea")
