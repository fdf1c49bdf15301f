"""Base of the simulations of particle fluids with bodies: common to tank and moving domain."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.errors import PhysicsError
from seals.fluid import BodyStates, FluidBody, MomentumBalance
from seals.plugins.fluids.coupling.bodies import Immersed, add_samples, clear_of, solid_scales
from seals.plugins.fluids.coupling.heights import HeightField
from seals.plugins.fluids.sampling import Samples
from seals.plugins.fluids.solver import Domain, Exchange, SolverSettings

if TYPE_CHECKING:
    from seals.plugins.fluids.coupling.fluid import ParticleFluid


class Simulation(ABC):
    """Particles in a domain, their boundaries and the bodies in them.

    A domain fills in the hooks `_lattice`, `_place`, and where needed `_track`, `_shift`, `_treat`,
    `_settle`, `_occupied`, `_update_surface` and `_reset`.

    Args:
        settings: options of the fluid.
        physics: options of the solver, with density and gravity of the environment.
        bodies: in the fluid.
        spacing: of the particles [m].

    Attributes:
        water: the solver.
        heights: height field of the surface, as last updated.
        last: momentum balance of the last step.
        removed: lattice places that bodies and solids displaced at the start.
        left: particles that left.
    """

    _state: ClassVar[tuple[str, ...]] = (
        *("last", "removed", "left", "_exchange", "_looked"),
        *("_ahead", "_share", "_past", "_took"),
    )

    def __init__(
        self,
        settings: ParticleFluid,
        physics: SolverSettings,
        bodies: Sequence[FluidBody],
        spacing: float,
    ) -> None:
        self.settings, self.physics, self.spacing = settings, physics, spacing
        self.bodies, self.immersed = len(bodies), Immersed(bodies, spacing, settings.thin)

    def _allocate(
        self,
        domain: tuple[Floats, Floats],
        fixed: Samples,
        moved: Sequence[Samples],
        *,
        capacity: int,
        surface: HeightField,
        level: float = -math.inf,
    ) -> None:
        """Allocate the solver, see `Domain`; ``moved`` are kinematic boundaries but bodies."""
        boundary = self.immersed.count + sum(len(s.points) for s in (*moved, fixed))
        refuse_large(capacity, boundary, self.settings.most)
        self.water = self.physics.build(
            Domain(
                spacing=self.spacing,
                lower=domain[0],
                upper=domain[1],
                capacity=capacity,
                boundary_capacity=boundary,
                bodies=self.bodies + len(moved),
                level=level,
            ),
            device=self.settings.device.value,
            threads=self.settings.threads,
        )
        scales = solid_scales(self.immersed.names, self.settings.solid_scale)
        for k, samples in enumerate((fixed, *self.immersed.samples, *moved)):
            add_samples(self.water, k, samples, scales[k - 1] if 0 < k <= self.bodies else 1.0)
        self.heights = surface
        self._reset()

    def _reset(self) -> None:
        """Return all counters to their initial values."""
        self.last: MomentumBalance | None = None
        self.removed = self.left = 0
        self._exchange: Exchange | None = None
        self._looked = -math.inf
        self._ahead, self._share = 0, np.zeros((self.bodies, 6))
        self._past: Floats | None = None
        self._took = 0.0

    def initialise(self, states: BodyStates) -> None:
        """Fill the domain with water around bodies and solids, at time zero."""
        if self.water.count:
            self.water.remove_particles(np.ones(self.water.count, dtype=bool))
        self._reset()
        self._track(states, 0.0)
        places = self._lattice()
        kept = clear_of(places, self._occupied(states), self.spacing)
        self.removed = len(places) - len(kept)
        self._place(states, 0.0, 0.0)
        self._fill(kept)
        self._settle(states)
        self._look(states, 0.0)

    def exchange(self, states: BodyStates, time: float, step: float) -> Floats:
        """Return the impulses on the bodies in a step [N s, N m s], shape (K, 6).

        The water may advance by several steps at once; each of them gets an equal share.
        """
        if self._ahead < 1:
            self._ahead = count = self._stride(states, time, step)
            late = 0.5 * (count - 1) * step / self._took if self._took else 0.0
            now = np.stack([states.velocity, states.spin])
            velocity, spin = now if self._past is None else now - late * (now - self._past)
            self._past, self._took = now, count * step
            centred = states._replace(velocity=velocity, spin=spin)
            self._share = self._advance(centred, time, count * step) / count
        self._ahead -= 1
        return self._share

    def _stride(self, states: BodyStates, time: float, step: float) -> int:
        """Return the number of steps [s] of the world that the water advances at once."""
        return 1

    def _advance(self, states: BodyStates, time: float, step: float) -> Floats:
        """Advance by a step [s]; return the impulses on the bodies [N s, N m s], shape (K, 6)."""
        before, self.step = self.water.momentum(), step
        start = self.water.momentum() if self._shift(states, time) else before
        self._place(states, time, step)
        done = self.water.advance(step, substeps=self._substeps(step))
        self.left += done.left
        moved = self.water.momentum()
        self._treat(states, time + step, step)
        after = self.water.momentum()
        self._exchange = done
        sources = (after - moved) + (start - before)
        self.last = momentum_balance(done, self.bodies, before, sources, after)
        self._look(states, time + step)
        return done.impulses[: self.bodies]

    def _substeps(self, step: float) -> int:
        return self.settings.substeps or self.water.substeps(step)

    @abstractmethod
    def _lattice(self) -> Floats:
        """Return the places of all particles if there were no body [m], shape (n, 3)."""

    @abstractmethod
    def _place(self, states: BodyStates, time: float, step: float) -> None:
        """Set bodies and moving boundaries for the step that begins at ``time``."""

    def _track(self, states: BodyStates, time: float) -> tuple[int, int]:
        """Let the domain follow the bodies; return the number of cells moved, east and north."""
        return 0, 0

    def _shift(self, states: BodyStates, time: float) -> bool:
        """Add and remove particles where the domain moved; return whether it did."""
        return False

    def _treat(self, states: BodyStates, time: float, step: float) -> None:  # noqa: B027  optional
        """Apply forcing and relaxation after a step."""

    def _settle(self, states: BodyStates) -> None:  # noqa: B027  optional
        """Let the water come to rest before time zero."""

    def _fill(self, places: Floats) -> None:
        """Add the initial particles."""
        self.water.add_particles(places)

    def _occupied(self, states: BodyStates) -> Samples:
        """Volumes without water at the start."""
        return self.immersed.volumes(states)

    def _look(self, states: BodyStates, time: float) -> None:
        """Update the surface every ``look`` seconds."""
        if time - self._looked >= self.settings.look - 1e-9:
            self._looked = time
            self._update_surface(states, time)

    def _update_surface(self, states: BodyStates, time: float) -> None:
        self.heights.update(self.water.positions(), self.immersed.surfaces(states).points)

    def surface(self, places: Floats, time: float) -> Floats:
        """Return the height of the surface over points (n, 2 or 3) [m], shape (n,)."""
        return self.heights.at(places)

    def diagnostics(self) -> dict[str, float]:
        """Return diagnostics: particles, spacing, compression, iterations; units in the names."""
        out = {"particles": float(self.water.count), "spacing [m]": float(self.water.spacing)}
        if self._exchange is not None:
            out["mean compression [1]"] = float(self._exchange.mean_compression)
            out["largest compression [1]"] = float(self._exchange.max_compression)
            out["iterations"] = float(self._exchange.iterations)
        return out

    def snapshot(self) -> Any:
        """Return a copy of the complete state."""
        own = {name: getattr(self, name) for name in self._state}
        return self.water.snapshot(), self.heights.heights.copy(), self.heights.lower.copy(), own

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        water, heights, lower, own = kept
        self.water.restore(water)
        self.heights.heights, self.heights.lower = heights.copy(), lower.copy()
        vars(self).update(own)


def refuse_large(count: int, boundary: int, most: int) -> None:
    """Refuse more particles than allowed before memory is allocated.

    Raises:
        PhysicsError: names their number and what to change.
    """
    if count + boundary > most:
        raise PhysicsError(
            f"the basin holds {count:,} particles and {boundary:,} boundary samples.\n"
            f"Allowed by fluid.most: {most:,}; use a coarser fluid.spacing or a smaller "
            f"fluid.size, or raise fluid.most (about {1.6e-6 * (count + boundary):.2g} GB)."
        )


def momentum_balance(
    done: Exchange, bodies: int, before: Floats, sources: Floats, after: Floats
) -> MomentumBalance:
    """Return the momentum balance of a step.

    Args:
        done: impulses of the step.
        bodies: number of moving boundaries that are bodies; the rest are moved walls.
        before: momentum of the water at the start [N s], shape (3,).
        sources: momentum from beaches, wind, particles added and removed [N s], shape (3,).
        after: momentum at the end [N s], shape (3,).
    """
    pushed = done.impulses[:bodies, :3].sum(axis=0)
    walls = done.walls + done.impulses[bodies:, :3].sum(axis=0)
    exchanged = (done.gravity, done.impulses[:, :3], done.walls)
    gross = sum(float(np.abs(part).sum()) for part in exchanged)
    return MomentumBalance(before, after, done.gravity, sources, pushed, walls, gross)
