"""Coulomb friction in MuJoCo: correction of its convex contact problem for sliding contacts.

The engine's contact problem is convex because it lets a sliding contact open: the normal
acceleration exceeds its reference by friction times that of the slip. Lowering the reference by
that much, and solving again, gives Coulomb's law.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, namespace

LOW, HIGH = 0.7, 2.0
"""Least and largest share of a correction that is made, by the secant of the last two [1]."""
ENOUGH = 1e-3
"""Normal velocity that may be left over [m/s]: it lifts a body by micrometres in a step."""
WAYS = 5
"""Ways in which a contact slides, rolls and spins, at most."""


class Sliding:
    """Correction of the reference normal accelerations of all contacts, step by step.

    Equation:
        a_n >= r_n + |mu (a_t - r_t)| is what the engine solves (r: references, t: tangential,
        rolling and spinning). With r_n lowered by the last solution's |mu (a_t - r_t)| the fixed
        point has a_n >= r_n, and friction opposite to the slip at mu times the normal force.

    Args:
        engine: the mujoco module.
        model: of the engine.
        data: of the engine.

    References:
        de Saxce and Feng 1998, doi:10.1016/S0895-7177(98)00119-8; Acary, Cadoux, Lemarechal and
        Malick 2011, doi:10.1002/zamm.201000073.
    """

    def __init__(self, engine: Any, model: Any, data: Any) -> None:
        self._engine, self._model, self._data = engine, model, data

    def begin(self) -> None:
        """Find the rows of the contacts with friction, after `mj_fwdVelocity`."""
        contact, aref = self._data.contact, self._data.efc_aref
        first, size = contact.efc_address, contact.dim
        some = (first >= 0) & (size > 1)
        self._rows = first[some]
        if not len(self._rows):
            return
        ways = np.arange(WAYS)
        slides = ways < size[some, None] - 1
        # ways that a contact does not have are read from the first one's row
        self._ways = self._rows[:, None] + 1 + np.where(slides, ways, 0)
        self._friction = np.where(slides, contact.friction[some], 0.0)
        self._wanted, self._base = aref[self._ways], aref[self._rows]
        self._past, self._known = np.zeros((3, len(self._rows))), np.zeros(1)

    def correct(self, step: float) -> bool:
        """Lower the references by the slip of the last solution; return whether to solve again."""
        if not len(self._rows):
            return False
        d = self._data
        found = np.zeros(d.nefc)
        self._engine.mj_mulJacVec(self._model, d, found, d.qacc)
        normal, past, again, _ = corrected(
            self._friction,
            self._base,
            self._wanted,
            found[self._ways],
            self._past,
            self._known,
            step,
        )
        if not again:
            return False
        self._past, self._known = past, np.ones(1)
        d.efc_aref[self._rows] = normal
        return True


def corrected(  # noqa: PLR0917  what is fixed in a step, and what is not
    friction: Array,
    base: Array,
    wanted: Array,
    change: Array,
    past: Array,
    known: Array,
    step: float,
) -> list[Array]:
    """Return references for the next solution, what to remember, and whether to solve again; pure.

    Args:
        friction: coefficients of every contact, one for each way to slide, zero for a way that it
            does not have [1], shape (C, 5).
        base: references of the normal accelerations [m/s^2], shape (C,).
        wanted: those of the ways to slide [m/s^2], shape (C, 5).
        change: accelerations of the last solution [m/s^2], shape (C, 5).
        past: by how much references were lowered in it; what was left over in the one before, and
            by how much they were lowered in that [m/s^2], shape (3, C).
        known: not zero where there was one before, shape (1,).
        step: h [s].

    Returns:
        References, past, and whether to solve again and whether not, shape (1,) each.
    """
    xp = namespace(base)
    lowered, then, before = past[0], past[1], past[2]
    parts = friction * (change - wanted)
    parts = parts * parts
    total = parts[:, 0]
    for k in range(1, WAYS):
        total = total + parts[:, k]
    slip = xp.sqrt(total)
    off = slip - lowered
    again = xp.max(xp.abs(off))[None] * step > ENOUGH
    # a share of the correction by the secant, where it is not far from one
    moved, less = lowered - before, then - off
    even = less == 0.0
    share = xp.minimum(
        xp.maximum(moved / xp.where(even, less + 1.0, less), moved * 0.0 + LOW), moved * 0.0 + HIGH
    )
    share = xp.where(even, moved * 0.0 + 1.0, share)
    secant = xp.maximum(lowered + share * off, lowered * 0.0)
    later = xp.where(known > 0.0, secant, slip)
    return [base - later, xp.stack((later, off, lowered), axis=0), again, ~again]
