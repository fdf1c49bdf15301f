"""Controllers over a batch: state, commands and control allocation."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace, some, unasked
from seals.control.allocation import LIFT_ROWS, Allocation, Saturation
from seals.control.bounded import Search, begun, changed, solved_rows, tried, weighted
from seals.control.plant import ROTOR, Plant
from seals.tensor_compiler import compile_law

ROUNDS = 24
"""Most changes of the active set, a drive; four or five in all are usual."""
AHEAD = 5
"""Changes a drive where numbers are not asked for, all of them always made: nobody waits to see
whether more are needed. Of 100,000 wrenches, most of them far beyond the drives, all (four drives)
and 99.95 % (six) are settled by then; commands of the rest are within their bounds, and not the
best ones."""


class View(NamedTuple):
    """State of every robot of a batch for controllers; see `seals.control.RobotState`.

    Args:
        step: time until the next call [s].
        rotation: R_WB, shape (B, 3, 3).
        velocity: of the body origin, world axes [m/s], shape (B, 3).
        angular_velocity: body axes [rad/s], shape (B, 3).
        submersion: submerged share of all hulls' volume [1], shape (B, 1).
        buoyancy: force against gravity [N], shape (B, 1).
        buoyancy_centre: body axes about the body origin [m], shape (B, 3).
        gain: thrust of every drive against that of its own map [1], shape (B, n).
        limit: largest commands [rad/s or N], shape (B, n).
        low: lowest commands, shape (B, n).
    """

    step: float
    rotation: Array
    velocity: Array
    angular_velocity: Array
    submersion: Array
    buoyancy: Array
    buoyancy_centre: Array
    gain: Array
    limit: Array
    low: Array


@runtime_checkable
class BatchController(Protocol):
    """Velocity controller over a batch of robots whose joints are held."""

    def start(self, batch: int) -> Any:
        """Return the initial controller state, arrays of B rows each."""
        ...

    def command(self, view: View, velocity: Array, yaw: Array, memory: Any) -> tuple[Array, Any]:
        """Return the commands of all drives, shape (B, n), and the new controller state.

        Args:
            view: of the batch.
            velocity: wanted, world axes [m/s], shape (B, 3).
            yaw: wanted heading [rad], shape (B, 1).
            memory: of the last call.
        """
        ...


class BatchAllocation:
    """`seals.control.Allocation` over a batch, about one centre.

    Args:
        plant: the robot; its drives push along one axis.
        centre: of gravity, body axes [m], shape (3,).
        like: array whose library, type and device to use.
        saturation: what gives way.
        weights: of the rows where not all can be had, shape (rows,).
    """

    def __init__(
        self, plant: Plant, centre: Array, like: Array, *, saturation: Saturation, weights: Array
    ) -> None:
        layout = plant.layout
        one = Allocation(layout, rows=LIFT_ROWS, saturation=saturation, weights=weights)
        matrix = one.matrix(centre)
        size = np.sqrt((matrix * matrix).sum(axis=1))
        self._saturation = saturation
        like = namespace(like).astype(like, namespace(like).float64)
        self._a = as_like(matrix, like)
        self._level = as_like(1.0 / size, like)
        square = matrix.shape[0] == matrix.shape[1]
        self._inverse = as_like(np.linalg.inv(matrix), like) if square else None
        self._weights = as_like(np.asarray(weights, dtype=float), like)
        self._squared = as_like([[float(kind == ROTOR) for kind in layout.kind]], like)
        self._reverse = as_like(layout.reverse[None], like)

    def commands(self, wrench: Array, view: View) -> Array:
        """Return the commands of all drives, shape (B, n), for wrenches of shape (B, rows)."""
        xp, kind = namespace(wrench), wrench.dtype
        if kind != xp.float64:
            # the search among bounds is decided by the last places of its numbers
            exact = {k: xp.astype(getattr(view, k), xp.float64) for k in ("gain", "limit", "low")}
            found: Array = self.commands(xp.astype(wrench, xp.float64), view._replace(**exact))
            return xp.astype(found, kind)
        u = self._least_norm(wrench, view.gain)
        high, least = self.squares(view.limit), self.squares(view.low)
        if self._saturation is Saturation.paper:
            u = xp.maximum(u, least)
            excess = xp.max(u / high, axis=1, keepdims=True)
            u = u / xp.maximum(excess, excess * 0.0 + 1.0)
        else:
            beyond = xp.any((u > high) | (u < least), axis=1)
            if type(u) is np.ndarray:
                (rows,) = beyond.nonzero()
                if len(rows):
                    each = np.broadcast_arrays(u, view.gain, least, high)[1:]
                    u[rows] = self._within(wrench[rows], *(x[rows] for x in each))
            elif some(beyond):
                inside = self._within(wrench, view.gain, least, high)
                u = xp.where(beyond[:, None], inside, u)
        u = xp.where(u < 0.0, u / self._reverse, u)
        size = xp.sqrt(xp.abs(u))
        root = xp.where(u < 0.0, -size, size)
        return self._squared * root + (1.0 - self._squared) * u

    def squares(self, command: Array) -> Array:
        """Return signed squared speeds, or forces, scaled where a drive runs backwards."""
        xp = namespace(command)
        u = command * (self._squared * xp.abs(command) + (1.0 - self._squared))
        return xp.where(u < 0.0, u * self._reverse, u)

    def _least_norm(self, wrench: Array, gain: Array) -> Array:
        """Smallest squared commands that produce the wrench."""
        if self._inverse is not None:
            return (wrench @ self._inverse.T) / gain
        xp = namespace(wrench)
        b = self._a[None] * gain[:, None, :] * self._level[None, :, None]
        across = xp.matmul(b, xp.permute_dims(b, (0, 2, 1)))
        y = solved_rows(across, wrench * self._level)
        return xp.matmul(xp.permute_dims(b, (0, 2, 1)), y[:, :, None])[:, :, 0]

    def _within(self, wrench: Array, gain: Array, low: Array, high: Array) -> Array:
        """Weighted least squares within the bounds, see `seals.control.allocation.best_within`."""
        a = self._a[None] * gain[:, None, :]
        h, g, span = weighted(a, wrench, low, high, self._weights)
        return low + _box(h, g) * span


def _box(h: Array, g: Array) -> Array:
    """Return a minimum of x H x / 2 - g x over 0 <= x <= 1 for every row.

    The active set changes as in `seals.control.allocation.best_within`, row by row. On a processor
    rows that have found theirs leave the search.
    """
    xp = namespace(h)
    now, count = begun(h, g), g.shape[1]
    if type(g) is np.ndarray:
        x = _row_by_row(now)
    else:
        ahead = unasked(g)
        for _ in range((AHEAD if ahead else ROUNDS) * count):
            x, wrong, then = _round(now)
            if not ahead and not bool(xp.any(wrong)):
                break
            now = then
    return xp.minimum(xp.maximum(x, x * 0.0), x * 0.0 + 1.0)


def _row_by_row(now: Search) -> Floats:
    """Solve every row on NumPy; rows that have converged are left out."""
    found: Floats = np.empty_like(now.g)
    rows = np.arange(len(found))
    for _ in range(ROUNDS * now.g.shape[1]):
        x, wrong = tried(now)
        found[rows] = x
        (left,) = wrong.any(axis=1).nonzero()
        if not len(left):
            break
        rows, x, wrong = rows[left], x[left], wrong[left]
        now = changed(Search(*(part[left] for part in now)), x, wrong)
    return found


@partial(compile_law, nested=True)
def _round(now: Search) -> tuple[Array, Array, Search]:
    """One round of the active-set search, on PyTorch: optimum, violated bounds, next state."""
    x, wrong = tried(now)
    return x, wrong, changed(now, x, wrong)
