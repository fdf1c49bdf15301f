"""What the sensors read: the IMU chain, slow sensors, noise, steps of the numbers, lost samples."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tests.validation.hidden.fly import Track
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import (
    Array,
    cross,
    exponential,
    matrix,
    multiply,
    turn_of,
)

# noise and rate of each channel: (sigma, rate)
Channels = Mapping[str, tuple[float, float]]
QUAD = {
    "angular_velocity": (0.01, 100),
    "specific_force": (0.08, 100),
    "position": (0.003, 100),
    "orientation": (0.004, 100),
    "battery_voltage": (0.01, 100),
}
CHANNELS: dict[str, dict[str, tuple[float, int]]] = {
    "quad": QUAD,
    "aam": {
        "angular_velocity": (0.012, 100),
        "specific_force": (0.1, 100),
        "position": (0.003, 100),
        "orientation": (0.004, 100),
        "joint_position": (0.001, 100),
        "battery_voltage": (0.01, 100),
    },
    "auv": {
        "angular_velocity": (0.005, 100),
        "specific_force": (0.03, 100),
        "position": (0.005, 20),
        "orientation": (0.004, 100),
        "velocity": (0.008, 10),
        "depth": (0.004, 20),
        "battery_voltage": (0.01, 100),
    },
    "drop": {
        "angular_velocity": (0.012, 50),
        "specific_force": (0.12, 50),
        "position": (0.003, 50),
        "orientation": (0.006, 50),
    },
    "drop_imu_only": {"angular_velocity": (0.012, 50), "specific_force": (0.12, 50)},
    "crossing": {
        "angular_velocity": (0.01, 100),
        "specific_force": (0.08, 100),
        "position": (0.004, 100),
        "orientation": (0.004, 100),
        "depth": (0.005, 25),
        "battery_voltage": (0.01, 100),
    },
}
UNITS = {
    "angular_velocity": "rad/s",
    "specific_force": "m/s^2",
    "position": "m",
    "orientation": "rad, rotation-vector error in body axes",
    "velocity": "m/s",
    "depth": "m",
    "battery_voltage": "V",
    "joint_position": "rad",
}
STEP = {
    "angular_velocity": 0.001,
    "specific_force": 0.005,
    "position": 0.0001,
    "orientation": 0.00001,
    "velocity": 0.001,
    "depth": 0.001,
    "battery_voltage": 0.01,
    "joint_position": 0.0002,
}


def _inertial(track: Track, plant: Plant) -> tuple[Array, Array]:
    """True spin and specific force at the IMU at the inner steps, (3, inner, n) each."""
    fine = track.fine
    spin = np.ascontiguousarray(fine[:, 7:].transpose(1, 0, 2))
    velocity = np.ascontiguousarray(fine[:, 4:7].transpose(1, 0, 2))
    velocity = velocity + cross(spin, plant["imu_place"][:, None])
    change = np.gradient(velocity, track.inner, axis=1, edge_order=1)
    turn = matrix(fine[:, :4].transpose(1, 0, 2))
    force = change + cross(spin, velocity) + plant["gravity"] * turn[2]
    return spin, force


def _late(fine: Array, rows: int, track: Track, delay: Array) -> Array:
    """Values (3, rows, n) of a fine channel (3, inner, n), read late by a delay (n,) [s]."""
    n = fine.shape[2]
    where = np.arange(rows)[:, None] * track.per_row - (delay / track.inner)[None]
    where = np.clip(where, 0.0, fine.shape[1] - 1.001)
    low = where.astype(np.intp)
    part = where - low
    case = np.arange(n)[None]
    return fine[:, low, case] * (1.0 - part) + fine[:, low + 1, case] * part


def exact(track: Track, plant: Plant, joints: slice | None = None) -> dict[str, Array]:
    """Readings without noise at the rows, each (rows, axes, n)."""
    rows = track.rows.shape[0]
    spin, force = _inertial(track, plant)
    spin = _late(spin, rows, track, plant["imu_delay"])
    force = _late(force, rows, track, plant["imu_delay"])
    off = turn_of(plant["imu_turn"])[:, :, None]
    spin = (1.0 + plant["gyro_scale"])[:, None] * (off * spin[:, None]).sum(0)
    spin = spin + plant["gyro_bias"][:, None]
    force = (off * force[:, None]).sum(0)
    force = (1.0 + plant["imu_scale"])[:, None] * force + plant["imu_bias"][:, None]
    out = {
        "angular_velocity": spin.transpose(1, 0, 2),
        "specific_force": force.transpose(1, 0, 2),
        "position": track.rows[:, :3],
        "orientation": track.rows[:, 3:7],
        "velocity": track.fine[:: track.per_row, 4:7][:rows],
        "depth": -track.rows[:, 2:3],
        "battery_voltage": track.volts[:, None],
    }
    if joints is not None:
        out["joint_position"] = track.rows[:, joints]
    return out


def measured(
    values: dict[str, Array], channels: Channels, rate: float, rng: np.random.Generator
) -> dict[str, Array]:
    """One log's channels with noise, rate, quantisation and lost samples, each (rows, axes)."""
    out = {}
    for name, (sigma, own_rate) in channels.items():
        value = values[name]
        if name == "orientation":
            error = sigma * rng.standard_normal((3, value.shape[0]))
            value = multiply(value.T, exponential(error)).T
        else:
            value = value + sigma * rng.standard_normal(value.shape)
        value = np.round(value / STEP[name]) * STEP[name]
        every = round(rate / own_rate)
        keep = np.arange(value.shape[0]) % every == rng.integers(every)
        if name != "battery_voltage":
            keep &= rng.random(value.shape[0]) > rng.uniform(0.003, 0.012)
        out[name] = np.where(keep[:, None], value, np.nan)
    return out


def differences(
    one: dict[str, Array], two: dict[str, Array], channels: Channels
) -> dict[str, Array]:
    """Differences of two sets of readings in units of the noise, each (rows, axes, n)."""
    out = {}
    for name, (sigma, _) in channels.items():
        if name == "battery_voltage":
            continue
        if name == "orientation":
            a, b = one[name].transpose(1, 0, 2), two[name].transpose(1, 0, 2)
            inverse = np.concatenate((b[:1], -b[1:]))
            turned = multiply(inverse, a)
            turned = np.where(turned[:1] < 0.0, -turned, turned)
            out[name] = 2.0 * turned[1:].transpose(1, 0, 2) / sigma
        else:
            out[name] = (one[name] - two[name]) / sigma
    return out
