"""Writes ``sea_spider.urdf`` and ``meshes``, and prints the hulls and the table of masses."""

from __future__ import annotations

from pathlib import Path

from seals.animals.workshop.legs import Plan, cylinders, legs
from seals.animals.workshop.shapes import tube
from seals.robots.workshop.files import publish
from seals.robots.workshop.links import Link, Machine
from seals.robots.workshop.pieces import Piece, rod

DENSITY = 1100.0
"""Of all tissue and cuticle [kg/m^3]."""
COLOURS = {
    "trunk": (0.86, 0.52, 0.20, 1.0),
    "limb": (0.92, 0.62, 0.28, 1.0),
    "joint": (0.74, 0.38, 0.14, 1.0),
    "eye": (0.05, 0.04, 0.04, 1.0),
}
PLAN = Plan(
    names=("coxa", "femur", "tibia"),
    lengths=(0.012, 0.050, 0.088),
    toe=0.0016,
    friction=1.0,
    limits=((-0.60, 0.60), (-1.35, 0.60), (0.35, 2.40)),
    stance=(0.094, 0.040),
    effort=(0.006, 0.010, 0.010),
    speed=8.0,
)
RADII = (0.0030, 0.0022, 0.0016)
"""Of the three links of a leg as full cylinders [m]."""
TRUNK, PROBOSCIS = (0.0060, 0.036), (0.0050, 0.040)
"""Radius and length [m]."""
HIPS = (
    (0.0150, 0.0065, 0.0),
    (0.0050, 0.0070, 0.0),
    (-0.0050, 0.0070, 0.0),
    (-0.0150, 0.0065, 0.0),
)
"""Hips of the left side from front to rear [m]."""
FANNED = (0.90, 0.30, -0.30, -0.90)
"""How far the legs point forwards of straight sideways [rad]."""


def machine() -> Machine:
    """Return links and joints of the animal."""
    links, joints = legs(PLAN, HIPS, FANNED, _segments)
    return Machine(name="sea_spider", links=[_body(), *links], joints=joints, colours=COLOURS)


def _body() -> Link:
    """Trunk, proboscis and the little abdomen, as one body."""
    half, front = 0.5 * TRUNK[1], 0.5 * TRUNK[1] + PROBOSCIS[1]
    solids = [
        rod(TRUNK[0], (-half, 0, 0), (half, 0, 0), wet=True, solid=True),
        rod(PROBOSCIS[0], (half, 0, 0), (front, 0, 0), wet=True, solid=True),
    ]
    pieces: list[Piece] = [piece.weighed(DENSITY) for piece in solids]
    rings = [(-half + 0.25 * k * TRUNK[1] / 2.25, 0.0, 0.0) for k in range(10)]
    swells = [0.0050 if k % 2 else 0.0062 for k in range(10)]
    pieces.append(tube(rings, swells, colour="trunk", corners=10))
    snout = [(half, 0, 0), (half + 0.012, 0, 0), (half + 0.028, 0, -0.001), (front, 0, -0.002)]
    pieces.append(tube(snout, (0.0032, 0.0048, 0.0058, 0.0026), colour="trunk", corners=10))
    tail = [(-half, 0, 0.001), (-half - 0.008, 0, 0.004)]
    pieces.append(tube(tail, (0.0024, 0.0015), colour="trunk"))
    knob = [(half - 0.004, 0, 0.004), (half - 0.004, 0, 0.0085), (half - 0.004, 0, 0.0105)]
    pieces.append(tube(knob, (0.0022, 0.0018, 0.0006), colour="eye", corners=6))
    for sign in (1.0, -1.0):
        palp = [
            (half, sign * 0.004, 0.001),
            (half + 0.012, sign * 0.014, 0.004),
            (half + 0.034, sign * 0.016, -0.002),
            (half + 0.046, sign * 0.014, -0.012),
        ]
        pieces.append(tube(palp, (0.0012, 0.0011, 0.0009, 0.0004), colour="limb", corners=6))
        base = [(x, sign * y * 1.2, z) for x, y, z in HIPS]
        pieces += [
            tube(((x, 0, 0), (x, y, z)), (0.0034, 0.0030), colour="trunk") for x, y, z in base
        ]
    return Link(name="body", pieces=pieces, friction=0.6)


def _segments() -> list[list[Piece]]:
    """Pieces of the three links of a leg."""
    first, second, third = PLAN.lengths
    solids = cylinders(PLAN, RADII, DENSITY)
    coxa = tube(
        ((0, 0, 0), (0.5 * first, 0, 0), (first, 0, 0)), (0.0034, 0.0026, 0.0032), colour="limb"
    )
    femur = tube(
        ((0, 0, 0), (0.2 * second, 0, 0), (0.85 * second, 0, 0), (second, 0, 0)),
        (0.0022, 0.0024, 0.0026, 0.0021),
        colour="limb",
    )
    knee = tube(((0.96 * second, 0, 0), (1.02 * second, 0, 0)), (0.0025, 0.0025), colour="joint")
    # two tibiae, tarsus and propodus, nearly in one line
    tibia = tube(
        ((0, 0, 0), (0.42 * third, 0, 0.002), (0.78 * third, 0, 0.001), (third, 0, 0)),
        (0.0021, 0.0019, 0.0013, 0.0004),
        colour="limb",
    )
    ankle = tube(
        ((0.40 * third, 0, 0.0019), (0.44 * third, 0, 0.0019)), (0.0022, 0.0022), colour="joint"
    )
    return [[solids[0], coxa], [solids[1], femur, knee], [solids[2], tibia, ankle]]


if __name__ == "__main__":
    made = machine()
    publish(made, Path(__file__).parent)
    print("stance", [round(angle, 4) for angle in PLAN.posture()])
    print("mass", sum(link.mass for link in made.links))
