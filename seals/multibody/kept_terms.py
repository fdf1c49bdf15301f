"""Terms of the equations of motion of many robots that outlast one evaluation at known poses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.multibody.composite import RigidInertias
from seals.multibody.linear import ChangedLead, Factors, LeadFactors


@dataclass(frozen=True, kw_only=True)
class KeptTerms:
    """Terms that depend on poses, velocities and rigid inertias alone, not on the loads.

    A fit evaluates a robot at the same poses with one set of parameters after another, and most of
    these change no inertia, or that of the base alone.

    Args:
        inertia: of the links about their origins, link axes, shape (1, L, 6, 6).
        rigid: the same in rigid-body form.
        armature: of the joint drives, shape (J,); None for none.
        matrix: generalised inertia, shape (B, n, n).
        moving: velocities of the links at which the loads hold.
        load: forces and torques of inertia on the links, link axes, shape (6, L, B).
    """

    inertia: Floats
    rigid: RigidInertias
    armature: Floats | None
    matrix: Floats
    moving: Any
    load: Floats

    @cached_property
    def factors(self) -> Factors:
        """Factors of the generalised inertia."""
        return Factors(self.matrix)

    @cached_property
    def _lead(self) -> LeadFactors | None:
        """Factors that stay when the base changes; None where the joints' inertia is indefinite."""
        try:
            return LeadFactors(self.matrix, 6)
        except np.linalg.LinAlgError:
            return None

    def factors_of(self, matrix: Floats, change: Floats) -> Factors | ChangedLead:
        """Return the factors of a generalised inertia that differs by that of the base alone.

        Args:
            matrix: shape (B, n, n).
            change: of its leading block, shape (B, 6, 6).
        """
        return Factors(matrix) if self._lead is None else self._lead.changed(change)

    def differing(self, inertia: Floats, armature: Floats | None) -> list[int] | None:
        """Return the links whose inertia differs; None where other terms do, too."""
        drives = np.zeros(0) if armature is None else armature
        own = np.zeros(0) if self.armature is None else self.armature
        if inertia.shape != self.inertia.shape or not np.array_equal(drives, own):
            return None
        return [int(k) for k in np.flatnonzero((inertia != self.inertia).any(axis=(0, 2, 3)))]
