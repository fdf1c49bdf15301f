"""Bodies afloat: draught against Archimedes, momentum in every step, sinking and hovering."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from seals.experiments.water_validation.bodies import SHAPES, Drift, Shape, drift
from seals.experiments.water_validation.case import Case, Line, Outcome
from seals.report.figures import Chart, Series

TANK = (0.6, 0.6, 0.4)
RATIOS = (0.2, 0.5, 0.8)
START = -0.35
"""Height of the middle of a sphere that is let go under water [m]."""
BAR = {10: 0.05, 20: 0.025}
"""Allowed error of the draught, of the body's height, by spacings across it."""


def draught_of(shape: Shape, ratio: float) -> float:
    """Return how deep a body stands in the water by Archimedes [m]."""
    if shape.kind != "sphere":
        return ratio * shape.height
    r = shape.size[0]
    cap = lambda d: np.pi * d * d * (3.0 * r - d) / 3.0 - ratio * shape.volume  # noqa: E731
    return float(brentq(cap, 0.0, 2.0 * r))


def raised(shape: Shape, ratio: float) -> float:
    """Return how much the body lifts the mean level of its tank [m]."""
    return ratio * shape.volume / (TANK[0] * TANK[1])


def float_on(shape: Shape, ratio: float, across: int, until: float) -> tuple[Drift, float]:
    """Return the drift of a body and its draught over the last third [m].

    The body is let go a twentieth of its height above its rest. At the start the water that it
    displaces is not there: the level stands for what the particles themselves fill.
    """
    rest = 0.5 * shape.height - draught_of(shape, ratio)
    found = drift(
        shape,
        ratio * 1000.0 * shape.volume,
        spacing=shape.height / across,
        tank=TANK,
        start=rest + 0.05 * shape.height,
        until=until,
        more=("fluid.freeboard=0.3",),
    )
    last = found.time > 0.66 * until
    water = found.particles * found.spacing**3
    # what is there of water and body fills the tank up to here
    level = (water + ratio * shape.volume) / (TANK[0] * TANK[1]) - TANK[2]
    return found, float(0.5 * shape.height - (found.height[last].mean() - level))


def run(quick: bool) -> Outcome:
    """Let sphere, box and cylinder float."""
    lines, series, gaps = [], [], []
    chosen = (10,) if quick else (10, 20)
    ratios = (0.5,) if quick else RATIOS
    count, spacing = 0, 0.0
    for across in chosen:
        for name, shape in SHAPES.items():
            for ratio in ratios:
                found, draught = float_on(shape, ratio, across, 2.4)
                exact = draught_of(shape, ratio)
                error = abs(draught - exact) / shape.height
                what = f"{name} of ratio {ratio:g}, {across} spacings: draught [m]"
                lines.append(Line(what, draught, exact, error, BAR[across]))
                series.append(Series(name=f"{name} {ratio:g}", x=found.time, y=found.height))
                gaps.append(found.gap)
                count, spacing = found.particles, found.spacing
    gap = max(gaps)
    lines.append(Line("largest gap of momentum in a step", gap, 0.0, gap, 1e-4, share=False))
    chart = Chart(
        title="Bodies coming to rest", y_label="height of the middle [m]", x_label="t [s]",
        series=tuple(series[:9]),
    )  # fmt: skip
    return Outcome(
        lines, [chart], count, spacing, chosen[-1], "Archimedes; conservation of momentum"
    )


def sinking(quick: bool) -> Outcome:
    """Let bodies of 0.8, 1.0 and 1.2 times the water's density go under water."""
    across = 8 if quick else 12
    shape, lines, series = SHAPES["sphere"], [], []
    count, spacing = 0, 0.0
    for ratio in (0.8, 1.0, 1.2):
        found = drift(
            shape,
            ratio * 1000.0 * shape.volume,
            spacing=shape.height / across,
            tank=(0.6, 0.6, 0.7),
            start=START,
            until=1.2,
            more=("fluid.freeboard=0.2",),
        )
        # at first constant, with the exact added mass of a sphere in open water and no drag
        early = (found.time > 0.04) & (found.time < 0.2)
        rate = 2.0 * float(np.polyfit(found.time[early], found.height[early], 2)[0])
        exact = 9.81 * (1.0 / ratio - 1.0) / (1.0 + 0.5 / ratio)
        what = f"ratio {ratio:g}: acceleration at first [m/s^2], error of g"
        lines.append(Line(what, rate, exact, abs(rate - exact) / 9.81, 0.05))
        # then, once the water has come to rest under its own weight
        late = found.time > 0.5
        fit = np.polyfit(found.time[late], found.height[late], 2)
        moved = float(found.height[-1]) - START
        if ratio == 1.0:
            rate = 2.0 * float(fit[0])
            error = abs(rate) / 9.81
            lines.append(Line("ratio 1: acceleration later [m/s^2], of g", rate, 0.0, error, 0.05))
        else:
            wrong = max(0.0, moved * np.sign(ratio - 1.0)) / shape.height
            what = f"ratio {ratio:g}: rise in 1.2 s [m]; error: way to the wrong side"
            lines.append(Line(what, moved, float("nan"), float(wrong), 0.0))
        series.append(Series(name=f"ratio {ratio:g}", x=found.time, y=found.height))
        count, spacing = found.particles, found.spacing
    chart = Chart(
        title="Spheres let go under water", y_label="height of the middle [m]", x_label="t [s]",
        series=tuple(series),
    )  # fmt: skip
    return Outcome(lines, [chart], count, spacing, across, "Archimedes")


CASES = (
    Case("archimedes", "Archimedes: sphere, box and cylinder afloat", run),
    Case("sinking", "Lighter, equal and heavier than water", sinking),
)
