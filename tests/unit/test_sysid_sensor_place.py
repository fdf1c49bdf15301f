"""Specific force at a sensor off the origin: derivatives against differences."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from seals.frames import exponential, matrix_of
from seals.sysid.predictors.sensor_readings import add_centripetal, at_sensor

RNG = np.random.default_rng(3)
SENSOR: Any = SimpleNamespace(
    imu_position=np.array([0.2, -0.1, 0.05]),
    imu_turn=matrix_of(exponential(np.array([[0.3, -0.2, 0.5]])))[0].T,
)


def felt(force: Any, alpha: Any, spin: Any) -> Any:
    """Specific force of the sensor, from that of the origin."""
    arm = SENSOR.imu_position
    whole = force + np.cross(alpha, arm) + np.cross(spin, np.cross(spin, arm))
    return whole @ SENSOR.imu_turn.T


def test_angular_acceleration_is_felt_off_the_origin() -> None:
    """The change of the reading is that of the whole law."""
    change, spin = RNG.normal(size=(4, 9)), RNG.normal(size=(4, 3))
    expected = felt(change[:, 6:], change[:, 3:6], spin) - felt(0.0, 0.0 * spin, spin)
    assert np.allclose(at_sensor(SENSOR, change), expected)


def test_spin_changes_the_centripetal_acceleration() -> None:
    """Columns of the output matrix are difference quotients of the law by the spin."""
    spin, step = RNG.normal(size=(4, 3)), 1e-6
    found = np.zeros((4, 3, 12))
    add_centripetal(found, SENSOR, spin)
    for k in range(3):
        ends = [felt(0.0, 0.0 * spin, spin + s * step * np.eye(3)[k]) for s in (1, -1)]
        assert np.allclose(found[:, :, 9 + k], (ends[0] - ends[1]) / (2.0 * step), atol=1e-8)
