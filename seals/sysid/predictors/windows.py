"""Short windows of a log: residuals of the model, marginalised over start states and gusts."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError
from seals.frames import multiply, rotation_vector
from seals.least_squares import factors_scaled
from seals.sysid.data.samples import Samples
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.predictors.linearise import (
    Columns,
    Dynamics,
    Prediction,
    ReleasableDynamics,
    dynamics_of,
)
from seals.sysid.predictors.surface_model_error import SurfaceModelError
from seals.sysid.predictors.whitened import Marginal, Weights, Whitened

WHOLE = 1e6
"""Length of the windows that take whole runs, from their stated starts [s]."""
_KNOT = 0.35
"""Spacing of the knots of the gusts in correlation times."""
BLOCK = 32
"""Parameters whose responses are carried through the windows together: a bound on memory."""
_ROOM = 8 << 20
"""Memory of the states that are kept on the way through the windows [byte]."""
_QUANTISED = 1.0 + 1.0 / 48.0
"""Variance of noise and rounding to half a sigma, in units of the noise alone."""


class Windows:
    """Windows of a log, linearised along one trajectory.

    Args:
        samples: the log.
        vehicle: noise levels.
        trajectory: about which the model is linear.
        dynamics: derivatives along the trajectory.
        length: of a window [s].
        gusts: factor on the vehicle's stated level of unmodelled force and torque.
        surface_error: of the model at the surface of water; None for none.
        stated: start states of the runs against the trajectory and their 1-sigma, (runs, n) and
            (n,), when every run is one window; None leaves the start states free.
        skip: rows left out at the start of every run.
        bias: 1-sigma of free biases of gyroscope [rad/s] and accelerometer [m/s^2] in every window;
            None for none.
        ignore: channels that do not count.
        delay: of the inertial sensors, applied to everything they read [s].
        knot: spacing of the knots of the gusts [s]; left out, a third of their correlation time.
    """

    loosened = False
    """Whether gusts have columns though none are stated."""

    def __init__(
        self,
        samples: Samples,
        vehicle: Vehicle,
        trajectory: Trajectory,
        dynamics: Dynamics | ReleasableDynamics,
        *,
        length: float,
        gusts: float,
        surface_error: SurfaceModelError | None = None,
        stated: tuple[Floats, Floats] | None = None,
        skip: int = 0,
        bias: tuple[float, float] | None = None,
        ignore: tuple[str, ...] = (),
        delay: float = 0.0,
        knot: float | None = None,
    ) -> None:
        self.samples, self.vehicle, self.trajectory = samples, vehicle, trajectory
        self._bias, self._knot, self.delay = bias, knot, delay
        self._ignored = ignore
        self._stated = stated
        self.along, self.size = dynamics, trajectory.size
        self.rows = window_rows(samples, length, skip)
        self.count, self.length = self.rows.shape
        self._reference(None if surface_error is None else surface_error.blur)
        self.gusts, self._extra = gusts, None if surface_error is None else surface_error.push
        self._gusts(gusts * vehicle.gust, self._extra)

    def missed(self, prediction: Prediction) -> Whitened:
        """Return the whitened misfit of a prediction, one column."""
        return self.whiten(self.residual(prediction)[:, :, None])

    def cells(self, outputs: Floats) -> Floats:
        """Return the part of whitened outputs that are readings, shape (W, K, channels)."""
        shape = self.count, self.length, len(self.channel_of)
        return outputs[:, : shape[1] * shape[2]].reshape(shape)

    def level(self, prediction: Prediction) -> float:
        """Return the misfit of a prediction per degree of freedom; noise and gusts alone give 1."""
        missed = self.missed(prediction)
        return float(missed.product(missed).sum()) / float(self.observed)

    @property
    def dynamics(self) -> Dynamics:
        """Derivatives along the trajectory."""
        return dynamics_of(self.along)

    def release(self) -> None:
        """Release the memory of all but rows, readings and weights."""
        for name in ("_march", "_marginal", "_weights"):
            self.__dict__.pop(name, None)

    def with_disturbance(self, gusts: float) -> Windows:
        """Return the same windows with another level of the gusts."""
        shared = self._marginal
        other = copy.copy(self)
        other.__dict__.pop("_weights", None)
        other.gusts, other._marginal = gusts, shared
        other._gusts(gusts * self.vehicle.gust, self._extra)
        return other

    def with_readings(self, samples: Samples) -> Windows:
        """Return the same windows with other readings of the same channels and equal weights."""
        other = copy.copy(self)
        other.samples = samples
        other._reference(None)
        other.weight, other.freedom, other.observed = self.weight, self.freedom, self.observed
        return other

    def shares_outputs(self, other: Windows) -> bool:
        """Return true if whitened outputs of other windows may be used in these."""
        mine, theirs = (w.__dict__.get("_marginal") for w in (self, other))
        return self is other or (mine is not None and mine is theirs)

    def _reference(self, blur: Floats | None) -> None:
        """Measured less trajectory values, weights, and the state component of each reading."""
        trajectory, sigma = self.trajectory, self.vehicle.sigma
        seen = self.samples.channels
        values: list[Floats] = []
        weight: list[Floats] = []
        self.channel_of: list[str] = []
        self._reads: list[int | None] = []
        joints = trajectory.joints.shape[1]
        level = self.vehicle.environment.water_level or 0.0
        back = trajectory.quaternion * np.array([-1.0, -1.0, -1.0, 1.0])
        table: dict[str, tuple[int | None, Floats]] = {}
        if "position" in seen:
            table["position"] = (0, seen["position"] - trajectory.position)
        if "orientation" in seen:
            measured = np.where(np.isfinite(seen["orientation"]), seen["orientation"], back * -1.0)
            gap = np.isfinite(seen["orientation"][:, :1])
            turn = rotation_vector(multiply(back, measured))
            table["orientation"] = (3, np.where(gap, turn, np.nan))
        if "velocity" in seen:
            table["velocity"] = (6, seen["velocity"] - trajectory.velocity)
        if "depth" in seen:
            table["depth"] = (2, level - seen["depth"][:, :1] - trajectory.position[:, 2:3])
        if "joint_position" in seen and joints:
            table["joint_position"] = (12, seen["joint_position"] - trajectory.joints)
        for name in ("angular_velocity", "specific_force"):
            if name in seen:
                table[name] = (None, seen[name])
        for name, (first, residual) in table.items():
            spread = self.samples.noise(name, sigma[name]) * np.sqrt(_QUANTISED)
            if name == "specific_force" and blur is not None:
                spread = np.hypot(spread, blur)
            for k in range(residual.shape[1]):
                column = residual[:, k]
                good = np.isfinite(column)
                values.append(np.where(good, column, 0.0))
                used = good & (name not in self._ignored)
                weight.append(np.where(used, 1.0 / spread, 0.0))
                self.channel_of.append(name)
                self._reads.append(None if first is None else first + k)
        self._values = np.stack(values, axis=1)[self.rows]
        self.weight = np.stack(weight, axis=1)[self.rows]
        self._inertial = [
            i
            for i, n in enumerate(self.channel_of)
            if n in table and n in ("angular_velocity", "specific_force")
        ]
        self._leave_out(self.late)

    @property
    def late(self) -> int:
        """Rows at the start of a window whose inertial readings were taken before it."""
        return int(np.ceil(self.delay / self.samples.step)) if self.delay > 0.0 else 0

    def _leave_out(self, late: int) -> None:
        """Leave out the first inertial readings of every window, and count the others."""
        self.weight[:, :late, self._inertial] = 0.0
        free = 0 if self._stated is not None else self.size
        self.freedom = np.count_nonzero(self.weight, axis=(1, 2)) - free
        self.observed = int(self.freedom.sum())

    def without_first(self, late: int) -> Windows:
        """Return the same windows without the inertial readings of their first rows."""
        other = copy.copy(self)
        for name in ("_marginal", "_weights"):
            other.__dict__.pop(name, None)
        other.weight = self.weight.copy()
        other._leave_out(late)
        return other

    def _gusts(self, gust: Floats, extra: Floats | None) -> None:
        """Hat functions of the gusts, and the inverse of the gusts' covariance."""
        spacing = self._knot or _KNOT * self.vehicle.gust_time
        span = (self.length - 1) * self.samples.step
        knots = max(2, round(span / spacing) + 1)
        if extra is None and not self.loosened and not np.any(gust):
            # what cannot push needs no columns
            knots = 0
        at = np.linspace(0.0, span, knots)
        time = np.arange(self.length) * self.samples.step
        self.hats = np.zeros((self.length, knots))
        for j, one in enumerate(np.eye(knots)):
            self.hats[:, j] = np.interp(time, at, one)
        decay = np.exp(-np.abs(at[:, None] - at[None, :]) / self.vehicle.gust_time)
        levels = np.repeat(np.maximum(gust, 1e-9), 3)
        # columns run knot by knot within each axis
        self._knots, self._spread = knots, 0.0
        prior = np.zeros((self.count, 6 * knots, 6 * knots))
        nearest = np.clip(np.round(at / self.samples.step).astype(int), 0, self.length - 1)
        for axis in range(6):
            block = slice(axis * knots, (axis + 1) * knots)
            covariance = np.tile(
                levels[axis] ** 2 * (decay + 1e-9 * np.eye(knots)), (self.count, 1, 1)
            )
            if extra is not None:
                covariance += np.eye(knots) * extra[self.rows[:, nearest], axis][:, None, :] ** 2
            prior[:, block, block] = np.linalg.inv(covariance)
            self._spread += float(np.linalg.slogdet(covariance)[1].sum())
        self._gust_precision = prior

    @cached_property
    def _march(self) -> tuple[Floats, Floats]:
        """Transition and output matrices along the windows, in the order of use.

        Shapes (K, W, n, n) and (K, W, 3, n).
        """
        order = self.rows.T
        pair = self.dynamics.transition, self.dynamics.output_matrix
        return np.ascontiguousarray(pair[0][order]), np.ascontiguousarray(pair[1][order])

    @cached_property
    def _marginal(self) -> Marginal:
        """Outputs of start states and gusts, and their products."""
        n, m, knots = self.size, 6 * self._knots, self._knots
        free = 0 if self._bias is None else 6
        start = np.zeros((self.count, n, n + m + free))
        start[:, :, :n] = np.eye(n)
        order = self.rows.T
        mean = 0.5 * (self.hats[1:] + self.hats[:-1])

        def push(k: int, states: Floats) -> None:
            matrix = self.dynamics.input_matrix[order[k]]
            for knot in np.flatnonzero(mean[k]):
                states[:, :, n + knot : n + m : knots] += matrix * mean[k, knot]

        def direct(part: slice) -> Floats:
            hats = self.hats[part]
            seen = np.zeros((len(hats), self.count, 6, n + m + free))
            table = self.dynamics.feedthrough[order[part]]
            out = table[:, :, :, :, None] * hats[:, None, None, None, :]
            seen[:, :, 3:, n : n + m] = out.reshape(
                *table.shape[:3], table.shape[3] * hats.shape[1]
            )
            seen[:, :, :, n + m :] = np.eye(6)[:, :free]
            return seen

        loose = self._run(start, push, direct)
        return Marginal(loose, np.matmul(loose.transpose(0, 2, 1), loose))

    @cached_property
    def _weights(self) -> Weights:
        """The factor of the normal matrix of start states and gusts."""
        n, m = self.size, 6 * self._knots
        normal = self._marginal.products.copy()
        normal[:, n : n + m, n : n + m] += self._gust_precision
        if self._bias is not None:
            last = range(n + m, n + m + 6)
            normal[:, last, last] += 1.0 / np.repeat(self._bias, 3) ** 2
        scale, factor = factors_scaled(normal)
        return Weights(scale, factor, np.asarray(np.linalg.inv(factor), dtype=np.float64))

    def _run(
        self,
        start: Floats,
        push: Callable[[int, Floats], None],
        direct: Callable[[slice], Floats],
    ) -> Floats:
        """Propagate state columns through the windows and return their whitened outputs.

        Some rows at a time: the states of all rows take more memory than everything else.

        Args:
            start: states at the first rows, shape (W, n, c).
            push: adds what step k pushes to the states (W, n, c) after it, in place.
            direct: what the inertial sensors read beside the states at some rows, (k, W, 6, c).

        Returns:
            Outputs of all rows and channels, shape (W, K * ny, c).
        """
        channels, steps = len(self.channel_of), self._march[0]
        out = np.empty((self.count, self.length, channels, start.shape[2]))
        block = min(max(2, _ROOM // start.nbytes), self.length)
        states = np.empty((block, *start.shape))
        states[0] = start
        for first in range(0, self.length, block):
            last = min(first + block, self.length)
            for k in range(max(first, 1), last):
                np.matmul(steps[k - 1], states[(k - 1) % block], out=states[k % block])
                push(k - 1, states[k % block])
            part = slice(first, last)
            self._read_out(states[: last - first], part, direct(part), out[:, part])
        if self.delay:
            late = delaying(self.length, self.delay / self.samples.step)
            shape = out[:, :, self._inertial].shape
            inertial = out[:, :, self._inertial].reshape(shape[0], self.length, -1)
            out[:, :, self._inertial] = np.matmul(late, inertial).reshape(shape)
        out *= self.weight[:, :, :, None]
        flat = out.reshape(self.count, self.length * channels, -1)
        if self._stated is None:
            return flat
        return np.concatenate([flat, start / self._stated[1][:, None]], axis=1)

    def _read_out(self, states: Floats, part: slice, direct: Floats, out: Floats) -> None:
        """Fill in what all channels read at some rows of the windows.

        Args:
            states: at these rows, shape (k, W, n, c).
            part: the rows.
            direct: what sensors read beside the states, and the pose's turn, (k, W, 6 or 9, c).
            out: to fill in, shape (W, k, ny, c).
        """
        for i, r in enumerate(self._reads):
            if r is not None:
                out[:, :, i] = states[:, :, r].transpose(1, 0, 2)
        if direct.shape[2] > 6 and "orientation" in self.channel_of:
            first = self.channel_of.index("orientation")
            out[:, :, first : first + 3] += direct[:, :, 6:9].transpose(1, 0, 2, 3)
        force = np.matmul(self._march[1][part], states)
        spin = states[:, :, 9:12]
        if not np.array_equal(self.vehicle.imu_turn, np.eye(3)):
            spin = np.matmul(self.vehicle.imu_turn, spin)
        for i in self._inertial:
            axis = i - self.channel_of.index(self.channel_of[i])
            seen = (
                spin[:, :, axis] if self.channel_of[i] == "angular_velocity" else force[:, :, axis]
            )
            axis += 0 if self.channel_of[i] == "angular_velocity" else 3
            out[:, :, i] = (seen + direct[:, :, axis]).transpose(1, 0, 2)

    def residual(self, prediction: Prediction) -> Floats:
        """Whitened residual with start states and gusts at zero, shape (W, K * ny)."""
        order = self.rows.T
        defect = prediction.defect[order][:, :, :, None]
        reading = prediction.reading[order][:, :, :, None]
        start = np.zeros((self.count, self.size, 1))
        model = self._run(start, _adding(defect), reading.__getitem__)[:, :, 0]
        measured = (self._values * self.weight).reshape(self.count, -1)
        if self._stated is not None:
            measured = np.concatenate([measured, self._stated[0] / self._stated[1]], axis=1)
        misfit: Floats = measured - model
        return misfit

    def responses(self, columns: Columns) -> Floats:
        """Derivatives of the whitened outputs by parameters, shape (W, K * ny, p)."""
        order, many = self.rows.T, len(columns.keys)
        rows = self.length * len(self.channel_of) + (0 if self._stated is None else self.size)
        out = np.empty((self.count, rows, many))
        for first in range(0, many, BLOCK):
            chosen = slice(first, first + BLOCK)
            push, reading = columns.push[:, :, chosen][order], columns.reading[:, :, chosen][order]
            start = np.zeros((self.count, *push.shape[2:]))
            out[:, :, chosen] = self._run(start, _adding(push), reading.__getitem__)
        return out

    @property
    def volume(self) -> float:
        """Log of the ratio of prior to posterior volume of gusts and start states.

        Up to a constant of the start states; twice the log evidence is less by this number.
        """
        diagonal = np.diagonal(self._weights.factor, axis1=1, axis2=2)
        return float(2.0 * np.log(diagonal / self._weights.scale).sum()) + self._spread

    def whiten(self, outputs: Floats) -> Whitened:
        """Return outputs with their projection on start states and gusts."""
        return self._absorbed(
            outputs, np.matmul(self._marginal.outputs.transpose(0, 2, 1), outputs)
        )

    def rewhitened(self, seen: Whitened) -> Whitened:
        """Project outputs, whitened by equal windows, on these windows' start states and gusts."""
        return self._absorbed(seen.outputs, seen.cross)

    def _absorbed(self, outputs: Floats, cross: Floats) -> Whitened:
        scaled = cross * self._weights.scale[:, :, None]
        absorbed = np.matmul(self._weights.inverse, scaled)
        return Whitened(outputs=outputs, absorbed=absorbed, cross=cross)

    def explained(self, residual: Floats) -> tuple[Floats, Floats]:
        """Return the start states and gusts that fit a residual best.

        Args:
            residual: shape (W, K * ny).

        Returns:
            Start state errors (W, n) and the wrench at every row of the windows (W, K, 6).
        """
        found = self._coefficients(residual)
        knots = found[:, self.size : self.size + 6 * self._knots].reshape(
            self.count, 6, self._knots
        )
        wrench = np.einsum("kj,waj->wka", self.hats, knots)
        return found[:, : self.size], wrench

    def states(self, residual: Floats, prediction: Prediction) -> Floats:
        """Return the fitted state errors at every row of the log, shape (T, n).

        Rows outside the windows get zeros.
        """
        start, wrench = self.explained(residual)
        defect = prediction.defect[self.rows]
        transition, input_matrix = (
            self.dynamics.transition[self.rows],
            self.dynamics.input_matrix[self.rows],
        )
        error = np.zeros((self.samples.rows, self.size))
        state = start
        for k in range(self.length):
            error[self.rows[:, k]] = state
            if k + 1 < self.length:
                mean = 0.5 * (wrench[:, k] + wrench[:, k + 1])
                pushed = np.einsum("wij,wj->wi", input_matrix[:, k], mean)
                state = np.einsum("wij,wj->wi", transition[:, k], state) + pushed + defect[:, k]
        return error

    def leftover(self, residual: Floats) -> Floats:
        """Return the residual after the fit of start states and gusts, shape (W, K * ny)."""
        found = self._coefficients(residual)
        rest: Floats = residual - np.matmul(self._marginal.outputs, found[:, :, None])[:, :, 0]
        return rest

    def _coefficients(self, residual: Floats) -> Floats:
        absorbed = self.whiten(residual[:, :, None]).absorbed
        back = np.matmul(self._weights.inverse.transpose(0, 2, 1), absorbed)[:, :, 0]
        found: Floats = back * self._weights.scale
        return found


def _adding(pushes: Floats) -> Callable[[int, Floats], None]:
    """Add pushes one after the other, shape (K, W, n, c); the last one has no effect."""

    def push(k: int, states: Floats) -> None:
        states += pushes[k]

    return push


def by_channel(windows: Windows, misfit: Floats) -> Mapping[str, float]:
    """Return the mean squared whitened residual by channel."""
    squares = windows.cells(misfit) ** 2
    seen = windows.weight > 0.0
    out: dict[str, float] = {}
    for name in dict.fromkeys(windows.channel_of):
        chosen = [i for i, n in enumerate(windows.channel_of) if n == name]
        out[name] = float(squares[:, :, chosen].sum() / max(1, seen[:, :, chosen].sum()))
    return out


_LEAST = 2
"""Rows of the shortest run that is compared."""


def window_rows(samples: Samples, length: float, skip: int) -> NDArray[np.int64]:
    """Return the rows of all windows of a common length, shape (W, K).

    Raises:
        LogError: a run has no rows but those that are left out at its start.
    """
    spans = [(first + skip, last) for first, last in samples.runs]
    for k, (first, last) in enumerate(spans):
        if last - first < _LEAST:
            rows, left_out = last - first + skip, skip * samples.step
            raise LogError(
                f"run {k + 1} of the log has {rows} rows, {rows * samples.step:.3g} s; the start "
                f"state of its drives counts for the first {left_out:.3g} s.\n"
                "Give a longer log, or leave out the runs that are too short."
            )
    longest = max(last - first for first, last in spans)
    wanted = max(4, min(round(length / samples.step), longest))
    pieces = [max(1, round((last - first) / wanted)) for first, last in spans]
    size = min((last - first) // n for (first, last), n in zip(spans, pieces, strict=True))
    starts = [
        first + k * size
        for (first, last), n in zip(spans, pieces, strict=True)
        for k in range((last - first) // size)
    ]
    return np.asarray(starts, dtype=np.int64)[:, None] + np.arange(size)


def interpolation(rows: int, at: NDArray[np.floating[Any]]) -> tuple[NDArray[np.int64], Floats]:
    """Return four rows and their weights for each place between rows, shape (4, n) both.

    The cubic through four rows (Lagrange): a straight line half way between two rows damps an
    oscillation of f Hz by cos(pi f T), 1 % at 5 Hz and rows of 10 ms, which is more than the noise
    of a gyroscope and would be laid to other effects. Straight lines at and beyond the ends.

    Args:
        rows: of the series.
        at: places, in rows.
    """
    below = np.clip(np.floor(at).astype(np.int64), 0, rows - 2)
    s = at - below
    cubic = np.stack(
        [
            -s * (s - 1.0) * (s - 2.0) / 6.0,
            (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
            -(s + 1.0) * s * (s - 2.0) / 2.0,
            (s + 1.0) * s * (s - 1.0) / 6.0,
        ]
    )
    straight = np.stack([np.zeros_like(s), 1.0 - s, s, np.zeros_like(s)])
    inside = (at >= 1.0) & (below <= rows - 3)
    chosen = np.clip(below + np.arange(-1, 3)[:, None], 0, rows - 1)
    return chosen, np.where(inside, cubic, straight)


def delaying(rows: int, late: float) -> Floats:
    """Return the matrix that delays a series by ``late`` rows, shape (rows, rows)."""
    chosen, weights = interpolation(rows, np.arange(rows) - late)
    matrix = np.zeros((rows, rows))
    np.add.at(matrix, (np.arange(rows), chosen), weights)
    return matrix
