"""``python -m seals.experiments.self_play``."""

from seals.experiments.command import run_main

run_main("seals.experiments.self_play")
