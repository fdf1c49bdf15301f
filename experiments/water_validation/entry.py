"""Water entry of a hemisphere-nosed impactor, against the IMpack drops."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.water_validation.bodies import Shape, drift
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome, relative
from seals.plugins.readers.impack import ReaderImpack
from seals.report.figures import Chart, Series

RADIUS, GRAVITY = 0.022225, 9.81
MASS = 0.801
"""[kg], as in `robots/impactor`: the recordings do not state it; one number for all speeds."""
MACH = 10.0
"""Speed of sound over that of the entry [1]."""
LASTS, EARLY, STEP = 0.05, 0.02, 0.001


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


class Entry(NamedTuple):
    """Entry of the impactor at one speed.

    Args:
        time: since it touched the water [s], shape (rows,).
        felt: force over mass, mean of each step [m/s^2], shape (rows,).
        particles: of water.
        spacing: of them [m].
    """

    time: Floats
    felt: Floats
    particles: int
    spacing: float

    @property
    def change(self) -> float:
        """Change of velocity over 50 ms [m/s]."""
        return float(self.felt[self.time < LASTS].sum() * STEP)

    @property
    def peak(self) -> float:
        """Largest mean over a step in the first 20 ms [m/s^2]."""
        return float(self.felt[self.time < EARLY].max())


def enter(speed: int, across: float, grade: Grade, more: Sequence[str] = ()) -> Entry:
    """Drop the impactor into a tank at a speed.

    Args:
        speed: nominal, of the recordings [m/s].
        across: spacings across the impactor.
        grade: where it runs, and by which solver.
        more: further overrides.
    """
    ball = 4.0 / 3.0 * math.pi * RADIUS**3
    shape = Shape("capsule", (RADIUS, 0.15), ball + math.pi * RADIUS**2 * 0.15, 0.15 + 2 * RADIUS)
    found = drift(
        shape,
        MASS,
        spacing=2.0 * RADIUS / across,
        tank=(0.2, 0.2, 0.36),
        start=0.5 * shape.height + 0.002,
        speed=-float(speed),
        until=LASTS + 0.004,
        step=STEP,
        more=(
            "fluid.freeboard=0.4",
            f"fluid.physics.sound_speed={MACH * speed}",
            *grade.words(),
            *more,
        ),
    )
    first = int(np.argmax(found.felt > 0.5))
    return Entry(
        found.time[first:] - found.time[first], found.felt[first:], found.particles, found.spacing
    )


def run(grade: Grade) -> Outcome:
    """Drop at 2, 4 and 6 m/s; compare the change of velocity over 50 ms, and the peak."""
    across = 5 if grade.quick else 16
    lines, series, count, d = [], [], 0, 0.0
    for speed in (4,) if grade.quick else (2, 4, 6):
        found = enter(speed, across, grade)
        t, felt = found.time, found.felt
        drops = measured(speed)
        lines += _compared(speed, found, drops)
        series.append(Series(name=f"simulated {speed} m/s", x=t[t < LASTS], y=felt[t < LASTS]))
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
        f"The impactor's mass is not published; {MASS:g} kg is a choice, the same for all speeds. "
        "Peaks are those of means over 1 ms, simulated and measured, in the first 20 ms."
    )
    return Outcome(lines, [chart], count, d, across, "IMpack, CC BY-SA 4.0", remark)


def references(drops: list[tuple[Floats, Floats]]) -> tuple[float, float]:
    """Return change of velocity [m/s] and peak [m/s^2] of drops, their mean."""
    change = float(np.mean([np.trapezoid(z[t < LASTS], t[t < LASTS]) for t, z in drops]))
    peak = float(np.mean([np.convolve(z[t < EARLY], [0.5, 0.5]).max() for t, z in drops]))
    return change, peak


def _compared(speed: int, found: Entry, drops: list[tuple[Floats, Floats]]) -> list[Line]:
    """Change of velocity and peak of one speed against the mean of the drops."""
    change, peak = references(drops)
    name = f"{speed} m/s: change of velocity over 50 ms [m/s]"
    return [
        relative(name, found.change, change, 0.12),
        relative(f"{speed} m/s: peak [m/s^2]", found.peak, peak, 0.15),
    ]


CASE = Case("entry", "Water entry of a hemisphere", run, quick=False)
