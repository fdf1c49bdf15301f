"""Control allocation: distribution of force and torque over the drives."""

from __future__ import annotations

import enum
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace, some
from seals.control.bounded import Search, begun, best_within, solved_rows, weighted
from seals.control.plant import ROTOR, Layout
from seals.multibody.linear import solution

LIFT_ROWS = (2, 3, 4, 5)
"""Rows of lift, roll, pitch and yaw among force and torque."""
RANK = 1e-6
"""Share of the largest singular value below which a direction cannot be commanded."""


class Saturation(enum.Enum):
    """Priority under saturation: which demand is reduced first.

    ``paper``: the pseudo-inverse; squared speeds below zero become zero, then all shrink alike
    until the largest is allowed. ``priority``: the best within all limits, roll and pitch before
    thrust, thrust before yaw.
    """

    paper = "paper"
    priority = "priority"


class Allocation:
    """Control allocation of wrenches about a moving centre of gravity, for one robot or a batch.

    Args:
        layout: of the drives.
        rows: components [force x, y, z, torque x, y, z] that are wanted, numbers 0 to 5; the
            others are passive.
        saturation: what gives way.
        weights: of the rows where not all can be had, shape (rows,); larger is more important.
        centre: about which the rank of the rows is judged, body axes [m], shape (3,); None for the
            middle of the drives, which serves where no passive force turns the vehicle.
        like: array whose library and device to use; None for NumPy.

    Attributes:
        full: whether the drives command all rows independently of each other.

    Example:
        >>> from seals import make
        >>> with make(["robot=hexacopter", "guide=hover"]) as world:
        ...     plant = world.actors["robot"].pilot.plant
        >>> allocation = Allocation(plant.layout)
        >>> allocation.full, allocation.commands(np.array([20.0, 0.0, 0.0, 0.0])).shape
        (True, (6,))
    """

    saturation: Saturation
    full: bool

    def __init__(
        self,
        layout: Layout,
        *,
        rows: tuple[int, ...] = LIFT_ROWS,
        saturation: Saturation = Saturation.paper,
        weights: Floats | None = None,
        centre: Floats | None = None,
        like: Array | None = None,
    ) -> None:
        self.saturation, chosen = saturation, list(rows)
        force = (layout.axis * layout.thrust_coefficient[:, None]).T
        reaction = (layout.axis * layout.reaction_coefficient[:, None]).T
        arm = np.cross(layout.position, layout.axis) * layout.thrust_coefficient[:, None]
        self._about_origin = np.concatenate((force, arm.T + reaction))[chosen]
        # what a metre of the centre along x, y and z takes from every row
        shift = np.zeros((3, 6, layout.drives))
        for k, axis in enumerate(np.eye(3)):
            shift[k, 3:] = np.cross(axis, force.T).T
        self._shift = np.ascontiguousarray(shift[:, chosen].reshape(3, -1))
        # moving the centre adds rows of force to rows of torque: where all of them are wanted, the
        # rank stays
        here = self.matrix(layout.position.mean(axis=0) if centre is None else centre)
        self.full = _has_rank(here)
        # the search among bounds is decided by the last places of its numbers
        like = (
            np.zeros(1) if like is None else namespace(like).astype(like, namespace(like).float64)
        )
        weights = np.ones(len(chosen)) if weights is None else np.asarray(weights, dtype=float)
        self._here, self._weights = as_like(here[None], like), as_like(weights, like)
        square = self.full and here.shape[0] == here.shape[1]
        self._inverse = as_like(np.linalg.inv(here), like) if square else None
        self._squared = as_like([[float(kind == ROTOR) for kind in layout.kind]], like)
        self._reverse = as_like(layout.reverse[None], like)
        self._limit, self._low = as_like(layout.limit[None], like), as_like(layout.low[None], like)

    def matrix(self, centre: Array, gain: Array | None = None) -> Array:
        """Return A: columns of force and torque for a unit of squared speed or of thruster force.

        Equation:
            For rotors along z the rows are those of the paper: k_T; (y - y_c) k_T;
            -(x - x_c) k_T; k_R d.

        Args:
            centre: of gravity, body axes [m], shape (3,) or (B, 3).
            gain: of every drive, see `seals.control.RobotState`, shape (n,) or (B, n); None for
                one.
        """
        shape = (*centre.shape[:-1], *self._about_origin.shape)
        a = self._about_origin - (centre @ self._shift).reshape(shape)
        return a if gain is None else a * gain[..., None, :]

    def commands(
        self,
        wrench: Array,
        centre: Array | None = None,
        *,
        gain: Array | None = None,
        limit: Array | None = None,
        low: Array | None = None,
    ) -> Array:
        """Return the commands of all drives [rad/s or N], shape (n,), or (B, n) of a batch.

        All arguments of a batch have a first axis of B, or of one.

        Args:
            wrench: wanted, the chosen rows, torque about the centre [N, N m].
            centre: of gravity, body axes [m], shape (3,); None for that of the class.
            gain: of every drive, shape (n,); None for one.
            limit: largest commands, shape (n,); None for those of the layout.
            low: lowest commands, shape (n,); None for those of the layout.
        """
        given = wrench, centre, gain, limit, low
        if wrench.ndim == 1:
            return self._commands(*(None if x is None else x[None] for x in given))[0]
        xp = namespace(wrench)
        if wrench.dtype == xp.float64:
            return self._commands(*given)
        exact = (None if x is None else xp.astype(x, xp.float64) for x in given)
        return xp.astype(self._commands(*exact), wrench.dtype)

    def _commands(self, wrench: Array, centre: Any, gain: Any, limit: Any, low: Any) -> Array:
        xp = namespace(wrench)
        high = self._squares(self._limit if limit is None else limit)
        least = self._squares(self._low if low is None else low)
        a = self._here if centre is None else self.matrix(centre)
        a = a if gain is None else a * gain[:, None, :]
        if centre is not None or self._inverse is None:
            u = _least_norm(a, wrench, full=self.full)
        else:
            u = wrench @ self._inverse.T
            u = u if gain is None else u / gain
        if self.saturation is Saturation.paper:
            u = xp.maximum(u, least)
            excess = xp.max(u / high, axis=1, keepdims=True)
            return self.of_squares(u / xp.maximum(excess, excess * 0.0 + 1.0))
        beyond = (u > high) | (u < least)
        if type(u) is np.ndarray and some(beyond):
            (rows,) = beyond.any(axis=1).nonzero()
            each = (np.broadcast_to(x, (len(u), *x.shape[1:]))[rows] for x in (a, least, high))
            u[rows] = self._within(wrench[rows], *each)
        elif some(beyond):
            u = xp.where(xp.any(beyond, axis=1)[:, None], self._within(wrench, a, least, high), u)
        return self.of_squares(u)

    def _within(self, wrench: Array, a: Array, least: Array, high: Array) -> Array:
        """Best squares within their bounds, shape (B, n)."""
        asked = _reachable(a, wrench, least, high)
        return best_within(a, asked, least, high, self._weights)

    def unbounded(
        self, wrench: Array, centre: Array, *, gain: Array, limit: Array, low: Array
    ) -> tuple[Array, Array, Search, Array, Array]:
        """Return what machine code needs of `commands` under ``priority``, for full rows.

        Returns:
            Commands without regard to their bounds, whether all are within (B, 1), the search for
            the best within, lowest squares, and their span. A result x of the search, from 0 to 1,
            means the squares ``low + x * span``, see `of_squares`.
        """
        xp = namespace(wrench)
        a, high, least = self.matrix(centre, gain), self._squares(limit), self._squares(low)
        u = _least_norm(a, wrench)
        asked = _reachable(a, wrench, least, high)
        h, g, span = weighted(a, asked, least, high, self._weights)
        inside = xp.all((u <= high) & (u >= least), axis=1, keepdims=True)
        return self.of_squares(u), inside, begun(h, g), least, span

    def of_squares(self, u: Array) -> Array:
        """Return commands for squared speeds of rotors, or forces of thrusters, shape (B, n)."""
        xp = namespace(u)
        u = xp.where(u < 0.0, u / self._reverse, u)
        size = xp.sqrt(xp.abs(u))
        root = xp.where(u < 0.0, -size, size)
        return self._squared * root + (1.0 - self._squared) * u

    def wrench(self, command: Floats, centre: Floats, gain: Floats | None = None) -> Floats:
        """Return the controlled components of the wrench that commands produce [N, N m]."""
        made: Floats = self.matrix(centre, gain) @ self._squares(command[None])[0]
        return made

    def _squares(self, command: Array) -> Array:
        """Signed squared speeds, or forces, scaled where a drive runs backwards, (B, n)."""
        u = command * (self._squared * namespace(command).abs(command) + (1.0 - self._squared))
        return namespace(u).where(u < 0.0, u * self._reverse, u)


def _reachable(a: Array, wrench: Array, low: Array, high: Array) -> Array:
    """Wrenches within what each row can do: to ask for more would weigh against what matters."""
    xp = namespace(wrench)
    # interval arithmetic: each drive at the end that helps this row
    ends = a * low[:, None, :], a * high[:, None, :]
    most, least = xp.sum(xp.maximum(*ends), axis=2), xp.sum(xp.minimum(*ends), axis=2)
    return xp.minimum(xp.maximum(wrench, least), most)


def _least_norm(a: Array, wrench: Array, *, full: bool = True) -> Array:
    """Return the smallest solutions of A u = w, or the nearest ones where A lacks rank, (B, n).

    Args:
        a: shape (1 or B, rows, n).
        wrench: shape (B, rows).
        full: whether the rows of A are known to be independent, which is faster.

    Example:
        >>> _least_norm(np.array([[[1.0, 1.0]]]), np.array([[3.0]]))
        array([[1.5, 1.5]])
    """
    if full and type(a) is np.ndarray and a.shape[1] == a.shape[2]:
        return solution(a, wrench)
    # rows of force and of yaw differ by orders of magnitude: level them
    xp = namespace(a)
    size = xp.sqrt(xp.sum(a * a, axis=2))
    level = 1.0 / xp.where(size > 0.0, size, size * 0.0 + 1.0)
    b, wanted = a * level[:, :, None], wrench * level
    # u = B^T (B B^T)^-1 w: the smallest of all solutions where the rows are independent
    turned = xp.permute_dims(b, (0, 2, 1))
    if not full:
        turned, found = np.linalg.pinv(b, rcond=RANK), wanted
    else:
        found = solved_rows(xp.matmul(b, turned), wanted)
    return xp.matmul(turned, found[:, :, None])[:, :, 0]


def _has_rank(a: Floats) -> bool:
    """Return whether the rows of A are independent.

    Example:
        >>> _has_rank(np.array([[1.0, 1.0], [2.0, 2.0]]))
        False
    """
    size = np.sqrt((a * a).sum(axis=1))
    if not a.size or float(size.min()) == 0.0 or a.shape[0] > a.shape[1]:
        return False
    # rows of one size: force and torque have different units
    values = np.linalg.svd(a / size[:, None], compute_uv=False)
    return bool(values[-1] > RANK * values[0])
