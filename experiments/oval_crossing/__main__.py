"""``python -m seals.experiments.oval_crossing``."""

from seals.experiments.command import run_main

run_main("seals.experiments.oval_crossing")
