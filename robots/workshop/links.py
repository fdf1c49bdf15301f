"""Links made of pieces, and the joints between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Floats
from seals.robots.workshop.pieces import Piece


@dataclass(frozen=True, kw_only=True)
class Link:
    """A link: its pieces, and the friction of its surface.

    Args:
        name: of the link.
        pieces: what it is made of; none for a frame.
        friction: Coulomb coefficient of its surface [1]; None leaves that of the engine.
        spinning: friction against turning on the spot, times the normal force [m].
        stem: of its mesh files, shared by links of one shape; empty for the name.
        hull_mesh: whether the solid pieces touch as one convex mesh instead of piece by piece.
    """

    name: str
    pieces: Sequence[Piece] = ()
    friction: float | None = None
    spinning: float = 0.0
    stem: str = ""
    hull_mesh: bool = False

    @property
    def mass(self) -> float:
        """Sum over the pieces [kg]."""
        return sum(piece.mass for piece in self.pieces)

    @property
    def volume(self) -> float:
        """Displaced by the wet pieces [m^3]."""
        return sum(piece.volume for piece in self.pieces if piece.wet)

    def centre(self) -> Floats:
        """Centre of mass in link axes [m], shape (3,)."""
        total = sum((piece.mass * piece.centre for piece in self.pieces), np.zeros(3))
        return total / self.mass

    def inertia(self) -> Floats:
        """Inertia about the centre of mass, link axes [kg m^2], shape (3, 3)."""
        total, middle = np.zeros((3, 3)), self.centre()
        for piece in self.pieces:
            d = piece.centre - middle
            total += piece.inertia() + piece.mass * (d @ d * np.eye(3) - np.outer(d, d))
        return total


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A joint between two links.

    Args:
        name: of the joint.
        parent: link.
        child: link.
        at: origin of the child in the parent [m].
        rpy: of the child in the parent [rad].
        axis: of a revolute joint in the child; empty for a fixed joint.
        limits: lower and upper [rad].
        effort: largest torque [N m].
        speed: largest speed [rad/s].
    """

    name: str
    parent: str
    child: str
    at: Sequence[float] = (0.0, 0.0, 0.0)
    rpy: Sequence[float] = (0.0, 0.0, 0.0)
    axis: Sequence[float] = ()
    limits: tuple[float, float] = (0.0, 0.0)
    effort: float = 0.0
    speed: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Machine:
    """A whole robot.

    Args:
        name: of the robot.
        links: the base first.
        joints: one above each link but the base.
        colours: red, green, blue, alpha of every material.
    """

    name: str
    links: Sequence[Link]
    joints: Sequence[Joint]
    colours: Mapping[str, Sequence[float]] = field(default_factory=dict)
