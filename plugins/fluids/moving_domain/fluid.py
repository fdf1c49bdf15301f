"""Water as particles in a window that goes with the robot through an open sea."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, Floats
from seals.environment.ground_settings import ObstacleSettings
from seals.environment.settings import EnvironmentSettings
from seals.environment.surroundings import WaterColumn
from seals.environment.waves import Sea
from seals.errors import ConfigError
from seals.fluid import BodyStates, Books, FluidBody, Surrounding
from seals.plugins.fluids.coupling import ACCOUNTS
from seals.plugins.fluids.moving_domain.box import Box
from seals.plugins.fluids.moving_domain.outer import Outer
from seals.plugins.fluids.moving_domain.parcel import Parcel
from seals.plugins.fluids.moving_domain.refusals import refuse_box, refuse_ground, refuse_sea
from seals.plugins.fluids.pbd.settings import PbdSettings
from seals.plugins.fluids.sampling import Thin
from seals.plugins.fluids.tank.settings import Device
from seals.schema import param, vector

_CHOSEN = "chosen"
MACH = 10.0
"""Speed of sound over that of the fastest long wave on water of the window's depth [1]."""


@dataclass(kw_only=True)
class FluidWindow:
    """Water as particles in a window that goes with the robot through an open sea.

    Equation:
        Water as in `FluidParticles`. Sides and floor are where the outer sea has carried them,
        x = X + U t + xi(X, t), with the displacement xi of the waves and the current U; in a ring
        along the sides v <- v + (u - v)(1 - exp(-rate w h)), u of the outer sea,
        w = (exp(s^3.5) - 1) / (e - 1), s from 0 at its inner edge to 1 at the side.

    Args:
        spacing: of the particles at rest [m]; the nearest one that divides the depth is taken.
        size: length (x), width (y) and depth of the window [m]; down to
            ``environment.tank_bottom`` where that is less deep.
        freeboard: height of the sides above the water [m].
        ring: width of the relaxation ring, in spacings.
        cell: by which the window moves, in spacings, once the robot has come so far.
        rate: at the sides [1/s].
        lag: in which a wrong amount of water in the window fades [s].
        current: east and north [m/s].
        substeps: of the fluid in a step of the world; 0 takes as many as its speed of sound asks.
        physics: numbers of the fluid itself; density and gravity are those of the environment.
        device: cpu or cuda.
        threads: on the cpu; 0 for all that this process may use.
        most: particles and boundary samples allowed before anything is allocated.
        thin: what parts of bodies thinner than a spacing stand for: their volume, or a layer.
        look: time between two looks at the surface [s].

    Assumptions:
        The outer sea is that of ``wave``: sums of linear waves, undisturbed by the robot. The
        first body of the robot is the one that the window follows. Air pushes nothing.

    Valid range:
        Waves of eight spacings and more; steepness k a below 0.2. Robots that fit inside of the
        ring with a cell to spare.

    Limitations:
        The window moves with the orbits of its waves as a whole, so it must hold the robot also
        when waves carry the two apart by their height. What the robot radiates ends in the ring,
        so the window should be some times as wide as the robot: the water that it pushes aside has
        to pass between it and the sides. A shift sends a small pulse of sound through the window,
        see `experiments/open_sea`. An irregular sea of many components costs more than the
        particles. No obstacles, no shore. The limits of `FluidParticles`.

    References:
        Jacobsen, Fuhrman and Fredsoe 2012, doi:10.1002/fld.2726, for the weight of the ring;
        those of `FluidParticles`.

    Example:
        >>> FluidWindow(spacing=0.05).name
        'window'
    """

    spacing: float = param(0.05, "m", bounds=(1e-3, 5.0), tolerance=0.0, source=_CHOSEN, fit=False)
    size: list[float] = vector((2.0, 1.6, 0.8), "m", bounds=(0.01, 1e3), source=_CHOSEN)
    freeboard: float = param(0.3, "m", bounds=(0.0, 1e3), tolerance=0.0, source=_CHOSEN, fit=False)
    ring: int = 5
    cell: int = 1
    rate: float = param(
        300.0, "1/s", bounds=(0.0, 1e4), tolerance=0.0, source="measured on shifts", fit=False
    )
    lag: float = param(0.1, "s", bounds=(1e-3, 1e3), tolerance=0.0, source=_CHOSEN, fit=False)
    current: list[float] = vector((0.0, 0.0), "m/s", bounds=(-10.0, 10.0), source=_CHOSEN)
    substeps: int = 0
    physics: PbdSettings = field(default_factory=PbdSettings)
    device: Device = Device.cpu
    threads: int = 0
    most: int = 2_000_000
    thin: Thin = Thin.volume
    look: float = param(0.02, "s", bounds=(0.0, 10.0), tolerance=0.0, source=_CHOSEN, fit=False)

    name: ClassVar[str] = "window"
    accounts_for: ClassVar[tuple[str, ...]] = ACCOUNTS

    def __post_init__(self) -> None:
        """Refuse counts that mean nothing; nothing is allocated yet."""
        if self.substeps < 0 or self.most < 1 or self.cell < 1:
            raise ConfigError(
                f"substeps={self.substeps}, most={self.most}, cell={self.cell} are not allowed.\n"
                "Allowed: substeps 0 (chosen by the speed of sound) or more, most and cell 1 or "
                "more."
            )
        self._parcel: Parcel | None = None
        self._time = 0.0

    @property
    def parcel(self) -> Parcel:
        """The water itself, once opened."""
        if self._parcel is None:
            raise ConfigError("the window of water is not open.\nIt opens with its world.")
        return self._parcel

    def solids(self, environment: EnvironmentSettings) -> Mapping[str, ObstacleSettings]:
        """Return nothing: an open sea has no walls."""
        return {}

    def box(self, environment: EnvironmentSettings) -> Box:
        """Return the sizes of the window in a given environment.

        Raises:
            ConfigError: a side is too short for the ring, or the ring too thin.
        """
        level = float(environment.water_level or 0.0)
        bottom = environment.tank_bottom
        depth = self.size[2] if bottom is None else min(self.size[2], level - bottom)
        refuse_box(self.spacing, (self.size[0], self.size[1], depth), self.ring)
        d = depth / round(depth / self.spacing)
        counts = (round(self.size[0] / d), round(self.size[1] / d), round(depth / d))
        half = 0.5 * d * np.array(counts)
        lower = np.array([-half[0], -half[1], level - depth])
        squeeze = environment.gravity / self._sound(environment.gravity, depth) ** 2
        return Box(d, lower, counts, self.ring, self.cell, self.freeboard, squeeze)

    def _sound(self, gravity: float, depth: float) -> float:
        """Speed of sound: it must not change with the height of a splash [m/s]."""
        return self.physics.sound_speed or MACH * math.sqrt(gravity * depth)

    def open(self, around: Surrounding, bodies: Sequence[FluidBody]) -> None:
        """Prepare the window and its boundaries."""
        e = around.environment
        box = self.box(e)
        refuse_ground(e, around.solids)
        level = float(e.water_level or 0.0)
        outer = Outer(around.waves, level, (self.current[0], self.current[1]))
        refuse_sea(outer, box, floor=e.tank_bottom)
        column = WaterColumn.of_profiles(e.water_temperature, e.salinity, e.water_density)
        physics = dataclasses.replace(
            self.physics,
            density=float(column.density[0]),
            gravity=e.gravity,
            sound_speed=self._sound(e.gravity, box.spacing * box.counts[2]),
        )
        self._parcel = Parcel(self, box, outer, physics, bodies)

    def fill(self, states: BodyStates) -> None:
        """Put the water of the outer sea around the bodies, as it moves at time zero."""
        self._time = 0.0
        self.parcel.fill(states)

    def exchange(self, states: BodyStates, time: float, step: float) -> Floats:
        """Advance; return the impulses on the bodies [N s, N m s], shape (K, 6)."""
        self._time = time + step
        return self.parcel.exchange(states, time, step)

    def surface(self, position: Array) -> Sea:
        """Return the surface over points: of the particles inside, of the outer sea outside."""
        heights = self.parcel.surface(np.asarray(position, dtype=float), self._time)
        return Sea(heights[:, None], None, None, None, None)

    def books(self) -> Books | None:
        """Return the momentum of the last step."""
        return self.parcel.last

    def figures(self) -> Mapping[str, float]:
        """Return particles, those that came and went, shifts and compression."""
        return self.parcel.figures()

    def particles(self) -> tuple[Floats, Floats]:
        """Return places and velocities."""
        return self.parcel.water.positions(), self.parcel.water.velocities()

    def snapshot(self) -> Any:
        """Return a copy of everything that changes."""
        return self._time, self.parcel.snapshot()

    def restore(self, kept: Any) -> None:
        """Put a snapshot back."""
        self._time, parcel = kept
        self.parcel.restore(parcel)

    def close(self) -> None:
        """Free the memory."""
        if self._parcel is not None:
            self._parcel.water.close()
            self._parcel = None
