"""Writes ``crab.urdf`` and ``meshes``, and prints the hulls, the table of masses and the stance."""

from __future__ import annotations

import math
from pathlib import Path

from seals.animals.workshop.legs import Plan, cylinders, legs
from seals.animals.workshop.shapes import shell, tube
from seals.robots.workshop.files import publish
from seals.robots.workshop.links import Link, Machine
from seals.robots.workshop.pieces import Piece, box, rod

WIDTH, LENGTH, HEIGHT = 0.080, 0.0645, 0.0286
"""Of the carapace [m]; the width is what this project calls a body length."""
DENSITY = 1230.0
"""Of all tissue and shell [kg/m^3]: the weight in water is a sixth of that in air."""
EDGE = (4.0 * math.pi / 3.0) ** (1.0 / 3.0) / 2.0
"""Edge of a box as a share of the axis of the ellipsoid of the same volume [1]."""
COLOURS = {
    "shell": (0.62, 0.29, 0.13, 1.0),
    "pale": (0.87, 0.66, 0.42, 1.0),
    "limb": (0.70, 0.36, 0.16, 1.0),
    "tip": (0.23, 0.13, 0.10, 1.0),
    "eye": (0.03, 0.03, 0.03, 1.0),
}
CORNERS = 44
"""Of the drawn rim of the carapace."""
PLAN = Plan(
    names=("coxa", "merus", "dactyl"),
    lengths=(0.007, 0.036, 0.044),
    toe=0.002,
    friction=1.0,
    limits=((-0.70, 0.70), (-1.30, 0.80), (0.52, 2.27)),
    stance=(0.057, 0.024),
    effort=(0.08, 0.12, 0.12),
    speed=25.0,
)
RADII = (0.0046, 0.0038, 0.0028)
"""Of the three links of a leg as full cylinders [m]."""
HIPS = ((0.024, 0.023, -0.006), (0.008, 0.025, -0.006), (-0.008, 0.023, -0.006))
"""Hips of the left side from front to rear [m]."""
FANNED = (0.45, 0.0, -0.45)
"""How far the legs point forwards of straight sideways [rad]."""


def machine() -> Machine:
    """Return links and joints of the animal."""
    links, joints = legs(PLAN, HIPS, FANNED, _segments)
    return Machine(name="crab", links=[_body(), *links], joints=joints, colours=COLOURS)


def _body() -> Link:
    """Carapace, claws and the folded last legs, as one body."""
    edges = [EDGE * size for size in (LENGTH, WIDTH, HEIGHT)]
    pieces: list[Piece] = [
        box(edges, (0.0, 0.0, 0.0), wet=True).weighed(DENSITY),
        shell(_rim, top=0.45 * HEIGHT, bottom=0.25 * HEIGHT, colour="shell", corners=CORNERS),
        shell(_belly, top=0.1 * HEIGHT, bottom=0.5 * HEIGHT, colour="pale", corners=20),
    ]
    for sign in (1.0, -1.0):
        pieces += _claw(sign)
        pieces += _last_leg(sign)
        stalk = ((0.029, sign * 0.011, 0.004), (0.033, sign * 0.012, 0.009))
        pieces += [tube(stalk, (0.0018, 0.0015), colour="limb", corners=6)]
        eye = (
            (0.0325, sign * 0.0119, 0.0082),
            (0.0334, sign * 0.0122, 0.0105),
            (0.034, sign * 0.0124, 0.0125),
        )
        pieces += [tube(eye, (0.0014, 0.0026, 0.0012), colour="eye")]
    core = shell(
        _core, top=0.45 * HEIGHT, bottom=0.5 * HEIGHT, colour="", corners=12, rows=2, solid=True
    )
    return Link(name="body", pieces=[*pieces, core], friction=0.6, hull_mesh=True)


def _rim(turn: float) -> tuple[float, float]:
    """Rim of the carapace: widest ahead of the middle, five teeth on either side, narrow behind."""
    c, s = math.cos(turn), math.sin(turn)
    x = 0.5 * LENGTH * math.copysign(abs(c) ** 0.9, c)
    # the widest place lies a sixth of the length ahead of the middle
    y = 0.5 * WIDTH * math.copysign(abs(s) ** 0.9, s) * (1.0 - 0.34 * max(0.0, 0.25 - c) ** 1.3)
    if 0.2 < c < 0.9:
        # every second corner stands out
        tooth = 1.0 + 0.05 * math.cos(round(turn * CORNERS / (2.0 * math.pi)) * math.pi)
        x, y = x * tooth, y * tooth
    return x, y


def _belly(turn: float) -> tuple[float, float]:
    return 0.42 * LENGTH * math.cos(turn), 0.40 * WIDTH * math.sin(turn)


def _core(turn: float) -> tuple[float, float]:
    """Rim of what touches: the carapace without its teeth."""
    return 0.49 * LENGTH * math.cos(turn), 0.49 * WIDTH * math.sin(turn)


def _claw(sign: float) -> list[Piece]:
    """One claw, folded before the mouth."""
    shoulder, elbow = (0.020, sign * 0.026, -0.004), (0.041, sign * 0.043, -0.003)
    wrist, palm = (0.052, sign * 0.034, -0.003), (0.062, sign * 0.012, -0.005)
    arm = tube((shoulder, elbow, wrist), (0.0045, 0.0068, 0.0060), colour="limb")
    hand = tube(
        (wrist, (0.057, sign * 0.027, -0.003), (0.061, sign * 0.017, -0.004), palm),
        (0.0060, 0.0085, 0.0088, 0.0055),
        colour="limb",
    )
    fixed = (
        (0.061, sign * 0.014, -0.008),
        (0.063, sign * 0.003, -0.010),
        (0.060, -sign * 0.003, -0.007),
    )
    free = (
        (0.062, sign * 0.014, -0.001),
        (0.067, sign * 0.003, 0.000),
        (0.062, -sign * 0.003, -0.005),
    )
    fingers = [
        tube(path, (0.0042, 0.0031, 0.0006), colour="tip", corners=6) for path in (fixed, free)
    ]
    solids = [
        rod(0.0055, shoulder, elbow, wet=True),
        rod(0.0080, wrist, (0.063, sign * 0.002, -0.004), wet=True),
    ]
    return [*(piece.weighed(DENSITY) for piece in solids), arm, hand, *fingers]


def _last_leg(sign: float) -> list[Piece]:
    """The last walking leg, carried off the ground behind the carapace."""
    hip, knee = (-0.018, sign * 0.020, -0.003), (-0.036, sign * 0.046, 0.010)
    heel, toe = (-0.052, sign * 0.052, 0.002), (-0.064, sign * 0.052, -0.003)
    drawn = tube((hip, knee), (0.0030, 0.0027), colour="limb")
    lower = tube((knee, heel, toe), (0.0025, 0.0024, 0.0006), colour="limb")
    return [rod(0.0024, hip, knee, wet=True).weighed(DENSITY), drawn, lower]


def _segments() -> list[list[Piece]]:
    """Pieces of the three links of a leg."""
    first, second, third = PLAN.lengths
    solids = cylinders(PLAN, RADII, DENSITY)
    coxa = tube(((-0.004, 0, 0), (first, 0, 0)), (0.0046, 0.0042), colour="limb")
    merus = tube(
        ((0, 0, 0), (0.3 * second, 0, 0.0006), (0.7 * second, 0, 0.0008), (second, 0, 0)),
        (0.0032, 0.0050, 0.0048, 0.0034),
        colour="limb",
        flat=0.6,
    )
    carpus = tube(
        ((0, 0, 0), (0.25 * third, 0, 0.0012), (0.6 * third, 0, 0)),
        (0.0032, 0.0038, 0.0026),
        colour="limb",
        flat=0.75,
    )
    claw = tube(
        ((0.58 * third, 0, 0), (0.8 * third, 0, 0.0008), (third, 0, 0)),
        (0.0026, 0.0019, 0.0006),
        colour="tip",
        corners=6,
    )
    return [[solids[0], coxa], [solids[1], merus], [solids[2], carpus, claw]]


if __name__ == "__main__":
    made = machine()
    publish(made, Path(__file__).parent)
    print("stance", [round(angle, 4) for angle in PLAN.posture()])
    print("mass", sum(link.mass for link in made.links))
