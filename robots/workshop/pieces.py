"""Homogeneous solids that make up a link: pose, mass, inertia, volume, mesh."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from seals.arrays import Floats

Place: TypeAlias = "Sequence[float] | Floats"

ROUND = 20
"""Corners of a drawn circle."""


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A homogeneous piece in link axes.

    Args:
        kind: ``box``, ``rod`` (full cylinder along its z), ``can`` (thin closed cylinder along its
            z), ``ball``; drawn only, without mass: ``blade`` (a box), ``ring`` (a short tube).
        size: box and blade full edges; rod and can radius, length; ball radius [m].
        mass: [kg].
        centre: [m], shape (3,).
        turn: rotation of the piece in the link, shape (3, 3).
        colour: name of its material; empty when it lies inside and is not drawn.
        solid: whether it touches other things.
        wet: whether it displaces water with its full volume.
        chamfer: of the rims of a drawn can [m].
    """

    kind: str
    size: tuple[float, ...]
    mass: float = 0.0
    centre: Floats = field(default_factory=lambda: np.zeros(3))
    turn: Floats = field(default_factory=lambda: np.eye(3))
    colour: str = ""
    solid: bool = False
    wet: bool = False
    chamfer: float = 0.0

    @property
    def volume(self) -> float:
        """Volume of the shape [m^3]."""
        if self.kind in ("box", "blade"):
            return math.prod(self.size)
        if self.kind == "ball":
            return 4.0 / 3.0 * math.pi * self.size[0] ** 3
        return math.pi * self.size[0] ** 2 * self.size[1]

    def weighed(self, density: float) -> Piece:
        """Return the piece with the mass of its volume, displacing water.

        Args:
            density: of its material [kg/m^3].
        """
        return dataclasses.replace(self, mass=density * self.volume, wet=True)

    def inertia(self) -> Floats:
        """Inertia about the piece's own centre, link axes [kg m^2], shape (3, 3)."""
        diagonal = np.diag(self.mass * np.array(_gyration(self.kind, self.size)))
        turned: Floats = self.turn @ diagonal @ self.turn.T
        return turned

    def mesh(self) -> Any:
        """Triangles of the shape in link axes."""
        from trimesh.creation import annulus, box, cylinder, icosphere, revolve

        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = self.turn, self.centre
        if self.kind in ("box", "blade"):
            made = box(extents=self.size)
        elif self.kind == "ball":
            made = icosphere(subdivisions=1, radius=self.size[0])
        elif self.kind == "ring":
            outer, length = self.size
            made = annulus(r_min=0.85 * outer, r_max=outer, height=length, sections=ROUND)
        elif self.chamfer > 0.0:
            radius, half, cut = self.size[0], self.size[1] / 2, self.chamfer
            outline = [(0, -half), (radius - cut, -half), (radius, cut - half)]
            outline += [(radius, half - cut), (radius - cut, half), (0, half)]
            made = revolve(np.array(outline), sections=2 * ROUND)
        else:
            made = cylinder(radius=self.size[0], height=self.size[1], sections=ROUND)
        made.apply_transform(pose)
        return made


def _gyration(kind: str, size: Sequence[float]) -> tuple[float, float, float]:
    """Moments per mass about the principal axes of a shape [m^2]."""
    if kind in ("box", "blade"):
        a, b, c = (edge**2 / 12.0 for edge in size)
        return b + c, a + c, a + b
    if kind == "ball":
        return (0.4 * size[0] ** 2,) * 3
    radius, length = size
    if kind == "rod":
        across = radius**2 / 4.0 + length**2 / 12.0
        return across, across, radius**2 / 2.0
    # a can has its mass in the mantle and two lids of one thickness
    mantle = length / (length + radius)
    across = mantle * (radius**2 / 2.0 + length**2 / 12.0)
    across += (1.0 - mantle) * (radius**2 / 4.0 + length**2 / 4.0)
    return across, across, mantle * radius**2 + (1.0 - mantle) * radius**2 / 2.0


def box(size: Sequence[float], at: Place, mass: float = 0.0, **more: Any) -> Piece:
    """Return a box with full edges [m] centred at a place [m]."""
    return Piece(kind="box", size=tuple(size), mass=mass, centre=np.array(at, float), **more)


def can(radius: float, length: float, at: Place, mass: float = 0.0, **more: Any) -> Piece:
    """Return a thin closed cylinder along z centred at a place [m]."""
    centre = np.array(at, float)
    return Piece(kind="can", size=(radius, length), mass=mass, centre=centre, **more)


def rod(radius: float, start: Place, end: Place, mass: float = 0.0, **more: Any) -> Piece:
    """Return a full cylinder, or a drawn ring, between the centres of its end faces [m]."""
    a, b = np.array(start, float), np.array(end, float)
    if b[2] < a[2]:
        a, b = b, a
    size = (radius, float(np.linalg.norm(b - a)))
    turn = along((b - a) / size[1])
    more.setdefault("kind", "rod")
    return Piece(size=size, mass=mass, centre=(a + b) / 2.0, turn=turn, **more)


def ball(radius: float, at: Place, mass: float = 0.0, **more: Any) -> Piece:
    """Return a full ball centred at a place [m]."""
    return Piece(kind="ball", size=(radius,), mass=mass, centre=np.array(at, float), **more)


def along(axis: Floats) -> Floats:
    """Return the rotation that carries z onto a unit axis by the shortest way, shape (3, 3)."""
    x, y, z = (float(v) for v in axis)
    if z < -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]])
    turn: Floats = np.eye(3) + cross + cross @ cross / (1.0 + z)
    return turn


def turned(axis: str, angle: float) -> Floats:
    """Return the rotation about a link axis x, y or z by an angle [rad], shape (3, 3)."""
    turn: Floats = Rotation.from_euler(axis, angle).as_matrix()
    return turn


def angles(turn: Floats) -> tuple[float, float, float]:
    """Return roll, pitch, yaw of a rotation as URDF means them [rad]."""
    pitch = math.asin(float(np.clip(-turn[2, 0], -1.0, 1.0)))
    if abs(turn[2, 0]) > 1.0 - 1e-9:
        return math.atan2(-float(turn[1, 2]), float(turn[1, 1])), pitch, 0.0
    roll = math.atan2(float(turn[2, 1]), float(turn[2, 2]))
    return roll, pitch, math.atan2(float(turn[1, 0]), float(turn[0, 0]))
