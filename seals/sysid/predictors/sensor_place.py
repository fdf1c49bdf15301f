"""Linearised specific force at the inertial sensor: lever arm and mounting axes."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.sysid.data.vehicle import Vehicle


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
    across = skew(np.broadcast_to(arm, spin.shape))
    change = -skew(np.cross(spin, arm)) - np.matmul(skew(spin), across)
    output_matrix[:, :, 9:12] += np.matmul(vehicle.imu_turn, change)


def skew(vector: Floats) -> Floats:
    """Return S with S b = a x b for every row a, shape (T, 3, 3)."""
    out = np.zeros((len(vector), 3, 3))
    x, y, z = vector.T
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -z, y, -x
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = z, -y, x
    return out
