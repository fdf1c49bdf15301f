"""Water column at rest: height, pressure and residual motion."""

from __future__ import annotations

import numpy as np

from seals.experiments.water_validation.box import advance, filled_box
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome
from seals.report.figures import Chart, Series

SIDE, HEIGHT, STEP = 0.3, 0.6, 0.004
REMARK = "The largest errors are those of the two layers on the floor."
GRAVITY, DENSITY = 9.81, 1000.0


def run(grade: Grade) -> Outcome:
    """Let a column stand for two seconds and average the third."""
    spacing = 0.03 if grade.quick else 0.015
    water = filled_box((SIDE, SIDE, HEIGHT), spacing, lambda p: p[:, 2] < HEIGHT, grade=grade)
    depths, pressures, energies, times = [], [], [], []
    steps = 750
    for k in range(steps):
        advance(water, STEP)
        energies.append(water.kinetic_energy())
        times.append((k + 1) * STEP)
        if k >= 500 and k % 10 == 0:
            depths.append(HEIGHT - water.positions()[:, 2])
            pressures.append(water.pressures())
    z, p = np.concatenate(depths), np.concatenate(pressures)
    count = round(HEIGHT / spacing)
    edges = np.linspace(0.0, HEIGHT, count + 1)
    row = np.digitize(z, edges)
    middle = np.array([z[row == k].mean() for k in range(2, count)])
    mean = np.array([p[row == k].mean() for k in range(2, count)])
    whole = DENSITY * GRAVITY * HEIGHT
    error = float(np.abs(mean - DENSITY * GRAVITY * middle).max() / whole)
    # the centre of mass of a column stands at half its height
    centre = float(np.mean([HEIGHT - d.mean() for d in depths]))
    potential = DENSITY * SIDE**2 * HEIGHT * GRAVITY * HEIGHT
    last = float(np.mean(energies[-100:])) / potential
    lines = [
        Line("height by the centre of mass [m]", 2 * centre, HEIGHT, 1 - 2 * centre / HEIGHT, 0.02),
        Line("largest error of the mean pressure, of that at the floor", error, 0.0, error, 0.05),
        Line("kinetic energy after 3 s, of m g H", last, 0.0, last, 1e-5, share=False),
    ]
    charts = [
        Chart(
            title="Pressure in a column at rest",
            y_label="[Pa]",
            x_label="depth [m]",
            series=(
                Series(name="simulated", x=middle, y=mean),
                Series(name="rho g z", x=middle, y=DENSITY * GRAVITY * middle),
            ),
        ),
    ]
    return Outcome(lines, charts, water.count, spacing, HEIGHT / spacing, "exact: rho g z", REMARK)


CASE = Case("hydrostatics", "Column of water at rest", run)
