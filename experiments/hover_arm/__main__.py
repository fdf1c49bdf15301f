"""``python -m seals.experiments.hover_arm``."""

from seals.experiments.command import run_main

run_main("seals.experiments.hover_arm")
