"""Quantities that depend on the state alone: link poses, link velocities, surroundings."""

from __future__ import annotations

from typing import NamedTuple

from seals.arrays import Array
from seals.environment.sample import Sample
from seals.motion import Motion
from seals.multibody.kinematics import Kinematics, LinkVelocities


class Posture(NamedTuple):
    """Poses, velocities and surroundings at a state, independent of the parameters.

    Args:
        base: R_WB, shape (B, 3, 3).
        motion: of the links, rows link by link.
        sample: surroundings without the flow effects; None to sample them afresh.
        kinematics: of the links; None for a single body.
        moving: velocities of the links; None for a single body.
    """

    base: Array
    motion: Motion
    sample: Sample | None = None
    kinematics: Kinematics | None = None
    moving: LinkVelocities | None = None
