"""The open water: engine, boundaries, and what happens in one step of the world."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.config.environment import EnvironmentSettings
from seals.fluid import BodyStates, Books, FluidBody, Surrounding
from seals.plugins.fluids.particles.basin import Basin, clear_of, refuse_large
from seals.plugins.fluids.particles.heights import HeightField
from seals.plugins.fluids.particles.paddle import Board, Paddle, board_of
from seals.plugins.fluids.particles.settings import Maker
from seals.plugins.fluids.particles.zones import blown, calm
from seals.plugins.fluids.pbd.settings import PbdSettings
from seals.plugins.fluids.sampling import ALL, Samples, joined, refuse_coarse, sample_pieces
from seals.plugins.fluids.sampling.solids import sample_solid

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
        self.samples = _body_samples(bodies, d, settings.thin)
        self._filled = [sample_pieces(b.pieces, d, layers=ALL) for b in bodies]
        self._solids = joined([sample_solid(s, d, *self._inside()) for s in around.solids])
        fixed = self._fixed()
        moved = self._moved()
        self.bodies = len(bodies)
        count = math.prod(self.basin.counts)
        boundary = sum(len(s.points) for s in (*self.samples, *moved, fixed))
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
        self._add(0, fixed)
        for k, samples in enumerate((*self.samples, *moved)):
            self._add(k + 1, samples)
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

    def _add(self, body: int, samples: Samples) -> None:
        """Hand samples to the engine, with the volumes that they stand for."""
        if not len(samples.points):
            return
        self.water.add_boundary(body=body, points=samples.points)
        if (samples.thick < 1.0).any():
            # what is thin has no surface that the engine could weigh: its volume counts
            weights, thick = self.water.boundary.weights, samples.thick
            own = samples.volumes / self.basin.spacing**3
            weights[body] = thick * weights[body] + (1.0 - thick) * own
            self.water.boundary.stale = True

    def fill(self, states: BodyStates) -> None:
        """Put the water at rest around bodies and solids."""
        if self.water.count:
            self.water.take(np.ones(self.water.count, dtype=bool))
        there = joined([self._solids, *_placed(self._filled, states)])
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
        pushed = done.impulses[: self.bodies]
        walls = done.walls + done.impulses[self.bodies :, :3].sum(axis=0)
        gross = float(np.abs(done.gravity).sum() + np.abs(done.impulses[:, :3]).sum())
        gross += float(np.abs(done.walls).sum())
        taken = pushed[:, :3].sum(axis=0)
        sources = after - moved
        self.last = Books(before, after, done.gravity, sources, taken, walls, gross)
        self._look(states, time + step)
        return pushed

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
        bodies = joined(_placed(self.samples, states)).points
        self.heights.update(self.water.positions(), bodies)

    def figures(self) -> dict[str, float]:
        """What a person wants to watch."""
        out = {"particles": float(self.water.count), "spacing [m]": self.basin.spacing}
        if self._exchange is not None:
            done = self._exchange
            out["mean compression [1]"] = done.mean_compression
            out["largest compression [1]"] = done.max_compression
            out["iterations"] = done.iterations
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


def _placed(samples: Sequence[Samples], states: BodyStates) -> list[Samples]:
    """Samples of the bodies in the world."""
    pairs = zip(samples, states.position, states.rotation, strict=True)
    return [s.placed(place, turn) for s, place, turn in pairs]


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


def _body_samples(bodies: Sequence[FluidBody], spacing: float, thin: Any) -> list[Samples]:
    """Samples of every body, after a look at whether the fluid can see their robots."""
    robots: dict[str, list[Any]] = {}
    for body in bodies:
        robots.setdefault(body.name.partition("/")[0], []).extend(body.pieces)
    for name, pieces in robots.items():
        refuse_coarse(name, pieces, spacing)
    return [sample_pieces(body.pieces, spacing, thin=thin) for body in bodies]
