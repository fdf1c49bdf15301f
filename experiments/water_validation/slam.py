"""Impulse of a sphere or cone driven into weightless water at constant speed: closed forms."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.water_validation import axisymmetric
from seals.experiments.water_validation.box import filled_box
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome, relative
from seals.experiments.water_validation.entry import CONE, CONE_DRAG
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.report.figures import Chart, Series
from seals.robot.pieces import Piece

RADIUS, SPEED, DENSITY, MACH = 0.022225, 4.0, 1000.0, 10.0
"""Of the sphere [m], its speed [m/s], density of the water [kg/m^3], and sound over speed [1]."""
TANK = (9.0, 5.4)
"""Width and depth of the water [radii]."""
DEEPEST, STEP = 0.6, 0.01
"""Way into the water, and the way of one step [radii]."""
JUDGED = (0.3, 0.5)
"""Depths at which the impulse is judged [radii]."""
SPHERE_DRAG = 0.3
"""Of a sphere in its cavity, C_s [1]; from the literature, not compared with a source."""
DEEP = 2.15
"""Way into the water of the run that tells the drag [radii]."""
DRAGGED = (1.0, 1.5, 2.0)
"""Depths at which the drag of the sphere is published [radii]."""
DEADRISE = 0.5 * math.pi - math.pi * CONE
"""Angle between the cone and the water, 15 degrees [rad]."""
EDGE = 0.25 * math.pi * math.tan(DEADRISE)
"""Depth of the cone at which the raised water is at its edge, 0.21 [radii]."""
CONE_DROPS = 2.65
"""Impulse of the cone at one radius in six recorded drops at 4 and 6 m/s, 2.54 to 2.72, by the mass
that their drag in the cavity tells (`entry.Drop.mass_of_cone`) [rho R^3 V]."""
CELLS = 24
"""In a radius, of the grid that tells the cone's reference: 0.98, 1.96 and 2.90 rho R^3 V at 0.21,
0.5 and 1 R."""
JUDGED_ACROSS = 12
"""Spacings across the sphere at which the figures have bars."""


def _disc(depth: Floats | float) -> Floats:
    """Impulse of von Karman's disc, I / (rho R^3 V), at depth b = h / R.

    Equation: I = M V, M = (4/3) rho c^3, half the added mass (8/3) rho c^3 of a disc (Lamb 1932,
    art. 102), c^2 = 2 R h - h^2 the circle where the sphere cuts the undisturbed surface.

    Example:
        >>> round(float(_disc(0.5)), 3)
        0.866
    """
    b = np.asarray(depth, dtype=float)
    found: Floats = 4.0 / 3.0 * (2.0 * b - b * b) ** 1.5
    return found


def raised(depth: Floats | float) -> Floats:
    """Impulse of Wagner's disc, I / (rho R^3 V): the circle of contact of the raised water.

    Equation: the contact radius solves h = int_0^c f'(r) sqrt(1 - r^2 / c^2) dr (the condition
    h = int_0^(pi/2) f(c sin t) sin t dt by parts), f = r^2 / (2 R) near the pole: c^2 = 3 R h,
    I = (4/3) (3 b)^(3/2). It holds for b -> 0 and bounds the impulse from above.

    Example:
        >>> round(float(raised(0.1)), 3)
        0.219
    """
    return 4.0 / 3.0 * (3.0 * np.asarray(depth, dtype=float)) ** 1.5


def fitted(depth: Floats | float) -> Floats:
    """Impulse I / (rho R^3 V) by the series of Miloh 1991, J. Eng. Math. 25, to b = 0.5.

    Equation: C_s = 5.5 b^(1/2) - 4.19 b - 4.26 b^(3/2), C_s = 2 F / (rho pi R^2 V^2), integrated.
    Its coefficients were not compared with the paper: nothing is judged by them alone.

    Example:
        >>> round(float(fitted(0.5)), 3)
        0.74
    """
    b = np.asarray(depth, dtype=float)
    return 0.5 * np.pi * (5.5 / 1.5 * b**1.5 - 4.19 / 2.0 * b**2 - 4.26 / 2.5 * b**2.5)


def cone_force(deadrise: float) -> float:
    """Slam coefficient of a cone when the raised water is at its edge, C_s [1].

    Equation: with Wagner's circle of contact, c = (4 / pi) V t / tan(b), the potential
    -(2 / pi) V (c^2 - r^2)^(1/2) is carried on to the cone's face by its normal velocity, and all
    of Bernoulli's terms are kept, where the pressure is positive:
    p / (rho V^2 / 2) = A / u - B (1 - u^2) / u^2 - 1, u^2 = 1 - r^2 / c^2,
    A = (16 / pi^2) / tan(b), B = (4 / pi^2) cos(b)^2. With u_0 the zero of p near the contact:
    C_s = 2 (A (1 - u_0) + B ln(u_0) - (1 - B) (1 - u_0^2) / 2). The first term with u_0 = 0 is
    Wagner's own force, which is 1.4 times as large at 15 degrees.

    Args:
        deadrise: b, angle between the cone and the water [rad].

    References:
        Korobkin 2004, Eur. J. Appl. Math. 15, 821 (modified Logvinovich model; here derived anew
        for a body of revolution); Hulin et al. 2022, J. Fluid Mech. (the same, held against
        nonlinear potential flow about cones).

    Example:
        >>> round(cone_force(math.radians(15.0)), 3)
        8.628
    """
    a = 16.0 / math.pi**2 / math.tan(deadrise)
    b = 4.0 / math.pi**2 * math.cos(deadrise) ** 2
    # (1 - b) u^2 - a u + b = 0
    zero = (a - math.sqrt(a * a - 4.0 * b * (1.0 - b))) / (2.0 * (1.0 - b))
    rest = b * math.log(zero) - 0.5 * (1.0 - b) * (1.0 - zero * zero)
    return 2.0 * (a * (1.0 - zero) + rest)


def cone(depth: Floats | float) -> Floats:
    """Impulse of a cone with a deadrise of 15 degrees, I / (rho R^3 V).

    Equation: a force that grows with the area of contact, I = (pi / 6) C_s h_e (h / h_e)^3, C_s
    by `cone_force`, until the raised water is at the edge, h_e = 0.21 R; from there on at least the
    drag of a cone in its cavity, (pi / 2) C_0 (h - h_e) / R, C_0 = 0.75. The force does not fall to
    that drag at once (that of a disc that struck water falls with t^(-1/3) at first, Iafrati and
    Korobkin 2008): beyond the edge the impulse is a lower bound.

    References:
        Wagner 1932, ZAMM 12; Guzevsky 1983, in Semenenko 2001, RTO-EN-010; Iafrati and Korobkin
        2008, Phys. Fluids 20 (not compared with the paper).

    Example:
        >>> [round(float(cone(b)), 2) for b in (0.1, 0.21045, 1.0)]
        [0.1, 0.95, 1.88]
    """
    b = np.asarray(depth, dtype=float)
    drag: Floats = 0.5 * np.pi * CONE_DRAG * np.maximum(b - EDGE, 0.0)
    most = np.pi / 6.0 * cone_force(DEADRISE) * EDGE
    impulse: Floats = most * (np.minimum(b, EDGE) / EDGE) ** 3 + drag
    return impulse


class Slam(NamedTuple):
    """An entry at constant speed.

    Args:
        depth: h / R after each step [1], shape (rows,).
        impulse: I / (rho R^3 V) [1], shape (rows,).
        particles: of water.
        spacing: of them [m].
    """

    depth: Floats
    impulse: Floats
    particles: int
    spacing: float

    def at(self, depth: float) -> float:
        """Return the impulse at a depth [radii]."""
        return float(np.interp(depth, self.depth, self.impulse))

    def drag(self, depth: float, over: float = 0.25) -> float:
        """Return C_s = 2 F / (rho pi R^2 V^2) about a depth, the mean over some way [radii]."""
        return 2.0 / math.pi * (self.at(depth + 0.5 * over) - self.at(depth - 0.5 * over)) / over


def slam(
    across: float,
    grade: Grade,
    *,
    finer: int = 1,
    nose: str = "sphere",
    deepest: float = DEEPEST,
) -> Slam:
    """Drive a body into water without weight; its motion is given, only its impulse is read.

    Args:
        across: spacings across the body.
        grade: where it runs, and by which solver.
        finer: substeps in place of each one that the solver asks for.
        nose: ``sphere``, or ``cone`` with a deadrise of 15 degrees.
        deepest: way into the water [radii].
    """
    spacing = 2.0 * RADIUS / across
    body, low = _body(nose)
    size = np.round(np.array([TANK[0], TANK[0], TANK[1]]) * RADIUS / spacing) * spacing
    water = filled_box(
        size,
        spacing,
        grade=grade,
        physics=PbfSettings(gravity=0.0, sound_speed=MACH * SPEED),
        body=body,
        above=6.0 * RADIUS,
    )
    middle = np.array([0.5 * size[0], 0.5 * size[1], size[2] + low])
    # off the lattice's planes of symmetry, and touching it
    middle += spacing * np.array([0.25, 0.25, 0.02])
    step, impulse, rows = STEP * RADIUS / SPEED, 0.0, []
    while (depth := (size[2] + low - middle[2]) / RADIUS) < deepest:
        water.place_bodies(
            position=middle[None],
            rotation=np.eye(3)[None],
            velocity=np.array([[0.0, 0.0, -SPEED]]),
            spin=np.zeros((1, 3)),
            inverse_mass=np.zeros(1),
            inverse_inertia=np.zeros((1, 3, 3)),
            acceleration=np.zeros((1, 3)),
        )
        found = water.advance(step, substeps=finer * water.substeps(step))
        middle[2] -= step * SPEED
        impulse += float(found.impulses[0, 2])
        rows.append((depth + STEP, impulse / (DENSITY * RADIUS**3 * SPEED)))
    count = water.count
    water.close()
    depths, impulses = np.array(rows).T
    return Slam(depths, impulses, count, spacing)


def _body(nose: str) -> tuple[list[Piece], float]:
    """Pieces of a body about its middle, and the depth of its lowest point below that [m]."""
    if nose == "sphere":
        return [Piece("sphere", (RADIUS,), np.zeros(3), np.eye(3))], RADIUS
    import trimesh

    tip = RADIUS * math.tan(DEADRISE)
    low = 0.5 * (2.0 * RADIUS + tip)
    outline = [(0.0, -low), (RADIUS, tip - low), (RADIUS, low), (0.0, low)]
    mesh = trimesh.creation.revolve(np.array(outline))
    corners, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    return [Piece("mesh", (), np.zeros(3), np.eye(3), vertices=corners, faces=faces)], low


def run(grade: Grade) -> Outcome:
    """Drive in the sphere at 8, 12 and 16 spacings across, at 12 deep, and a cone of 12."""
    found = {
        across: slam(across, grade, deepest=DEEP if across == JUDGED_ACROSS else DEEPEST)
        for across in ((8, 12) if grade.quick else (8, 12, 16))
    }
    lines: list[Line] = []
    for across, entry in found.items():
        judged = across == JUDGED_ACROSS
        for b in JUDGED:
            what = f"{across} across: impulse at {b:g} R [rho R^3 V]"
            bar = 0.08 if judged else None
            lines.append(relative(what, entry.at(b), float(fitted(b)), bar))
        lines.append(between(f"{across} across", entry.at(0.3), 0.0 if judged else None))
    half, whole = slam(JUDGED_ACROSS, grade, finer=2), found[JUDGED_ACROSS]
    what = f"{JUDGED_ACROSS} across: impulse at 0.5 R, half the substep [rho R^3 V]"
    lines.append(relative(what, half.at(0.5), whole.at(0.5), 0.03))
    grid = axisymmetric.enter(None, CELLS, deepest=DEEPEST)
    for b in JUDGED:
        what = f"{JUDGED_ACROSS} across: impulse at {b:g} R, grid of {CELLS} cells per radius"
        lines.append(relative(what, whole.at(b), float(np.interp(b, *grid)), None))
    for b in DRAGGED:
        what = f"{JUDGED_ACROSS} across: drag about {b:g} R, C_s over a path of 0.25 R"
        lines.append(relative(what, whole.drag(b), SPHERE_DRAG, None))
    lines += _cones(grade)
    depths = np.linspace(0.0, 0.5, 51)
    theory = [("Miloh", fitted), ("disc, undisturbed water", _disc), ("disc, raised water", raised)]
    series = [Series(name=name, x=depths, y=law(depths)) for name, law in theory]
    for n, e in found.items():
        near = e.depth <= DEEPEST  # one run goes deeper, for the drag
        series.append(Series(name=f"{n} across", x=e.depth[near], y=e.impulse[near]))
    chart = Chart(
        title="Impulse of a sphere driven into weightless water",
        y_label="impulse [rho R^3 V]",
        x_label="depth [radii]",
        series=tuple(series),
    )
    last = found[max(found)]
    source = (
        "discs: Lamb 1932, art. 102; Wagner 1932; Miloh 1991 (series not compared with paper); "
        "cone: Korobkin 2004; ideal flow on a grid, `axisymmetric`; drops: IMpack, CC BY-SA 4.0; "
        "sphere in its cavity: 0.3, not compared with a source"
    )
    remark = (
        f"Constant {SPEED:g} m/s, speed of sound c {MACH:g} times that; no gravity. A substep is "
        f"{STEP:g} R of way, 0.6 d/c at 12 across: the longest that the solver allows, 3 d/c, "
        "does not resolve the impact and is not judged here. For a cone there is a closed form "
        "until "
        "the raised water reaches its edge, 0.21 R, and beyond only the bound from the drag of its "
        "cavity (1.88 at 1 R): it is judged by ideal flow on a fine grid, and by drops."
    )
    return Outcome(lines, [chart], last.particles, last.spacing, max(found), source, remark)


def _cones(grade: Grade) -> list[Line]:
    """Impulse of the cone against ideal flow on a fine grid, closed forms and drops."""
    lines: list[Line] = []
    grid = axisymmetric.enter(math.tan(DEADRISE), CELLS, deepest=1.02)
    for across in (8, JUDGED_ACROSS) if grade.quick else (8, JUDGED_ACROSS, 16):
        found = slam(across, grade, nose="cone", deepest=1.05)
        for b in (EDGE, 0.5, 1.0):
            judged = across == JUDGED_ACROSS and b == 1.0
            what = f"{across} across: cone, impulse at {b:.2g} R, grid of {CELLS} cells per radius"
            reference = float(np.interp(b, *grid))
            lines.append(relative(what, found.at(b), reference, 0.15 if judged else None))
        if across == JUDGED_ACROSS:
            what = f"{across} across: cone, impulse at 1 R, recorded drops [rho R^3 V]"
            lines.append(relative(what, found.at(1.0), CONE_DROPS, 0.15))
    what = (
        f"grid of {CELLS} cells per radius: cone, impulse at {EDGE:.2g} R, closed form [rho R^3 V]"
    )
    lines.append(relative(what, float(np.interp(EDGE, *grid)), float(cone(EDGE)), None))
    return lines


def between(words: str, found: float, allowed: float | None) -> Line:
    """Return the share by which an impulse at 0.3 R leaves the range of the two discs.

    The disc of the raised water bounds it from above. That of the undisturbed water has neither
    the rise, which adds, nor the sphere's roundness, which takes away: at 0.3 R the rise prevails.
    """
    low, high = float(_disc(0.3)), float(raised(0.3))
    outside = max(low - found, found - high, 0.0) / low
    return Line(f"{words}: impulse at 0.3 R between the discs", found, low, outside, allowed)


CASE = Case("slam", "Impulse of a sphere and a cone that enter the water", run)
