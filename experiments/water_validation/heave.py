"""Heave decay of a floating sphere, after Kramer et al. 2021."""

from __future__ import annotations

import math

import numpy as np

from seals.experiments.water_validation.bodies import Shape, drift
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome, relative
from seals.report.figures import Chart, Series

DIAMETER, MASS, DEPTH = 0.3, 7.056, 0.9
DROP = 0.09
"""Height of the drop [m]; half of it is clear of the draught at rest."""
PERIOD = 0.76
"""Damped period [s]."""


def run(grade: Grade) -> Outcome:
    """Lift a half-submerged sphere by 0.3 of its diameter and let it go."""
    across = 10 if grade.quick else 16
    spacing = DIAMETER / across
    # waves come back from the walls of the small one after half a second
    tank = (1.2, 1.2, 0.6) if grade.quick else (2.4, 2.4, DEPTH)
    shape = Shape("sphere", (0.5 * DIAMETER,), math.pi / 6.0 * DIAMETER**3, DIAMETER)
    found = drift(
        shape,
        MASS,
        spacing=spacing,
        tank=tank,
        start=DROP,
        until=1.6,
        more=("fluid.freeboard=0.5", *grade.words()),
    )
    z = (found.height - found.height[-100:].mean()) / DROP
    # extremes: first trough, then crest
    trough = int(np.argmin(z[: round(0.75 / 0.004)]))
    crest = trough + int(np.argmax(z[trough : trough + round(0.6 / 0.004)]))
    period = 2.0 * float(found.time[crest] - found.time[trough])
    lines = [
        relative("period from first trough to crest, twice [s]", period, PERIOD, 0.05),
        Line("first trough over drop", float(z[trough]), float("nan"), float("nan"), None),
        Line("first crest over drop", float(z[crest]), float("nan"), float("nan"), None),
    ]
    chart = Chart(
        title="Heave decay of a sphere", y_label="z over drop [1]", x_label="t [s]",
        series=(Series(name="simulated", x=found.time, y=z),),
    )  # fmt: skip
    remark = (
        "Diameter, mass and period as quoted from the paper; its curve is not at hand, so the "
        "heights are published without an error. Waves come back from the walls of this tank after "
        "half a second."
    )
    return Outcome(
        lines, [chart], found.particles, found.spacing, across,
        "Kramer et al. 2021, Energies 14(2) 269", remark,
    )  # fmt: skip


CASE = Case("heave", "Heave decay of a sphere", run)
