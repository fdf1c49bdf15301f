"""Pictures of the tow: surface, forces, computing time, and the domain in its sea."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from seals.experiments.open_sea.tow import POINTS, Tow
from seals.report.figures import Chart, Mark, Series, lines
from seals.report.pictures import write_picture

WARM = 5
"""First steps, in which kernels are compiled."""
CLOSE = 1.5
"""Length of the close look at the forces [s]."""


def draw(folder: Path, alone: Tow, ball: Tow) -> None:
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
