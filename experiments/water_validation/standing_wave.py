"""Standing wave in a box: period, and the method's viscosity from the damping."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.optimize import curve_fit

from seals.environment.linear_waves import wavenumber
from seals.experiments.water_validation.box import advance, filled_box
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome, relative
from seals.report.figures import Chart, Series

LENGTH, DEPTH, STEP, GRAVITY = 1.0, 0.4, 0.004, 9.81
AMPLITUDE = 0.03


def run(grade: Grade) -> Outcome:
    """Simulate half a standing wave and fit a damped cosine to its centre of mass."""
    spacing = 0.02 if grade.quick else 0.01
    k = math.pi / LENGTH
    # the frequency of a wave number by the dispersion relation [rad/s]
    omega = math.sqrt(GRAVITY * k * math.tanh(k * DEPTH))
    assert abs(wavenumber(omega, DEPTH, GRAVITY) - k) < 1e-9 * k
    water = filled_box(
        (LENGTH, 6 * spacing, DEPTH + 4 * AMPLITUDE),
        spacing,
        lambda p: p[:, 2] < DEPTH + AMPLITUDE * np.cos(k * p[:, 0]),
        grade=grade,
    )
    time, swing = [0.0], [water.positions()[:, 0].mean()]
    for n in range(round(5.0 * 2.0 * math.pi / omega / STEP)):
        advance(water, STEP)
        time.append((n + 1) * STEP)
        swing.append(water.positions()[:, 0].mean())
    t, x = np.array(time), np.array(swing) - 0.5 * LENGTH
    guess = (x[0], 0.1, omega, 0.0, 0.0)
    fit, _ = curve_fit(_damped, t, x, p0=guess, maxfev=20000)
    period, exact = 2.0 * math.pi / abs(fit[2]), 2.0 * math.pi / omega
    viscosity = float(fit[1] / (2.0 * k * k))
    share = viscosity / (spacing * math.sqrt(GRAVITY * DEPTH))
    lost = 1.0 - math.exp(-fit[1] * period)
    lines = [
        relative("period [s]", period, exact, 0.03),
        Line("viscosity of the method [m^2/s]", viscosity, 1e-6, viscosity, None, share=False),
        Line("the same over d sqrt(g h)", share, 0.0, share, None, share=False),
        Line("amplitude lost in a period", lost, 0.0, lost, None),
    ]
    chart = Chart(
        title="Standing wave",
        y_label="centre of mass [m]",
        x_label="t [s]",
        series=(
            Series(name="simulated", x=t, y=x),
            Series(name="undamped linear theory", x=t, y=x[0] * np.cos(omega * t)),
        ),
    )
    across = 2 * LENGTH / spacing
    return Outcome(lines, [chart], water.count, spacing, across, "linear theory")


def _damped(t: Any, a: float, rate: float, omega: float, phase: float, level: float) -> Any:  # noqa: PLR0917
    return a * np.exp(-rate * t) * np.cos(omega * t + phase) + level


CASE = Case("standing_wave", "Standing wave of half a length", run)
