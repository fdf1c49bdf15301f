"""Rotor thrust and torque, scaled by the density at each disc (air, water, partly submerged)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seals.arrays import namespace, some
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Identification
from seals.environment.disc import hub_depth, wet_share
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param


@dataclass(kw_only=True)
class RotorMedium(Effect):
    """Thrust and torque of rotors by the density at each disc, limited by the motor torque.

    Equation:
        Q = g Q_free and T = (1 - (1 - efficiency) s) g T_free at equal speed, with
        g = ((1 - s) rho_a + s rho_w) / rho_0 and s = u^2 (3 - 2 u), u = (depth + R) / (2 R) of each
        hub, held between 0 and 1. Where Q is more than the motor's torque limit the rotor runs
        slower by the root of what is missing: k_Q g w^2 = limit, and T falls with Q.

    Args:
        efficiency: thrust for a torque in water against that in air [1].
        torque_limit: of every motor [N m].
        reference_density: rho_0, for which the rotors' coefficients hold [kg/m^3].
        links: the link of the rotors it changes, the root by default.

    Assumptions:
        Coefficients of thrust and torque do not depend on the Reynolds number beyond the
        efficiency. A rotor that gets under water is braked at once, and at once as fast as its
        motor allows when it comes out: the torque of the water is hundreds of times the motor's.
        The state of its drive is then what is asked of it, not its speed.

    Valid range:
        Crossings of the surface faster than the pull of air into the disc; tip speeds in water
        below cavitation, some 15 m/s near the surface.

    Limitations:
        No ventilation, no cavitation, no slamming of blades; drives without a disc (radius zero)
        are left alone. Under waves the surface is plane around the link.

    References:
        Alzu'bi, Mansour, Rawashdeh 2018, Loon Copter, Journal of Field Robotics 35(5): air
        propellers that work under water at a small share of their speed in air. The efficiency and
        the smooth step over one radius are chosen.

    Example:
        >>> RotorMedium(efficiency=0.7, torque_limit=0.12).efficiency
        0.7
    """

    efficiency: float = param(0.7, "1", bounds=(0.0, 2.0), tolerance=0.1, source="chosen")
    torque_limit: float = param(
        0.1, "N m", bounds=(1e-6, 1e4), tolerance=0.0, source="chosen: motors of 60 g", fit=False
    )
    reference_density: float = param(
        1.2, "kg/m^3", bounds=(0.1, 2e3), tolerance=0.0, source="ISO 2533 at 20 degC", fit=False
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("thrust in water",)
    # a motor at its limit throughout: the corner where a limit sets in hides the order of a method
    material: ClassVar[dict[str, float]] = {"torque_limit": 0.03}
    # the thrust in water is a candidate by itself
    identification: ClassVar[Identification] = Identification(
        searched=False,
        compared=None,
    )

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts [N], reaction torques [N m] and speeds [rad/s] in the medium at every disc."""
        xp = namespace(drives.thrust)
        bare = drives.radius <= 0.0
        # most robots have no drive without a disc, and nothing to leave alone
        discs = not some(bare)
        air = params["reference_density"] if medium.air_density is None else medium.air_density
        gain = push = air / params["reference_density"]
        depth = hub_depth(drives, motion, medium)
        # high above the water, most of the time, there is no disc to look at
        if depth is not None and some(depth >= -drives.radius):
            wet = wet_share(depth, drives.radius if discs else xp.where(bare, 1.0, drives.radius))
            full = medium.water_density / params["reference_density"]
            gain = gain + wet * (full - gain)
            push = (1.0 - (1.0 - params["efficiency"]) * wet) * gain
        limit = params["torque_limit"]
        asked = xp.abs(drives.torque) * gain
        if push is gain and not some(asked > limit):
            gain = gain if discs else xp.where(bare, 1.0, gain)
            hubs = drives.position, drives.axis, drives.radius
            return Drives(*hubs, drives.thrust * gain, drives.torque * gain, drives.speed)
        held = limit / xp.maximum(asked, limit)
        speed = drives.speed
        slower, push, gain = xp.sqrt(held), push * held, gain * held
        if not discs:
            slower, push, gain = (xp.where(bare, 1.0, x) for x in (slower, push, gain))
        return drives._replace(
            thrust=drives.thrust * push,
            torque=drives.torque * gain,
            speed=None if speed is None else speed * slower,
        )
