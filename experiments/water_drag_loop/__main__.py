"""``python -m seals.experiments.water_drag_loop``."""

from seals.experiments.command import run_main

run_main("seals.experiments.water_drag_loop")
