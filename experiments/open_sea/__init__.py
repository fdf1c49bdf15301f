"""Tow of a moving particle domain through 60 m of open sea, with and without a ball."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from seals.experiments.command import folder_of, parser_of, show_table
from seals.experiments.open_sea.measures import Measured as Measured
from seals.experiments.open_sea.measures import measures as measures
from seals.experiments.open_sea.tow import POINTS, Tow
from seals.experiments.open_sea.tow import towed as towed
from seals.report.figures import Chart, Mark, Series, lines
from seals.report.pictures import write_picture
from seals.run.build import run_settings

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
    settings = run_settings([*OVERRIDES, *given.overrides])
    out.mkdir(parents=True, exist_ok=True)
    tows = {
        name: towed(settings, way=given.way, speed=given.speed, radius=radius)
        for name, radius in (("alone", 0.0), ("ball", given.radius))
    }
    for name, tow in tows.items():
        np.savez_compressed(out / f"{name}.npz", **tow._asdict())
    _draw(out, tows["alone"], tows["ball"])
    show_table(out, measures(tows["alone"], tows["ball"]).table())
    return 0


WARM = 5
"""First steps, in which kernels are compiled."""
CLOSE = 1.5
"""Length of the close look at the forces [s]."""


def _draw(folder: Path, alone: Tow, ball: Tow) -> None:
    """Write ``figure.png`` and ``side.png``."""
    tow, middle = ball, POINTS // 2
    surface = {"particles": alone.inside[:, middle], "outer sea": alone.outside[:, middle]}
    force = {f"F{axis}": tow.force[:, k] for k, axis in enumerate("xyz")}
    end = float(tow.time[-1])
    close = (tow.time > end - CLOSE - 1.0) & (tow.time < end - 1.0)
    shifts = tow.time[close & tow.shifted.astype(bool)]
    marks = tuple(Mark(at=float(t - tow.step), label="") for t in shifts)
    near = {name: values[close] for name, values in force.items()}
    cost = {"step": 1e3 * tow.cost[WARM:]}
    write_picture(
        folder / "figure.png",
        [
            lines("Surface in the window alone", "height [m]", alone.time, surface),
            lines("Force of the water on the ball", "[N]", tow.time, force),
            lines(
                "The same, close; lines where the window moved",
                "[N]",
                tow.time[close],
                near,
                marks=marks,
            ),
            lines("Processor time of a step", "[ms]", tow.time[WARM:], cost),
        ],
    )
    # particles of a slice around the ball, the ball, and the outer sea's surface
    slab = tow.shot[np.abs(tow.shot[:, 1]) < 1.5 * tow.spacing]
    angle = np.linspace(0.0, 2.0 * np.pi, 90)
    x, z = tow.place[-1] + tow.radius * np.cos(angle), tow.radius * np.sin(angle) - tow.depth
    write_picture(
        folder / "side.png",
        [
            Chart(
                title=f"The window after {tow.place[-1]:.0f} m",
                y_label="height [m]",
                x_label="east [m]",
                series=(
                    Series(name="particles", x=slab[:, 0], y=slab[:, 2], points=True),
                    Series(name="outer sea", x=tow.sea[0], y=tow.sea[1]),
                    Series(name="ball", x=x, y=z),
                ),
                equal=True,
            )
        ],
    )
