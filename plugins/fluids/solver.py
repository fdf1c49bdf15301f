"""Protocol of particle solvers: particles, boundary samples, rigid bodies, step, diagnostics.

Tank and moving domain know a solver through this protocol only. All arrays are NumPy float64,
world axes east-north-up, SI units. Bodies are numbered 1..K; body 0 is everything static.

What the domains assume of every solver:

- A particle is ``spacing``^3 of water: its mass is density times spacing^3. Level control, wind and
  the initial lattice count with it.
- Boundary samples lie half a spacing inside of the surface that they stand for, and the first layer
  of particles rests one spacing from them, half a spacing outside: the water then ends at that
  surface. Walls of a tank are samples half a spacing behind their faces. Buoyancy depends on it.
- Samples of thin parts are weighed by their ``volumes``, those of thick ones by area, see ``bulk``.
- Motion of bodies within a step is the solver's: it moves them with the given velocities,
  accelerations and mobilities. Its own poses are forgotten after the step.
- What cannot be is refused with `seals.errors.PhysicsError`, in numbers and with what to change;
  nothing is left out or clipped silently.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import Field, dataclass
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.state_records import state_record


class Domain(NamedTuple):
    """Extent and capacities that a solver is allocated for.

    Args:
        spacing: distance of particles at rest [m].
        lower: lower corner [m], shape (3,). Tank walls are boundary samples of body 0 inside of it;
            the domain only bounds the search.
        upper: upper corner [m], shape (3,).
        capacity: largest number of particles.
        boundary_capacity: largest number of boundary samples, all bodies together.
        bodies: number K of bodies.
        level: surface of the water at rest [m]; minus infinity for none. Compressible water yields
            to its pressure over that at rest alone: at rest, its density is even.
    """

    spacing: float
    lower: Floats | Sequence[float]
    upper: Floats | Sequence[float]
    capacity: int
    boundary_capacity: int
    bodies: int
    level: float = -math.inf


@state_record
class Exchange(NamedTuple):
    """Impulses and quality measures of one ``advance``.

    Args:
        impulses: impulse of the water on each body, force part then moment about its centre of
            mass, world axes [N s, N m s], shape (K, 6); bodies that are moved from outside, such
            as a paddle, included.
        walls: impulse of the water on everything static [N s], shape (3,).
        gravity: impulse of gravity on the water [N s], shape (3,).
        external: change of the water's momentum not explained by the above [N s], shape (3,):
            rounding; after - before = gravity - walls - sum of impulses + external.
        iterations: pressure iterations, mean over the substeps.
        mean_compression: mean of max(density / rest density - 1, 0) after the last substep [1].
        max_compression: its maximum [1].
        left: particles removed because they left through an open domain face.
    """

    impulses: Floats
    walls: Floats
    gravity: Floats
    external: Floats
    iterations: float
    mean_compression: float
    max_compression: float
    left: int


@state_record
@dataclass(frozen=True)
class Snapshot:
    """State of a solver, to be passed to ``restore``.

    Args:
        arrays: copies, or arrays that the solver never writes to again, by name. Checkpoints write
            them to disk, so they may hold what `seals.state_tree.packed` takes: NumPy arrays of
            numbers, numbers, text, None, and tuples, lists and mappings of these.
    """

    arrays: dict[str, Any]


@runtime_checkable
class ParticleSolver(Protocol):
    """A particle fluid with static boundaries and moving rigid bodies.

    Particles keep their row: arrays are in the order in which particles were added; removal keeps
    the order of the others.

    Attributes:
        spacing: distance of particles at rest [m].
        origin: lower corner of the domain [m], shape (3,).
        capacity: largest number of particles.
        count: number of particles.
        sound: numerical speed of sound for the coming steps [m/s], first that of the settings. The
            moving domain sets it by the speeds of the bodies.
    """

    spacing: float
    origin: Floats
    capacity: int
    count: int
    sound: float

    @property
    def boundary_count(self) -> int:
        """Number of boundary samples."""

    def add_particles(
        self, positions: Floats, velocities: Floats | None = None, *, trusted: bool = False
    ) -> None:
        """Add particles at positions (n, 3) [m] with velocities (n, 3) [m/s], zero if None.

        ``trusted`` skips the search for overlaps.

        Raises:
            PhysicsError: more than the capacity, not finite, outside of the domain, or overlapping.
        """

    def remove_particles(self, chosen: NDArray[np.bool_]) -> int:
        """Remove the particles marked in ``chosen`` (n,); return their number."""

    def set_particles(
        self, *, positions: Floats | None = None, velocities: Floats | None = None
    ) -> None:
        """Overwrite positions [m] and/or velocities [m/s] of all particles, shape (n, 3)."""

    def positions(self) -> Floats:
        """Positions [m], shape (n, 3)."""

    def velocities(self) -> Floats:
        """Velocities [m/s], shape (n, 3)."""

    def shift_domain(self, spacings: NDArray[np.int64]) -> None:
        """Move the domain by whole spacings (3,); particles and boundary stay in the world."""

    def add_boundary(
        self,
        *,
        body: int,
        points: Floats,
        volumes: Floats | None = None,
        bulk: Floats | None = None,
        scale: float = 1.0,
    ) -> None:
        """Add boundary samples of a body, in world axes (body 0) or body axes.

        Axes of a body have their origin at the position that `place_bodies` gives. Further samples
        of the same body are added to those it has.

        Args:
            body: 0 for static samples, 1..K for bodies.
            points: [m], shape (b, 3).
            volumes: displaced by each sample [m^3], shape (b,); used where ``bulk`` is below 1.
            bulk: share of the weight by area, the rest is by volume [1], shape (b,); None for 1.
            scale: weight of all samples of the body in the density [1]; it is handed over where
                it is not 1.

        Raises:
            PhysicsError: unknown body, not finite, or more samples than the boundary capacity.
        """

    def move_boundary(self, *, body: int, points: Floats) -> None:
        """Move the samples of a body to ``points`` [m], shape (b, 3); weights are kept."""

    def place_bodies(
        self,
        *,
        position: Floats,
        rotation: Floats,
        velocity: Floats,
        spin: Floats,
        inverse_mass: Floats,
        inverse_inertia: Floats,
        acceleration: Floats,
    ) -> None:
        """Set pose, twist, mobility and known acceleration of all bodies for the next step.

        Arguments are those of `seals.fluid.BodyStates`; a kinematic body has zero inverse mass.
        Called before every `advance` if there are bodies. Positions are those at t, the start of
        the step. Velocities are those at t - h/2 where the backend keeps half-step velocities and
        knows the last one, else those at t; see `seals.fluid`. A kinematic body moves with the
        given velocity.

        Raises:
            PhysicsError: a value is not finite, or there are not K of them.
        """

    def substeps(self, step: float) -> int:
        """Return the number of substeps that ``step`` [s] requires for stability.

        Users may set another number, which `advance` then gets.
        """

    def advance(self, step: float, *, substeps: int) -> Exchange:
        """Advance by ``step`` [s] in equal substeps; bodies move along within it.

        Particles that leave the domain are removed and counted where the settings allow outflow.
        After a shift the moving domain advances water at rest by single substeps, with bodies that
        do not move, and keeps the places of the ring alone.

        Raises:
            PhysicsError: a result is not finite, or particles left a domain without outflow.
        """

    def momentum(self) -> Floats:
        """Momentum of the fluid [N s], shape (3,)."""

    def kinetic_energy(self) -> float:
        """Kinetic energy of the fluid [J]."""

    def snapshot(self) -> Snapshot:
        """Return the complete state."""

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot of this solver.

        Boundary samples are those that were added; bodies are placed, and moved samples moved, by
        the domain before the next `advance`. A snapshot may come from a file.

        Raises:
            ValueError: the snapshot cannot be one of this solver, such as a count over capacity.
        """

    def close(self) -> None:
        """Free memory and devices."""


class SolverSettings(Protocol):
    """Options of a solver, a dataclass, and the construction of the solver from them.

    Attributes:
        density: rest density [kg/m^3].
        gravity: acceleration of free fall [m/s^2].
        sound_speed: numerical speed of sound [m/s]. The tank passes 0 on, which lets the solver
            choose. The moving domain gives a positive one, and ``Domain.level``.
        outflow: whether particles may leave the domain.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    density: float
    gravity: float
    sound_speed: float
    outflow: bool

    def build(self, domain: Domain, *, device: str, threads: int) -> ParticleSolver:
        """Allocate a solver for a domain.

        Args:
            domain: extent and capacities.
            device: ``cpu`` or ``cuda``.
            threads: on the CPU; 0 for all that this process may use.
        """
