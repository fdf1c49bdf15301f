"""Grasp and lift: a cube of 0.1 kg from the bottom of a tank to 1 m above the water."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.experiments.fetching import command_line, object_place, outcome_of
from seals.experiments.trials import Outcome
from seals.logs import Log
from seals.run.simulation import Record

HEIGHT = 1.0
"""Least height of the cube at the end [m]."""
TIME = 1.0
"""It must have been held there for so long [s]."""


def vary(seed: int) -> list[str]:
    """Return start and object of a seed: places within 0.3 m, any heading of the cube."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-0.3, 0.3, 2)
    z, yaw = rng.uniform(0.5, 0.9), rng.uniform(-0.5, 0.5)
    a, b = rng.uniform(-0.3, 0.3, 2)
    turn = rng.uniform(-np.pi, np.pi)
    return [
        f"initial.position=[{x:.4f},{y:.4f},{z:.4f}]",
        f"initial.rpy=[0,0,{yaw:.4f}]",
        f"objects.cube.position=[{a:.4f},{b:.4f},-0.975]",
        f"objects.cube.rpy=[0,0,{turn:.4f}]",
    ]


def judge(record: Record) -> Outcome:
    """Return whether the cube hung above the water at the end."""

    def missed(log: Log) -> str:
        last = log.time > log.time[-1] - TIME
        lowest = float(object_place(log, "cube")[last, 2].min())
        return "" if lowest >= HEIGHT else f"the cube was at {lowest:.2f} m"

    return outcome_of(record, thing="cube", missed=missed)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    return command_line("grasp_lift", vary, judge, arguments)
