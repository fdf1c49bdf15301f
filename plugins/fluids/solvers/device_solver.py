"""Host side of the particle solvers whose particles live on a device.

All arrays are NumPy float64, world axes ENU, SI. Particles keep their row: `positions()`,
`velocities()` and `densities()` are in the order in which particles were added. Particles and
bodies are checked when they are given, the state after each step.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import PhysicsError
from seals.plugins.fluids.solver import Domain, Exchange, Snapshot
from seals.plugins.fluids.solvers.pbf.boundary import Boundary
from seals.plugins.fluids.solvers.pbf.engine import Engine
from seals.plugins.fluids.solvers.pbf.fields import CROWDED, ESCAPED, LONGEST, NOT_FINITE
from seals.plugins.fluids.solvers.pbf.points import nearest_pair
from seals.plugins.fluids.solvers.pbf.stress import Method, mean_stress

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.device_pipeline import DevicePipeline, Sums
    from seals.plugins.fluids.solvers.device_settings import DeviceSettings


Array = NDArray[np.float64]
# particles, and particles and samples, may be filled this close [spacings]
CLOSEST = 0.6


def _check_state(arrays: Mapping[str, Any], capacity: int) -> None:
    """Refuse a stored state with indices or sizes outside the arrays.

    Raises:
        ValueError: a count, the numbers of the particles, or the origin cannot be.
    """
    count = arrays["count"]
    if type(count) is not int or not 0 <= count <= capacity:
        raise ValueError(f"{str(count)[:40]} particles; this water holds 0 to {capacity:,}")
    if not np.array_equal(np.sort(arrays["number"][:count]), np.arange(count)):
        raise ValueError("the particles are not numbered from 0, each once")
    if not np.isfinite(arrays["origin"]).all():
        raise ValueError("the origin of the water is not finite")


def _check_fill(
    new: Array,
    speed: Array,
    *,
    have: Array,
    static: Array,
    lower: Array,
    size: Array,
    spacing: float,
    capacity: int,
    trusted: bool,
) -> None:
    """Refuse initial particles that are invalid, such as not finite or overlapping.

    Raises:
        PhysicsError: wrong shape, not finite, outside, over capacity, or overlapping.
    """
    if new.ndim != 2 or new.shape[1] != 3 or speed.shape != new.shape:
        raise PhysicsError(
            f"Particles need positions and velocities of shape (n, 3), "
            f"not {new.shape} and {speed.shape}."
        )
    if not (np.isfinite(new).all() and np.isfinite(speed).all()):
        raise PhysicsError("A position or velocity of the particles to fill is not finite.")
    if len(new) + len(have) > capacity:
        raise PhysicsError(
            f"{len(new) + len(have)} particles exceed the capacity of {capacity}.\n"
            "Use more capacity, less water, or a coarser spacing; no particles were dropped."
        )
    outside = ((new < lower) | (new > lower + size)).any(axis=1)
    if outside.any():
        raise PhysicsError(
            f"{outside.sum()} of {len(new)} particles are outside the domain "
            f"{lower} .. {lower + size} m, the first at {new[outside][0]}."
        )
    if not trusted:
        _overlaps(new, have=have, static=static, spacing=spacing)


def _overlaps(new: Array, *, have: Array, static: Array, spacing: float) -> None:
    radius = CLOSEST * spacing
    for other, name in ((have, "particles already there"), (static, "static boundary samples")):
        gap = nearest_pair(new, other, radius)
        if gap < radius:
            raise PhysicsError(
                f"Particles to fill overlap {name}: {gap:.4g} m apart, spacing {spacing:.4g} m.\n"
                "Leave out particles within one spacing."
            )
    gap = nearest_pair(new, new, radius, same=True)
    if gap < radius:
        raise PhysicsError(
            f"Particles to fill overlap each other: {gap:.4g} m apart, spacing {spacing:.4g} m."
        )


def _trouble(
    found: NDArray[np.int32],
    *,
    finite: bool,
    outflow: bool,
    time: float,
    substep: float,
    longest: int,
    advised: float,
) -> str:
    """Return the reason why an advance failed, or an empty string."""
    when = f"at {time:.4g} s"
    if found[NOT_FINITE] or not finite:
        return (
            f"The state of the water became non-finite {when} (substep {substep:.3g} s).\n"
            f"Take substeps of {advised:.3g} s or less, and check bodies that start in the water."
        )
    if found[CROWDED]:
        return (
            f"{found[CROWDED]} particles had more than neighbours={longest} neighbours {when}, "
            f"up to {found[LONGEST]}.\n"
            "A body may overlap water; otherwise raise neighbours."
        )
    if found[ESCAPED] and not outflow:
        return (
            f"{found[ESCAPED]} times a particle was outside the domain {when}.\n"
            "Close the gap in the walls (samples one spacing apart), take shorter substeps, "
            "enlarge the domain, or set outflow=true to let water leave."
        )
    return ""


class DeviceSolver(ABC):
    """Host side of a particle solver: arrays, boundaries, bodies, impulses; see `ParticleSolver`.

    Bodies are numbered 1..bodies; body 0 is everything static. A kinematic wall (piston, flap) is
    a body with zero inverse mass and inertia: place it with its velocity each step.
    The first layer of water rests one spacing from boundary samples: samples inset by half a
    spacing from a surface put the water exactly at that surface.

    Args:
        domain: extent and capacities.
        settings: physics and solver.
        engine: the owner of Taichi.

    Attributes:
        pipeline: fields and kernels.
        sound: speed of sound for the coming steps [m/s]; 0 leaves it to the solver.
    """

    pipeline: DevicePipeline

    def __init__(self, domain: Domain, *, settings: DeviceSettings, engine: Engine) -> None:
        self.origin = np.asarray(domain.lower, dtype=np.float64)
        self.size = np.asarray(domain.upper, dtype=np.float64) - self.origin
        spacing, bodies = domain.spacing, domain.bodies
        if spacing <= 0 or (self.size < 4 * spacing).any():
            raise PhysicsError(
                f"A domain of {self.size} m is too small for a spacing of {spacing} m.\n"
                "Each side needs at least four spacings."
            )
        engine.start(self)
        self.spacing, self.settings, self.sound = spacing, settings, settings.sound_speed
        self.pipeline = self._pipeline(domain, engine.accelerated)
        self.boundary = Boundary(
            bodies=self.pipeline.bodies,
            samples=self.pipeline.samples,
            numbers=self.pipeline.numbers,
            spacing=spacing,
            kernel=settings.kernel,
            lattice=self.pipeline.smoothing.lattice,
        )
        self.capacity, self.bodies, self.level = domain.capacity, bodies, domain.level
        self.count = 0
        self.time = 0.0
        self._depth = 0.0
        self._momentum: Array | None = np.zeros(3)
        # whether particles were written since the last substep
        self._written = False
        self._placed = not bodies
        self._bodies = np.zeros((bodies, 24))

    def add_particles(
        self, positions: Array, velocities: Array | None = None, *, trusted: bool = False
    ) -> None:
        """Add particles at positions (n, 3) [m] with velocities (n, 3) [m/s], zero if None.

        ``trusted`` skips the search for overlaps, which takes seconds for millions of particles.

        Raises:
            PhysicsError: particles overlap each other or static boundary samples, lie outside of
                the domain, are not finite, or exceed the capacity.
        """
        new = np.asarray(positions, dtype=np.float64)
        speed = np.zeros_like(new) if velocities is None else np.asarray(velocities, np.float64)
        _check_fill(
            new,
            speed,
            have=self.positions() if not trusted else np.empty((self.count, 3)),
            static=self.boundary.points.get(0, np.empty((0, 3))),
            lower=self.origin,
            size=self.size,
            spacing=self.spacing,
            capacity=self.capacity,
            trusted=trusted,
        )
        if len(new):
            both = np.hstack([new - self.origin, speed])
            self.pipeline.rows.append(np.ascontiguousarray(both, np.float32))
        known = self.positions()[:, 2] if self._deepening else np.empty(0)
        self._changed(self.count + len(new), np.concatenate([known, new[:, 2]]))

    def remove_particles(self, chosen: NDArray[np.bool_]) -> int:
        """Remove the particles marked in ``chosen`` (n,); return their number."""
        keep, before = ~np.asarray(chosen, dtype=bool), self.count
        parts = self._memory()
        held = keep[parts["number"][:before]]
        last = int(held.sum())
        for values in parts.values():
            values[:last] = values[:before][held]
        parts["number"][:last] = (np.cumsum(keep) - 1)[parts["number"][:last]]
        for name, values in parts.items():
            getattr(self.pipeline.particles, name)[0].from_numpy(values)
        self._changed(last, np.empty(0))
        return before - last

    def set_particles(
        self, *, positions: Array | None = None, velocities: Array | None = None
    ) -> None:
        """Overwrite positions and/or velocities (n, 3) of all particles (relaxation zones)."""
        rows, known = self.pipeline.rows, self._momentum
        if positions is not None:
            rows.move(self._single(np.asarray(positions, np.float64) - self.origin))
        if velocities is not None:
            single = self._single(velocities)
            rows.drive(single)
            known = self.pipeline.mass * single.sum(axis=0, dtype=np.float64)
        heights = self.positions()[:, 2] if self._deepening else np.empty(0)
        self._changed(self.count, heights)
        self._momentum = known

    def _single(self, values: Array) -> Any:
        """Values of all particles in single precision, shape (n, 3)."""
        return np.ascontiguousarray(np.reshape(values, (self.count, 3)), np.float32)

    def shift_domain(self, spacings: NDArray[np.int64]) -> None:
        """Move the domain by whole spacings (3,); particles and boundary stay in the world."""
        where = self.positions()
        self.origin = self.origin + np.asarray(spacings) * self.spacing
        self.set_particles(positions=where)
        self.boundary.stale = True

    def add_boundary(
        self,
        *,
        body: int,
        points: Array,
        volumes: Array | None = None,
        bulk: Array | None = None,
        scale: float = 1.0,
    ) -> None:
        """Add boundary samples of a body; their volumes follow Akinci et al. 2012.

        Args:
            body: 0 for static samples in world axes; 1..K for points in the body's axes about its
                centre of mass.
            points: positions [m], shape (b, 3), each point once: one spacing apart they hold the
                water, two thirds of one apart it also slides along them.
            volumes: displaced by each sample [m^3], shape (b,); used where ``bulk`` is below 1.
            bulk: share of the weight by area, the rest is by volume [1], shape (b,); None for 1.
            scale: weight of all samples of the body in the density [1], besides ``solid_scale``.

        Raises:
            PhysicsError: unknown body, not finite, or more samples than the capacity.
        """
        self.boundary.add(body, points, convex=body > 0, volumes=volumes, bulk=bulk, scale=scale)

    def move_boundary(self, *, body: int, points: Array) -> None:
        """Move the samples of a body to ``points`` [m], shape (b, 3); their weights are kept."""
        self.boundary.move(body, points)

    @property
    def boundary_count(self) -> int:
        """Number of boundary samples."""
        return self.boundary.count

    def place_bodies(
        self,
        *,
        position: Array,
        rotation: Array,
        velocity: Array,
        spin: Array,
        inverse_mass: Array,
        inverse_inertia: Array,
        acceleration: Array,
    ) -> None:
        """Place all bodies for the coming ``advance``.

        Args:
            position: centres of mass [m], world axes, shape (K, 3).
            rotation: body to world, shape (K, 3, 3).
            velocity: of the centre of mass [m/s], shape (K, 3).
            spin: angular velocity, world axes [rad/s], shape (K, 3).
            inverse_mass: [1/kg], shape (K,); 0 for a kinematic wall.
            inverse_inertia: about the centre of mass, world axes [1/(kg m^2)], shape (K, 3, 3);
                held over the step.
            acceleration: by all loads but the water, held over the step [m/s^2], shape (K, 3).

        Raises:
            PhysicsError: a value is not finite, or a mass is negative.
        """
        local = np.asarray(position) - self.origin
        parts = [local, rotation, velocity, spin, inverse_mass, inverse_inertia]
        parts += [acceleration, np.zeros((self.bodies, 3))]
        # refuse poses, twists and masses that are not finite, or not one per body
        for value in parts:
            array = np.asarray(value)
            if len(array) != self.bodies or not np.isfinite(array).all():
                odd = "" if np.isfinite(array).all() else " with values not finite"
                raise PhysicsError(
                    f"place_bodies() needs finite values for each of {self.bodies} bodies; got "
                    f"shape {array.shape}{odd}."
                )
        self.pipeline.send(np.hstack([np.reshape(part, (self.bodies, -1)) for part in parts]))
        self._placed = True

    @abstractmethod
    def _pipeline(self, domain: Domain, accelerated: bool) -> DevicePipeline:
        """Allocate fields and kernels."""

    @property
    @abstractmethod
    def sound_speed(self) -> float:
        """Speed of sound of the compliance in use [m/s]."""

    @property
    @abstractmethod
    def longest_substep(self) -> float:
        """Longest substep that is stable [s]."""

    def substeps(self, step: float) -> int:
        """Return the number of substeps of ``step`` [s] required for stability."""
        return max(1, math.ceil(step / self.longest_substep))

    def advance(self, step: float, *, substeps: int) -> Exchange:
        """Advance by ``step`` [s] in equal substeps; bodies move along inside of it.

        Raises:
            PhysicsError: not finite, particles left the domain, or too many neighbours: said with
                numbers and with what to change.
        """
        if not self._placed:
            raise PhysicsError("Bodies were never placed.\nCall place_bodies() before advance().")
        fresh = self.boundary.stale
        if fresh:
            self.boundary.upload(self.origin)
        self.pipeline.moving = self.boundary.moving > 0
        before = self.momentum()
        self.pipeline.prepare(step / substeps, self.sound_speed, self.level - self.origin[2])
        done = 0
        for k in range(substeps):
            done += self.pipeline.substep(static_changed=fresh and k == 0)
        self.time += step
        sums = self.pipeline.sums()
        self._check(sums, step / substeps)
        return self._exchange(sums, before, step, done / substeps)

    def _check(self, sums: Sums, substep: float) -> None:
        found = self.pipeline.numbers.trouble.to_numpy()
        finite = np.isfinite(sums.velocity).all() and np.isfinite(sums.square)
        if found.any() or not finite:
            self.pipeline.numbers.trouble.fill(0)
            message = _trouble(
                found,
                finite=bool(finite),
                outflow=self.settings.outflow,
                time=self.time,
                substep=substep,
                longest=self.settings.neighbours,
                advised=self.longest_substep,
            )
            if message:
                raise PhysicsError(message)

    def _exchange(self, sums: Sums, before: Array, step: float, iterations: float) -> Exchange:
        mass = self.pipeline.mass
        self._bodies = self.pipeline.collect()
        impulses = self._bodies[:, 18:24].copy()
        walls = self.pipeline.wall_impulse()
        gravity = np.array([0.0, 0.0, -self.settings.gravity * step * mass * self.count])
        after = mass * sums.velocity
        external = after - before - gravity + walls + impulses[:, :3].sum(axis=0)
        self._momentum, self._written = after, False
        count = max(self.count, 1)
        result = Exchange(
            impulses=impulses,
            walls=walls,
            gravity=gravity,
            external=external,
            iterations=iterations,
            mean_compression=sums.compression / count,
            max_compression=sums.largest,
            left=0,
        )
        if self.settings.outflow:
            local = self.positions() - self.origin
            gone = np.asarray(((local < 0) | (local > self.size)).any(axis=1))
            return result._replace(left=self.remove_particles(gone) if gone.any() else 0)
        return result

    def _rows(self, field: Any) -> Array:
        values = field.to_numpy()[: self.count]
        found = np.empty(values.shape, dtype=np.float64)
        found[self.pipeline.particles.number[0].to_numpy()[: self.count]] = values
        return found

    def positions(self) -> Array:
        """Positions [m], shape (n, 3)."""
        return self._read(self.pipeline.particles.place) + self.origin

    def velocities(self) -> Array:
        """Velocities [m/s], shape (n, 3)."""
        return self._read(self.pipeline.particles.velocity)

    def _read(self, buffers: Sequence[Any]) -> Array:
        """First three numbers of the particles' vectors in buffer 0, by row, shape (n, 3)."""
        found = np.empty((self.count, 3), np.float32)
        if self.count:
            self.pipeline.rows.write(buffers[0].plain, found)
        return found.astype(np.float64)

    def densities(self) -> Array:
        """Densities by summation, boundary included, of the last substep [kg/m^3], shape (n,)."""
        return self.settings.density * self._rows(self.pipeline.particles.density)

    def pressures(self) -> Array:
        """Pressures of the last substep, see `pbf.stress` [Pa], shape (n,)."""
        if not self.pipeline.current:
            return np.zeros(self.count)
        settings, boundary = self.settings, self.boundary
        method = Method(
            self.spacing,
            settings.kernel,
            self.pipeline.smoothing.lattice,
            settings.stress_correction,
            settings.solid_scale,
        )
        samples = [np.empty((0, 3))]
        weights = [np.empty(0)]
        for body, points in boundary.points.items():
            if body:
                turn = self._bodies[body - 1, 3:12].reshape(3, 3)
                points = points @ turn.T + self._bodies[body - 1, :3] + self.origin  # noqa: PLW2901
            samples.append(points)
            weights.append(boundary.weights[body])
        stress = mean_stress(
            self.positions(),
            self._pressed(),
            np.concatenate(samples),
            np.concatenate(weights),
            method,
        )
        return settings.density / self.pipeline.current**2 * stress

    def _pressed(self) -> Array:
        """Multipliers that press on the neighbours, see `pressures` [m^2], shape (n,)."""
        return self._rows(self.pipeline.particles.place[0])[:, 3]

    def placed(self) -> tuple[Array, Array, Array, Array]:
        """Position, rotation, velocity and angular velocity of the bodies after the step."""
        table = self._bodies
        return (
            table[:, :3] + self.origin,
            table[:, 3:12].reshape(-1, 3, 3),
            table[:, 12:15],
            table[:, 15:18],
        )

    def momentum(self) -> Array:
        """Momentum of the water [N s], shape (3,), summed in double precision."""
        found = self._momentum
        if found is None:
            found = self._momentum = self.pipeline.mass * self.pipeline.sums().velocity
        return np.array(found)

    def kinetic_energy(self) -> float:
        """Kinetic energy of the water [J]."""
        return float(0.5 * self.pipeline.mass * self.pipeline.sums().square)

    def snapshot(self) -> Snapshot:
        """Return everything needed to continue bit for bit (deterministic mode)."""
        p, arrays = self.pipeline.particles, self._memory()
        arrays |= {"density": p.density.to_numpy(), "third": p.third.to_numpy()}
        arrays |= {"origin": self.origin.copy()}
        arrays |= {"count": self.count, "time": self.time, "depth": self._depth}
        return Snapshot(arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot; the caller sets the bodies again."""
        p, arrays = self.pipeline.particles, snapshot.arrays
        _check_state(arrays, self.capacity)
        p.place[0].from_numpy(arrays["place"])
        p.velocity[0].from_numpy(arrays["velocity"])
        p.number[0].from_numpy(arrays["number"])
        p.density.from_numpy(arrays["density"])
        p.third.from_numpy(arrays["third"])
        self.boundary.stale |= bool((self.origin != arrays["origin"]).any())
        self.origin = arrays["origin"].copy()
        self.count, self.time, self._depth = arrays["count"], arrays["time"], arrays["depth"]
        self.pipeline.numbers.count[None] = self.count
        self._momentum, self._written = None, True

    def _memory(self) -> dict[str, Any]:
        """Places, velocities and numbers of the particles in the order of the device's memory."""
        p = self.pipeline.particles
        fields = {"place": p.place[0], "velocity": p.velocity[0], "number": p.number[0]}
        return {name: field.to_numpy() for name, field in fields.items()}

    @property
    def _deepening(self) -> bool:
        """Whether the speed of sound follows the height of the water."""
        return self.sound <= 0.0

    def _changed(self, count: int, heights: Array) -> None:
        """Note the number of particles, and how tall the water has been by its heights [m]."""
        self.count = self.pipeline.numbers.count[None] = count
        if len(heights):
            self._depth = max(self._depth, float(np.ptp(heights)) + self.spacing)
        self._momentum, self._written = None, True

    def close(self) -> None:
        """Free the memory of the fields."""
        self.pipeline.fields.free()
        Engine.leave(self)
