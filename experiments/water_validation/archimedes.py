"""Floating bodies: draught against Archimedes, momentum balance, sinking and hovering."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.optimize import brentq

from seals.experiments.water_validation.bodies import SHAPES, Drift, Shape, drift
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome, relative
from seals.report.figures import Chart, Mark, Series

TANK = (0.6, 0.6, 0.4)
RATIOS = (0.2, 0.5, 0.8)
LIGHT = 0.1
"""Density of the light ball over that of water [1]."""
DRAG = 0.47
"""Of a sphere at Reynolds numbers of 1e4 to 2e5 [1] (Hoerner 1965)."""
EARLY, LASTS = 0.042, 0.6
"""Until the flow has not grown yet, and the end [s]."""
START = -0.35
"""Height of the middle of a sphere that is let go under water [m]."""
BAR = {10: 0.05, 20: 0.025}
"""Allowed error of the draught, of the body's height, by spacings across it."""


def _draught_of(shape: Shape, ratio: float) -> float:
    """Return the draught of a body by Archimedes [m]."""
    if shape.kind != "sphere":
        return ratio * shape.height
    r = shape.size[0]
    cap = lambda d: np.pi * d * d * (3.0 * r - d) / 3.0 - ratio * shape.volume  # noqa: E731
    return float(brentq(cap, 0.0, 2.0 * r))


def _float_on(
    shape: Shape, ratio: float, across: int, until: float, grade: Grade
) -> tuple[Drift, float]:
    """Return the drift of a body and its draught over the last third [m].

    The body is let go a twentieth of its height above its rest. At the start the water that it
    displaces is not there: the level stands for what the particles themselves fill.
    """
    rest = 0.5 * shape.height - _draught_of(shape, ratio)
    found = drift(
        shape,
        ratio * 1000.0 * shape.volume,
        spacing=shape.height / across,
        tank=TANK,
        start=rest + 0.05 * shape.height,
        until=until,
        more=("fluid.freeboard=0.3", *grade.words()),
    )
    last = found.time > 0.66 * until
    water = found.particles * found.spacing**3
    # what is there of water and body fills the tank up to here
    level = (water + ratio * shape.volume) / (TANK[0] * TANK[1]) - TANK[2]
    return found, float(0.5 * shape.height - (found.height[last].mean() - level))


def _afloat(name: str, grade: Grade) -> Outcome:
    """Let a body of one shape float."""
    lines, gaps, draughts = [], [], []
    chosen = (10,) if grade.quick else (10, 20)
    ratios = (0.5,) if grade.quick else RATIOS
    shape, count, spacing = SHAPES[name], 0, 0.0
    for across in chosen:
        for ratio in ratios:
            found, draught = _float_on(shape, ratio, across, 1.6 if grade.quick else 2.4, grade)
            exact = _draught_of(shape, ratio)
            error = abs(draught - exact) / shape.height
            what = f"ratio {ratio:g}, {across} spacings: draught [m], error of the body's height"
            lines.append(Line(what, draught, exact, error, BAR[across]))
            draughts.append((across, ratio, draught))
            gaps.append(found.gap)
            count, spacing = found.particles, found.spacing
    gap = max(gaps)
    lines.append(Line("largest gap of momentum in a step", gap, 0.0, gap, 1e-4, share=False))
    chart = chart_of_draughts(name, draughts)
    return Outcome(
        lines, [chart], count, spacing, chosen[-1], "Archimedes; conservation of momentum"
    )


def chart_of_draughts(name: str, draughts: Sequence[tuple[int, float, float]]) -> Chart:
    """Draw the errors of draughts with their bounds.

    Args:
        name: of the shape.
        draughts: spacings across the body, its density over that of water, and its draught [m].
    """
    shape = SHAPES[name]
    series = []
    for across in sorted({row[0] for row in draughts}):
        rows = sorted(row[1:] for row in draughts if row[0] == across)
        errors = [(d - _draught_of(shape, ratio)) / shape.height for ratio, d in rows]
        ratios = np.array([ratio for ratio, _ in rows])
        label = f"{across} spacings"
        series.append(Series(name=label, x=ratios, y=100.0 * np.array(errors)))
    return Chart(
        title=f"A {name} afloat: error of the draught",
        y_label="error [% of the height]",
        x_label="density over that of water [1]",
        series=tuple(series),
        marks=(
            Mark(at=0.0, label="Archimedes", level=True),
            *(
                Mark(at=100.0 * BAR[n], label=f"allowed, {n} spacings", level=True)
                for n in sorted({row[0] for row in draughts})
            ),
        ),
    )


def light(grade: Grade) -> Outcome:
    """Let a ball of a tenth of the water's density swim for ten seconds."""
    shape, across, until = SHAPES["sphere"], 10, 10.0
    found, draught = _float_on(shape, LIGHT, across, until, grade)
    exact = _draught_of(shape, LIGHT)
    late = found.time > 0.5 * until
    speed = np.abs(np.diff(found.height) / np.diff(found.time))[late[1:]]
    fastest = float(speed.max())
    lines = [
        Line("draught [m], error of the body's height", draught, exact,
             abs(draught - exact) / shape.height, BAR[across]),
        Line("largest speed in the last 5 s [m/s]", fastest, 0.0, fastest, 0.05, share=False),
        Line("largest gap of momentum in a step", found.gap, 0.0, found.gap, 1e-4, share=False),
    ]  # fmt: skip
    chart = Chart(
        title="A ball of a tenth of the water's density", y_label="height of the middle [m]",
        x_label="t [s]", series=(Series(name="simulated", x=found.time, y=found.height),),
    )  # fmt: skip
    return Outcome(lines, [chart], found.particles, found.spacing, across, "Archimedes")


def _sinking(grade: Grade) -> Outcome:
    """Let bodies of 0.8, 1.0 and 1.2 times the water's density go under water."""
    across = 8 if grade.quick else 20
    shape, lines, series = SHAPES["sphere"], [], []
    count, spacing = 0, 0.0
    for ratio in (0.8, 1.0, 1.2):
        found = drift(
            shape,
            ratio * 1000.0 * shape.volume,
            spacing=shape.height / across,
            tank=(0.6, 0.6, 0.7),
            start=START,
            until=LASTS,
            more=("fluid.freeboard=0.2", *grade.words()),
        )
        # before the flow has grown: the exact added mass of a sphere in open water, no drag
        early = found.time < EARLY
        rate = 2.0 * float(np.polyfit(found.time[early], found.height[early], 2)[0])
        exact = 9.81 * (1.0 / ratio - 1.0) / (1.0 + 0.5 / ratio)
        what = f"ratio {ratio:g}: initial acceleration [m/s^2], error of g"
        lines.append(Line(what, rate, exact, abs(rate - exact) / 9.81, 0.05))
        moved = float(found.height[-1]) - START
        if ratio == 1.0:
            late = found.time > 0.3
            rate = 2.0 * float(np.polyfit(found.time[late], found.height[late], 2)[0])
            error = abs(rate) / 9.81
            lines.append(Line("ratio 1: acceleration later [m/s^2], of g", rate, 0.0, error, 0.05))
        else:
            wrong = max(0.0, moved * np.sign(ratio - 1.0)) / shape.height
            what = f"ratio {ratio:g}: path in the wrong direction [m]"
            lines.append(Line(what, float(wrong), 0.0, float(wrong), 0.0))
            with_drag = _risen(ratio, shape.size[0], LASTS)
            what = f"ratio {ratio:g}: rise in {LASTS:g} s [m], against a drag coefficient of {DRAG}"
            lines.append(relative(what, moved, with_drag, None))
        series.append(Series(name=f"ratio {ratio:g}", x=found.time, y=found.height))
        count, spacing = found.particles, found.spacing
    chart = Chart(
        title="Spheres let go under water", y_label="height of the middle [m]", x_label="t [s]",
        series=tuple(series),
    )  # fmt: skip
    remark = (
        f"The initial acceleration is that in the first {EARLY * 1e3:.0f} ms: later the layer of "
        "slow water that a coarse lattice causes around the body has grown and brakes it."
    )
    return Outcome(lines, [chart], count, spacing, across, "Archimedes", remark)


def _risen(ratio: float, radius: float, until: float) -> float:
    """Return the rise of a sphere in open water with added mass and a constant drag [m].

    Equation:
        (ratio + 1/2) V v' = (1 - ratio) V g - DRAG A v |v| / 2.

    Example:
        >>> _risen(1.0, 0.1, 1.0)
        0.0
    """
    steps = 2000
    speed = height = 0.0
    for _ in range(steps):
        pull = (1.0 - ratio) * 9.81 - 0.375 * DRAG / radius * speed * abs(speed)
        speed += pull / (ratio + 0.5) * until / steps
        height += speed * until / steps
    return height


CASES = (
    *(
        Case(f"afloat_{name}", f"Archimedes: a {name} afloat", partial(_afloat, name))
        for name in SHAPES
    ),
    Case("sinking", "Lighter, equal and heavier than water", _sinking),
    Case("light", "A light ball for ten seconds", light, quick=False),
)
