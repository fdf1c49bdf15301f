"""Thrust of air rotors under water."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.environment.disc import wet_share
from seals.environment.settings import EnvironmentSettings
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param

HALF_WIDTH = 0.03
"""Depth of a hub at which it is wholly wet [m]."""


@dataclass(kw_only=True)
class ThrustInWater(Effect):
    """Change of thrust and reaction torque of every drive whose hub is under water.

    Equation:
        T = T_free (1 + s_h (ratio + ratio_change - 1)), the reaction torque likewise; s_h = u^2
        (3 - 2 u) with u = (depth of the hub + 3 cm) / 6 cm, held between 0 and 1.

    Args:
        ratio: of thrust in water to that in the drive's own map [1].
        ratio_change: change of the ratio [1].
        water_level: world z of the still surface [m].
        links: the link of the actuators it changes, the root by default.

    Assumptions:
        The surface is flat at ``water_level``; the controller takes account of the density, so that
        the ratio is near one.

    Valid range:
        Crossings of the surface faster than the pull of air into the disc.

    Limitations:
        No ventilation, no cavitation, no waves at the disc.

    References:
        Alzu'bi, Mansour, Rawashdeh 2018, Loon Copter, Journal of Field Robotics.
        The width of 6 cm is chosen.

    Example:
        >>> ThrustInWater(ratio=0.8).ratio
        0.8
    """

    ratio: float = param(
        1.0, "1", bounds=(0.0, 2000.0), tolerance=0.0, source="one: no change", fit=False
    )
    ratio_change: float = param(
        0.0, "1", bounds=(-2.0, 2.0), tolerance=0.02, source="zero: the ratio rules"
    )
    water_level: float = param(
        0.0, "m", bounds=(-1e4, 1e4), tolerance=0.0, source="chosen: world zero", fit=False
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("thrust in water",)
    identification: ClassVar[Identification] = Identification(
        words={"ratio_change": "thrust in water"},
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a change of the stated ratio."""
        if not len(subject.lag) or not subject.rotors or name not in subject.effects:
            return []
        ratio = Freed(tolerance=subject.spread("water_thrust_ratio"), scale=0.15)
        order = (Stage.actuators, 0, 8)
        return [
            Addition(instance=name, effect=None, parameters={"ratio_change": ratio}, order=order)
        ]

    @classmethod
    def of_log(
        cls,
        name: str,
        parameters: Mapping[str, float],
        medium: str | None,
        environment: EnvironmentSettings,
    ) -> tuple[str, Effect]:
        """Return the effect with the water level of the log."""
        level: dict[str, Any] = {"water_level": environment.water_level or 0.0}
        return name, cls(**{**parameters, **level})

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts [N] and reaction torques [N m], changed for submerged hubs."""
        hub = motion.position[:, 2:3] + motion.up @ drives.position.T
        depth = params["water_level"] - hub
        gain = 1.0 + wet_share(depth, HALF_WIDTH) * (params["ratio"] + params["ratio_change"] - 1.0)
        return drives._replace(thrust=drives.thrust * gain, torque=drives.torque * gain)
