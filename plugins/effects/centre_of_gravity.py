"""Shift of the centre of gravity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from seals.arrays import Array, namespace
from seals.effects import (
    Addition,
    Comparison,
    Identification,
    Stage,
    Subject,
    addition_along_axes,
)
from seals.effects.effect import Effect, Parameters
from seals.frames import skew_last
from seals.motion import Body
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (-1.0, 1.0),
    "tolerance": 0.0006,
    "source": "zero: the centre of the link applies",
}


@dataclass(kw_only=True)
class CentreOfGravity(Effect):
    """Shift of a link's centre of gravity; the moments of inertia about it are unchanged.

    Equation:
        dM = m [[0, -S(d)], [S(d), S(c)^2 - S(c + d)^2]] about the link origin, order [linear,
        angular], with c the stated centre, m the link's mass and S(a) b = a x b.

    Args:
        offset_x: d along link x [m].
        offset_y: d along link y [m].
        offset_z: d along link z [m].

    Assumptions:
        Mass and inertia about the centre of gravity are known.

    Valid range:
        Shifts small against the vehicle.

    Limitations:
        Beside ``payload`` the shift is that of the link without the load.

    References:
        Featherstone 2008, Rigid Body Dynamics Algorithms, ch. 2.

    Example:
        >>> CentreOfGravity(offset_x=0.005).offset_x
        0.005
    """

    offset_x: float = param(0.0, "m", **_LIMITS)
    offset_y: float = param(0.0, "m", **_LIMITS)
    offset_z: float = param(0.0, "m", **_LIMITS)
    accounts_for: ClassVar[tuple[str, ...]] = ("centre of gravity",)
    material: ClassVar[dict[str, float]] = {
        "offset_x": 0.02,
        "offset_y": -0.03,
        "offset_z": 0.025,
    }
    identification: ClassVar[Identification] = Identification(
        confounders=("weak_rotor", "centre_of_buoyancy"),
        may_begin=True,
        may_end=True,
        measurement="Balancing the vehicle on an edge would distinguish them.",
        words={"offset": "centre of gravity"},
        compared=Comparison(
            order=(Stage.body, 2), scales={"offset": lambda s: 0.05 * s.reach}, rigid=True
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a shift of the base's centre of gravity."""
        sizes = subject.spread(name), 0.01
        return addition_along_axes(cls, name, "offset", sizes, (Stage.body, 0, 2))

    @staticmethod
    def inertia_change(body: Body, params: Parameters) -> Array:
        """Change of the inertia about the link origin [kg, kg m, kg m^2]."""
        xp = namespace(body.mass)
        shift = skew_last(params["offset"] + body.centre_of_mass * 0.0)
        before = skew_last(body.centre_of_mass + params["offset"] * 0.0)
        after = before + shift
        corner = xp.matmul(before, before) - xp.matmul(after, after)
        upper = xp.concat((shift * 0.0, -shift), axis=2)
        lower = xp.concat((shift, corner), axis=2)
        return body.mass[:, :, None] * xp.concat((upper, lower), axis=1)
