"""``python -m seals.experiments.photoreal``."""

from seals.experiments.command import run_main

run_main("seals.experiments.photoreal")
