"""Weight of every link."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

from seals.arrays import Array
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Identification
from seals.environment.settings import EnvironmentSettings
from seals.field_roles import roles
from seals.frames import cross
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.robot.model import RobotModel


@roles(data="links")
@dataclass(kw_only=True)
class Gravity(Effect):
    """Uniform gravity on the mass of every link.

    Equation:
        F = -m g R^T e_z at the centre of mass; T = c x F about the link origin.

    Args:
        links: links with weight, all by default.

    Assumptions:
        A uniform field of the strength ``environment.gravity``.

    Valid range:
        Any motion near the ground.

    Limitations:
        No variation with height or latitude; set ``environment.gravity`` to the local value.

    References:
        Newton 1687; standard gravity 9.80665 m/s^2, 3rd CGPM 1901.

    Example:
        >>> Gravity().links
        ['*']
    """

    links: list[str] = field(default_factory=lambda: ["*"])
    accounts_for: ClassVar[tuple[str, ...]] = ("weight",)
    # every model holds it
    identification: ClassVar[Identification] = Identification(
        searched=False,
        compared=None,
    )

    @classmethod
    def of_log(
        cls,
        name: str,
        parameters: Mapping[str, float],
        medium: str | None,
        environment: EnvironmentSettings,
    ) -> tuple[str, Effect]:
        """Return the weight of all links with the gravity of the log's environment."""
        return name, cls()

    @classmethod
    def of_surroundings(
        cls, name: str, robot: RobotModel, environment: EnvironmentSettings
    ) -> dict[str, Effect]:
        """Return the weight of all links."""
        return {name: cls()}

    def ambient(self) -> Effect | None:
        """Return the effect for every link of another robot or object in the scene."""
        return None if self.correction else replace(self, links=["*"])

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Weight at the centre of mass [N, N m]."""
        force = motion.up * (-medium.gravity * motion.body.mass)
        return Wrench(force, cross(motion.body.centre_of_mass, force)), memory
