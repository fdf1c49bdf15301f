"""Water entry of a hemisphere-nosed impactor, against the IMpack drops."""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats
from seals.experiments.water_validation.bodies import Shape, drift
from seals.experiments.water_validation.case import Case, Outcome, relative
from seals.plugins.readers.impack import ReaderImpack
from seals.report.figures import Chart, Series

RADIUS, GRAVITY = 0.022225, 9.81
MASS = 0.5
"""[kg]; the drops' own mass is not published: one number for all speeds, chosen."""
LASTS = 0.05


def measured(speed: int) -> list[tuple[Floats, Floats]]:
    """Return time since the entry [s] and felt force [m/s^2] of all drops of a nominal speed."""
    out = []
    for run in (1, 2, 3):
        (log,) = ReaderImpack().read(f"{speed}mps_sphere_{run}")
        t, z = log.time, log.columns["specific_force_z"]
        fall = round(0.9 * speed / GRAVITY * 2009)
        # the longest stretch near zero before the largest peak is the fall
        quiet = np.convolve(np.abs(z), np.full(fall, 1.0 / fall), mode="valid")
        end = int(np.argmin(quiet)) + fall
        offset = float(z[end - fall + 20 : end - 20].mean())
        entry = end + int(np.argmax(np.abs(z[end - 20 :] - offset) > 0.05 * GRAVITY)) - 20
        out.append((t[entry:] - t[entry], z[entry:] - offset))
    return out


def run(quick: bool) -> Outcome:
    """Drop at 2, 4 and 6 m/s and compare the change of velocity over 50 ms."""
    across = 5 if quick else 8
    spacing = 2.0 * RADIUS / across
    ball = 4.0 / 3.0 * math.pi * RADIUS**3
    shape = Shape("capsule", (RADIUS, 0.15), ball + math.pi * RADIUS**2 * 0.15, 0.15 + 2 * RADIUS)
    lines, series, count, d = [], [], 0, 0.0
    for speed in (4,) if quick else (2, 4, 6):
        drops = measured(speed)
        change = float(np.mean([np.trapezoid(z[t < LASTS], t[t < LASTS]) for t, z in drops]))
        found = drift(
            shape, MASS, spacing=spacing, tank=(0.2, 0.2, 0.36), start=0.5 * shape.height + 0.002,
            speed=-float(speed), until=LASTS + 0.004, step=0.001, more=("fluid.freeboard=0.4",),
        )  # fmt: skip
        first = int(np.argmax(found.felt > 0.5))
        t = found.time[first:] - found.time[first]
        kept = t < LASTS
        simulated = float(found.felt[first:][kept].sum() * 0.001)
        lines.append(
            relative(f"{speed} m/s: change of velocity over 50 ms [m/s]", simulated, change, 0.15)
        )
        series.append(Series(name=f"simulated {speed} m/s", x=t[kept], y=found.felt[first:][kept]))
        t, z = drops[0]
        series.append(Series(name=f"measured {speed} m/s", x=t[t < LASTS], y=z[t < LASTS]))
        count, d = found.particles, found.spacing
    chart = Chart(
        title="Entry of a hemisphere",
        y_label="felt force [m/s²]",
        x_label="t [s]",
        series=tuple(series),
    )
    remark = (
        f"The impactor's mass is not published; {MASS:g} kg is a choice, the same for all speeds."
    )
    return Outcome(lines, [chart], count, d, across, "IMpack, CC BY-SA 4.0", remark)


CASE = Case("entry", "Water entry of a hemisphere", run, quick=False)
