"""The open water: engine, boundaries, and what happens in one step of the world."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.environment.settings import EnvironmentSettings
from seals.fluid import BodyStates, Books, FluidBody, Surrounding
from seals.plugins.fluids.coupling import Immersed, account, add_samples, shown
from seals.plugins.fluids.pbd.settings import PbdSettings
from seals.plugins.fluids.sampling import Samples, joined
from seals.plugins.fluids.sampling.solids import sample_solid
from seals.plugins.fluids.tank.basin import Basin, clear_of, refuse_large
from seals.plugins.fluids.tank.heights import HeightField
from seals.plugins.fluids.tank.paddle import Board, Paddle, board_of
from seals.plugins.fluids.tank.settings import Maker
from seals.plugins.fluids.tank.zones import blown, calm

CALM = 20.0
"""Rate at which motion is taken out of water that settles [1/s]."""
CALMED = 0.7
"""Share of the time for which it is; then the water is on its own."""


class Pool:
    """Water in its basin.

    Args:
        settings: of the fluid, a `FluidParticles`.
        basin: sizes.
        physics: numbers of the engine.
        around: what it is opened in.
        bodies: that it pushes.

    Attributes:
        water: the engine.
        heights: of the surface, as of the last look.
        last: momentum of the last step.
        removed: places of the lattice that bodies and solids took at the start.

    Raises:
        SealsError: the spacing is too coarse for a body, or there would be too many particles.
    """

    def __init__(
        self,
        settings: Any,
        basin: Basin,
        physics: PbdSettings,
        around: Surrounding,
        bodies: Sequence[FluidBody],
    ) -> None:
        """Sample all boundaries and allocate the engine."""
        from seals.plugins.fluids.pbd.engine import Engine
        from seals.plugins.fluids.pbd.water import ParticleWater

        self.settings, self.physics, self._step = settings, physics, around.step
        e = around.environment
        level = float(e.water_level or 0.0)
        self.paddle = paddle_of(settings, e)
        self.basin = basin
        d = self.basin.spacing
        self.immersed = Immersed(bodies, d, settings.thin)
        self._solids = joined([sample_solid(s, d, *self._inside()) for s in around.solids])
        fixed = self._fixed()
        moved = self._moved()
        self.bodies = len(bodies)
        count = math.prod(self.basin.counts)
        boundary = self.immersed.count + sum(len(s.points) for s in (*moved, fixed))
        refuse_large(count, boundary, settings.most)
        low, high = self.basin.domain(settings.tide.amplitude)
        self.water = ParticleWater(
            spacing=d,
            lower=low,
            upper=high,
            capacity=count,
            boundary_capacity=boundary,
            bodies=self.bodies + len(moved),
            settings=physics,
            engine=Engine(device=settings.device.value, threads=settings.threads),
        )
        for k, samples in enumerate((fixed, *self.immersed.samples, *moved)):
            add_samples(self.water, k, samples)
        self.heights = HeightField(self.basin.lower, self.basin.upper, d, level)
        self.last: Books | None = None
        self.removed = self.left = 0
        self._exchange: Any = None
        self._looked = -math.inf

    def _inside(self) -> tuple[Floats, Floats]:
        """Corners of the room that solids may stand in: not inside the walls."""
        high = self.basin.upper.copy()
        high[2] = self.basin.top
        return self.basin.lower, high

    @property
    def _tidal(self) -> bool:
        return bool(self.settings.tide.amplitude > 0.0)

    def _fixed(self) -> Samples:
        """Everything that stands still."""
        walls = self.basin.walls(floor=not self._tidal, paddle=self.paddle is not None)
        return joined([walls, self._solids])

    def _moved(self) -> list[Samples]:
        """Boundaries that are moved from outside: the paddle, then the floor."""
        out = [] if self.paddle is None else [self.basin.paddle()]
        return [*out, self.basin.floor()] if self._tidal else out

    def fill(self, states: BodyStates) -> None:
        """Put the water at rest around bodies and solids."""
        if self.water.count:
            self.water.take(np.ones(self.water.count, dtype=bool))
        there = joined([self._solids, self.immersed.volumes(states)])
        places = self.basin.lattice()
        kept = clear_of(places, there, self.basin.spacing)
        self.removed, self.left = len(places) - len(kept), 0
        self._place(states, 0.0)
        self.water.fill(kept)
        self._settle(states)
        self._looked, self.last, self._exchange = -math.inf, None, None
        self._look(states, 0.0)

    def _settle(self, states: BodyStates) -> None:
        """Let the water come to rest around bodies that are held."""
        steps = round(self.settings.settle / self._step)
        free = int(CALMED * steps)
        held = states._replace(
            velocity=np.zeros_like(states.velocity),
            spin=np.zeros_like(states.spin),
            inverse_mass=np.zeros_like(states.inverse_mass),
            inverse_inertia=np.zeros_like(states.inverse_inertia),
            acceleration=np.zeros_like(states.acceleration),
        )
        for k in range(steps):
            self._place(held, 0.0)
            self.water.advance(
                self._step, substeps=self.settings.substeps or self.water.substeps(self._step)
            )
            if k < free:
                self.water.write(velocities=self.water.velocities() * math.exp(-CALM * self._step))

    def exchange(self, states: BodyStates, time: float, step: float) -> Floats:
        """Advance by a step; return the impulses on the bodies, shape (K, 6)."""
        before = self.water.momentum()
        self._place(states, time)
        n = self.settings.substeps or self.water.substeps(step)
        done = self.water.advance(step, substeps=n)
        self.left += done.left
        moved = self.water.momentum()
        after = self._treat(step)
        self._exchange = done
        self.last = account(done, self.bodies, before, after - moved, after)
        self._look(states, time + step)
        return done.impulses[: self.bodies]

    def _place(self, states: BodyStates, time: float) -> None:
        """Hand all bodies and moved boundaries to the engine."""
        boards = self._boards(time)
        if not self.bodies + len(boards):
            return
        s = states
        none, still = np.zeros(len(boards)), np.zeros((len(boards), 3))
        self.water.place(
            position=_with(s.position, [b.position for b in boards]),
            rotation=_with(s.rotation, [b.rotation for b in boards]),
            velocity=_with(s.velocity, [b.velocity for b in boards]),
            spin=_with(s.spin, [b.spin for b in boards]),
            inverse_mass=np.concatenate([s.inverse_mass, none]),
            inverse_inertia=np.concatenate([s.inverse_inertia, np.zeros((len(boards), 3, 3))]),
            acceleration=np.concatenate([s.acceleration, still]),
        )

    def _boards(self, time: float) -> list[Board]:
        """Paddle and floor as they stand."""
        out = []
        if self.paddle is not None:
            kind, depth = self.settings.maker.kind, self.basin.depth
            out.append(board_of(kind, self.paddle.stroke(time), self.basin.foot, depth))
        if self._tidal:
            tide = self.settings.tide
            rate = 2.0 * math.pi / tide.period
            up = np.array([0.0, 0.0, tide.amplitude])
            place = self.basin.middle + up * math.sin(rate * time)
            out.append(Board(place, np.eye(3), up * rate * math.cos(rate * time), np.zeros(3)))
        return out

    def _treat(self, step: float) -> Floats:
        """Let beach and wind act; return the momentum after them [N s]."""
        s = self.settings
        windy = s.wind.stress_x != 0.0 or s.wind.stress_y != 0.0
        if s.beach.length > 0.0 or windy:
            places, velocities = self.water.positions(), self.water.velocities()
            velocities = calm(s.beach, self.basin, places, velocities, step)
            over = self.heights.at(places) if windy else np.zeros(0)
            velocities = blown(
                s.wind, self.basin, over, places, velocities, step / self.physics.density
            )
            self.water.write(velocities=velocities)
        return self.water.momentum()

    def _look(self, states: BodyStates, time: float) -> None:
        """Find the surface, every now and then."""
        if time - self._looked < self.settings.look - 1e-9:
            return
        self._looked = time
        bodies = self.immersed.surfaces(states).points
        self.heights.update(self.water.positions(), bodies)

    def figures(self) -> dict[str, float]:
        """What a person wants to watch."""
        out = shown(self.water, self._exchange)
        out["left through open sides"] = float(self.left)
        for name, place in self.settings.gauges.items():
            out[f"gauge {name} [m]"] = float(self.heights.at(np.array([place]))[0])
        return out

    def snapshot(self) -> Any:
        """Return everything that changes."""
        surface = (self.heights.heights.copy(), self._looked)
        return self.water.snapshot(), surface, self.last, (self.removed, self.left), self._exchange

    def restore(self, kept: Any) -> None:
        """Put a snapshot back."""
        water, (heights, self._looked), self.last, counts, self._exchange = kept
        self.water.restore(water)
        self.heights.heights = heights.copy()
        self.removed, self.left = counts


def paddle_of(settings: Any, environment: EnvironmentSettings) -> Paddle | None:
    """Return the wave maker of a fluid, or None.

    Raises:
        ConfigError: its waves are too high for the theory.
    """
    e = environment
    if settings.maker.kind is Maker.none:
        return None
    depth = (
        settings.size[2] if e.tank_bottom is None else float(e.water_level or 0.0) - e.tank_bottom
    )
    return Paddle(settings.maker, depth=depth, gravity=e.gravity)


def _with(array: Floats, more: Sequence[Floats]) -> Floats:
    return np.concatenate([array, np.array(more)]) if more else array
