"""A point mass fixed to a link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, fixed, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.rigid import skew
from seals.motion import Body
from seals.schema import param

_PLACE: dict[str, Any] = {
    "bounds": (-10.0, 10.0),
    "tolerance": 0.02,
    "source": "chosen: the origin",
}
_EYE = np.eye(3)[None]


@dataclass(kw_only=True)
class Payload(Effect):
    """Point mass fixed to a link: weight, inertia and shift of the centre of gravity.

    Equation:
        dM = m [[1, -S(p)], [S(p), -S(p)^2]] about the link origin, order [linear, angular], with
        S(p) b = p x b.

    Args:
        mass: m, negative for a mass that is missing [kg].
        position_x: p along link x [m].
        position_y: p along link y [m].
        position_z: p along link z [m].
        links: the link that carries it, the root by default.
        correction: see `seals.effects.Effect`.

    Assumptions:
        A point: no inertia about its own centre; no volume, no drag.

    Valid range:
        As long as the mass of the link with it stays positive.

    Limitations:
        Nothing swings or slips.

    References:
        Featherstone 2008, Rigid Body Dynamics Algorithms, ch. 2.

    Example:
        >>> Payload(mass=0.15, position_z=-0.1).mass
        0.15
    """

    mass: float = param(
        0.0, "kg", bounds=(-100.0, 100.0), tolerance=0.01, source="zero: the link's own mass rules"
    )
    position_x: float = param(0.0, "m", **_PLACE)
    position_y: float = param(0.0, "m", **_PLACE)
    position_z: float = param(0.0, "m", **_PLACE)
    accounts_for: ClassVar[tuple[str, ...]] = ("payload",)
    twins: ClassVar[tuple[str, ...]] = ("thrust_coefficient", "buoyancy", "wind")

    @staticmethod
    def nominal(body: Body, params: Parameters) -> Array:
        """Inertia of the point mass about the link origin [kg, kg m, kg m^2]."""
        xp = namespace(params["mass"])
        arm = skew(params["position"] + body.centre_of_mass * 0.0)
        one = arm * 0.0 + fixed(_EYE, arm)
        upper = xp.concat((one, -arm), axis=2)
        lower = xp.concat((arm, -xp.matmul(arm, arm)), axis=2)
        return params["mass"][:, :, None] * xp.concat((upper, lower), axis=1)
