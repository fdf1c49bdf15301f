"""Mean flows of water and air: their course over height, across a jet and with the tide."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import Effect, Parameters
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.motion import Inputs, Medium, Motion
from seals.schema import LATER, param

_TINY = 1e-9
_PLACE = (-1.2e4, 1.2e4)


class FlowProfile(Enum):
    """How a mean flow varies in space; y is the height above the datum."""

    uniform = "uniform"
    """The same everywhere."""
    power = "power"
    """(y / reference)^exponent: 1/7 over land and above a sea bed, 1 is a linear shear."""
    log = "log"
    """ln(y / roughness) / ln(reference / roughness), the layer above a rough wall."""
    layer = "layer"
    """exp(-(y - reference)^2 / (2 width^2)): a jet in the form of a layer, as an undercurrent."""
    jet = "jet"
    """exp(-r^2 / (2 width^2)), r the distance from a line through the centre along the flow."""


@roles(data="links")
@dataclass(kw_only=True)
class MeanFlow(Effect):
    """Velocity of a medium over ground, by a profile in space and with the tide.

    Equation:
        u = velocity f(y, r) (1 - A + A cos(2 pi t / T + phi)), f by `FlowProfile`, zero where y is
        below zero (``power``) or below the roughness (``log``).

    Args:
        profile: f, uniform by default.
        datum: height of the ground or of the sea bed in the world, above which y counts [m].
        reference: height y at which ``velocity`` holds; of the middle of a layer or jet [m].
        exponent: of the power law [1].
        roughness: y_0 of the log law [m].
        width: 1-sigma half width of a layer or jet [m].
        centre_x: a point of the line of a jet, toward east [m].
        centre_y: the same toward north [m].
        tide: A, share of the flow that turns with the tide [1].
        tide_period: T [s].
        tide_phase: phi [rad].
    """

    velocity_x: float = param(
        0.0, "m/s", bounds=(-100.0, 100.0), tolerance=0.05, source="still by default"
    )
    velocity_y: float = param(
        0.0, "m/s", bounds=(-100.0, 100.0), tolerance=0.05, source="still by default"
    )
    velocity_z: float = param(
        0.0, "m/s", bounds=(-100.0, 100.0), tolerance=0.05, source="still by default"
    )
    profile: FlowProfile = field(default=FlowProfile.uniform, metadata=LATER)
    datum: float = param(0.0, "m", bounds=_PLACE, tolerance=0.1, source="chosen", later=True)
    reference: float = param(
        10.0,
        "m",
        bounds=(1e-3, 1e5),
        tolerance=0.1,
        source="height of anemometers: WMO",
        later=True,
    )
    exponent: float = param(
        1.0 / 7.0,
        "1",
        bounds=(0.0, 2.0),
        tolerance=0.03,
        source="1/7: Peterson and Hennessey 1978 (wind), Soulsby 1997 (tidal currents)",
        later=True,
    )
    roughness: float = param(
        0.03, "m", bounds=(1e-6, 10.0), tolerance=0.01, source="open grass land: WMO", later=True
    )
    width: float = param(1.0, "m", bounds=(1e-3, 1e5), tolerance=0.1, source="chosen", later=True)
    centre_x: float = param(0.0, "m", bounds=_PLACE, tolerance=0.1, source="chosen", later=True)
    centre_y: float = param(0.0, "m", bounds=_PLACE, tolerance=0.1, source="chosen", later=True)
    tide: float = param(
        0.0, "1", bounds=(0.0, 1.0), tolerance=0.05, source="steady by default", later=True
    )
    tide_period: float = param(
        44714.2, "s", bounds=(1.0, 1e8), tolerance=1.0, source="M2, 12.42 h: Pugh 1987", later=True
    )
    tide_phase: float = param(
        0.0, "rad", bounds=(-7.0, 7.0), tolerance=0.1, source="chosen", later=True
    )

    def __post_init__(self) -> None:
        """Refuse a log law whose reference lies within the roughness.

        Raises:
            ConfigError: ``reference`` is no larger than ``roughness``.
        """
        if self.profile is FlowProfile.log and self.reference <= self.roughness:
            raise ConfigError(
                f"reference={self.reference:g} m of a log profile is not above its "
                f"roughness={self.roughness:g} m.\n"
                "Allowed: a reference well above the roughness; raise it, or choose profile=power."
            )

    def ambient(self) -> Effect | None:
        """Return the effect for every link of another robot or object in the scene."""
        return None if self.correction else replace(self, links=["*"])

    def constants(self) -> dict[str, Floats]:
        """Return keys that name the profile and a tide; none for a uniform, steady flow."""
        one = np.ones((1, 1))
        own = {} if self.profile is FlowProfile.uniform else {self.profile.value: one}
        return {**own, **({"tidal": one} if self.tide else {})}

    @staticmethod
    def flow(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """Velocity of the medium, world axes [m/s]."""
        velocity = params["velocity"]
        share = _share(motion.position, velocity, params)
        if share is not None:
            velocity = velocity * share
        if "tidal" in params:
            xp, part = namespace(velocity), params["tide"]
            angle = 2.0 * math.pi / params["tide_period"] * motion.time + params["tide_phase"]
            velocity = velocity * (1.0 - part + part * xp.cos(angle))
        return velocity, memory


def _share(position: Array, velocity: Array, params: Parameters) -> Array | None:
    """Share f of the velocity at points, shape (N, 1); None for all of it."""
    xp, reference = namespace(position), params["reference"]
    if "jet" in params:
        height = params["datum"] + reference
        middle = xp.concat((params["centre_x"], params["centre_y"], height), axis=1)
        away = position - middle
        along = xp.sum(away * velocity, axis=1)[:, None]
        fast = xp.sum(velocity * velocity, axis=1)[:, None] + _TINY**2
        apart = xp.sum(away * away, axis=1)[:, None] - along * along / fast
        return xp.exp(-0.5 * apart / params["width"] ** 2)
    y = position[:, 2:3] - params["datum"]
    if "layer" in params:
        return xp.exp(-0.5 * ((y - reference) / params["width"]) ** 2)
    if "power" in params:
        rise = (xp.clip(y, _TINY, None) / reference) ** params["exponent"]
        return xp.where(y > 0.0, rise, 0.0 * rise)
    if "log" in params:
        rough = params["roughness"]
        return xp.log(xp.maximum(y, rough) / rough) / xp.log(reference / rough)
    return None
