"""Residual torque and force of a flight, after commands and damping."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.logs.log import Log
from seals.scaffold.disagreement import smooth

_ROBUST = 1.4826
_TAIL, _TAIL_SIGMAS = 0.9, 1.6449
"""Share of samples inside so many standard deviations of a normal distribution."""
_LEAST_TIME = 0.05
_SHARE = 0.1
"""Share of unexplained angular acceleration above which a log's commands are a poor sample."""
_MOST = 4.0
"""Largest inertia, over the stated one, by which commands may turn a vehicle less."""
_DELAYS = np.arange(0.0, 0.07, 0.01)
_LAGS = (0.0, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2)
"""Delays of commands and lags of rotors of which the best pair counts [s]."""


class Disturbance(NamedTuple):
    """A fluctuating disturbance torque about x and y.

    Args:
        sigma: standard deviation about x and y [N m].
        time: in which its correlation falls to 1/e [s].
        share: of the angular acceleration's variance [1].
    """

    sigma: float
    time: float
    share: float

    @property
    def clear(self) -> bool:
        """Whether it is larger than the error of a linear response to commands in a good log."""
        return self.share > _SHARE


def disturbing_torque(
    thrust: Floats,
    turned: Floats,
    step: float,
    *,
    inertia: Floats,
    arms: Floats,
    noise: float,
    velocity: Floats | None = None,
) -> Disturbance | None:
    """Return the torque that neither commands, after one lag and delay, nor damping explain.

    A controller answers faster than a log's rows, so that rows of its commands are samples of
    what the rotors got; on a small vehicle that is more than gusts.

    Args:
        thrust: commanded, of each rotor; each may be weak [N], shape (T, n).
        turned: measured rates about x and y [rad/s], shape (T, 2).
        step: of the even rows [s].
        inertia: about x and y, as stated, shape (2,).
        arms: stated torque about x and y of a unit of each thrust [m], shape (n, 2).
        noise: white noise of the gyroscope [rad/s].
        velocity: body axes [m/s], shape (T, 3), for moments of drag; None where it is unknown.
    """
    if len(turned) < 300:
        return None
    rates, asked = smooth(turned), smooth(thrust)
    measured = np.gradient(rates, step, axis=0)
    shifts = np.unique(np.round(_DELAYS / step).astype(int))
    first = int(shifts[-1])
    beside = [np.ones((len(rates), 1)), rates]
    if velocity is not None:
        beside.append(velocity)
    fixed, measured = np.concatenate(beside, axis=1)[first:], measured[first:]
    best = None
    for lag in _LAGS:
        lagged = _lagged(asked, lag, step)
        for k in shifts:
            known = np.concatenate([fixed, lagged[first - k : len(asked) - k]], axis=1)
            slope = np.linalg.lstsq(known, measured, rcond=None)[0]
            rest = measured - known @ slope
            if best is None or np.sum(rest**2) < np.sum(best[0] ** 2):
                best = rest, slope[fixed.shape[1] :]
    assert best is not None
    left, gain = best
    # a fit gives a vehicle that answers less a larger inertia, and the torque counts with that
    answered = np.sum(gain * arms, axis=0) / np.maximum(np.sum(arms**2, axis=0), 1e-12)
    shown = np.where(answered > 0.0, 1.0 / np.maximum(answered, 1e-9), inertia)
    felt = np.clip(shown, inertia, _MOST * inertia)
    pulse = np.zeros((401, 1))
    pulse[200] = 1.0
    white = noise * float(np.sqrt(np.sum(np.gradient(smooth(pulse), step, axis=0) ** 2)))
    # lost packets and filled-in rows have longer tails than a normal distribution
    spread = np.quantile(np.abs(left), _TAIL, axis=0) / _TAIL_SIGMAS
    level = np.sqrt(np.maximum(spread**2 - white**2, 0.0))
    whole = _ROBUST * np.median(np.abs(measured - measured.mean(axis=0)), axis=0)
    return Disturbance(
        sigma=float(np.sqrt(np.mean((level * felt) ** 2))),
        time=_time(left, step),
        share=float(np.sum(level**2) / max(float(np.sum(whole**2)), 1e-12)),
    )


def _lagged(thrust: Floats, lag: float, step: float) -> Floats:
    """Thrusts after a lag of first order, from a steady start, shape (T, n)."""
    from scipy.signal import lfilter

    keep = np.exp(-step / lag) if lag > 0.0 else 0.0
    found: Floats = thrust[0] + lfilter([1.0 - keep], [1.0, -keep], thrust - thrust[0], axis=0)
    return found


def _time(left: Floats, step: float) -> float:
    """Time shift at which the autocorrelation of a signal falls to 1/e [s]."""
    size = float(np.sum(left**2))
    for k in range(1, len(left) // 2):
        if float(np.sum(left[k:] * left[:-k])) < size / np.e:
            return max(k * step, _LEAST_TIME)
    return _LEAST_TIME


def unexplained_force(force: Floats, velocity: Floats, thrust: Floats) -> Floats:
    """Return the specific force along x and y that neither a drag nor thrust explains.

    Drags are linear, or quadratic in the speed along each axis or in the whole speed: what is taken
    for gusts would hide them from a diagnosis.

    Args:
        force: specific force about x and y, shape (T, 2).
        velocity: body axes, shape (T, 3).
        thrust: over mass, shape (T,).
    """
    own = np.abs(velocity) * velocity
    whole = np.linalg.norm(velocity, axis=1, keepdims=True) * velocity
    known = np.column_stack([np.ones(len(force)), velocity, own, whole, thrust])
    left: Floats = force - known @ np.linalg.lstsq(known, force, rcond=None)[0]
    return left


def inertia_of(vehicle: Mapping[str, Any]) -> Floats:
    """Return the moments of inertia about x and y, shape (2,)."""
    return np.asarray(np.diag(np.asarray(vehicle["inertia"], dtype=float))[:2])


def velocity_of(log: Log, step: float) -> Floats | None:
    """Return the velocity in body axes from the pose of a log, shape (T, 3); None without one."""
    from seals.frames import matrix_of, normalised, rotate
    from seals.logs.resample import one_sign

    if not (log.has("position") and log.has("orientation")):
        return None
    place, turn = log.channel("position"), log.channel("orientation")
    good = np.isfinite(place).all(axis=1) & np.isfinite(turn).all(axis=1)
    if good.mean() < 0.1 or good.sum() < 50:
        return None
    q = one_sign(turn[good][:, [1, 2, 3, 0]])
    even = [np.interp(log.time, log.time[good], v) for v in (*place[good].T, *q.T)]
    speed = np.gradient(smooth(np.stack(even[:3], axis=1)), step, axis=0)
    attitude = matrix_of(normalised(np.stack(even[3:], axis=1)))
    return np.asarray(rotate(np.swapaxes(attitude, -1, -2), speed))
