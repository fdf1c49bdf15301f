"""The account of a step: momentum, and what a person wants to watch."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.fluid import Books


def account(done: Any, bodies: int, before: Floats, sources: Floats, after: Floats) -> Books:
    """Return the momentum of a step.

    Args:
        done: what the engine says of it, an `Exchange`.
        bodies: how many of its moving boundaries are bodies; the rest are walls that are moved.
        before: momentum of the water at the start [N s], shape (3,).
        sources: by what the scene did to the water [N s], shape (3,).
        after: momentum at the end [N s], shape (3,).
    """
    pushed = done.impulses[:bodies, :3].sum(axis=0)
    walls = done.walls + done.impulses[bodies:, :3].sum(axis=0)
    exchanged = (done.gravity, done.impulses[:, :3], done.walls)
    gross = sum(float(np.abs(part).sum()) for part in exchanged)
    return Books(before, after, done.gravity, sources, pushed, walls, gross)


def shown(water: Any, done: Any) -> dict[str, float]:
    """Return particles, spacing, compression and iterations.

    Args:
        water: the engine, a `ParticleWater`.
        done: what it says of the last step, an `Exchange`; None before the first.
    """
    out = {"particles": float(water.count), "spacing [m]": float(water.spacing)}
    if done is not None:
        out["mean compression [1]"] = float(done.mean_compression)
        out["largest compression [1]"] = float(done.max_compression)
        out["iterations"] = float(done.iterations)
    return out
