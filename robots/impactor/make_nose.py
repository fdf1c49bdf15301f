"""Writes ``nose.obj``: the effective nose of the impactor, a half ellipsoid.

Water rises around an entering sphere, so that the wetted radius grows like sqrt(3 R h) and not
like the geometric sqrt(2 R h) (Wagner 1932; Korobkin and Pukhnachov 1988). The nose that meets the
water is therefore as wide as the sphere but 2/3 as high.
"""

from __future__ import annotations

import math
from pathlib import Path

RADIUS = 0.022225
HEIGHT = RADIUS * 2.0 / 3.0
ROUND, RINGS = 24, 8


def vertices_and_faces() -> tuple[list[tuple[float, float, float]], list[tuple[int, ...]]]:
    """Return the closed mesh: tip at -RADIUS, rim at -RADIUS + HEIGHT."""
    top = -RADIUS + HEIGHT
    points = [(0.0, 0.0, -RADIUS)]
    for ring in range(1, RINGS + 1):
        angle = 0.5 * math.pi * ring / RINGS
        r, z = RADIUS * math.sin(angle), top - HEIGHT * math.cos(angle)
        points += [
            (r * math.cos(2 * math.pi * k / ROUND), r * math.sin(2 * math.pi * k / ROUND), z)
            for k in range(ROUND)
        ]
    points.append((0.0, 0.0, top))
    lid = len(points) - 1
    faces: list[tuple[int, ...]] = []
    for k in range(ROUND):
        a, b = 1 + k, 1 + (k + 1) % ROUND
        faces.append((0, b, a))
        for ring in range(RINGS - 1):
            p, q = a + ring * ROUND, b + ring * ROUND
            faces += [(p, q, q + ROUND), (p, q + ROUND, p + ROUND)]
        rim = (RINGS - 1) * ROUND
        faces.append((a + rim, b + rim, lid))
    return points, faces


if __name__ == "__main__":
    points, faces = vertices_and_faces()
    lines = [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in points]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    Path(__file__).with_name("nose.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
