"""``python -m seals.experiments.grasp_lift``."""

from seals.experiments.command import run_main

run_main("seals.experiments.grasp_lift")
