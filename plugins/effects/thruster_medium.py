"""Thruster force by the density at each hub (air, water, partly submerged)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seals.arrays import namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Identification
from seals.environment.disc import hub_depth, wet_share
from seals.environment.seawater import FRESH_WATER
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param

AIR = 1.2
"""Density of air where it is not known: ISO 2533 at 20 degC [kg/m^3]."""


@dataclass(kw_only=True)
class ThrusterMedium(Effect):
    """Force of thrusters in proportion to the density around each of them.

    Equation:
        T = (s + (1 - s) rho_a / rho_w) T_free at equal speed, s = u^2 (3 - 2 u), u = (depth + R) /
        (2 R) of each hub, held between 0 and 1.

    Args:
        radius: R of the propellers [m].
        links: the link of the thrusters it changes, the root by default.

    Assumptions:
        The electronics turn a commanded force into the speed that gives it under water, and hold
        that speed outside. Drives with a disc of their own, rotors, are left alone.

    Valid range:
        Thrusters that break the surface now and then.

    Limitations:
        No ventilation of a thruster just below the surface, no racing out of the water. Power goes
        with the force alone.

    References:
        Faltinsen 1990, Sea Loads on Ships and Offshore Structures, ch. 9: loss of thrust of a
        propeller that comes out of the water. The smooth step over one radius is chosen.

    Example:
        >>> ThrusterMedium(radius=0.04).radius
        0.04
    """

    radius: float = param(
        0.05, "m", bounds=(1e-3, 10.0), tolerance=0.0, source="chosen: small thrusters", fit=False
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("thrust in water",)
    actuator: ClassVar[str] = "thrusters"
    # the thrust in water is a candidate by itself
    identification: ClassVar[Identification] = Identification(
        searched=False,
        compared=None,
    )

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Forces [N] in the medium at every hub."""
        xp = namespace(drives.thrust)
        air = params["radius"] * 0.0 + AIR if medium.air_density is None else medium.air_density
        depth = hub_depth(drives, motion, medium)
        if depth is None:
            gain = air / FRESH_WATER
        else:
            thin = air / medium.water_density
            gain = thin + (1.0 - thin) * wet_share(depth, params["radius"])
        return drives._replace(thrust=drives.thrust * xp.where(drives.radius > 0.0, 1.0, gain))
