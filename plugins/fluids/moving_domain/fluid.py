"""Water as particles in a moving domain: a box in the outer sea that follows the robot."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.environment.settings import EnvironmentSettings, ObstacleSettings
from seals.errors import PhysicsError
from seals.fluid import BodyStates, FluidBody, Surrounding
from seals.plugins.fluids.coupling import HeightField, ParticleFluid, Simulation, refuse_large
from seals.plugins.fluids.moving_domain.box import Box
from seals.plugins.fluids.moving_domain.outer_sea import OuterSea
from seals.plugins.fluids.moving_domain.refusals import (
    refuse_astray,
    refuse_box,
    refuse_ground,
    refuse_large_robot,
    refuse_sea,
)
from seals.plugins.fluids.sampling import reach_of, volume_of
from seals.plugins.fluids.solver import SolverSettings
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.schema import count, setting, vector

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
        step: of the world [s].

    Attributes:
        shifts: number of times the box has moved by a cell.
        entered: particles added by a shift or by the level controller.
        lift: level by volume above that of the highest particles [m].

    Raises:
        SealsError: the spacing is too coarse for a body, or there would be too many particles.
    """

    settings: FluidWindow
    _state: ClassVar[tuple[str, ...]] = (
        *Simulation._state,
        *("box", "shifts", "entered", "lift", "_pace"),
    )

    def __init__(
        self,
        settings: FluidWindow,
        box: Box,
        outer: OuterSea,
        physics: SolverSettings,
        bodies: Sequence[FluidBody],
        *,
        step: float,
    ) -> None:
        refuse_large(math.prod(box.counts), box.boundary, settings.most)
        super().__init__(settings, physics, bodies, box.spacing)
        self.outer, self._first, self._sides, self._world = outer, box, box.sides(), step
        if bodies:
            refuse_large_robot(self.immersed.samples[0], box)
        self._strain, high = self._strained()
        volume = max((float(body.volumes.sum()) for body in self.immersed.filled), default=0.0)
        length = max(volume ** (1 / 3), high, box.spacing)
        self._least = max(math.sqrt(physics.gravity * length), 0.01)
        self._own = physics.sound_speed <= 0.0
        self._sound = physics.sound_speed or MACH * self._least
        self._reach = self._strain + (ROOM + 2.0) * box.spacing
        self._high = np.array([0.0, 0.0, box.freeboard])
        self._allocate(
            self._domain(),
            self._sides,
            (),
            capacity=math.ceil(SPARE * math.prod(box.counts)),
            surface=HeightField(box.lower, box.upper, box.spacing, outer.level),
            level=outer.level,
        )

    def _reset(self) -> None:
        super()._reset()
        self.box = self._first
        self.shifts = self.entered = 0
        self.level = LevelController(self.settings.lag)
        self.lift = 0.0
        self._pace = self._least

    def _stride(self, states: BodyStates, time: float, step: float) -> int:
        if self._own:
            self._listen(states, time, step)
        count = 1
        if not self.settings.substeps:
            while count < STRIDE and self.water.substeps((count + 1) * step) == 1:
                count += 1
        return count

    def _listen(self, states: BodyStates, time: float, step: float) -> None:
        """Set the speed of sound by the fastest body in the water, or about to fall into it."""
        rest = self.outer.rest(states.position, time)
        past = states.velocity - self.outer.velocity(rest, time)
        speed = np.linalg.norm(past, axis=1)[rest[:, 2] < self.outer.level + self.box.freeboard]
        fading = self._pace * math.exp(-step / FADES)
        self._pace = max(self._least, fading, float(speed.max(initial=0.0)))
        # in halves of an octave: each change is a new plan of the iterations
        rise = math.ceil(2.0 * math.log2(self._pace / self._least) - 1e-9)
        self.water.sound = self._sound = MACH * self._least * 2.0 ** (0.5 * rise)

    def _lattice(self) -> Floats:
        return self.outer.places(self.box.lattice(), 0.0)

    def _fill(self, places: Floats) -> None:
        speed = self.outer.velocity(self.outer.rest(places, 0.0), 0.0)
        self.water.add_particles(places, speed, trusted=True)

    def _strained(self) -> tuple[Floats, float]:
        """Most that waves strain the box, with a margin, (3,), and rise over the level [m]."""
        sides = zip(self._first.lower, self._first.upper, strict=True)
        corners = np.array(list(itertools.product(*sides)))
        points = np.concatenate([corners, self._first.middle[None]])
        far, high = np.zeros(3), 0.0
        for time in np.linspace(0.0, SPAN, LOOKS):
            moved = self.outer.displacement(points, time)
            far = np.maximum(far, np.abs(moved[:-1] - moved[-1]).max(axis=0))
            high = max(high, float(self.outer.elevation(points[-1:], time)[0]) - self.outer.level)
        return far * 1.2, high

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
        # the pressure around a body is that of its motion, and would be lost: the ring alone
        near, _, _ = self._ring(self.water.positions(), time)
        self._relax(states, near, self.settings.relaxations)
        return True

    def _settle(self, states: BodyStates) -> None:
        self.step = self._stride(states, 0.0, self._world) * self._world
        # critical damping of the slowest sound, a quarter of whose wave is the depth
        sound = self._sound * self.step / self._substeps(self.step) / self.box.depth
        kept, rounds = math.exp(-math.pi * sound), math.ceil(SETTLED * 2.0 / math.pi / sound)
        self._relax(states, np.arange(self.water.count), rounds, kept)

    def _relax(self, states: BodyStates, rows: Any, rounds: int, kept: float = 0.0) -> None:
        """Even out the density of some particles by places alone, with a share of their motion.

        Left to the next step, it would be a pulse of sound.
        """
        if not rounds:
            return
        velocities, places, still = self.water.velocities(), self.water.positions(), {}
        if self.bodies:
            held = {"velocity", "spin", "inverse_mass", "inverse_inertia", "acceleration"}
            still = {k: 0.0 * v if k in held else v for k, v in states._asdict().items()}
        count = self._substeps(self.step)
        for k in range(rounds):
            motion = kept * self.water.velocities() if k else np.zeros_like(velocities)
            self.water.set_particles(velocities=motion)
            if self.bodies:
                self.water.place_bodies(**still)
            self.water.advance(self.step / count, substeps=1)
        places[rows] = self.water.positions()[rows]
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
                f"{out.sum()} particles passed through the sides of the window.\n"
                "Use shorter steps, or lower waves."
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
        box, field = self.box, self.heights
        i, j = np.meshgrid(*(np.arange(n) + 0.5 for n in field.shape), indexing="ij")
        middles = field.lower + np.stack([i.ravel(), j.ravel()], -1) * field.edge
        seen = float((field.heights.ravel() - self.outer.elevation(middles, time)).mean())
        over = self._over(states, time)
        self.lift = over * box.depth / math.prod(box.counts) - seen

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


_CHOSEN = "chosen"
WIDE, FITS = 2.0, 1.2
"""Width of the water inside of the ring, where none is set, over the diameter of a ball of the
followed body's volume, and over its own [1]."""
MACH = 10.0
"""Speed of sound over the largest speed of the flow: one per cent of compression [1]."""
FADES = 0.1
"""Time in which the speed of sound follows that of a body that slows down [s]."""
SETTLED = 4.0
"""Damping of the sound in the first filling before time zero: e to this power [1]."""
STRIDE = 4
"""Most steps of the world that the water advances at once."""


@dataclass(kw_only=True)
class FluidWindow(ParticleFluid):
    """Water as particles in a moving domain that follows the robot through an open sea.

    Equation:
        Water as in `FluidParticles`. Sides and floor are where the outer sea has carried them,
        x = X + U t + xi(X, t), with the displacement xi of the waves and the current U; in a ring
        along the sides v <- v + (u - v)(1 - exp(-rate w h)), u of the outer sea,
        w = (exp(s^3.5) - 1) / (e - 1), s from 0 at its inner edge to 1 at the side.
        Water is compressed by its pressure over rho g (level - z): its density is even at rest. The
        speed of sound is 10 max(sqrt(g l), v), l the cube root of the largest body's volume or the
        amplitude of the waves, v of the fastest body below the top of the sides against the sea.
        The water advances by as many steps of the world as one substep holds, four at most.

    Args:
        spacing: of the particles at rest [m]; the nearest one that divides the depth is taken.
        size: length (x), width (y) and depth of the window [m]; a length or width of 0 is the
            largest of 1.2 times that of the body that the window follows, two diameters of a ball
            of its volume, and the depth, and a ring and a cell on both sides. Down to
            ``environment.tank_bottom`` where that is less deep.
        freeboard: height of the sides above the water [m].
        ring: width of the relaxation ring, in spacings.
        cell: by which the window moves, in spacings, once the robot has come so far.
        rate: of relaxation at the sides [1/s].
        relaxations: substeps after a shift in which only places change, so that what was cut and
            added is as dense as the rest; 0 leaves it to the next step.
        lag: time constant of the level controller [s].
        current: east and north [m/s].

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
        to pass between it and the sides. The default size knows of the followed body alone, of no
        arms and no depth of a dive. A shift sends a small pulse of sound through the window, see
        `experiments/open_sea`. Over a step of the water the load on a body is its mean:
        ``substeps=1`` takes every step of the world alone. An irregular sea of many components
        costs more than the particles. No obstacles, no shore. The limits of `FluidParticles`.

    References:
        Jacobsen, Fuhrman and Fredsoe 2012, doi:10.1002/fld.2726, for the weight of the ring;
        those of `FluidParticles`.

    Example:
        >>> FluidWindow(spacing=0.05).name
        'window'
    """

    size: list[float] = vector((0.0, 0.0, 0.6), "m", bounds=(0.0, 1e3), source=_CHOSEN)
    freeboard: float = setting(0.3, "m", bounds=(0.0, 1e3), source=_CHOSEN)
    physics: PbfSettings = field(default_factory=PbfSettings)
    ring: int = count(5, bounds=(1, 1000))
    cell: int = count(1, bounds=(1, 100))
    rate: float = setting(300.0, "1/s", bounds=(0.0, 1e4), source="measured on shifts")
    relaxations: int = count(4, bounds=(0, 100))
    lag: float = setting(0.1, "s", bounds=(1e-3, 1e3), source=_CHOSEN)
    current: list[float] = vector((0.0, 0.0), "m/s", bounds=(-10.0, 10.0), source=_CHOSEN)

    name: ClassVar[str] = "window"

    @property
    def lacks_drag(self) -> bool:
        """Whether stated drag is added, see `seals.fluid`: effects do not know the current."""
        return self.subgrid_drag and not any(self.current)

    def solids(self, environment: EnvironmentSettings) -> Mapping[str, ObstacleSettings]:
        """Return an empty list: an open sea has no walls."""
        return {}

    def box(self, environment: EnvironmentSettings, reach: float = 0.0, volume: float = 0.0) -> Box:
        """Return the box of the domain in an environment.

        Args:
            environment: its level and floor.
            reach: of the followed body about its reference point [m]; for sides that are not set.
            volume: of that body [m^3].

        Raises:
            ConfigError: a side is too short for the ring, or the ring too thin.
        """
        level = float(environment.water_level or 0.0)
        bottom = environment.tank_bottom
        depth = self.size[2] if bottom is None else min(self.size[2], level - bottom)
        ball = (6.0 * volume / math.pi) ** (1 / 3)
        ample = (
            max(2.0 * FITS * reach, WIDE * ball, depth) + 2 * (self.ring + self.cell) * self.spacing
        )
        length, width = (side or ample for side in self.size[:2])
        refuse_box(self.spacing, (length, width, depth), self.ring)
        d = depth / round(depth / self.spacing)
        counts = (round(length / d), round(width / d), round(depth / d))
        half = 0.5 * d * np.array(counts)
        lower = np.array([-half[0], -half[1], level - depth])
        return Box(d, lower, counts, self.ring, self.cell, self.freeboard)

    def open(self, around: Surrounding, bodies: Sequence[FluidBody]) -> None:
        """Create the domain and its boundaries."""
        e = around.environment
        reach = reach_of(bodies[0].pieces, self.spacing, self.thin) if bodies else 0.0
        box = self.box(e, reach, sum(map(volume_of, bodies[0].pieces)) if bodies else 0.0)
        refuse_ground(e, around.solids)
        level = float(e.water_level or 0.0)
        outer = OuterSea(around.waves, level, (self.current[0], self.current[1]))
        refuse_sea(outer, box, floor=e.tank_bottom)
        self._simulation = MovingDomain(
            self, box, outer, self._physics(e), bodies, step=around.step
        )
