"""Boundary samples on the host, and their upload to the device fields."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import PhysicsError
from seals.plugins.fluids.solvers.device_settings import Kernel
from seals.plugins.fluids.solvers.pbf.device.bodies import GROUP, Bodies
from seals.plugins.fluids.solvers.pbf.fields import Globals, Samples
from seals.plugins.fluids.solvers.pbf.lattice import Calibration
from seals.plugins.fluids.solvers.pbf.points import plane_normals, weigh

Array = NDArray[np.float64]


class Boundary:
    """Boundary samples by body number; body 0 is static.

    Args:
        bodies: the bodies' fields.
        samples: the samples' fields.
        numbers: counts.
        spacing: distance at rest [m].
        kernel: smoothing kernel.
        lattice: its calibration.
    """

    def __init__(
        self,
        *,
        bodies: Bodies,
        samples: Samples,
        numbers: Globals,
        spacing: float,
        kernel: Kernel,
        lattice: Calibration,
    ) -> None:
        self.bodies, self.samples, self.numbers = bodies, samples, numbers
        self.spacing, self.kernel, self.lattice = spacing, kernel, lattice
        # as given, and as the solver uses them
        self.given: dict[int, Array] = {}
        self.points: dict[int, Array] = {}
        self.weights: dict[int, Array] = {}
        self.normals: dict[int, Array] = {}
        self.thin: dict[int, Array] = {}
        # whether samples have to be uploaded, and whether any came or went since
        self.stale = self.other = True

    def add(
        self,
        body: int,
        points: Array,
        *,
        convex: bool,
        volumes: Array | None = None,
        bulk: Array | None = None,
        scale: float = 1.0,
    ) -> None:
        """Append samples to a body and recompute the weights of all of its samples.

        Samples of thin parts have no surface to be weighed by: with ``bulk`` below 1 their own
        volume counts instead, for that they must be all samples of their body. ``scale`` weighs
        them all: density and pressure alike, so that momentum is kept.

        Raises:
            PhysicsError: unknown body, not finite, or more samples than the capacity.
        """
        points = np.asarray(points, dtype=np.float64)
        if not 0 <= body <= self.bodies.bodies:
            raise PhysicsError(
                f"Boundary body {body} does not exist.\n"
                f"Allowed: 0 (static) and 1..{self.bodies.bodies}."
            )
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise PhysicsError(
                f"Boundary points of body {body} must be finite and (b, 3), not {points.shape}."
            )
        total = sum(map(len, self.points.values())) + len(points)
        if total > self.samples.capacity:
            raise PhysicsError(
                f"{total} boundary samples exceed the capacity of {self.samples.capacity}.\n"
                f"Give boundary_capacity={total} or more, or a coarser spacing."
            )
        whole = np.concatenate([self.given.get(body, np.empty((0, 3))), points])
        self.given[body] = whole
        self.points[body], self.weights[body] = weigh(
            whole, spacing=self.spacing, kernel=self.kernel, lattice=self.lattice, convex=convex
        )
        if body:
            self.normals[body] = plane_normals(whole, self.spacing)
            self.thin[body] = np.zeros(len(whole))
        if volumes is not None and bulk is not None and (bulk < 1.0).any():
            own = volumes / self.spacing**3
            self.weights[body] = bulk * self.weights[body] + (1.0 - bulk) * own
            self.thin[body] = 1.0 - bulk
        self.weights[body] = scale * self.weights[body]
        self.stale = self.other = True

    def move(self, body: int, points: Array) -> None:
        """Move the samples of a body; their weights are kept."""
        self.points[body], self.stale = points, True

    def clear(self, body: int) -> None:
        """Remove all samples of a body."""
        self.given.pop(body, None)
        self.points.pop(body, None)
        self.weights.pop(body, None)
        self.normals.pop(body, None)
        self.thin.pop(body, None)
        self.stale = self.other = True

    @property
    def count(self) -> int:
        """Number of samples."""
        return sum(map(len, self.points.values()))

    @property
    def moving(self) -> int:
        """Number of samples of bodies."""
        return sum(len(points) for body, points in self.points.items() if body)

    def upload(self, origin: Array) -> None:
        """Write samples ordered by body, static ones last, and the groups that sum them."""
        order = sorted(self.points, key=lambda body: (body == 0, body))
        places = [self.points[body] - (origin if body == 0 else 0.0) for body in order]
        point = np.zeros((self.samples.capacity, 3), np.float32)
        point[: self.count] = np.concatenate([np.empty((0, 3)), *places])
        _write(self.samples.point, point)
        if self.other:
            self._describe(order)
        self.stale = self.other = False

    def _describe(self, order: list[int]) -> None:
        """Write weights and owners of all samples, and the groups that sum them."""
        capacity, bodies = self.samples.capacity, self.bodies
        weight, owner = np.zeros(capacity, np.float32), np.zeros(capacity, np.int32)
        normal, thin = np.zeros((capacity, 3), np.float32), np.zeros(capacity, np.float32)
        group = np.zeros((bodies.most, 3), np.int32)
        spans = np.zeros((bodies.bodies + 1, 2), np.int32)
        at = groups = 0
        for body in order:
            end = at + len(self.points[body])
            weight[at:end], owner[at:end] = self.weights[body], body
            if body:
                normal[at:end], thin[at:end] = self.normals[body], self.thin[body]
                spans[body, 0] = groups
                for first in range(at, end, GROUP):
                    group[groups] = body, first, min(first + GROUP, end)
                    groups += 1
                spans[body, 1] = groups
            at = end
        _write(self.samples.weight, weight)
        _write(self.samples.normal, normal)
        _write(self.samples.thin, thin)
        _write(self.samples.body, owner)
        _write(bodies.group, group)
        _write(bodies.first, spans)
        bodies.groups[None] = groups
        self.numbers.samples[None], self.numbers.moving[None] = self.count, self.moving


def _write(field: Any, values: Any) -> None:
    field.from_numpy(values[: field.shape[0]] if len(values) > field.shape[0] else values)
