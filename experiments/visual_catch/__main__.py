"""``python -m seals.experiments.visual_catch``."""

from seals.experiments.command import run_main

run_main("seals.experiments.visual_catch")
