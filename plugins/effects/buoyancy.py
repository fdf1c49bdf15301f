"""Buoyancy of partially or fully submerged hulls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

from seals.arrays import Array
from seals.effects import Addition, Comparison, Freed, Identification, Property, Stage, Subject
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.environment.settings import EnvironmentSettings
from seals.field_roles import roles
from seals.frames import cross
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.robot.model import RobotModel
from seals.schema import param


@roles(data="links")
@dataclass(kw_only=True)
class Buoyancy(Effect):
    """Buoyancy: weight of the displaced water, at the centroid of the submerged volume.

    Equation:
        F = rho (V + dV) s (g up + a_water) at the centroid r_b of the submerged volume; T = r_b x
        F about the link origin. The second term is the pressure gradient of accelerating water,
        zero in still water.

    Args:
        volume_change: dV, change of the displaced volume against the hull's, same shape [m^3].
        medium: the fluid that lifts, water by default.
        links: links with a hull, all by default.

    Assumptions:
        The pressure is that of the undisturbed water; the surface is plane over the hull; the
        density is that at the link.

    Valid range:
        Hulls small against the wave length and the depth over which the density changes.

    Limitations:
        Lift in air is neglected.

    References:
        Archimedes, On Floating Bodies; Fossen 2011, Handbook of Marine Craft Hydrodynamics, ch. 4.

    Example:
        >>> Buoyancy(volume_change=1e-4).volume_change
        0.0001
    """

    volume_change: float = param(
        0.0,
        "m^3",
        bounds=(-10.0, 10.0),
        tolerance=1e-5,
        source="zero: the volume of the hull applies",
    )
    medium: MediumKind = MediumKind.water
    links: list[str] = field(default_factory=lambda: ["*"])
    accounts_for: ClassVar[tuple[str, ...]] = ("buoyancy",)
    zero_when_dry: ClassVar[bool] = True
    identification: ClassVar[Identification] = Identification(
        confounders=("payload",),
        may_begin=True,
        may_end=True,
        measurement="Weighing the vehicle under water would distinguish them.",
        words={"volume_change": "displaced volume"},
        compared=Comparison(
            order=(Stage.water, 0),
            media=("water",),
            scales={"volume_change": lambda s: 0.1 * max(s.volume, 1e-9)},
            whole=True,
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a change of the displaced volume."""
        hull = subject.hull
        if not subject.has_water or hull is None:
            return []
        spread, size = subject.spread("displaced_volume") * hull.volume, 0.05 * hull.volume
        whole = Property(
            name="displaced_volume", value=float(hull.volume), unit="m^3", section="hulls"
        )
        return [
            Addition(
                instance=name,
                effect=None,
                parameters={"volume_change": Freed(tolerance=spread, scale=size, changes=whole)},
                reported=("volume",),
                order=(Stage.water, 0, 0),
            )
        ]

    @classmethod
    def of_log(
        cls,
        name: str,
        parameters: Mapping[str, float],
        medium: str | None,
        environment: EnvironmentSettings,
    ) -> tuple[str, Effect]:
        """Return the buoyancy of the base link, the only hull that a log states."""
        return name, cls(links=["root"])

    @classmethod
    def of_surroundings(
        cls, name: str, robot: RobotModel, environment: EnvironmentSettings
    ) -> dict[str, Effect]:
        """Return the buoyancy of every link with a hull; one instance for the base."""
        wet = [k for k, hull in enumerate(robot.hulls) if hull is not None]
        if environment.water_level is None:
            return {}
        made: dict[str, Effect] = {name: cls(links=["root"])} if 0 in wet else {}
        further = [robot.links[k] for k in wet if k]
        return made | ({f"{name}_links": cls(links=further)} if further else {})

    def ambient(self) -> Effect | None:
        """Return the effect for every link of another robot or object in the scene."""
        return None if self.correction else replace(self, links=["*"], volume_change=0.0)

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Buoyancy force at the centre of buoyancy [N, N m]."""
        displaced = (
            medium.density * (motion.body.volume + params["volume_change"]) * medium.submersion
        )
        force = (motion.up * medium.gravity + medium.acceleration) * displaced
        return Wrench(force, cross(medium.buoyancy_centre, force)), memory
