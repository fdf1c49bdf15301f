"""Drag of a sphere towed at constant speed, without a correction, against the textbook."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.water_validation.box import filled_box
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome, relative
from seals.plugins.fluids.sampling import ALL, sample_pieces
from seals.plugins.fluids.solvers.device_settings import DeviceSettings
from seals.report.figures import Chart, Series
from seals.robot.pieces import Piece

DIAMETER, DENSITY = 0.2, 1000.0
"""Of the sphere [m], and of the water [kg/m^3]."""
TANK = (11.0, 5.0, 5.0)
"""Length, width and depth [diameters]; the sphere fills 3 % of the cross-section."""
START, END, STEADY = 1.5, 8.5, 4.5
"""Middle of the sphere at the start, at the end, and from where on it is judged [diameters]."""
DRAG = 0.47
"""Of a smooth sphere below its crisis [1] (Hoerner 1965, ch. 3)."""
STEP, REST = 0.004, 0.3
"""Of the commands, and the time for which the water settles [s]."""


class Tow(NamedTuple):
    """A tow at constant speed.

    Args:
        place: of the sphere along the tank [diameters], shape (rows,).
        drag: coefficient, the mean of each step [1], shape (rows,).
        particles: of water.
        spacing: of them [m].
    """

    place: Floats
    drag: Floats
    particles: int
    spacing: float

    @property
    def steady(self) -> float:
        """Mean coefficient of the steady part [1]."""
        return float(self.drag[self.place > STEADY].mean())


def tow(speed: float, across: float, grade: Grade, physics: DeviceSettings | None = None) -> Tow:
    """Tow a sphere in the middle of a tank; it reaches its speed within a diameter.

    Args:
        speed: [m/s].
        across: spacings across the sphere.
        grade: where it runs, and by which solver.
        physics: options of the solver; as it comes for None.
    """
    spacing = DIAMETER / across
    size = np.round(np.array(TANK) * DIAMETER / spacing) * spacing
    middle = np.array([START * DIAMETER, 0.5 * size[1], 0.5 * size[2]])
    sphere = [Piece("sphere", (0.5 * DIAMETER,), np.zeros(3), np.eye(3))]
    water = filled_box(
        size,
        spacing,
        grade=grade,
        physics=physics,
        body=sphere,
        without=sample_pieces(sphere, spacing, layers=ALL).placed(middle, np.eye(3)),
        above=DIAMETER,
    )
    rise, rows = 2.0 * DIAMETER / speed, []
    force, area = 0.5 * DENSITY * speed**2, 0.25 * np.pi * DIAMETER**2
    time = -REST
    while middle[0] < END * DIAMETER:
        now = speed * min(max(time / rise, 0.0), 1.0)
        # place the sphere, whose motion the water does not change
        water.place_bodies(
            position=middle[None],
            rotation=np.eye(3)[None],
            velocity=np.array([[now, 0.0, 0.0]]),
            spin=np.zeros((1, 3)),
            inverse_mass=np.zeros(1),
            inverse_inertia=np.zeros((1, 3, 3)),
            acceleration=np.zeros((1, 3)),
        )
        found = water.advance(STEP, substeps=water.substeps(STEP))
        middle = middle + STEP * np.array([now, 0.0, 0.0])
        time += STEP
        drag = -float(found.impulses[0, 0]) / STEP / (force * area)
        rows.append((middle[0] / DIAMETER, drag))
    place, drags = np.array(rows).T
    count = water.count
    water.close()
    return Tow(place, drags, count, spacing)


def run(grade: Grade) -> Outcome:
    """Tow at 1, 2 and 4 m/s."""
    across = 6 if grade.quick else 16
    lines: list[Line] = []
    series, found = [], None
    for speed in (1.0,) if grade.quick else (1.0, 2.0, 4.0):
        found = tow(speed, across, grade)
        lines.append(relative(f"{speed:g} m/s: drag coefficient", found.steady, DRAG, 0.15))
        kernel = np.full(25, 1.0 / 25)
        smooth = np.convolve(found.drag, kernel, mode="same")
        series.append(Series(name=f"{speed:g} m/s", x=found.place, y=smooth))
    assert found is not None
    chart = Chart(
        title="Drag of a sphere towed",
        y_label="coefficient [1]",
        x_label="way [diameters]",
        series=tuple(series),
    )
    remark = (
        f"Judged from {STEADY - START:g} to {END - START:g} diameters of the way. A sphere in a "
        "channel of this size has about 7 % more drag than in open water."
    )
    source = "Hoerner 1965, Fluid-Dynamic Drag, ch. 3: smooth sphere below its crisis"
    return Outcome(lines, [chart], found.particles, found.spacing, across, source, remark)


CASE = Case("tow", "Drag of a sphere towed", run, quick=False)
