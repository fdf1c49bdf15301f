"""Writes ``auv.urdf`` and ``meshes``, and prints the hulls and the table of masses."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.robots.workshop.airframe import COLOURS, WATER
from seals.robots.workshop.files import publish
from seals.robots.workshop.links import Joint, Link, Machine
from seals.robots.workshop.pieces import Piece, box, rod

RESERVE = 0.01
"""Buoyancy above the weight, as a share of it: comes up by itself when its thrusters stop."""
FOAM, SKID = (0.30, 0.24, 0.05), (0.25, 0.012, 0.13)
"""Full edges of the block of foam, and of the plates at the sides [m]."""
RING = 0.21
"""Distance of the thrusters from the middle [m]."""
EYE = (0.205, 0.0, 0.0)
"""Place of the front camera [m]."""


def thrusters() -> list[tuple[list[float], list[float]]]:
    """Return place [m] and axis of each: three lying, tangential; three standing, between them."""
    found = []
    for k in range(6):
        a = math.pi / 3.0 * k + math.pi / 6.0
        place = [RING * math.cos(a), RING * math.sin(a), 0.0]
        axis = [0.0, 0.0, 1.0] if k % 2 == 0 else [-math.sin(a), math.cos(a), 0.0]
        found.append((place, axis))
    return found


def pieces(trim: float, forward: float = 0.0) -> list[Piece]:
    """Return the pieces of the body.

    Args:
        trim: mass of the ballast at the keel [kg].
        forward: place of the ballast [m].
    """
    found = [
        rod(0.06, (-0.17, 0, 0), (0.17, 0, 0), 4.2, colour="metal", solid=True, wet=True),
        box(FOAM, (0, 0, 0.085), 0.72, colour="shell", solid=True, wet=True),
        box((0.20, 0.10, 0.016), (forward, 0, -0.075), trim, colour="metal"),
        rod(0.03, (0.168, 0, 0), EYE, 0.06, colour="glass"),
    ]
    for side in (1.0, -1.0):
        at = (0.0, side * 0.13, -0.03)
        found.append(box(SKID, at, 0.37, colour="dark", solid=True, wet=True))
        for x in (-0.09, 0.09):
            # drawn only: what carries the plate, from the hull and from the foam
            found.append(rod(0.007, (x, 0, -0.03), (x, side * 0.13, -0.03), colour="metal"))
            foam = (x, side * 0.11, 0.07)
            found.append(rod(0.006, (x, side * 0.128, 0.02), foam, colour="metal"))
    for place, axis in thrusters():
        middle, half = np.array(place), 0.025 * np.array(axis)
        found.append(rod(0.0348, middle - half, middle + half, 0.344, solid=True, wet=True))
        found += _shroud(middle, np.array(axis))
    return found


def _shroud(at: Floats, axis: Floats) -> list[Piece]:
    """A drawn duct with its motor, and the strut that holds it."""
    half = 0.02 * axis
    duct = rod(0.048, at - half, at + half, colour="dark", kind="ring")
    motor = rod(0.016, at - 1.6 * half, at + 1.6 * half, colour="blade")
    strut = rod(0.007, 0.25 * at, at, colour="metal")
    return [duct, motor, strut]


def machine() -> Machine:
    """Return the one body of the robot and its frames."""
    bare = Link(name="body", pieces=pieces(0.0))
    trim = round(WATER * bare.volume / (1.0 + RESERVE) - bare.mass, 3)
    frames = [Link(name="camera_front"), Link(name="imu_link")]
    joints = [
        Joint(name="camera_front_mount", parent="body", child="camera_front", at=EYE),
        Joint(name="imu_link_mount", parent="body", child="imu_link"),
    ]
    body = Link(name="body", pieces=pieces(trim, round(-bare.mass / trim * bare.centre()[0], 4)))
    return Machine(name="auv", links=[body, *frames], joints=joints, colours=COLOURS)


if __name__ == "__main__":
    publish(machine(), Path(__file__).parent)
    for place, axis in thrusters():
        print([round(v, 4) for v in place], [round(v, 4) for v in axis])
