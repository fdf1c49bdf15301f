"""Misfit between simulator and log: whitened, and in physical units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.frames import exponential, multiply, rotation_vector
from seals.sysid.data.samples import IMU, Samples
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.predictors.linearise import dynamics_along
from seals.sysid.predictors.problem import Problem, stated_starts, transient_rows
from seals.sysid.predictors.surface_model_error import surface_model_error
from seals.sysid.predictors.windows import WHOLE, Windows, by_channel, window_rows
from seals.sysid.validation.model import Model
from seals.sysid.validation.replay import Track, between_rows, replay

HORIZONS = (0.1, 0.25, 0.5, 1.0)
"""Times from the start of a window at which plain errors are taken [s]."""
_SHARE = 0.8
"""An error at a horizon is that of the rows from this share of it on."""
_PROMPT = 1e-3
"""Delay of the inertial sensors up to which windows need not follow it [s]."""
_KNOT = 0.05
"""Spacing of the knots of the gusts where a hull pierces the surface [s]."""


@dataclass(frozen=True, kw_only=True)
class Yardstick:
    """Common windows of one log for a comparison of models.

    Args:
        problem: the log made ready.
        rows: of the windows, shape (W, K).
        skip: rows left out at the start of every run.
        samples: the log without the readings that a late sensor lacks at the start of a window.
        length: of a window [s].
    """

    problem: Problem
    rows: NDArray[np.int64]
    skip: int
    samples: Samples
    length: float

    def windows(self, model: Model) -> Windows:
        """Return the windows linearised about one model."""
        fitter, vehicle = self.problem.fitter, self.problem.vehicle
        plant, timing = model.tangent(self.samples, parts=self.problem.plant.parts)
        trajectory = fitter.trajectory
        dynamics = dynamics_along(plant, trajectory, timing)
        surface_error = surface_model_error(plant, trajectory)
        knot = None if surface_error is None else max(_KNOT, 1.5 * self.samples.step)
        return Windows(
            self.samples,
            vehicle,
            trajectory,
            dynamics,
            length=self.length,
            gusts=fitter.windows.gusts,
            surface_error=surface_error,
            knot=knot,
            stated=None if self.samples.posed else stated_starts(plant, trajectory),
            skip=self.skip,
            delay=_followed(model),
        )


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """Misfit of one model to a log.

    Args:
        model: that was replayed.
        windows: about it.
        residual: whitened, without freedom, shape (W, m).
        each: whitened misfit of every window once start states and gusts are free, shape (W,).
        plain: root mean square error by channel and horizon, in the channel's unit.
        channels: whitened mean square by channel that start states and gusts leave.
        track: of the simulator.
    """

    model: Model
    windows: Windows
    residual: Floats
    each: Floats
    plain: Mapping[str, Mapping[float, float]]
    channels: Mapping[str, float]
    track: Track

    @property
    def level(self) -> float:
        """Misfit per degree of freedom; noise and gusts alone give 1."""
        return float(self.each.sum()) / float(self.windows.observed)


@dataclass(frozen=True, kw_only=True)
class Fall:
    """Difference of misfit between two models on the same log.

    Args:
        value: fall of the misfit per degree of freedom.
        noise: 1-sigma of it: what chance alone moves the difference of two such models by.
    """

    value: float
    noise: float

    @property
    def certain(self) -> bool:
        """Return true if the misfit fell significantly (one-sided, 95 %)."""
        return self.value > _ONE_SIDED * self.noise

    @property
    def worse(self) -> bool:
        """Return true if the misfit rose significantly (one-sided, 95 %)."""
        return -self.value > _ONE_SIDED * self.noise


_ONE_SIDED = 1.645


def yardstick(problem: Problem, models: Sequence[Model]) -> Yardstick:
    """Choose common windows for all of the models."""
    samples, length = problem.samples, WHOLE
    if samples.posed:
        old = problem.fitter.windows
        length = old.length * samples.step
    plants = [m.tangent(samples, parts=problem.plant.parts)[0] for m in models]
    skip = max(transient_rows(plant) for plant in plants)
    rows = window_rows(samples, length, skip)
    late = max(_followed(m) for m in models)
    count = int(np.ceil(late / samples.step - 1e-9))
    channels = dict(samples.channels)
    for name in IMU:
        if count and name in channels:
            channels[name] = channels[name].copy()
            channels[name][rows[:, :count]] = np.nan
    masked = replace(samples, channels=channels)
    return Yardstick(problem=problem, rows=rows, skip=skip, samples=masked, length=length)


def _followed(model: Model) -> float:
    """Sensor delay by which the windows are shifted; the readings account for small ones."""
    late = model.sensor_delay
    return late if late > _PROMPT else 0.0


def measure(model: Model, ruler: Yardstick, *, tell: Callable[[int], None] | None = None) -> Misfit:
    """Replay a log in the simulator and measure the misfit."""
    windows, trajectory = ruler.windows(model), ruler.problem.fitter.trajectory
    followed = windows.delay > 0.0
    track = replay(model, ruler.samples, trajectory, ruler.rows, prompt=followed, tell=tell)
    prediction = track.prediction(windows.dynamics, ruler.samples.rows)
    residual = windows.residual(prediction)
    whitened = windows.whiten(residual[:, :, None])
    return Misfit(
        model=model,
        windows=windows,
        residual=residual,
        each=whitened.product(whitened)[:, 0, 0],
        plain=plain_errors(track, ruler, delay=windows.delay),
        channels=by_channel(windows, windows.leftover(residual)),
        track=track,
    )


def fall(before: Misfit, after: Misfit) -> Fall:
    """Compare two models on the same windows.

    Equation:
        With r the residual of the better model and D the difference of the two predictions, both
        whitened, the fall is |D|^2 - 2 r D, whose standard deviation is 2 |D| for white r of unit
        size; windows in which r is larger count with their own size.
    """
    windows = after.windows
    change = windows.whiten((before.residual - after.residual)[:, :, None])
    apart = np.maximum(change.product(change)[:, 0, 0], 0.0)
    per_window = max(1.0, windows.observed / windows.count)
    size = np.maximum(1.0, np.minimum(before.each, after.each) / per_window)
    return Fall(
        value=float((before.each - after.each).sum()) / windows.observed,
        noise=float(2.0 * np.sqrt((size * apart).sum())) / windows.observed,
    )


def plain_errors(
    track: Track, ruler: Yardstick, *, delay: float = 0.0, blank: bool = False
) -> dict[str, dict[float, float]]:
    """Root mean square errors by channel and horizon, in physical units.

    Args:
        track: of the simulator.
        ruler: windows of the log.
        delay: by which the track's inertial readings are yet to be shifted [s].
        blank: whether the track holds errors already, to be taken where the log has samples.
    """
    samples, rows = ruler.problem.samples, ruler.rows
    errors = _errors(track, ruler, delay=delay, blank=blank)
    time = np.arange(rows.shape[1]) * samples.step
    out: dict[str, dict[float, float]] = {}
    for name, error in errors.items():
        out[name] = {}
        for horizon in HORIZONS:
            # a window of whole rows ends a little before its horizon
            near = (time > _SHARE * horizon - 1e-9) & (time <= horizon + 1e-9)
            seen = error[:, near][np.isfinite(error[:, near])]
            if seen.size:
                out[name][horizon] = float(np.sqrt(np.mean(seen**2)))
    return out


def _errors(track: Track, ruler: Yardstick, *, delay: float, blank: bool) -> dict[str, Floats]:
    """Measured less simulated by channel, shape (W, K, k); attitude as a small rotation [rad]."""
    problem, rows, e = ruler.problem, ruler.rows, track.error
    trajectory, late = problem.fitter.trajectory, delay / problem.samples.step
    level = problem.vehicle.environment.water_level or 0.0
    joints = trajectory.joints.shape[1]
    base = np.zeros(1) if blank else np.ones(1)
    position = base * trajectory.position[rows] + e[..., :3]
    made = {
        "position": position,
        "velocity": base * trajectory.velocity[rows] + e[..., 6:9],
        "depth": base * level - position[..., 2:3],
        "joint_position": base * trajectory.joints[rows] + e[..., 12 : 12 + joints],
        "angular_velocity": _shifted(track.reading[..., :3], late),
        "specific_force": _shifted(track.reading[..., 3:6], late),
    }
    out = {}
    for name, values in problem.samples.channels.items():
        seen = values[rows]
        if name == "orientation":
            turn = track.reading[..., 6:9]
            out[name] = _turned(seen, trajectory, rows, e[..., 3:6], turn, blank=blank)
        elif made[name].shape[2]:
            out[name] = np.where(np.isfinite(seen), base * np.nan_to_num(seen) - made[name], np.nan)
    return out


def _turned(
    seen: Floats,
    trajectory: Trajectory,
    rows: NDArray[np.int64],
    error: Floats,
    turn: Floats,
    *,
    blank: bool,
) -> Floats:
    """Small rotation from the simulated to the measured attitude [rad], shape (W, K, 3).

    The simulated one is turned like the pose where an effect turns that: (W, K, 3), else (W, K, 0).
    """
    gap = np.isfinite(seen[..., :1])
    if blank:
        return np.where(gap, error, np.nan)
    made = multiply(trajectory.quaternion[rows.ravel()], exponential(error.reshape(-1, 3)))
    if turn.size:
        made = multiply(made, exponential(turn.reshape(-1, 3)))
    level = np.where(gap, seen, np.array([0.0, 0.0, 0.0, 1.0])).reshape(-1, 4)
    angle = rotation_vector(multiply(made * np.array([-1.0, -1.0, -1.0, 1.0]), level))
    return np.where(gap, angle.reshape(error.shape), np.nan)


def _shifted(values: Floats, late: float) -> Floats:
    """Delay readings by ``late`` rows within their windows; earlier ones are unknown."""
    if not late:
        return values
    at = np.arange(values.shape[1]) - late
    return np.where((at >= 0.0)[None, :, None], between_rows(values, at), np.nan)
