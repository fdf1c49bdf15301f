"""The water of the window, and what happens to it in one step of the world."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import PhysicsError
from seals.fluid import BodyStates, Books, FluidBody
from seals.plugins.fluids.coupling import Immersed, account, add_samples, shown
from seals.plugins.fluids.moving_domain.box import Box
from seals.plugins.fluids.moving_domain.level import Keeper
from seals.plugins.fluids.moving_domain.outer import Outer
from seals.plugins.fluids.moving_domain.refusals import refuse_astray, refuse_large_robot
from seals.plugins.fluids.pbd.settings import PbdSettings
from seals.plugins.fluids.tank.basin import clear_of, refuse_large
from seals.plugins.fluids.tank.heights import HeightField

CUT = 0.07
"""How much further a cut through the water lies than the side that is put there, in spacings.

Water that was cut through is in disorder; a side pushes it into layers, with a pressure that this
makes up for in the mean. Measured on a tow: the mean push on a ball after a shift is least here.
"""
ROOM = 3.0
"""Room of the domain beyond sides and floor, in spacings."""
SPARE = 1.05
"""Particles that memory is kept for, over those of the box."""
LOOKS = 400
"""Instants at which the largest deformation of the box is looked for."""
SPAN = 300.0
"""Time in which they lie [s]."""


class Parcel:
    """A parcel of the sea, made of particles.

    Its sides and its floor go with the water of the outer sea, so no water passes through them; in
    its ring velocities are drawn to those of the outer sea.

    Args:
        settings: of the fluid, a `FluidWindow`.
        box: sizes, around the origin.
        outer: the sea around it.
        physics: numbers of the engine.
        bodies: that the water pushes.

    Attributes:
        water: the engine.
        heights: of the surface, as of the last look.
        last: momentum of the last step.
        shifts: how often the window has moved by a cell.
        entered: particles that came, by a shift or by the level.
        left: particles that went.

    Raises:
        SealsError: the spacing is too coarse for a body, or there would be too many particles.
    """

    def __init__(
        self,
        settings: Any,
        box: Box,
        outer: Outer,
        physics: PbdSettings,
        bodies: Sequence[FluidBody],
    ) -> None:
        """Sample all boundaries and allocate the engine."""
        from seals.plugins.fluids.pbd.engine import Engine
        from seals.plugins.fluids.pbd.water import ParticleWater

        self.settings, self.physics, self.outer = settings, physics, outer
        self._first = self.box = box
        d = box.spacing
        self.bodies, self.immersed = len(bodies), Immersed(bodies, d, settings.thin)
        if bodies:
            refuse_large_robot(self.immersed.samples[0], box)
        self._sides = box.sides()
        count = math.ceil(SPARE * math.prod(box.counts))
        boundary = self.immersed.count + len(self._sides.points)
        refuse_large(count, boundary, settings.most)
        self._reach = self._room()
        self._high = np.array([0.0, 0.0, box.freeboard])
        low, high = self._domain()
        self.water = ParticleWater(
            spacing=d,
            lower=low,
            upper=high,
            capacity=count,
            boundary_capacity=boundary,
            bodies=self.bodies,
            settings=physics,
            engine=Engine(device=settings.device.value, threads=settings.threads),
        )
        self._put_sides(0.0)
        for k, samples in enumerate(self.immersed.samples):
            add_samples(self.water, k + 1, samples)
        self.heights = HeightField(box.lower, box.upper, d, outer.level)
        self._forget()

    def _forget(self) -> None:
        """Start the books anew."""
        self.last: Books | None = None
        self.shifts = self.entered = self.left = self.removed = 0
        self.keeper = Keeper(self.settings.lag)
        self._exchange: Any = None
        self._looked, self.lift = -math.inf, 0.0

    def _corners(self, box: Box) -> Floats:
        low, high = box.lower, box.upper
        return np.array(
            [
                [x, y, z]
                for x in (low[0], high[0])
                for y in (low[1], high[1])
                for z in (low[2], high[2])
            ]
        )

    def _room(self) -> Floats:
        """How far the sides go from where they would be if the box moved as a whole [m]."""
        points = np.concatenate([self._corners(self._first), self._first.middle[None]])
        far = np.zeros(3)
        for time in np.linspace(0.0, SPAN, LOOKS):
            moved = self.outer.displacement(points, time)
            far = np.maximum(far, np.abs(moved[:-1] - moved[-1]).max(axis=0))
        return far * 1.2 + (ROOM + 2.0) * self._first.spacing

    def _domain(self) -> tuple[Floats, Floats]:
        """Corners of the room around the box at time zero [m]."""
        return self._first.lower - self._reach, self._first.upper + self._reach + self._high

    def _put_sides(self, time: float) -> None:
        """Put sides and floor where the outer sea has carried them."""
        boundary = self.water.boundary
        if 0 not in boundary.points:
            boundary.add(0, self._sides.points, convex=False)
            self._rest = boundary.points[0]
        rest = self._rest + (self.box.lower - self._first.lower)
        # the weights stay: the sides are strained by less than the steepness
        boundary.points[0], boundary.stale = self.outer.places(rest, time), True

    def fill(self, states: BodyStates) -> None:
        """Put the water of the outer sea around the bodies, as it moves at time zero."""
        if self.water.count:
            self.water.take(np.ones(self.water.count, dtype=bool))
        self._forget()
        self.box = self._first
        self._follow(states, 0.0)
        self._frame(0.0)
        places = self.outer.places(self.box.lattice(), 0.0)
        kept = clear_of(places, self.immersed.volumes(states), self.box.spacing)
        self.removed = len(places) - len(kept)
        self._put_sides(0.0)
        self._place(states)
        self.water.fill(kept, self.outer.velocity(self.outer.rest(kept, 0.0), 0.0), trusted=True)
        self._look(states, 0.0)

    def exchange(self, states: BodyStates, time: float, step: float) -> Floats:
        """Advance by a step; return the impulses on the bodies, shape (K, 6)."""
        before = self.water.momentum()
        self._shift(states, time)
        start = self.water.momentum()
        self._put_sides(time + step)
        self._frame(time)
        self._place(states)
        n = self.settings.substeps or self.water.substeps(step)
        done = self.water.advance(step, substeps=n)
        self.left += done.left
        moved = self.water.momentum()
        self._relax(states, time + step, step)
        after = self.water.momentum()
        self._exchange = done
        sources = (after - moved) + (start - before)
        self.last = account(done, self.bodies, before, sources, after)
        self._look(states, time + step)
        return done.impulses

    def _place(self, states: BodyStates) -> None:
        """Hand all bodies to the engine."""
        if self.bodies:
            self.water.place(**{name: getattr(states, name) for name in BodyStates._fields})

    def _frame(self, time: float) -> None:
        """Let the engine's domain follow the box by whole spacings."""
        middle = self.outer.places(self.box.middle[None], time)[0]
        off = (middle - self._first.middle) - (self.water.origin - self._domain()[0])
        cells = np.rint(off / self.box.spacing).astype(np.int64)
        if (np.abs(cells) >= 2).any():
            self.water.shift(cells)

    def _follow(self, states: BodyStates, time: float) -> tuple[int, int]:
        """Move the box by whole cells to where the robot is; return by how many."""
        if not self.bodies:
            return 0, 0
        rest = self.outer.rest(states.position, time)
        cells = self.box.cells_to(rest[0])
        self.box = self.box.moved(cells)
        refuse_astray(self.immersed.names, rest, self.box)
        return cells

    def _shift(self, states: BodyStates, time: float) -> None:
        """Leave water behind and take new water in, where the robot has moved on."""
        old = self.box
        if self._follow(states, time) == (0, 0):
            return
        self.shifts += 1
        rest = self.outer.rest(self.water.positions(), time)
        self.left += self.water.take(~self.box.holds(rest, slack=-CUT * self.box.spacing))
        new = self.box.lattice()
        new = new[~old.holds(new)]
        self.entered += len(new)
        places = self.outer.places(new, time)
        self._put_sides(time)
        self._frame(time)
        self.water.fill(places, self.outer.velocity(new, time), trusted=True)

    def _relax(self, states: BodyStates, time: float, step: float) -> None:
        """Draw the ring to the outer sea, and hold its level."""
        places, velocities = self.water.positions(), self.water.velocities()
        rest = self.outer.rest(places, time)
        weight = self.box.weight(rest)
        near = weight > 0.0
        share = -np.expm1(-self.settings.rate * step * weight[near])[:, None]
        velocities[near] += share * (self.outer.velocity(rest[near], time) - velocities[near])
        self.water.write(velocities=velocities)
        self._refuse_far(rest)
        change = self.keeper.change(self.box, rest, self._taken(states, time), step)
        if len(change.gone):
            self.left += self.water.take(np.isin(np.arange(len(places)), change.gone))
        come = change.come[: self.water.capacity - self.water.count]
        if len(come):
            speed = self.outer.velocity(come, time)
            self.water.fill(self.outer.places(come, time), speed, trusted=True)
            self.entered += len(come)

    def _taken(self, states: BodyStates, time: float) -> float:
        """Volume of the bodies below the surface of the outer sea [m^3]."""
        whole = self.immersed.volumes(states)
        under = self.outer.rest(whole.points, time)[:, 2] < self.outer.level
        return float(whole.volumes[under].sum())

    def _refuse_far(self, rest: Floats) -> None:
        """Refuse water that came through the sides."""
        out = ~self.box.holds(rest, slack=2.0 * self.box.spacing)
        if out.any():
            raise PhysicsError(
                f"{out.sum()} particles came through the sides of the window.\n"
                "Take shorter steps, or a lower sea."
            )

    def _look(self, states: BodyStates, time: float) -> None:
        """Find the surface, every now and then."""
        if time - self._looked < self.settings.look - 1e-9:
            return
        self._looked = time
        carried = self.outer.places(self.box.middle[None], time)[0] - self.box.middle
        self.heights.lower = (self.box.lower + carried)[:2]
        bodies = self.immersed.surfaces(states).points
        self.heights.update(self.water.positions(), bodies)
        self.lift = self._settled(states, time)

    def _settled(self, states: BodyStates, time: float) -> float:
        """How far the level by volume lies above the highest particles' [m]."""
        box, field = self.box, self.heights
        i, j = np.meshgrid(*(np.arange(n) + 0.5 for n in field.shape), indexing="ij")
        middles = field.lower + np.stack([i.ravel(), j.ravel()], -1) * field.edge
        seen = float((field.heights.ravel() - self.outer.elevation(middles, time)).mean())
        over = self.water.count + self._taken(states, time) / box.spacing**3 - math.prod(box.counts)
        depth = box.spacing * box.counts[2]
        by_volume = over * depth / math.prod(box.counts) - 0.5 * box.squeeze * depth**2
        return by_volume - seen

    def surface(self, places: Floats, time: float) -> Floats:
        """Return the height of the surface, the outer sea's outside of the window [m]."""
        outer = self.outer.elevation(places, time)
        level = np.column_stack([places[:, :2], outer])
        weight = self.box.weight(self.outer.rest(level, time))
        out: Floats = weight * outer + (1.0 - weight) * (self.heights.at(places) + self.lift)
        return out

    def figures(self) -> dict[str, float]:
        """What a person wants to watch."""
        out = shown(self.water, self._exchange)
        out |= {"shifts of the window": float(self.shifts)}
        return out | {"particles come": float(self.entered), "particles gone": float(self.left)}

    def snapshot(self) -> Any:
        """Return everything that changes."""
        counts = self.shifts, self.entered, self.left, self.removed
        surface = self.heights.heights.copy(), self.heights.lower.copy(), self._looked, self.lift
        return self.water.snapshot(), self.box, counts, surface, self.keeper.owed, self.last

    def restore(self, kept: Any) -> None:
        """Put a snapshot back."""
        water, self.box, counts, surface, self.keeper.owed, self.last = kept
        self.water.restore(water)
        self.shifts, self.entered, self.left, self.removed = counts
        heights, lower, self._looked, self.lift = surface
        self.heights.heights, self.heights.lower = heights.copy(), lower.copy()
