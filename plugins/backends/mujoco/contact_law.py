"""MuJoCo's contact and joint-limit parameters from surface coefficients and the time step."""

from __future__ import annotations

from typing import Any

from seals.robot.model import Surface

STIFF = 0.999
"""Share of the reference acceleration that a constraint enforces [1]: 1 would be rigid."""
RETURN = 0.1
"""Share of a penetration that is taken back in one step [1].

A body pushed out leaves with that share of the speed at which it came, so less is better; at 0.1 a
penetration is gone after some thirty steps.
"""
GRIP = 100.0
"""Ratio of the stiffnesses of friction and of the normal force [1]: a held body does not creep."""
LEAST = 1e-5
"""Least friction coefficient of the engine [1]."""


def impedance() -> list[float]:
    """Return the engine's ``solimp``: the same stiffness at any penetration."""
    return [STIFF, STIFF, 0.001, 0.5, 2.0]


def reference(step: float, restitution: float = 0.0) -> list[float]:
    """Return the engine's ``solref`` of a constraint that stops an approach within one step.

    Equation:
        The engine aims at the acceleration a = -b v - k r. With b = (1 + e) / h the velocity after
        a step is -e v (Newton's law of impact), with k = RETURN / h^2 a penetration r goes back by
        that share. Negative numbers are stiffness and damping as such, scaled by the impedance.

    Args:
        step: h [s].
        restitution: e [1].
    """
    return [-RETURN / step**2 * STIFF**2, -(1.0 + restitution) / step * STIFF]


def set_pair(pair: Any, surface: Surface, step: float) -> None:
    """Set the parameters of a pair of shapes.

    Args:
        pair: of the engine's model description.
        surface: combined coefficients.
        step: h [s].
    """
    slide, spin, roll = surface.friction or 0.0, surface.spinning or 0.0, surface.rolling or 0.0
    pair.condim = 6 if roll > 0.0 else 4 if spin > 0.0 else 3 if slide > LEAST else 1
    pair.friction = [max(x, LEAST) for x in (slide, slide, spin, roll, roll)]
    pair.solref = reference(step, surface.restitution or 0.0)
    # without restitution: what slides is stopped, not sent back
    pair.solreffriction = reference(step)
    pair.solimp = impedance()
    pair.margin = pair.gap = 0.0
