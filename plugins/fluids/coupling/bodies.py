"""Rigid bodies in the fluid: boundary samples of their surfaces, and displaced volumes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from seals.arrays import Floats
from seals.errors import refuse_unlisted
from seals.fluid import BodyStates, FluidBody
from seals.plugins.fluids.sampling import ALL, Samples, joined, refuse_coarse, sample_pieces
from seals.plugins.fluids.solver import ParticleSolver

CLEAR = 0.95
"""Least initial distance of water from a sample of a body, in cube roots of its volume [1]."""


class Immersed:
    """Rigid bodies immersed in a fluid, with their samples.

    Args:
        bodies: in the order of their states.
        spacing: of the fluid [m].
        thin: treatment of pieces thinner than a spacing.

    Attributes:
        names: of the bodies.
        samples: one layer under each surface, in body axes.
        filled: the whole of each body, in body axes.

    Raises:
        PhysicsError: the spacing is too coarse for a robot.
    """

    def __init__(self, bodies: Sequence[FluidBody], spacing: float, thin: Any) -> None:
        robots: dict[str, list[Any]] = {}
        for body in bodies:
            robots.setdefault(body.name.partition("/")[0], []).extend(body.pieces)
        for name, pieces in robots.items():
            refuse_coarse(name, pieces, spacing)
        self.names = [body.name for body in bodies]
        self.samples = [sample_pieces(body.pieces, spacing, thin=thin) for body in bodies]
        self.filled = [sample_pieces(body.pieces, spacing, layers=ALL) for body in bodies]

    def __len__(self) -> int:
        return len(self.names)

    @property
    def count(self) -> int:
        """Number of samples."""
        return sum(len(samples.points) for samples in self.samples)

    def surfaces(self, states: BodyStates) -> Samples:
        """Return the samples of all surfaces, world axes."""
        return joined(_placed(self.samples, states))

    def volumes(self, states: BodyStates) -> Samples:
        """Return the samples of all volumes, world axes."""
        return joined(_placed(self.filled, states))


def _placed(samples: Sequence[Samples], states: BodyStates) -> list[Samples]:
    pairs = zip(samples, states.position, states.rotation, strict=True)
    return [s.placed(place, turn) for s, place, turn in pairs]


def solid_scales(names: Sequence[str], chosen: Mapping[str, float]) -> list[float]:
    """Return the weight of each body's boundary volumes in the density [1].

    Args:
        names: of the bodies, robot/link.
        chosen: weights by robot, or by robot/link, which counts more.

    Raises:
        ConfigError: a name is that of no body.

    Example:
        >>> solid_scales(["crab/body", "crab/claw", "raft/deck"], {"crab": 2.0, "crab/claw": 0.5})
        [2.0, 0.5, 1.0]
    """
    robots = [name.partition("/")[0] for name in names]
    for name in chosen:
        refuse_unlisted(
            name, [*robots, *names], f"fluid.solid_scale.{name}: no body in the water has this name"
        )
    return [
        chosen.get(name, chosen.get(robot, 1.0)) for name, robot in zip(names, robots, strict=True)
    ]


def add_samples(solver: ParticleSolver, body: int, samples: Samples, scale: float = 1.0) -> None:
    """Add the samples of a body, with the volumes that they displace, to a solver.

    Args:
        solver: of the fluid.
        body: its number there.
        samples: in body axes.
        scale: weight of its volumes in the density [1].
    """
    if len(samples.points):
        # a solver that knows no weights is asked for none
        weighed = {} if scale == 1.0 else {"scale": scale}
        solver.add_boundary(
            body=body,
            points=samples.points,
            volumes=samples.volumes,
            bulk=samples.thick,
            **weighed,
        )


def clear_of(places: Floats, samples: Samples, spacing: float) -> Floats:
    """Return the points that keep clear of the samples [m], shape (n, 3).

    Args:
        places: candidate positions of particles [m], shape (n, 3).
        samples: of all bodies, world axes.
        spacing: of the fluid [m].
    """
    if not len(samples.points):
        return places
    near = cKDTree(samples.points).query_ball_point(places, CLEAR * spacing)
    # a sample of little volume displaces little water
    radius = CLEAR * np.cbrt(np.minimum(samples.volumes, spacing**3))
    inside = np.zeros(len(places), dtype=bool)
    for k, found in enumerate(near):
        if found:
            apart = np.linalg.norm(samples.points[found] - places[k], axis=1)
            inside[k] = bool((apart < radius[found]).any())
    return places[~inside]
