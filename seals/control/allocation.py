"""Control allocation: distribution of force and torque over the drives."""

from __future__ import annotations

import enum
import math
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, namespace, some
from seals.control.bounded import Search, begun, weighted
from seals.control.plant import ROTOR, Layout
from seals.multibody.linear import solution, solved

LIFT_ROWS = (2, 3, 4, 5)
"""Rows of lift, roll, pitch and yaw among force and torque."""
ROUNDS = 24
"""Most changes of the active set, a drive; four or five in all are usual."""
SOFT = 1e-9
"""Stiffness that makes the choice among equally good commands unique, share of the whole."""
RANK = 1e-6
"""Share of the largest singular value below which a direction is out of reach."""


class Saturation(enum.Enum):
    """Priority under saturation: which demand is reduced first.

    ``paper``: the pseudo-inverse; squared speeds below zero become zero, then all shrink alike
    until the largest is allowed. ``priority``: the best within all limits, roll and pitch before
    thrust, thrust before yaw.
    """

    paper = "paper"
    priority = "priority"


class Allocation:
    """Control allocation of a wrench about a moving centre of gravity.

    Args:
        layout: of the drives.
        rows: components [force x, y, z, torque x, y, z] that are wanted, numbers 0 to 5; the
            others are passive.
        saturation: what gives way.
        weights: of the rows where not all can be had, shape (rows,); larger is more important.
        centre: about which the rank of the rows is judged, body axes [m]; None for the middle of
            the drives, which serves where no passive force turns the vehicle.
    """

    def __init__(
        self,
        layout: Layout,
        *,
        rows: tuple[int, ...] = LIFT_ROWS,
        saturation: Saturation = Saturation.paper,
        weights: Floats | None = None,
        centre: Floats | None = None,
    ) -> None:
        self._layout, self._rows, self.saturation = layout, list(rows), saturation
        self._squared = [kind == ROTOR for kind in layout.kind]
        self._all_rotors = all(self._squared)
        self._reverse = layout.reverse.tolist()
        force = (layout.axis * layout.thrust_coefficient[:, None]).T
        reaction = (layout.axis * layout.reaction_coefficient[:, None]).T
        arm = np.cross(layout.position, layout.axis) * layout.thrust_coefficient[:, None]
        self._about_origin = np.concatenate((force, arm.T + reaction))[self._rows]
        # what a metre of the centre along x, y and z takes from every row
        shift = np.zeros((3, 6, layout.drives))
        for k, axis in enumerate(np.eye(3)):
            shift[k, 3:] = np.cross(axis, force.T).T
        self._shift = np.ascontiguousarray(shift[:, self._rows].reshape(3, -1))
        self._bounds = self._squared_bounds(layout.limit, layout.low)
        self._kept_gain: Floats | None = None
        self._plain = True
        # moving the centre adds rows of force to rows of torque: where all of them are wanted, the
        # rank stays
        about = layout.position.mean(axis=0) if centre is None else centre
        self._full = has_rank(self.matrix(about))
        self._weights = np.ones(len(rows)) if weights is None else np.asarray(weights, dtype=float)

    @property
    def full(self) -> bool:
        """Whether the drives command all rows independently of each other."""
        return self._full

    def matrix(self, centre: Floats, gain: Floats | None = None) -> Floats:
        """Return A: columns of force and torque for a unit of squared speed or of thruster force.

        Equation:
            For rotors along z the rows are those of the paper: k_T; (y - y_c) k_T;
            -(x - x_c) k_T; k_R d.

        Args:
            centre: of gravity, body axes [m], shape (3,).
            gain: of every drive, see `seals.control.RobotState`; None for one.
        """
        a: Floats = self._about_origin - (centre @ self._shift).reshape(self._about_origin.shape)
        if gain is not None and type(gain) is not np.ndarray:
            return a * gain
        if gain is not None and gain is not self._kept_gain:
            # in air it is the very same array at every call
            self._kept_gain, self._plain = gain, bool((gain == 1.0).all())
        return a if gain is None or self._plain else a * gain

    def commands(
        self,
        wrench: Floats,
        centre: Floats,
        *,
        gain: Floats | None = None,
        limit: Floats | None = None,
        low: Floats | None = None,
    ) -> Floats:
        """Return the commands of all drives [rad/s or N], shape (n,).

        Args:
            wrench: wanted, the chosen rows, torque about the centre [N, N m].
            centre: of gravity, body axes [m], shape (3,).
            gain: of every drive, shape (n,); None for one.
            limit: largest commands, shape (n,); None for those of the layout.
            low: lowest commands, shape (n,); None for those of the layout.
        """
        limit = self._layout.limit if limit is None else limit
        low = self._layout.low if low is None else low
        a = self.matrix(centre, gain)
        if limit is not self._bounds[0] or low is not self._bounds[1]:
            self._bounds = self._squared_bounds(limit, low)
        high, least, high_, least_ = self._bounds[2:]
        u = least_norm(a, wrench, full=self._full)
        if self.saturation is Saturation.paper:
            u = shrunk(u, least, high)
        elif any(x > b or x < a for x, a, b in zip(u.tolist(), least_, high_, strict=True)):
            # asking for more than there is would weigh against what matters more
            ends = a * least, a * high
            most = np.maximum(*ends).sum(axis=1), np.minimum(*ends).sum(axis=1)
            asked = np.minimum(np.maximum(wrench, most[1]), most[0])
            u = best_within(a, asked, least, high, self._weights)
        kinds = zip(u.tolist(), self._squared, self._reverse, strict=True)
        return np.array([_command(x, r, rotor=rotor) for x, rotor, r in kinds])

    @property
    def plain(self) -> bool:
        """Whether `unbounded` gives its commands: all rows can be had from rotors."""
        return self._full and self._all_rotors and self.saturation is Saturation.priority

    def unbounded(
        self, wrench: Array, centre: Array, *, gain: Array, limit: Array, low: Array
    ) -> tuple[Array, Array]:
        """Return commands of rotors without regard to their bounds, and whether all are within.

        On any array library; arguments as of `commands`.
        """
        xp = namespace(wrench)
        u = least_norm(self.matrix(centre, gain), wrench)
        high, least = self._squares(limit), self._squares(low)
        return self.of_squares(u), xp.all((u <= high) & (u >= least))

    def search(
        self, wrench: Array, centre: Array, *, gain: Array, limit: Array, low: Array
    ) -> tuple[Search, Array, Array]:
        """Return the search for the best commands within bounds, lowest squares and their span.

        On any array library; arguments as of `commands`. A result x of the search, from 0 to 1,
        means the squares ``low + x * span``, see `of_squares`.
        """
        high, least = self._squares(limit)[None], self._squares(low)[None]
        a = self.matrix(centre, gain)[None]
        h, g, span = weighted(a, wrench[None], least, high, self._weights)
        return begun(h, g), least[0], span[0]

    def of_squares(self, u: Array) -> Array:
        """Return the commands of rotors for squared speeds, on any array library."""
        xp = namespace(u)
        back = xp.where(u < 0.0, u / self._layout.reverse, u)
        root = xp.sqrt(xp.abs(back))
        return xp.where(back < 0.0, -root, root)

    def wrench(self, command: Floats, centre: Floats, gain: Floats | None = None) -> Floats:
        """Return the controlled components of the wrench that commands produce [N, N m]."""
        made: Floats = self.matrix(centre, gain) @ self._squares(command)
        return made

    def _squared_bounds(self, limit: Floats, low: Floats) -> tuple[Any, ...]:
        """Bounds as given, and squared, as arrays and as lists; cached, constant in air."""
        high, least = self._squares(limit), self._squares(low)
        return limit, low, high, least, high.tolist(), least.tolist()

    def _squares(self, command: Floats) -> Floats:
        """Signed squared speeds, or forces; scaled where a drive runs backwards."""
        u: Floats = command * np.abs(command)
        if not self._all_rotors:
            u = np.where(self._squared, u, command)
        if not some(command < 0.0):
            return u
        less: Floats = np.where(u < 0.0, u * self._layout.reverse, u)
        return less


def _command(u: float, reverse: float, *, rotor: bool) -> float:
    """Command of a drive for a squared speed or a force; divided by ``reverse`` backwards."""
    u = u if u >= 0.0 else u / reverse
    return math.copysign(math.sqrt(abs(u)), u) if rotor else u


def least_norm(a: Floats, wrench: Floats, *, full: bool = True) -> Floats:
    """Return the smallest solution of A u = w, or the nearest one where A lacks rank.

    Args:
        a: shape (rows, n).
        wrench: shape (rows,).
        full: whether the rows of A are known to be independent, which is faster.

    Example:
        >>> least_norm(np.array([[1.0, 1.0]]), np.array([3.0]))
        array([1.5, 1.5])
    """
    if full and type(a) is np.ndarray and a.shape[0] == a.shape[1]:
        return solved(a, wrench)
    # rows of force and of yaw differ by orders of magnitude: level them
    size = np.sqrt(np.sum(a * a, axis=1))
    level = 1.0 / np.where(size > 0.0, size, 1.0)
    b, wanted = a * level[:, None], wrench * level
    if full:
        smallest: Floats = b.T @ solution((b @ b.T)[None], wanted[None])[0]
        return smallest
    inverse: Any = np.linalg.pinv(b, rcond=RANK)
    nearest: Floats = inverse @ wanted
    return nearest


def has_rank(a: Floats) -> bool:
    """Return whether the rows of A are independent.

    Example:
        >>> has_rank(np.array([[1.0, 1.0], [2.0, 2.0]]))
        False
    """
    size = np.sqrt((a * a).sum(axis=1))
    if not a.size or float(size.min()) == 0.0 or a.shape[0] > a.shape[1]:
        return False
    values = np.linalg.svd(a / size[:, None], compute_uv=False)
    return bool(values[-1] > RANK * values[0])


def shrunk(u: Floats, low: Floats, high: Floats) -> Floats:
    """Return feasible commands: clipped at ``low``, then scaled to fit under ``high``.

    Example:
        >>> shrunk(np.array([-1.0, 2.0, 4.0]), np.zeros(3), np.full(3, 2.0))
        array([0., 1., 2.])
    """
    u = np.maximum(u, low)
    excess = float(np.max(u / high, initial=0.0))
    return u / excess if excess > 1.0 else u


def best_within(a: Floats, wrench: Floats, low: Floats, high: Floats, weights: Floats) -> Floats:
    """Return the solution of weighted least squares A u = w with low <= u <= high.

    The active set changes by blocks of all drives that break a limit or pull off one; when that
    does not settle, one drive at a time, which always does (Judice and Pires 1992).

    Args:
        a: shape (rows, n).
        wrench: wanted, shape (rows,).
        low: shape (n,).
        high: above low, shape (n,).
        weights: of the rows, shape (rows,); each row counts against the most that it can do.
    """
    # in shares of each drive's range and of each row's reach: numbers near one
    span = high - low
    scaled = a * span
    reach = np.abs(scaled).sum(axis=1)
    weight = weights / np.where(reach > 0.0, reach, 1.0)
    b = scaled * weight[:, None]
    target = (wrench - a @ low) * weight
    h = b.T @ b
    share = _box(h, b.T @ target)
    return low + share * span


def _box(h: Floats, g: Floats) -> Floats:
    """Return a minimum of x H x / 2 - g x over 0 <= x <= 1."""
    count = len(g)
    eye = np.eye(count)
    soft = h + SOFT * float(np.trace(h)) * eye
    x = solved(soft, g)
    bound = np.minimum(np.maximum(x, 0.0), 1.0)
    free = (bound == x).astype(float)
    fewest, patience = count + 1, 3
    for _ in range(ROUNDS * count):
        held = bound * (1.0 - free)
        # the rows and columns of held drives become those of the identity
        system = soft * (free[:, None] * free) + eye * (1.0 - free)
        x = solved(system, free * (g - h @ held) + held)
        # where H lacks rank the softening bends the rows: one refinement straightens them
        x = x + solved(system, free * (g - h @ x))
        slope = h @ x - g
        off = np.where(bound > 0.5, slope, -slope)
        beyond = np.abs(x - 0.5) - 0.5
        wrong = np.where(free > 0.0, beyond, off) > 1e-12
        bad = int(np.count_nonzero(wrong))
        if bad == 0:
            break
        patience = 3 if bad < fewest else patience - 1
        fewest = min(fewest, bad)
        if patience <= 0:
            wrong[: np.flatnonzero(wrong)[-1]] = False
        bound = np.where(wrong, (x > 0.5).astype(float), bound)
        free = np.where(wrong, 1.0 - free, free)
    inside: Floats = np.minimum(np.maximum(x, 0.0), 1.0)
    return inside
