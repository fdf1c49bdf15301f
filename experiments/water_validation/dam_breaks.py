"""Dam break validation: front position and height of a collapsing water column."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from seals.arrays import Floats
from seals.experiments.water_validation.box import advance, filled_box
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome
from seals.plugins.fluids.solvers.device_settings import DeviceSettings
from seals.report.figures import Chart, Series

GRAVITY = 9.81
MARTIN_MOYCE = 0.05715
"""Width of their column [m]."""
SLICE = 6
"""Thickness of the slice in spacings."""

# Martin and Moyce 1952, tables 2 and 6, n^2 = 2, a = 2.25 in
# T = t sqrt(2 g / a), tau = t sqrt(g / a)
FRONT_T = [0.41, 0.84, 1.19, 1.43, 1.63, 1.83, 1.98, 2.20, 2.32, 2.51, 2.65, 2.83, 2.98, 3.11, 3.33]
FRONT_Z = [1.11, 1.22, 1.44, 1.67, 1.89, 2.11, 2.33, 2.56, 2.78, 3.00, 3.22, 3.44, 3.67, 3.89, 4.11]
HEIGHT_T = [
    0.56,
    0.77,
    0.93,
    1.08,
    1.28,
    1.46,
    1.66,
    1.84,
    2.00,
    2.21,
    2.45,
    2.70,
    3.06,
    3.44,
    4.20,
]
HEIGHT_H = [
    0.94,
    0.89,
    0.83,
    0.78,
    0.72,
    0.67,
    0.61,
    0.56,
    0.50,
    0.44,
    0.39,
    0.33,
    0.28,
    0.22,
    0.17,
]
# Koshizuka and Oka 1996, t sqrt(2 g / L)
KO_T = [0.0, 0.381, 0.769, 1.153, 1.537, 1.935, 2.323, 2.719, 3.096]
KO_Z = [1.000, 1.111, 1.252, 1.505, 1.892, 2.241, 2.615, 3.003, 3.624]


class Course(NamedTuple):
    """Time series of a dam break.

    Args:
        time: [s].
        front: of the tongue from the wall [m].
        height: of the water at the wall [m].
        particles: of water.
    """

    time: Floats
    front: Floats
    height: Floats
    particles: int

    def front_errors(self, width: float, unit: float) -> tuple[Line, Line]:
        """Return errors of a front against Martin and Moyce, with and without a shift of time.

        Args:
            width: of the column [m].
            unit: of time, the root of width over gravity [s].
        """
        unit = unit / math.sqrt(2.0)
        front = np.interp(np.array(FRONT_T) * unit, self.time, self.front) / width
        return (
            _mean("front Z, mean error", front, FRONT_Z, 0.06),
            _started("front Z", FRONT_T, FRONT_Z, unit, self, width),
        )


def collapse(  # noqa: PLR0917  one geometry
    width: float,
    height: float,
    length: float,
    spacing: float,
    until: float,
    grade: Grade,
    physics: DeviceSettings | None = None,
) -> Course:
    """Simulate the collapse of a column and record it.

    Args:
        width: of the column [m].
        height: of the column [m].
        length: of the floor [m].
        spacing: of the particles [m].
        until: time [s].
        grade: where it runs.
        physics: options of the solver; as it comes for None.
    """
    water = filled_box(
        (length, SLICE * spacing, 2.0 * height),
        spacing,
        lambda p: (p[:, 0] < width) & (p[:, 2] < height),
        grade=grade,
        physics=physics,
    )
    step = 0.001 * math.sqrt(width / 0.057)
    rows = []
    for k in range(round(until / step) + 1):
        if k:
            advance(water, step)
        p = water.positions()
        # the tongue: the foremost rows together, not a single drop
        ahead = np.sort(p[:, 0])[-2 * SLICE :]
        at_wall = p[p[:, 0] < 2.0 * spacing, 2]
        top = np.sort(at_wall)[-2 * SLICE :].mean() if len(at_wall) > 2 * SLICE else 0.0
        rows.append((k * step, ahead.mean() + 0.5 * spacing, top + 0.5 * spacing))
    time, front, high = np.array(rows).T
    count = water.count
    water.close()
    return Course(time, front, high, count)


def _martin_moyce(grade: Grade) -> Outcome:
    """Compare with Martin and Moyce 1952."""
    a, unit = MARTIN_MOYCE, math.sqrt(MARTIN_MOYCE / GRAVITY)
    spacing = a / (16 if grade.quick else 32)
    found = collapse(a, 2.0 * a, 8.0 * a, spacing, 4.4 * unit, grade)
    # column twice as high as wide; the height is against its own
    high = np.interp(np.array(HEIGHT_T) * unit, found.time, found.height) / (2.0 * a)
    lines = list(found.front_errors(a, unit))
    # mean of the errors at the measured points, against the first height
    error = float(np.mean(np.abs(high - np.array(HEIGHT_H))))
    lines.append(
        Line("height H, mean error of the first height", float(high[-1]), HEIGHT_H[-1], error, 0.05)
    )
    charts = [
        _chart(
            "Front, Martin and Moyce",
            "T = t sqrt(2 g / a)",
            found.time * math.sqrt(2) / unit,
            found.front / a,
            FRONT_T,
            FRONT_Z,
        ),
        _chart(
            "Height at the wall, Martin and Moyce",
            "tau = t sqrt(g / a)",
            found.time / unit,
            found.height / (2 * a),
            HEIGHT_T,
            HEIGHT_H,
        ),
    ]
    source = (
        "Martin and Moyce 1952, tables 2 and 6, n² = 2, a = 57.15 mm; gate and friction left out"
    )
    return Outcome(lines, charts, found.particles, spacing, a / spacing, source)


def _koshizuka_oka(grade: Grade) -> Outcome:
    """Compare with Koshizuka and Oka 1996."""
    width = 0.146
    spacing = width / (16 if grade.quick else 32)
    unit = math.sqrt(width / (2.0 * GRAVITY))
    found = collapse(width, 2.0 * width, 4.0 * width, spacing, 3.1 * unit, grade)
    front = np.interp(np.array(KO_T) * unit, found.time, found.front) / width
    lines = [
        _mean("tip position, mean error", front[1:], KO_Z[1:], 0.06),
        _started("tip position", KO_T[1:], KO_Z[1:], unit, found, width),
    ]
    charts = [
        _chart(
            "Tip, Koshizuka and Oka",
            "t sqrt(2 g / L)",
            found.time / unit,
            found.front / width,
            KO_T,
            KO_Z,
        )
    ]
    source = "Koshizuka and Oka 1996, L = 146 mm, column 2 L high"
    return Outcome(lines, charts, found.particles, spacing, width / spacing, source)


def _mean(what: str, found: Floats, reference: list[float], allowed: float) -> Line:
    """Mean of the relative errors at the measured points."""
    error = float(np.mean(np.abs(found / np.array(reference) - 1.0)))
    return Line(what, float(found[-1]), reference[-1], error, allowed)


def _started(  # noqa: PLR0917  one line of the table
    what: str, times: list[float], values: list[float], unit: float, found: Course, width: float
) -> Line:
    """Mean error with the time offset of the measurement fitted, as the gate opens gradually."""
    t, z = np.array(times), np.array(values)

    def off(shift: float) -> float:
        simulated = np.interp((t - shift) * unit, found.time, found.front) / width
        return float(np.mean(np.abs(simulated / z - 1.0)))

    shift = float(minimize_scalar(off, bounds=(-0.5, 0.5), method="bounded").x)
    what = f"{what}, clock started {1e3 * shift * unit:.1f} ms later: mean error"
    return Line(what, float("nan"), float("nan"), off(shift), None)


def _chart(  # noqa: PLR0917  one chart
    title: str, x_label: str, x: Floats, y: Floats, points: list[float], values: list[float]
) -> Chart:
    return Chart(
        title=title,
        y_label="[1]",
        x_label=x_label,
        series=(
            Series(name="simulated", x=x, y=y),
            Series(name="measured", x=np.array(points), y=np.array(values)),
        ),
    )


CASES = (
    Case("martin_moyce", "Dam break of Martin and Moyce", _martin_moyce),
    Case("koshizuka_oka", "Dam break of Koshizuka and Oka", _koshizuka_oka),
)
