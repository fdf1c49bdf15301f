"""Sample of air and water at the links, and its view for the medium of an effect."""

from __future__ import annotations

from typing import NamedTuple

from seals.arrays import Array
from seals.motion import Medium, MediumKind


class Sample(NamedTuple):
    """Air and water at the links, shapes as in `seals.motion.Medium`, for both media at once.

    ``water_gradient`` is that of the waves' velocity, as in `seals.environment.waves.Sea`.
    """

    submersion: Array
    submersion_rate: Array
    buoyancy_centre: Array
    normal: Array
    sinking_speed: Array
    gravity: Array
    water_velocity: Array
    water_acceleration: Array
    water_density: Array
    water_viscosity: Array
    air_velocity: Array
    air_density: Array
    air_viscosity: Array
    one: Array
    depth: Array | None = None
    water_gradient: Array | None = None

    def view(self, kind: MediumKind | None) -> Medium:
        """Return the surroundings as seen by an effect of the medium ``kind``.

        An effect that knows no medium gets the fraction 1 and the fields of the air.
        """
        s = self.submersion
        if kind is MediumKind.water:
            own = (
                s,
                self.water_velocity,
                self.water_acceleration,
                self.water_density,
                self.water_viscosity,
            )
        elif kind is MediumKind.air:
            own = (
                1.0 - s,
                self.air_velocity,
                self.air_velocity * 0.0,
                self.air_density,
                self.air_viscosity,
            )
        elif kind is None:
            air = self.air_velocity
            own = (self.one, air, air, self.air_density, self.air_viscosity)
        else:
            dry = 1.0 - s
            own = (
                self.one,
                s * self.water_velocity + dry * self.air_velocity,
                s * self.water_acceleration,
                s * self.water_density + dry * self.air_density,
                s * self.water_viscosity + dry * self.air_viscosity,
            )
        # in the order of the fields: keywords cost as much as the arithmetic
        return Medium(
            *own,
            s,
            self.submersion_rate,
            self.buoyancy_centre,
            self.normal,
            self.sinking_speed,
            self.gravity,
            self.depth,
            self.water_density,
            self.air_density,
        )
