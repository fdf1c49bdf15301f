"""Surface layer of a solid: one layer of samples, finer than the fluid's lattice.

The layer lies half a spacing behind the surface. Were its samples a spacing apart, the density
that they add would change by a third from place to place along a flat wall, and a fluid that slides
along it would climb from hollow to hollow: water in a slice of eight spacings between such walls
loses half of a wave in one period, against a third without. Two thirds of a spacing leave one per
cent.
"""

from __future__ import annotations

from seals.plugins.fluids.sampling.samples import Samples
from seals.plugins.fluids.sampling.shapes import (
    SEEN,
    sample_box,
    sample_capsule,
    sample_cylinder,
    sample_sphere,
)

PITCH = 2.0 / 3.0
"""Distance of samples in a face, in spacings of the fluid."""


THICK = 3.0
"""Thickness from which a solid has a face, in spacings of the fluid."""


def fine_face(
    kind: str, size: tuple[float, ...], spacing: float, *, pitch: float = PITCH
) -> Samples:
    """Sample the surface layer of a box, sphere, cylinder or capsule.

    The samples are those of a slightly smaller shape at the finer distance, so that they lie half a
    spacing of the fluid under the surface; they share the volume of the layer evenly.

    Args:
        kind: of the shape.
        size: as the shape's own function takes it [m].
        spacing: of the fluid [m].
        pitch: distance of the samples [1 spacing].

    Example:
        >>> found = fine_face("sphere", (0.1,), 0.02)
        >>> bool(abs((found.points**2).sum(axis=1) ** 0.5 - 0.09).max() < 1e-9)
        True
    """
    fine = pitch * spacing
    edges = [_smaller_edge(edge, spacing, fine) for edge in size]
    # the radius of a finer sphere with the outer shell of `radius` [m]
    reach = max(size[0] - 0.5 * spacing, 0.0)
    shells = max(1, round(reach / fine + 0.5))
    radius = reach / (1.0 - 0.5 / shells)
    smaller = {
        "sphere": (radius,),
        "box": tuple(edges),
        "cylinder": (radius, edges[-1]),
        "capsule": (radius, size[-1]),
    }[kind]
    whole, found = _layer(kind, size, spacing), _layer(kind, smaller, fine)
    return Samples(found.points, found.volumes * (whole.volumes.sum() / found.volumes.sum()))


def face_edge(edge: float, spacing: float) -> float:
    """Return the distance between the outermost samples of an edge [m]."""
    return max(edge - spacing, 0.0)


def _smaller_edge(edge: float, spacing: float, fine: float) -> float:
    """Return the edge of a finer box whose outer samples coincide with those of ``edge`` [m]."""
    reach = face_edge(edge, spacing)
    count = round(reach / fine) + 1
    return reach * count / max(count - 1, 1)


def _layer(kind: str, size: tuple[float, ...], spacing: float) -> Samples:
    """Return the outermost layer of samples of a shape."""
    if kind == "sphere":
        return sample_sphere(size[0], spacing, SEEN)
    draw = {"box": sample_box, "cylinder": sample_cylinder, "capsule": sample_capsule}
    return draw[kind](size, spacing, SEEN)
