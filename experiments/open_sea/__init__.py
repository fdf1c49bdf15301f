"""A window of particles goes 60 m through an open sea: alone, and with a ball in tow."""

from __future__ import annotations

import argparse
import datetime
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from seals.config.compose import compose
from seals.experiments.open_sea.measures import Measured, measures, table
from seals.experiments.open_sea.pictures import draw
from seals.experiments.open_sea.tow import Tow, towed
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

__all__ = ["Measured", "Tow", "main", "measures", "towed"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    parser = argparse.ArgumentParser(prog="python -m seals.experiments.open_sea")
    parser.add_argument("--out", type=Path, help="folder; runs/DATE/TIME_NAME when left out")
    parser.add_argument("--way", type=float, default=60.0, help="of the tow [m]")
    parser.add_argument("--speed", type=float, default=1.5, help="of the tow [m/s]")
    parser.add_argument("--radius", type=float, default=0.15, help="of the ball [m]")
    parser.add_argument("overrides", nargs="*", help="as for seals run: wave.*, fluid.*, time.step")
    given = parser.parse_args(arguments)
    stamp = datetime.datetime.now().astimezone()
    out = given.out or Path("runs") / f"{stamp:%Y-%m-%d}" / f"{stamp:%H-%M-%S}_open_sea"
    settings = build_run(compose([*OVERRIDES, *given.overrides]))
    out.mkdir(parents=True, exist_ok=True)
    tows = {
        name: towed(settings, way=given.way, speed=given.speed, radius=radius)
        for name, radius in (("alone", 0.0), ("ball", given.radius))
    }
    for name, tow in tows.items():
        np.savez_compressed(out / f"{name}.npz", **tow._asdict())
    text = table(measures(tows["alone"], tows["ball"]))
    (out / "table.md").write_text(text, encoding="utf-8")
    draw(out, tows["alone"], tows["ball"])
    print(text)
    return 0
