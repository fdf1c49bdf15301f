"""Tow of a moving particle domain through 60 m of open sea, with and without a ball."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.config.compose import compose
from seals.experiments.command import folder_of, parser_of, show_table
from seals.experiments.open_sea.measures import Measured as Measured
from seals.experiments.open_sea.measures import measures as measures
from seals.experiments.open_sea.pictures import draw
from seals.experiments.open_sea.tow import Tow as Tow
from seals.experiments.open_sea.tow import towed as towed
from seals.run.build import build_run

OVERRIDES = (
    "robot=ball",
    "water=window",
    "wave=sea",
    "wave.height=0.2",
    "wave.period=2",
    "fluid.spacing=0.06",
    "fluid.size=[2.1,1.5,0.6]",
    "time.step=0.006",
)
"""Deep water, waves of 6.2 m in the direction of the tow."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    parser = parser_of("open_sea", "as for seals run: wave.*, fluid.*, time.step")
    parser.add_argument("--way", type=float, default=60.0, help="of the tow [m]")
    parser.add_argument("--speed", type=float, default=1.5, help="of the tow [m/s]")
    parser.add_argument("--radius", type=float, default=0.15, help="of the ball [m]")
    given = parser.parse_args(arguments)
    out = folder_of(given, "open_sea")
    settings = build_run(compose([*OVERRIDES, *given.overrides]))
    out.mkdir(parents=True, exist_ok=True)
    tows = {
        name: towed(settings, way=given.way, speed=given.speed, radius=radius)
        for name, radius in (("alone", 0.0), ("ball", given.radius))
    }
    for name, tow in tows.items():
        np.savez_compressed(out / f"{name}.npz", **tow._asdict())
    draw(out, tows["alone"], tows["ball"])
    show_table(out, measures(tows["alone"], tows["ball"]).table())
    return 0
