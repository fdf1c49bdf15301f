"""Boundary samples of static solids, obstacles and shores, inside a basin."""

from __future__ import annotations

import itertools

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import Solid
from seals.frames import matrix_of
from seals.plugins.fluids.sampling.faces import PITCH, THICK, face_edge, fine_face
from seals.plugins.fluids.sampling.samples import Samples
from seals.plugins.fluids.sampling.shapes import SEEN, sample_cylinder, sample_sphere


def sample_solid(solid: Solid, spacing: float, lower: Floats, upper: Floats) -> Samples:
    """Sample the part of a solid inside a box; level planes, which are the floor, are skipped.

    Args:
        solid: that stands still.
        spacing: of the fluid [m].
        lower: corner of the box [m], shape (3,).
        upper: opposite corner [m], shape (3,).
    """
    if solid.kind == "plane":
        return Samples(np.zeros((0, 3)), np.zeros(0))
    turn = matrix_of(np.asarray(solid.quaternion, dtype=float)[None])[0]
    if solid.kind == "box":
        found = _box_near(solid, turn, spacing, lower, upper)
    elif 2.0 * solid.size[0] >= THICK * spacing and solid.size[-1] >= spacing:
        found = fine_face(solid.kind, solid.size, spacing)
    elif solid.kind == "sphere":
        found = sample_sphere(solid.size[0], spacing)
    else:
        found = sample_cylinder(solid.size, spacing)
    # a static obstacle may displace a full cell: no buoyancy depends on it
    found = Samples(found.points, np.maximum(found.volumes, spacing**3))
    placed = found.placed(solid.position, turn)
    inside = ((placed.points > lower) & (placed.points < upper)).all(axis=1)
    return Samples(placed.points[inside], placed.volumes[inside])


def _box_near(solid: Solid, turn: Floats, spacing: float, lower: Floats, upper: Floats) -> Samples:
    """The two outer layers of a box, only where they may lie in another box."""
    corners = np.array(list(itertools.product(*zip(lower, upper, strict=True))))
    local = (corners - solid.position) @ turn
    axes, depth = [], []
    for k, edge in enumerate(solid.size):
        # thick boxes have a finer face, its outer samples where those of the lattice would be
        fine = PITCH * spacing if min(solid.size) >= THICK * spacing else spacing
        reach = 0.5 * face_edge(edge, spacing)
        count = round(2.0 * reach / fine) + 1
        step = 2.0 * reach / max(count - 1, 1)
        low, high = local[:, k].min() + reach, local[:, k].max() + reach
        first = int(np.clip(low // max(step, fine), 0, count))
        last = int(np.clip(high // max(step, fine) + 2, 0, count))
        index = np.arange(first, last)
        axes.append(index * step - reach)
        depth.append(np.minimum(index, count - 1 - index))
    deep = np.minimum.reduce(np.meshgrid(*depth, indexing="ij"))
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1)[deep < SEEN]
    return Samples(points, np.full(len(points), spacing**3))
