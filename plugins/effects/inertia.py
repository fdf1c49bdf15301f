"""Change of the moments of inertia."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, fixed, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import (
    Addition,
    Comparison,
    Freed,
    Identification,
    Property,
    Stage,
    Subject,
)
from seals.frames import AXES
from seals.motion import Body
from seals.robot.whole_body import whole_body
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (-1e3, 1e3),
    "tolerance": 0.0005,
    "source": "zero: the inertia of the link applies",
}
_ANGULAR = np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])[None]


@dataclass(kw_only=True)
class InertiaChange(Effect):
    """Change of a link's moments of inertia about its centre of gravity.

    Equation:
        dM = diag(0, 0, 0, delta_xx, delta_yy, delta_zz), order [linear, angular]; the same about
        the centre of gravity and about the link origin.

    Args:
        delta_xx: about link x [kg m^2].
        delta_yy: about link y [kg m^2].
        delta_zz: about link z [kg m^2].

    Assumptions:
        Mass and centre of gravity are known; no change of the products of inertia.

    Valid range:
        As long as the whole inertia is that of a possible body.

    Limitations:
        Axes are those of the link, not the principal ones.

    References:
        Featherstone 2008, Rigid Body Dynamics Algorithms, ch. 2.

    Example:
        >>> InertiaChange(delta_zz=0.002).delta_zz
        0.002
    """

    delta_xx: float = param(0.0, "kg m^2", **_LIMITS)
    delta_yy: float = param(0.0, "kg m^2", **_LIMITS)
    delta_zz: float = param(0.0, "kg m^2", **_LIMITS)
    accounts_for: ClassVar[tuple[str, ...]] = ("inertia",)
    identification: ClassVar[Identification] = Identification(
        answers=True,
        needs_motion=2,
        data_sheet="thrust and mass",
        words={"delta": "moment of inertia"},
        compared=Comparison(
            order=(Stage.body, 1),
            scales={"delta": lambda s: 0.1 * s.mass * s.reach**2},
            rigid=True,
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a change of the base's moments of inertia."""
        diagonal = np.diag(subject.robot.inertia[0])
        whole, spread = np.diag(whole_body(subject.robot)[2]), subject.spread(name)
        sizes = {
            f"delta_{a}{a}": Freed(
                tolerance=spread * diagonal[i],
                scale=0.3 * diagonal[i],
                bounds=(-0.8 * diagonal[i], np.inf),
                changes=Property(name=f"{name}_{a}{a}", value=float(whole[i]), unit="kg m^2"),
            )
            for i, a in enumerate(AXES)
        }
        order = (Stage.body, 0, 1)
        return [Addition(instance=name, effect=cls(), parameters=sizes, order=order)]

    @staticmethod
    def inertia_change(body: Body, params: Parameters) -> Array:
        """Change of the inertia about the link origin [kg m^2]."""
        x, y, z = params["delta_xx"], params["delta_yy"], params["delta_zz"]
        rows = x * 0.0 + y * 0.0 + z * 0.0 + body.mass * 0.0
        diagonal = namespace(x).concat((rows, rows, rows, x + rows, y + rows, z + rows), axis=1)
        return diagonal[:, :, None] * fixed(_ANGULAR, diagonal)
