"""Readings of inertial sensors: lever arm, mounting axes, delay; and their linearisation."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.frames import skew_last
from seals.sysid.data.samples import Samples
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.predictors.extended_model import ExtendedModel


def at_sensor(vehicle: Vehicle, change: Floats) -> Floats:
    """Return the change of the specific force at the sensor [m/s^2], shape (T, 3).

    Equation:
        df + dalpha x r, turned into the sensor's axes.

    Args:
        vehicle: place r and axes of the sensor.
        change: of linear and angular acceleration and specific force of the body's origin, body
            axes, shape (T, 9 or more).
    """
    force = change[:, 6:9]
    if np.any(vehicle.imu_position):
        force = force + np.cross(change[:, 3:6], vehicle.imu_position)
    out: Floats = force @ vehicle.imu_turn.T
    return out


def add_centripetal(output_matrix: Floats, vehicle: Vehicle, spin: Floats) -> None:
    """Add the change of the sensor's centripetal acceleration with the angular velocity, in place.

    Equation:
        d(w x (w x r)) = -(S(w x r) + S(w) S(r)) dw, with S(a) b = a x b.

    Args:
        output_matrix: specific force by state errors, shape (T, 3, n).
        vehicle: place and axes of the sensor.
        spin: w, body axes [rad/s], shape (T, 3).
    """
    arm = vehicle.imu_position
    if not np.any(arm):
        return
    across = skew_last(np.broadcast_to(arm, spin.shape))
    change = -skew_last(np.cross(spin, arm)) - np.matmul(skew_last(spin), across)
    output_matrix[:, :, 9:12] += np.matmul(vehicle.imu_turn, change)


def as_simulated(
    vehicle: Vehicle, samples: Samples, reading: Floats, angular_acceleration: Floats, step: float
) -> Floats:
    """Return the readings as a simulation with half-step velocities tells them.

    Equation:
        An accelerometer tells the forces at the start of the step that has just ended, f(t - h); a
        gyroscope the velocity at the middle of that step and half a step of the acceleration that
        led there, w(t) - h / 2 (w'(t) - w'(t - h)).

    Args:
        vehicle: with its sensor.
        samples: the log, whose rows are equal steps within a run.
        reading: gyroscope and accelerometer, sensor axes, shape (T, 6).
        angular_acceleration: w' in body axes, shape (T, 3) [rad/s^2].
        step: h of the simulation [s].
    """
    rate = angular_acceleration @ vehicle.imu_turn.T
    both = np.concatenate([rate, reading[:, 3:]], axis=1)
    before = both.copy()
    for first, last in samples.runs:
        # straight pieces: a command that jumps bends the force at its row
        at = np.maximum(np.arange(last - first) - step / samples.step, 0.0)
        low = np.minimum(at.astype(int), max(last - first - 2, 0))
        share, own = (at - low)[:, None], both[first:last]
        before[first:last] = own[low] + share * (own[np.minimum(low + 1, len(own) - 1)] - own[low])
    late = 0.5 * step * (rate - before[:, :3])
    return np.concatenate([reading[:, :3] - late, before[:, 3:]], axis=1)


def delayed(plant: ExtendedModel, reading: Floats, delay: float, order: int = 0) -> Floats:
    """Delay readings, run by run; or return a time derivative of them.

    Cubic pieces with the slopes of central differences: straight ones would weigh the noise of the
    trajectory by where between two rows the delay falls.
    """
    from scipy.interpolate import CubicHermiteSpline

    out: Floats = reading.copy()
    step = plant.samples.step
    for first, last in plant.samples.runs:
        time, seen = plant.samples.time[first:last], reading[first:last]
        if len(time) < 2:
            continue
        if not np.isfinite(seen).all():
            # a trajectory that ran out of digits has no readings at any time
            out[first:last] = np.nan
            continue
        curve = CubicHermiteSpline(time, seen, np.gradient(seen, step, axis=0))
        out[first:last] = curve(np.clip(time - delay, time[0], time[-1]), order)
    return out
