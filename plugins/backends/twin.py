"""Backend ``twin``: free motion of one robot; in learning, batch dynamics of many."""

from __future__ import annotations

from dataclasses import dataclass

from seals.field_roles import roles
from seals.plugins.backends.free import BackendFree
from seals.schema import param


@roles(data="double")
@dataclass(kw_only=True)
class BackendTwin(BackendFree):
    """Backend ``free`` in a run; in learning thousands of robots in one PyTorch batch, joints held.

    Args:
        passable: see `BackendFree`.
        interval: step of the batch's integrator, fourth order [s].
        double: whether the batch computes in float64.

    Limitations:
        As of ``free``: nothing touches anything. In a batch, the joints stand still.

    Example:
        >>> BackendTwin().interval
        0.02
    """

    interval: float = param(
        0.02,
        "s",
        bounds=(1e-4, 0.05),
        tolerance=0.0,
        source="chosen: speed; see docs/learning.md",
        fit=False,
    )
    double: bool = False
