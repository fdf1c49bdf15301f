"""Water column at rest: height, pressure and residual motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.water_validation.box import filled_box
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome, relative
from seals.plugins.fluids.solvers.device_settings import DeviceSettings
from seals.report.figures import Chart, Series

SIDE, HEIGHT, STEP = 0.3, 0.6, 0.004
SOURCE = "exact: the weight of the water above"
REMARK = "The largest errors occur in the layers on the floor; the uppermost layer is excluded."
GRAVITY, DENSITY = 9.81, 1000.0


class Still(NamedTuple):
    """A column at rest.

    Args:
        depth: of the layers, all but the uppermost: what lies above, at rest density [m],
            shape (layers,).
        pressure: their means [Pa], shape (layers,).
        height: by the centre of mass [m].
        energy: kinetic, of what the column weighs times its height [1].
        carried: by the floor, of the weight [1].
        particles: of water.
        spacing: [m].
    """

    depth: Floats
    pressure: Floats
    height: float
    energy: float
    carried: float
    particles: int
    spacing: float

    @property
    def error(self) -> float:
        """Largest error of the mean pressure of a layer, of that at the floor [1]."""
        off = np.abs(self.pressure - DENSITY * GRAVITY * self.depth)
        return float(off.max() / (DENSITY * GRAVITY * HEIGHT))


def stand(
    spacing: float, grade: Grade, physics: DeviceSettings | None = None, *, seconds: float = 3.0
) -> Still:
    """Let a column stand, and average the last third of the time.

    Args:
        spacing: of the particles [m].
        grade: where it runs, and by which solver.
        physics: options of the solver; as it comes for None.
        seconds: for which it stands [s].
    """
    water = filled_box(
        (SIDE, SIDE, HEIGHT), spacing, lambda p: p[:, 2] < HEIGHT, grade=grade, physics=physics
    )
    heights, depths, pressures, energies, floor = [], [], [], [], []
    steps = round(seconds / STEP)
    for k in range(steps):
        found = water.advance(STEP, substeps=water.substeps(STEP))
        energies.append(water.kinetic_energy())
        floor.append(-found.walls[2] / STEP)
        if k >= 2 * steps // 3 and k % 10 == 0:
            heights.append(water.positions()[:, 2])
            above = np.argsort(np.argsort(-heights[-1])) + 0.5
            depths.append(above * spacing**3 / SIDE**2)
            pressures.append(water.pressures())
    z, p = np.concatenate(depths), np.concatenate(pressures)
    count = round(HEIGHT / spacing)
    places = HEIGHT - np.concatenate(heights)
    row = np.digitize(places, np.linspace(0.0, HEIGHT, count + 1))
    potential = DENSITY * SIDE**2 * HEIGHT * GRAVITY * HEIGHT
    out = Still(
        np.array([z[row == k].mean() for k in range(2, count + 1)]),
        np.array([p[row == k].mean() for k in range(2, count + 1)]),
        # the centre of mass of a column stands at half its height
        2.0 * float(np.mean([h.mean() for h in heights])),
        float(np.mean(energies[-steps // 8 :])) / potential,
        float(np.mean(floor[2 * steps // 3 :])) * HEIGHT / potential,
        water.count,
        spacing,
    )
    water.close()
    return out


def run(grade: Grade) -> Outcome:
    """Let a column stand for two seconds and average the third."""
    spacing = 0.03 if grade.quick else 0.015
    found = stand(spacing, grade)
    middle, mean, error, last = found.depth, found.pressure, found.error, found.energy
    off = abs(1.0 - found.height / HEIGHT)
    lines = [
        Line("height from the centre of mass [m]", found.height, HEIGHT, off, 0.02),
        Line("largest error of the mean pressure, of that at the floor", error, 0.0, error, 0.02),
        Line("kinetic energy after 3 s, of m g H", last, 0.0, last, 1e-5, share=False),
        relative("load on the floor, relative to the weight", found.carried, 1.0, 0.02),
    ]
    charts = [
        Chart(
            title="Pressure in a column at rest",
            y_label="[Pa]",
            x_label="water above, at rest density [m]",
            series=(
                Series(name="simulated", x=middle, y=mean),
                Series(name="rho g z", x=middle, y=DENSITY * GRAVITY * middle),
            ),
        ),
    ]
    return Outcome(lines, charts, found.particles, spacing, HEIGHT / spacing, SOURCE, REMARK)


CASE = Case("hydrostatics", "Column of water at rest", run)
