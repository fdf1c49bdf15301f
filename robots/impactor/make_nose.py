"""Writes ``nose.obj`` and ``cone.obj``: the effective noses of the impactor.

Water rises around an entering nose, so that the wetted radius runs ahead of the geometric one
(Wagner 1932). On a sphere it grows like sqrt(3 R h) instead of sqrt(2 R h), on a flat cone it is
4/pi times the geometric one (Korobkin and Pukhnachov 1988; Shiffman and Spencer 1951). The nose
that meets the water is therefore as wide as the real one but 2/3, or pi/4, as high.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

RADIUS = 0.022225
SPHERE_HEIGHT = RADIUS * 2.0 / 3.0
CONE_HEIGHT = RADIUS / math.tan(math.radians(75.0)) * math.pi / 4.0
ROUND, RINGS = 24, 8

Point = tuple[float, float, float]
Face = tuple[int, ...]


def sphere_outline() -> list[tuple[float, float]]:
    """Return radius and height above the tip of a half ellipsoid."""
    angles = [0.5 * math.pi * k / RINGS for k in range(1, RINGS + 1)]
    return [(RADIUS * math.sin(a), SPHERE_HEIGHT * (1.0 - math.cos(a))) for a in angles]


def cone_outline() -> list[tuple[float, float]]:
    """Return radius and height above the tip of a cone."""
    return [(RADIUS * k / RINGS, CONE_HEIGHT * k / RINGS) for k in range(1, RINGS + 1)]


def turned(outline: Sequence[tuple[float, float]]) -> tuple[list[Point], list[Face]]:
    """Return the closed mesh of an outline turned about z, its tip at -RADIUS, with a flat lid."""
    points: list[Point] = [(0.0, 0.0, -RADIUS)]
    for r, height in outline:
        angles = [2.0 * math.pi * k / ROUND for k in range(ROUND)]
        points += [(r * math.cos(a), r * math.sin(a), height - RADIUS) for a in angles]
    points.append((0.0, 0.0, outline[-1][1] - RADIUS))
    lid = len(points) - 1
    faces: list[Face] = []
    for k in range(ROUND):
        a, b = 1 + k, 1 + (k + 1) % ROUND
        faces.append((0, b, a))
        for ring in range(len(outline) - 1):
            p, q = a + ring * ROUND, b + ring * ROUND
            faces += [(p, q, q + ROUND), (p, q + ROUND, p + ROUND)]
        rim = (len(outline) - 1) * ROUND
        faces.append((a + rim, b + rim, lid))
    return points, faces


def write(name: str, outline: Sequence[tuple[float, float]]) -> None:
    """Write one nose as an OBJ file beside this one."""
    points, faces = turned(outline)
    lines = [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in points]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    Path(__file__).with_name(name).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write("nose.obj", sphere_outline())
    write("cone.obj", cone_outline())
