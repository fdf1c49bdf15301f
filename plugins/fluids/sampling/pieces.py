"""Samples of bodies, and the check that the spacing resolves them."""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence

import numpy as np

from seals.errors import PhysicsError
from seals.plugins.fluids.sampling.convex import convex_face, hull_of, inscribed
from seals.plugins.fluids.sampling.faces import PITCH, THICK, fine_face
from seals.plugins.fluids.sampling.meshes import (
    is_closed,
    sample_closed,
    sample_sheet,
    volume_of,
)
from seals.plugins.fluids.sampling.samples import Samples, joined
from seals.plugins.fluids.sampling.shapes import (
    SEEN,
    sample_box,
    sample_capsule,
    sample_cylinder,
    sample_sphere,
)
from seals.robot.pieces import Piece

THIN = 1.5
"""Thickness in spacings up to which a piece is its volume alone; from `THICK` its surface is.

Measured on held bodies: rods of 0.8 and 1.4 spacings are lifted by 1.03 of their weight in water by
their volume alone, a ball of two spacings by 0.73 only.
"""
LAYERS = 2.0
"""Spacings that the main piece of a body must be thick, so that the fluid sees a solid."""


class Thin(enum.Enum):
    """Treatment of pieces thinner than a spacing."""

    volume = "volume"
    """By their volume: exact buoyancy, partly permeable."""
    block = "block"
    """As a layer one spacing thick: impermeable, but displaces more."""


def sample_pieces(
    pieces: Sequence[Piece], spacing: float, *, thin: Thin = Thin.volume, layers: int = SEEN
) -> Samples:
    """Sample the pieces of a body, in its axes.

    Args:
        pieces: of the body; where they overlap, the volumes add up as they do in a hull.
        spacing: of the fluid [m].
        thin: treatment of pieces thinner than a spacing.
        layers: under the surface; deeper ones are left out.
    """
    return joined([_sampled(piece, spacing, thin, layers) for piece in pieces])


def _sampled(piece: Piece, spacing: float, thin: Thin, layers: int) -> Samples:
    """Sample one piece; a stated volume rescales the volumes of its samples."""
    if piece.kind == "mesh":
        assert piece.vertices is not None
        closed = is_closed(piece.faces) and volume_of(piece.vertices, piece.faces) > 0.0
        hull = hull_of(piece.vertices, _own_volume(piece)) if closed else None
        if hull is not None and layers == SEEN and thickness(piece) >= THICK * spacing:
            found = convex_face(hull, spacing, PITCH * spacing)
        elif closed:
            found = sample_closed(piece.vertices, piece.faces, spacing, layers)
        else:
            found = sample_sheet(piece.vertices, piece.faces, spacing)
    elif layers == SEEN and thickness(piece) >= THICK * spacing:
        found = fine_face(piece.kind, piece.size, spacing)
    elif piece.kind == "sphere":
        found = sample_sphere(piece.size[0], spacing, layers)
    else:
        draw = {"box": sample_box, "cylinder": sample_cylinder, "capsule": sample_capsule}
        found = draw[piece.kind](piece.size, spacing, layers)
    if piece.volume is not None:
        found = Samples(found.points, found.volumes * (piece.volume / _own_volume(piece)))
    bulk = min(max((thickness(piece) / spacing - THIN) / (THICK - THIN), 0.0), 1.0)
    if thin is Thin.block or not _own_volume(piece):
        bulk = 1.0
        found = Samples(found.points, np.maximum(found.volumes, spacing**3))
    found = found._replace(bulk=np.full(len(found.points), bulk))
    return found.placed(piece.position, piece.rotation)


def reach_of(pieces: Sequence[Piece], spacing: float, thin: Thin) -> float:
    """Return how far the surface of a body lies from its reference point, at most [m].

    Args:
        pieces: of the body.
        spacing: of the fluid [m].
        thin: treatment of pieces thinner than a spacing.
    """
    points = sample_pieces(pieces, spacing, thin=thin).points
    far = np.linalg.norm(points, axis=1).max(initial=0.0)
    return float(far) + 0.5 * spacing if len(points) else 0.0


def _own_volume(piece: Piece) -> float:
    """Return the volume of a piece's shape [m^3], zero for a sheet.

    Example:
        >>> _own_volume(Piece("box", (1.0, 2.0, 3.0), np.zeros(3), np.eye(3)))
        6.0
    """
    if piece.kind == "mesh":
        assert piece.vertices is not None
        return volume_of(piece.vertices, piece.faces) if is_closed(piece.faces) else 0.0
    if piece.kind == "box":
        return math.prod(piece.size)
    radius = piece.size[0]
    ball = 4.0 / 3.0 * math.pi * radius**3
    if piece.kind == "sphere":
        return ball
    straight = math.pi * radius**2 * piece.size[1]
    return straight + (ball if piece.kind == "capsule" else 0.0)


def thickness(piece: Piece) -> float:
    """Return the thickness of a piece [m].

    Of a convex mesh twice the radius of the largest ball in it, of others the thickness of a plate
    of equal volume and area.

    Example:
        >>> thickness(Piece("cylinder", (0.1, 0.05), np.zeros(3), np.eye(3)))
        0.05
    """
    if piece.kind == "box":
        return min(piece.size)
    if piece.kind == "cylinder":
        return min(2.0 * piece.size[0], piece.size[1])
    if piece.kind in ("sphere", "capsule"):
        return 2.0 * piece.size[0]
    assert piece.vertices is not None
    hull = hull_of(piece.vertices, _own_volume(piece)) if _own_volume(piece) > 0.0 else None
    if hull is not None:
        return 2.0 * inscribed(hull)[1]
    a, b, c = (piece.vertices[np.asarray(piece.faces)[:, k]] for k in range(3))
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    # a plate of thickness t has the volume A t and the area 2 A; a ball gives 2 D / 3
    return min(2.0 * _own_volume(piece) / area, float(np.ptp(piece.vertices, axis=0).min()))


def refuse_coarse(name: str, pieces: Sequence[Piece], spacing: float) -> None:
    """Refuse a spacing that does not resolve a body.

    The piece with the largest volume must be `LAYERS` spacings thick; a body of sheets alone
    passes, since a sheet is always a layer.

    Args:
        name: of the body.
        pieces: of all its links.
        spacing: of the fluid [m].

    Raises:
        PhysicsError: the largest spacing that would do is printed.
    """
    solid = [piece for piece in pieces if _own_volume(piece) > 0.0]
    if not solid:
        return
    thick = thickness(max(solid, key=_own_volume))
    if thick < LAYERS * spacing:
        raise PhysicsError(
            f"a spacing of {spacing:g} m is too coarse for '{name}': its main part is "
            f"{thick:.3g} m thick.\n"
            f"Allowed: up to {thick / LAYERS:.3g} m, {LAYERS:g} particles through it; "
            "for forces within 5 % take a tenth of its size."
        )
