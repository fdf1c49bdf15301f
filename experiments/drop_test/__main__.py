"""``python -m seals.experiments.drop_test``."""

from seals.experiments.command import run_main

run_main("seals.experiments.drop_test")
