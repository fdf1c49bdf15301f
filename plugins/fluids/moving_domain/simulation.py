"""Simulation of the moving domain: a box of particles in the outer sea that follows a robot."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import PhysicsError
from seals.fluid import BodyStates, FluidBody
from seals.plugins.fluids.coupling import HeightField, Simulation, refuse_large
from seals.plugins.fluids.moving_domain.box import Box
from seals.plugins.fluids.moving_domain.outer_sea import OuterSea
from seals.plugins.fluids.moving_domain.refusals import refuse_astray, refuse_large_robot
from seals.plugins.fluids.solver import SolverSettings

if TYPE_CHECKING:
    from seals.plugins.fluids.moving_domain.fluid import FluidWindow


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


class MovingDomain(Simulation):
    """Box of water particles that follows a body through an open sea.

    Sides and floor move with the water of the outer sea, so no water passes through them; in the
    relaxation ring velocities are drawn to those of the outer sea.

    Args:
        settings: options of the fluid.
        box: sizes, around the origin.
        outer: the sea around it.
        physics: options of the solver.
        bodies: in the water; the first one is followed.

    Attributes:
        shifts: number of times the box has moved by a cell.
        entered: particles added by a shift or by the level controller.
        lift: level by volume above that of the highest particles [m].

    Raises:
        SealsError: the spacing is too coarse for a body, or there would be too many particles.
    """

    settings: FluidWindow
    _state: ClassVar[tuple[str, ...]] = (*Simulation._state, "box", "shifts", "entered", "lift")

    def __init__(
        self,
        settings: FluidWindow,
        box: Box,
        outer: OuterSea,
        physics: SolverSettings,
        bodies: Sequence[FluidBody],
    ) -> None:
        refuse_large(math.prod(box.counts), box.boundary, settings.most)
        super().__init__(settings, physics, bodies, box.spacing)
        self.outer, self._first, self._sides = outer, box, box.sides()
        if bodies:
            refuse_large_robot(self.immersed.samples[0], box)
        self._strain = self._strained()
        self._reach = self._strain + (ROOM + 2.0) * box.spacing
        self._high = np.array([0.0, 0.0, box.freeboard])
        self._allocate(
            self._domain(),
            self._sides,
            (),
            capacity=math.ceil(SPARE * math.prod(box.counts)),
            surface=HeightField(box.lower, box.upper, box.spacing, outer.level),
        )

    def _reset(self) -> None:
        super()._reset()
        self.box = self._first
        self.shifts = self.entered = 0
        self.level = LevelController(self.settings.lag)
        self.lift = 0.0

    def _lattice(self) -> Floats:
        return self.outer.places(self.box.lattice(), 0.0)

    def _fill(self, places: Floats) -> None:
        speed = self.outer.velocity(self.outer.rest(places, 0.0), 0.0)
        self.water.add_particles(places, speed, trusted=True)

    def _strained(self) -> Floats:
        """Return the largest displacement of the sides relative to the middle of the box [m]."""
        sides = zip(self._first.lower, self._first.upper, strict=True)
        corners = np.array(list(itertools.product(*sides)))
        points = np.concatenate([corners, self._first.middle[None]])
        far = np.zeros(3)
        for time in np.linspace(0.0, SPAN, LOOKS):
            moved = self.outer.displacement(points, time)
            far = np.maximum(far, np.abs(moved[:-1] - moved[-1]).max(axis=0))
        return far * 1.2

    def _domain(self) -> tuple[Floats, Floats]:
        """Corners of the room around the box at time zero [m]."""
        return self._first.lower - self._reach, self._first.upper + self._reach + self._high

    def _put_sides(self, time: float) -> None:
        """Move sides and floor to where the outer sea has carried them."""
        rest = self._sides.points + (self.box.lower - self._first.lower)
        # the weights stay: the sides are strained by less than the steepness
        self.water.move_boundary(body=0, points=self.outer.places(rest, time))

    def _place(self, states: BodyStates, time: float, step: float) -> None:
        self._put_sides(time + step)
        self._frame(time)
        if self.bodies:
            self.water.place_bodies(**states._asdict())

    def _frame(self, time: float) -> None:
        """Let the engine's domain follow the box by whole spacings."""
        middle = self.outer.places(self.box.middle[None], time)[0]
        off = (middle - self._first.middle) - (self.water.origin - self._domain()[0])
        cells = np.rint(off / self.box.spacing).astype(np.int64)
        if (np.abs(cells) >= 2).any():
            self.water.shift_domain(cells)

    def _track(self, states: BodyStates, time: float) -> tuple[int, int]:
        """Move the box by whole cells to where the robot is; return by how many."""
        if not self.bodies:
            return 0, 0
        rest = self.outer.rest(states.position, time)
        cells = self.box.cells_to(rest[0])
        self.box = self.box.moved(cells)
        refuse_astray(self.immersed.names, rest, self.box)
        return cells

    def _shift(self, states: BodyStates, time: float) -> bool:
        """Remove the water left behind and add new water ahead, where the body has moved on."""
        old = self.box
        if self._track(states, time) == (0, 0):
            return False
        self.shifts += 1
        rest = self.outer.rest(self.water.positions(), time)
        outside = ~self.box.holds(rest, slack=-CUT * self.spacing)
        self.left += self.water.remove_particles(outside)
        new = self.box.lattice()
        new = new[~old.holds(new)]
        self._put_sides(time)
        self._frame(time)
        self._add(new, time)
        self._relax(states, time)
        return True

    def _relax(self, states: BodyStates, time: float) -> None:
        """Even out the density of what was cut and added by places alone, without velocities.

        Left to the next step, it would be a pulse of sound. Only the ring changes: the pressure
        around a body is that of its motion, and would be lost.
        """
        if not self.settings.relaxations:
            return
        velocities, places, still = self.water.velocities(), self.water.positions(), {}
        near, _, _ = self._ring(places, time)
        if self.bodies:
            held = {"velocity", "spin", "inverse_mass", "inverse_inertia", "acceleration"}
            still = {k: 0.0 * v if k in held else v for k, v in states._asdict().items()}
        count = self._substeps(self.step)
        for _ in range(self.settings.relaxations):
            self.water.set_particles(velocities=np.zeros_like(velocities))
            if self.bodies:
                self.water.place_bodies(**still)
            self.water.advance(self.step / count, substeps=1)
        places[near] = self.water.positions()[near]
        self.water.set_particles(positions=places, velocities=velocities)

    def _add(self, rest: Floats, time: float) -> None:
        """Add particles of the outer sea, by their places of rest (n, 3) [m]."""
        self.entered += len(rest)
        places, speed = self.outer.places(rest, time), self.outer.velocity(rest, time)
        self.water.add_particles(places, speed, trusted=True)

    def _treat(self, states: BodyStates, time: float, step: float) -> None:
        """Relax the ring towards the outer sea, and control the level."""
        velocities = self.water.velocities()
        rows, rest, weight = self._ring(self.water.positions(), time)
        share = -np.expm1(-self.settings.rate * step * weight)[:, None]
        velocities[rows] += share * (self.outer.velocity(rest, time) - velocities[rows])
        self.water.set_particles(velocities=velocities)
        out = ~self.box.holds(rest, slack=2.0 * self.box.spacing)
        if out.any():
            raise PhysicsError(
                f"{out.sum()} particles came through the sides of the window.\n"
                "Take shorter steps, or a lower sea."
            )
        over = self._over(states, time)
        change = self.level.change(self.box, rest, over, step)
        if len(change.gone):
            gone = np.zeros(self.water.count, dtype=bool)
            gone[rows[change.gone]] = True
            self.left += self.water.remove_particles(gone)
        come = change.come[: self.water.capacity - self.water.count]
        if len(come):
            self._add(come, time)

    def _ring(self, places: Floats, time: float) -> tuple[Any, Floats, Floats]:
        """Rows, places of rest [m] and weights of the particles in the ring.

        Water far from the sides, by more than waves strain the box, is left out beforehand.
        """
        box = self.box
        carried = self.outer.places(box.middle[None], time)[0] - box.middle
        low, high = (
            side + sign * (box.ring * box.spacing + self._strain)
            for sign, side in ((1.0, box.lower + carried), (-1.0, box.upper + carried))
        )
        east, north = places[:, 0], places[:, 1]
        inside = (east > low[0]) & (east < high[0]) & (north > low[1]) & (north < high[1])
        rows = np.flatnonzero(~inside)
        rest = self.outer.rest(places[rows], time)
        weight = box.weight(rest)
        near = weight > 0.0
        return rows[near], rest[near], weight[near]

    def _over(self, states: BodyStates, time: float) -> float:
        """Particles, and those that would fill the bodies below the surface, over the box's."""
        whole = self.immersed.volumes(states)
        under = self.outer.rest(whole.points, time)[:, 2] < self.outer.level
        filled = float(whole.volumes[under].sum()) / self.box.spacing**3
        return self.water.count + filled - math.prod(self.box.counts)

    def _update_surface(self, states: BodyStates, time: float) -> None:
        carried = self.outer.places(self.box.middle[None], time)[0] - self.box.middle
        self.heights.lower = (self.box.lower + carried)[:2]
        super()._update_surface(states, time)
        self.lift = self._settled(states, time)

    def _settled(self, states: BodyStates, time: float) -> float:
        """Return the level by volume above the level of the highest particles [m]."""
        box, field = self.box, self.heights
        i, j = np.meshgrid(*(np.arange(n) + 0.5 for n in field.shape), indexing="ij")
        middles = field.lower + np.stack([i.ravel(), j.ravel()], -1) * field.edge
        seen = float((field.heights.ravel() - self.outer.elevation(middles, time)).mean())
        over = self._over(states, time)
        depth = box.spacing * box.counts[2]
        by_volume = over * depth / math.prod(box.counts) - 0.5 * box.squeeze * depth**2
        return by_volume - seen

    def surface(self, places: Floats, time: float) -> Floats:
        """Return the surface height; outside the domain that of the outer sea [m]."""
        outer = self.outer.elevation(places, time)
        level = np.column_stack([places[:, :2], outer])
        weight = self.box.weight(self.outer.rest(level, time))
        return weight * outer + (1.0 - weight) * (self.heights.at(places) + self.lift)

    def diagnostics(self) -> dict[str, float]:
        """Return diagnostics of solver and box: shifts, particles added and removed."""
        out = super().diagnostics() | {"shifts of the window": float(self.shifts)}
        return out | {"particles come": float(self.entered), "particles gone": float(self.left)}

    def snapshot(self) -> Any:
        """Return a copy of the complete state."""
        return super().snapshot(), self.level.owed

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        state, self.level.owed = kept
        super().restore(state)


MOST = 0.1
"""Share of the ring's columns that lose or gain a particle in one step, at most."""


LEAST = 0.005
"""Share of them that loses or gains one at once, at least: what is owed adds up until then."""


class Change(NamedTuple):
    """Particles to remove and to add.

    Args:
        gone: rows of those to remove among those of the ring, shape (m,).
        come: places of rest of those to add [m], shape (m, 3).
    """

    gone: Any
    come: Floats


class LevelController:
    """Integral controller of the number of particles.

    A body that dives into the window lifts its surface, which an open sea would not do; a body that
    leaves it lowers the surface; a body under way leaves a trough behind, and less water goes at
    the rear than comes in front. So particles and the volume that bodies take below the surface
    have to make up the box together. Excess is removed at the highest places of the ring, a deficit
    is added at its lowest.

    Args:
        lag: time constant of the correction [s].
    """

    def __init__(self, lag: float) -> None:
        self.lag, self.owed = lag, 0.0

    def change(self, box: Box, rest: Floats, over: float, step: float) -> Change:
        """Return the particles to add and remove after a step.

        Args:
            box: the window.
            rest: places of rest of the particles in the ring [m], shape (n, 3).
            over: particles, and those that would fill the bodies below the surface, over those of
                the box.
            step: [s].
        """
        self.owed += -math.expm1(-step / self.lag) * over
        (length, width, _), ring = box.counts, 2 * box.ring
        columns = length * width - max(length - ring, 0) * max(width - ring, 0)
        if abs(self.owed) < max(1.0, LEAST * columns):
            return Change(np.zeros(0, dtype=int), np.zeros((0, 3)))
        rows, columns, tops = _tops(box, rest)
        count = min(int(abs(self.owed)), max(1, round(MOST * len(rows))))
        self.owed -= math.copysign(count, self.owed)
        order = np.argsort(tops)
        if over > 0:
            return Change(rows[order[-count:]], np.zeros((0, 3)))
        low = order[:count]
        plan = box.lower[:2] + (columns[low] + 0.5) * box.spacing
        return Change(np.zeros(0, dtype=int), np.column_stack([plan, tops[low] + box.spacing]))


def _tops(box: Box, ring: Floats) -> tuple[Any, Any, Floats]:
    """Highest particle of every column of the ring, columns a spacing wide.

    Returns:
        Its row, shape (m,), its column, shape (m, 2), and its height at rest [m], shape (m,).
    """
    most = np.array(box.counts[:2]) - 1
    column = np.floor((ring[:, :2] - box.lower[:2]) / box.spacing).astype(int)
    column = np.clip(column, 0, most)
    order = np.lexsort((-ring[:, 2], column[:, 0] * box.counts[1] + column[:, 1]))
    ordered = column[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    rows = order[first]
    return rows, column[rows], ring[rows, 2]
