"""``python -m seals.experiments.learning_study``."""

from seals.experiments.command import run_main

run_main("seals.experiments.learning_study")
