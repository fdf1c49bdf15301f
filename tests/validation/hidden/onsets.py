"""Hidden effects that begin or end in the middle of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array

Span = tuple[float | None, float | None]
NAMES = {
    "quad": ["wind", "payload", "weak_rotor", "tether"],
    "aam": ["wind", "payload", "weak_rotor"],
    "auv": ["current", "payload", "weak_rotor", "tether"],
    "crossing": ["payload", "weak_rotor"],
}


def draw(rng: np.random.Generator, name: str, seconds: float) -> Span:
    """First and last moment after the first logged row [s]; None where it is open."""
    early, late = rng.uniform(0.2, 0.5) * seconds, rng.uniform(0.6, 0.8) * seconds
    if name == "payload":
        return None, float(rng.uniform(early, late))
    if name == "weak_rotor":
        return float(rng.uniform(early, late)), None
    kind = int(rng.integers(3))
    moment = float(rng.uniform(early, late))
    return [(moment, None), (None, moment), (float(early), float(late))][kind]


def acts(span: Span, t: float) -> bool:
    """True where the effect acts at a time after the first logged row."""
    start, end = span
    return (start is None or t >= start) and (end is None or t < end)


def schedule(
    spans: Sequence[Span],
    with_it: Plant,
    without: Plant,
    before: float,
    make: Callable[[Plant], Any],
) -> list[tuple[float, Any]]:
    """Bodies of a batch and the times of the run from which they hold, the first at zero.

    Args:
        spans: Of every member.
        with_it: Parameters where the effect acts; members along the last axis.
        without: The same where it does not.
        before: Time of the first logged row.
        make: Builds the equations of motion.
    """
    times = sorted({x for span in spans for x in span if x is not None})
    out = []
    for moment in [-before, *times]:
        acting = np.array([acts(s, moment + 1e-9) for s in spans])
        plant = {
            k: np.where(acting, with_it[k], without[k]) if with_it[k].ndim else with_it[k]
            for k in with_it
        }
        out.append((moment + before, make(plant)))
    return out


def entered(body: Any, after: Any, state: Array, t: Array) -> Array:
    """The state under other parameters: pose and velocities go on, momentum follows."""
    m = body.motion(state, t)[0]
    return after.with_motion(state, m.velocity, m.spin, t)
