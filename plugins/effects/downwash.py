"""Downwash: the air that the rotors of other robots drive down, as a turbulent jet."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import ClassVar

from seals.arrays import Array, as_like, namespace
from seals.effects import Identification
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.scene import Scene
from seals.field_roles import roles
from seals.motion import Inputs, Medium, Motion
from seals.schema import param

_TINY = 1e-9


@roles(data="links")
@dataclass(kw_only=True)
class Downwash(Effect):
    """Air that the rotors of each other robot of the run drive away: one round turbulent jet.

    Equation:
        Against the sum of its thrusts T, from their centre, at the distance z along it and r beside
        it: u = u_c(z) (1 + a (r / z)^2)^-2, a = (sqrt(2) - 1) / S^2, S the growth of the radius of
        half the speed. The momentum of the jet is the thrust, rho int u^2 dA = T, so that
        u_c = sqrt(3 a T / (pi rho)) / z. No air is faster than in the far wake of the rotors by
        momentum theory, w = sqrt(2 T / (rho A)), A the area of all discs: nearer than where u_c is
        w the jet is as it is there. Nothing upstream.

    Args:
        spreading: S [1].
        medium: air.
        links: links that feel it, all by default.

    Assumptions:
        The rotors of a robot make one jet, which is steady and straight, in air at rest; it follows
        its thrust at once. Jets of several robots add up. Air drag and all laws of the air on the
        links feel it, each link at its origin.

    Valid range:
        From 2.5 diameters of the upper robot below it, where measured flow below quadrotors is that
        of a round jet; hover and slow flight.

    Limitations:
        The thrust of rotors in the jet does not change, though inflow from above costs some of it;
        nearer than 2.5 diameters single wakes are told apart in truth. No wind that bends the jet,
        no delay on its way, no ground, no turbulence in it: the effect ``gusts`` adds some.

    References:
        Bauersfeld, Muller, Ziegler, Coletti and Scaramuzza 2024, Robotics meets Fluid Dynamics,
        arXiv 2403.13321 (a turbulent jet from 2.5 diameters on). Pope 2000, Turbulent Flows, ch. 5
        (round jets: profile, S = 0.094); Abdel-Rahman, Al-Fahed and Chakroun 1996, Mech. Res.
        Commun. 23, 313 (u_c = 6.11 U d / z behind a nozzle, here 5.93); Leishman 2006, Principles
        of Helicopter Aerodynamics, ch. 2 (far wake).

    Example:
        >>> Downwash().spreading
        0.094
    """

    spreading: float = param(
        0.094,
        "1",
        bounds=(0.01, 1.0),
        tolerance=0.008,
        source="round jets: Pope 2000, table 5.1, after Hussein, Capp and George 1994",
    )
    medium: MediumKind = MediumKind.air
    links: list[str] = field(default_factory=lambda: ["*"])
    accounts_for: ClassVar[tuple[str, ...]] = ("downwash",)
    identification: ClassVar[Identification] = Identification(searched=False, compared=None)

    def ambient(self) -> Effect | None:
        """Return the effect for every link of another robot or object in the scene."""
        return None if self.correction else replace(self, links=["*"])

    @staticmethod
    def flow(  # noqa: PLR0917  arguments of the hook
        motion: Motion,
        medium: Medium,
        inputs: Inputs,
        memory: Array,
        params: Parameters,
        scene: Scene,
    ) -> tuple[Array, Array]:
        """Velocity of the air, world axes [m/s]."""
        place = motion.position
        xp, total = namespace(place), 0.0 * place
        density = scene.air_density
        growth = (math.sqrt(2.0) - 1.0) / params["spreading"] ** 2
        for rotors in scene.rotors():
            thrust = xp.clip(as_like(rotors.thrust, place), 0.0, None)[:, None]
            push = xp.sum(thrust * as_like(rotors.axis, place), axis=0)[None]
            size = xp.sqrt(xp.sum(push * push, axis=1, keepdims=True)) + _TINY
            weight = thrust / (xp.sum(thrust, axis=0)[None] + _TINY)
            centre = xp.sum(weight * as_like(rotors.position, place), axis=0)[None]
            area = math.pi * float((rotors.radius**2).sum())
            down, away = -push / size, place - centre
            along = xp.sum(away * down, axis=1, keepdims=True)
            across = xp.sum(away * away, axis=1, keepdims=True) - along**2
            far = xp.sqrt(3.0 * growth * size / (math.pi * density))
            core = far / xp.sqrt(2.0 * size / (density * area))
            ahead = xp.where(along > core, along, core)
            speed = far / ahead * (1.0 + growth * across / ahead**2) ** -2
            total = total + xp.where(along > 0.0, speed, 0.0 * speed) * down
        return total, memory
