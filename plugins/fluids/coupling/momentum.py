"""Linear momentum balance of a step, from the impulses that a solver reports."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.fluid import MomentumBalance
from seals.plugins.fluids.solver import Exchange


def momentum_balance(
    done: Exchange, bodies: int, before: Floats, sources: Floats, after: Floats
) -> MomentumBalance:
    """Return the momentum balance of a step.

    Args:
        done: impulses of the step.
        bodies: number of moving boundaries that are bodies; the rest are moved walls.
        before: momentum of the water at the start [N s], shape (3,).
        sources: momentum from beaches, wind, particles added and removed [N s], shape (3,).
        after: momentum at the end [N s], shape (3,).
    """
    pushed = done.impulses[:bodies, :3].sum(axis=0)
    walls = done.walls + done.impulses[bodies:, :3].sum(axis=0)
    exchanged = (done.gravity, done.impulses[:, :3], done.walls)
    gross = sum(float(np.abs(part).sum()) for part in exchanged)
    return MomentumBalance(before, after, done.gravity, sources, pushed, walls, gross)
