"""Properties of a vehicle estimated from a flight: noise, rates, biases, hover thrust, delays.

What commands and damping do not explain is the residual torque and force.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.logs.channels import CHANNELS
from seals.logs.check_motion import hover_ratio
from seals.logs.log import Log
from seals.logs.time_offset import time_offset
from seals.scaffold.disagreement import disagreement, smooth

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


class _Disturbance(NamedTuple):
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
) -> _Disturbance | None:
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
        velocity: body axes [m/s], shape (T, 3), for moments of drag; None if it is unknown.
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
    return _Disturbance(
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


def _velocity_of(log: Log, step: float) -> Floats | None:
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


SENSED = ("angular_velocity", "specific_force", "position", "orientation", "velocity", "depth",
          "joint_position", "battery_voltage")  # fmt: skip
"""Channels whose noise a data sheet states."""
_STILL_RATE, _STILL_FORCE = 0.05, 0.3
"""Scatter of gyroscope [rad/s] and accelerometer [m/s^2] of a body that stands still."""
_STILL_FOR = 1.0
_SLOW = 0.5
"""Speed below which drag does not matter to the level of gusts [m/s]."""
_GUST_TIME = 0.35
_WINDOW = 2.0
_SLOWEST, _LONGEST_LAG, _ALIKE = 0.021, 0.25, 0.5
"""Step of rows [s] and lag [s] up to which a lag is looked for, and the correlation it needs."""
_THIRD = 20.0
"""Variance of third differences of white noise, in units of its own."""
_NOISE_AT, _INSIDE = 3.7064, 0.91126
"""Third differences that are noise, over their median size: to 2.5 standard deviations of normal
ones; and the variance of those."""
_SCATTER = 1.24
"""Relative 1-sigma of the noise by n third differences, times the root of n."""
_SAME = 3.0
"""Scatters [1-sigma] by which the axes of a channel may differ and have one noise."""


class Measured(NamedTuple):
    """Estimated number and its derivation."""

    value: float
    how: str


class FlightFacts(NamedTuple):
    """Properties estimated from a flight; None for those that it does not show.

    Args:
        noise: white noise of each channel, 1-sigma, in its unit.
        rate: of its samples [Hz].
        gyroscope_bias: largest mean rate at rest of any axis [rad/s].
        accelerometer_bias: deviation of the mean specific force at rest from gravity [m/s^2].
        hover_ratio: thrust of the commanded speeds over mass and specific force [1].
        response: time from commands to the turning they cause: lag of the rotors and delay [s].
        late: lateness of inertial channels against the pose [s].
        gust: standard deviation of force that comes and goes, over mass [m/s^2].
        torque: torque that comes and goes, beside the commanded one [N m].
        differing: by channel, error of an inertial channel or of the attitude, where white noise
            does not explain their difference.
        full_voltage: highest voltage of the battery [V].
        seconds_at_rest: time that the vehicle stood still [s].
    """

    noise: Mapping[str, float]
    rate: Mapping[str, float]
    gyroscope_bias: Measured | None
    accelerometer_bias: Measured | None
    hover_ratio: Measured | None
    response: Measured | None
    late: Measured | None
    gust: Measured | None
    torque: _Disturbance | None
    differing: Mapping[str, float]
    full_voltage: Measured | None
    seconds_at_rest: float


def flight_facts(log: Log, vehicle: Mapping[str, Any]) -> FlightFacts:
    """Estimate the properties of a vehicle from a flight.

    Args:
        log: in SI units, ENU and FLU, with even rows and rotor speeds.
        vehicle: mass and rotors, as in ``meta.yaml``.
    """
    held = [stem for stem in SENSED if log.has(stem)]
    rest = _at_rest(log)
    seconds = float(rest.sum()) * _step(log)
    offset = time_offset(log)
    noise = {stem: _noise(log, stem) for stem in held}
    found = disagreement(log, noise)
    # errors that white noise does not explain
    differing = {stem: each.sigma for stem, each in found.items() if each.clear}
    turned = found.get("angular_velocity")
    if turned is not None and turned.of_pose > noise.get("orientation", 0.0):
        differing["orientation"] = turned.of_pose
    rate = force = hover = None
    if rest.any():
        means = (log.channel(c)[rest] for c in ("angular_velocity", "specific_force"))
        turning, felt = (np.nanmean(values, axis=0) for values in means)
        rate = float(np.nanmax(np.abs(turning)))
        force = abs(float(np.linalg.norm(felt)) - 9.81)
    volts = log.columns["battery_voltage"] if log.has("battery_voltage") else np.zeros(0)
    volts, full = volts[np.isfinite(volts)], None
    if volts.size:
        full = Measured(float(np.quantile(volts, 0.999)), "highest voltage in the flight")
    ratios = hover_ratio(log, vehicle)
    if ratios.size >= 50:
        said = "thrust over mass and specific force in flight"
        hover = Measured(float(np.median(ratios)), said)
    return FlightFacts(
        noise=noise,
        rate={stem: _rate(log, stem) for stem in held},
        gyroscope_bias=None if rate is None else Measured(rate, "mean rate at rest"),
        accelerometer_bias=None
        if force is None
        else Measured(force, "size of specific force at rest"),
        hover_ratio=hover,
        response=_response(log, vehicle),
        late=None if offset is None else Measured(offset.late, "gyroscope against attitude"),
        gust=_gust(log, vehicle),
        torque=_torque(log, vehicle),
        differing=differing,
        full_voltage=full,
        seconds_at_rest=seconds,
    )


def _step(log: Log) -> float:
    steps = np.diff(log.time)
    return float(np.median(steps[steps > 0.0])) if steps.size else 0.01


def _noise(log: Log, stem: str) -> float:
    """White noise from the median third difference, in which slow motion cancels.

    Axes that differ by no more than the scatter of such medians share their root mean square: the
    largest of three would be 2 to 3 % too high. Where they differ by more, the largest counts.
    """
    from seals.frames import conjugate, multiply, rotation_vector
    from seals.logs.resample import one_sign

    values = log.channel(stem)
    there = np.isfinite(values)
    held = there.any(axis=0)
    # a component may begin later than the others
    values = values[there[:, held].all(axis=1)][:, held]
    if len(values) < 20:
        return 0.0
    if stem == "orientation":
        q = one_sign(values)[:, [1, 2, 3, 0]]
        turns = rotation_vector(multiply(conjugate(q[:-1]), q[1:]))
        third = np.diff(turns, 2, axis=0)
    else:
        third = np.diff(values, 3, axis=0)
    # the median says what is noise; the mean square of that scatters a fifth less than the median
    inside = np.abs(third) <= _NOISE_AT * np.median(np.abs(third), axis=0)
    axes = np.sqrt((third**2 * inside).sum(axis=0) / inside.sum(axis=0) / _INSIDE)
    largest, shared = float(np.max(axes)), float(np.sqrt(np.mean(axes**2)))
    same = largest <= shared * (1.0 + _SAME * _SCATTER / np.sqrt(len(third)))
    return float((shared if same else largest) / np.sqrt(_THIRD))


def _rate(log: Log, stem: str) -> float:
    there = np.isfinite(log.channel(stem)).any(axis=1)
    steps = np.diff(log.time[there])
    return float(1.0 / np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0


def _at_rest(log: Log) -> NDArray[np.bool_]:
    """Rows of periods in which no rotor turns and both inertial sensors stay constant."""
    still = np.zeros(log.rows, dtype=bool)
    if not (log.has("angular_velocity") and log.has("specific_force")):
        return still
    width = max(5, round(_STILL_FOR / _step(log)))
    gyro, force = log.channel("angular_velocity"), log.channel("specific_force")
    turning = np.zeros(log.rows, dtype=bool)
    if log.has("rotor_speed_cmd"):
        speed = np.nan_to_num(log.channel("rotor_speed_cmd"))
        turning = speed.max(axis=1) > 0.05 * max(float(speed.max()), 1e-9)
    for first in range(0, log.rows - width + 1, width):
        part = slice(first, first + width)
        quiet = np.nanmax(np.nanstd(gyro[part], axis=0), initial=0.0) < _STILL_RATE
        calm = np.nanmax(np.nanstd(force[part], axis=0), initial=0.0) < _STILL_FORCE
        still[part] = quiet and calm and not turning[part].any()
    return still


def _turning(log: Log, vehicle: Mapping[str, Any]) -> tuple[Floats, Floats] | None:
    """Commanded and measured angular acceleration about x and y, shape (T, 2)."""
    rotors = vehicle.get("rotors") or []
    if not (rotors and log.has("rotor_speed_cmd") and log.has("angular_velocity")):
        return None
    speed = np.nan_to_num(log.channel("rotor_speed_cmd"))
    gyro = log.channel("angular_velocity")
    if speed.shape[1] != len(rotors) or not np.isfinite(gyro).all(axis=1).mean() > 0.9:
        return None
    factor = np.array([float(r["thrust_coefficient"]) for r in rotors])
    torque = (speed**2 * factor) @ _arms(vehicle)
    wanted = torque @ np.linalg.inv(np.asarray(vehicle["inertia"], dtype=float)).T
    good = np.isfinite(gyro).all(axis=1)
    even = np.stack([np.interp(log.time, log.time[good], v) for v in gyro[good].T], axis=1)
    return wanted[:, :2], np.gradient(even, _step(log), axis=0)[:, :2]


def _arms(vehicle: Mapping[str, Any]) -> Floats:
    """Torque about the centre of gravity of a unit of each thrust, shape (n, 3) [m]."""
    place = np.array([r["position"] for r in vehicle["rotors"]], dtype=float)
    axis = np.array([r["axis"] for r in vehicle["rotors"]], dtype=float)
    return np.cross(place - np.asarray(vehicle["centre_of_gravity"], dtype=float), axis)


def _response(log: Log, vehicle: Mapping[str, Any]) -> Measured | None:
    """Time constant of the lag by which commanded and measured angular acceleration agree best."""
    from scipy.signal import lfilter

    found, step = _turning(log, vehicle), _step(log)
    if found is None or step > _SLOWEST:
        return None
    wanted, turned = (values - values.mean(axis=0) for values in found)
    lags = np.arange(0.0, _LONGEST_LAG, 0.5 * step)
    scores = []
    for lag in lags:
        keep = math.exp(-step / lag) if lag > 0.0 else 0.0
        follow = lfilter([1.0 - keep], [1.0, -keep], wanted, axis=0)
        size = math.sqrt(float(np.sum(follow**2) * np.sum(turned**2)))
        scores.append(float(np.sum(follow * turned)) / max(size, 1e-12))
    best = int(np.argmax(scores))
    if scores[best] < _ALIKE or best == len(lags) - 1:
        return None
    how = f"commands against angular acceleration, correlation {scores[best]:.2f}"
    return Measured(float(lags[best]), how)


def _torque(log: Log, vehicle: Mapping[str, Any]) -> _Disturbance | None:
    """Disturbance torque in flight."""
    step = _step(log)
    if _turning(log, vehicle) is None or step > _SLOWEST:
        return None
    flying, thrust = _flying(log, vehicle), _thrusts(log, vehicle)
    gyro = np.nan_to_num(log.channel("angular_velocity")[:, :2])
    noise = _noise(log, "angular_velocity")
    velocity = _velocity_of(log, step)
    velocity = None if velocity is None else velocity[flying]
    arms, inertia = (
        _arms(vehicle)[:, :2],
        np.asarray(np.diag(np.asarray(vehicle["inertia"], dtype=float))[:2]),
    )
    return disturbing_torque(
        thrust[flying], gyro[flying], step,
        inertia=inertia, arms=arms, noise=noise, velocity=velocity,
    )  # fmt: skip


def _flying(log: Log, vehicle: Mapping[str, Any]) -> NDArray[np.bool_]:
    """Rows from the first to the last in which thrust exceeds half of its median."""
    lifted = _thrusts(log, vehicle).sum(axis=1)
    rows = np.flatnonzero(lifted > 0.5 * float(np.median(lifted[lifted > 0.0], axis=0)))
    flying = np.zeros(log.rows, dtype=bool)
    if rows.size:
        flying[rows[0] : rows[-1] + 1] = True
    return flying


def _thrusts(log: Log, vehicle: Mapping[str, Any]) -> Floats:
    """Thrusts of the commanded speeds [N], shape (T, n)."""
    speed = np.nan_to_num(log.channel("rotor_speed_cmd"))
    factor = np.array([float(r["thrust_coefficient"]) for r in vehicle["rotors"]])
    return np.asarray(speed**2 * factor)


def _gust(log: Log, vehicle: Mapping[str, Any]) -> Measured | None:
    """Specific force of gusts along x and y [m/s^2]: of slow flight, else beside a drag.

    Its part faster than two seconds, less white noise. A coloured force of 0.35 s keeps 1 - 2 *
    0.35 / 2 of its variance above its mean over two seconds.
    """
    rotors, step = vehicle.get("rotors") or [], _step(log)
    if not (rotors and log.has("rotor_speed_cmd") and log.has("specific_force")):
        return None
    force = log.channel("specific_force")
    if log.channel("rotor_speed_cmd").shape[1] != len(rotors):
        return None
    width, short = round(_WINDOW / step), max(1, round(0.1 / step))
    white, share = _noise(log, "specific_force") ** 2 / short, 1.0 - 2.0 * _GUST_TIME / _WINDOW
    there, lifted = np.isfinite(force).all(axis=1), _thrusts(log, vehicle).sum(axis=1)

    def fast(values: Floats, width: int) -> Floats:
        return _mean(values, short) - _mean(values, width)

    if not lifted.any():
        return None
    slow = (lifted > 0.5 * float(np.median(lifted[lifted > 0.0], axis=0))) & (_pace(log) < _SLOW)
    flying, velocity, left = _flying(log, vehicle) & there, _velocity_of(log, step), None
    if velocity is not None and flying.sum() >= 2 * width:
        thrust = lifted / float(vehicle["mass"])
        left = unexplained_force(force[flying][:, :2], velocity[flying], thrust[flying])
        slow = slow[flying]
    if there.mean() > 0.9 and slow.sum() >= 2 * max(3, width):
        # a mean that reaches into faster flight holds its drag
        values = np.nan_to_num(force[:, :2]) if left is None else left
        level = [float(np.var(fast(v, max(3, width))[slow])) for v in values.T]
        how = "level specific force in slow flight, faster than two seconds"
    elif left is not None:
        level = [(1.4826 * float(np.median(np.abs(fast(v, width))))) ** 2 for v in left.T]
        how = "level specific force beside a drag, faster than two seconds"
    else:
        return None
    return Measured(math.sqrt(max(float(np.mean(level)) - white, 0.0) / share), how)


def _mean(values: Floats, rows: int) -> Floats:
    return np.convolve(values, np.ones(rows) / rows, mode="same")


def _pace(log: Log) -> Floats:
    """Speed over ground [m/s], shape (T,); infinite where it is unknown."""
    if log.has("velocity"):
        known: Floats = np.linalg.norm(np.nan_to_num(log.channel("velocity")), axis=1)
        return known
    fast = np.full(log.rows, np.inf)
    if not log.has("position"):
        return fast
    place = log.channel("position")
    good = np.isfinite(place).all(axis=1)
    if good.sum() < 2:
        return fast
    half = max(1, round(0.25 / _step(log)))
    even = np.stack([np.interp(log.time, log.time[good], v) for v in place[good].T], axis=1)
    moved = np.linalg.norm(even[2 * half :] - even[: -2 * half], axis=1)
    fast[half:-half] = moved / (2 * half * _step(log))
    return fast


def unit_of(stem: str) -> str:
    """Return the unit of a channel's noise."""
    return "rad" if stem == "orientation" else CHANNELS[stem].unit
