"""Bodies in particles: as the samples that push, and as the places that hold no water."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from seals.fluid import BodyStates, FluidBody
from seals.plugins.fluids.sampling import ALL, Samples, joined, refuse_coarse, sample_pieces


class Immersed:
    """The bodies of a fluid, sampled once.

    Args:
        bodies: in the order of their states.
        spacing: of the fluid [m].
        thin: what pieces thinner than a spacing stand for.

    Attributes:
        names: of the bodies.
        samples: one layer under each surface, in body axes.
        filled: the whole of each body, in body axes.

    Raises:
        PhysicsError: the spacing is too coarse for a robot.
    """

    def __init__(self, bodies: Sequence[FluidBody], spacing: float, thin: Any) -> None:
        """Look whether the fluid can see the robots, and sample them."""
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
        """Return the surfaces in the world."""
        return joined(_placed(self.samples, states))

    def volumes(self, states: BodyStates) -> Samples:
        """Return the volumes in the world."""
        return joined(_placed(self.filled, states))


def _placed(samples: Sequence[Samples], states: BodyStates) -> list[Samples]:
    pairs = zip(samples, states.position, states.rotation, strict=True)
    return [s.placed(place, turn) for s, place, turn in pairs]


def add_samples(water: Any, body: int, samples: Samples) -> None:
    """Hand samples to the engine, with the volumes that they stand for.

    Args:
        water: the engine, a `ParticleWater`.
        body: number of the body there.
        samples: in its axes.
    """
    if not len(samples.points):
        return
    water.add_boundary(body=body, points=samples.points)
    if (samples.thick < 1.0).any():
        # what is thin has no surface that the engine could weigh: its volume counts
        weights, thick = water.boundary.weights, samples.thick
        own = samples.volumes / water.spacing**3
        weights[body] = thick * weights[body] + (1.0 - thick) * own
        water.boundary.stale = True
