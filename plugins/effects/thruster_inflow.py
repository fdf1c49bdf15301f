"""Thrust that falls as water already flows through the thruster."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.arrays import namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.frames import cross
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param

_LEAST = 1e-6
"""Force beside that commanded, which keeps the slope of the root finite at rest [N]."""


@dataclass(kw_only=True)
class ThrusterInflow(Effect):
    """Loss of thrust by the speed at which water flows into a thruster.

    Equation:
        T = T_0 - k sqrt(|T_0|) u, u the velocity of the hub through the water along its axis: the
        bilinear law T = T_nn |n| n - T_nu |n| u with the speed n that gives T_0 at rest.

    Args:
        coefficient: k [N^0.5 s/m].
        links: the link of the thrusters it changes, the root by default.

    Assumptions:
        The electronics hold the speed of the blades, not the force. The flow at the hub is that
        around the vehicle: no wake of the hull.

    Valid range:
        Advance speeds below that at which the thrust is gone.

    Limitations:
        The same coefficient for all thrusters, in both directions. Cross flow is left out. Drives
        with a disc of their own, rotors, are left alone.

    References:
        Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control (bilinear thruster
        model); Blanke, Lindegaard and Fossen 2000, Dynamic model for thrust generation of marine
        propellers.

    Example:
        >>> ThrusterInflow(coefficient=1.2).coefficient
        1.2
    """

    coefficient: float = param(
        0.0, "N^0.5 s/m", bounds=(0.0, 1e3), tolerance=0.0, source="zero: a thrust measured at rest"
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("thruster inflow",)
    actuator: ClassVar[str] = "thrusters"
    material: ClassVar[dict[str, float]] = {"coefficient": 0.5}
    identification: ClassVar[Identification] = Identification(
        confounders=("linear_drag", "thrust_coefficient", "thruster_dead_zone"),
        resists=True,
        answers=True,
        measurement="A bollard-pull test, compared with the thrust at speed, would distinguish "
        "them.",
        words={"coefficient": "loss of thrust by inflow"},
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate, where thrusters push."""
        if subject.rotors or not len(subject.lag) or not subject.has_water:
            return []
        loss = Freed(scale=1.0, bounds=(0.0, np.inf))
        order = (Stage.actuators, 0, 5)
        return [
            Addition(instance=name, effect=cls(), parameters={"coefficient": loss}, order=order)
        ]

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Forces [N] of blades that already move with the water."""
        xp = namespace(drives.thrust)
        through = motion.velocity - medium.velocity
        # a . (v + w x p) = a . v + w . (p x a)
        arm = cross(drives.position, drives.axis)
        inflow = through @ drives.axis.T + motion.angular_velocity @ arm.T
        root = xp.sqrt(abs(drives.thrust) + _LEAST)
        thrust = drives.thrust - params["coefficient"] * root * inflow
        return drives._replace(thrust=xp.where(drives.radius > 0.0, drives.thrust, thrust))
