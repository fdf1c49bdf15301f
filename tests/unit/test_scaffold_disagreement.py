"""What a flight tells of errors as slow as the motion: sensors against the pose, torque."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from seals.arrays import Floats
from seals.logs.log import Log
from seals.scaffold.datasheet import write_datasheet
from seals.scaffold.disagreement import disagreement
from seals.scaffold.flight_facts import disturbing_torque, flight_facts, unexplained_force

STEP, ROWS = 0.01, 3000
TIME = STEP * np.arange(ROWS)
WHITE = {"angular_velocity": 0.01, "specific_force": 0.05, "position": 2e-4, "orientation": 1e-3}
VEHICLE: dict[str, Any] = {
    "name": "quad",
    "mass": 1.0,
    "inertia": np.diag([0.01, 0.01, 0.02]),
    "centre_of_gravity": np.zeros(3),
    "rotors": [
        {
            "position": [x, y, 0.0],
            "axis": [0.0, 0.0, 1.0],
            "thrust_coefficient": 1e-5,
            "time_constant": 0.0,
        }
        for x, y in ((0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1))
    ],
}


def _slow(rng: np.random.Generator, sigma: float, time: float, columns: int) -> Floats:
    """Ornstein-Uhlenbeck noise."""
    keep = np.exp(-STEP / time)
    white = rng.standard_normal((ROWS, columns))
    return np.asarray(sigma * lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=0))


def _log(gyro_error: float, force_error: float) -> Log:
    """A flight of known course; inertial channels with white noise and slow errors."""
    rng = np.random.default_rng(3)
    angles = np.stack([0.3 * np.sin(1.9 * TIME), 0.25 * np.sin(2.3 * TIME), 0.2 * TIME], axis=1)
    turn = Rotation.from_euler("xyz", angles)
    rates = (turn[:-1].inv() * turn[1:]).as_rotvec() / STEP
    rates = 0.5 * (np.concatenate([rates, rates[-1:]]) + np.concatenate([rates[:1], rates]))
    sines = np.array([0.8, 1.1, 0.9]) * TIME[:, None]
    force = turn.inv().apply(-(np.array([0.8, 1.1, 0.9]) ** 2) * np.sin(sines) + [0, 0, 9.81])
    values = {
        "angular_velocity": rates + _slow(rng, gyro_error, 0.2, 3),
        "specific_force": force + _slow(rng, force_error, 0.2, 3),
        "position": np.sin(sines),
    }
    columns = {"t": TIME}
    for stem, clean in values.items():
        noisy = clean + WHITE[stem] * rng.standard_normal((ROWS, 3))
        columns |= {f"{stem}_{axis}": noisy[:, k] for k, axis in enumerate("xyz")}
    small = Rotation.from_rotvec(WHITE["orientation"] * rng.standard_normal((ROWS, 3)))
    q = (turn * small).as_quat()
    columns |= {f"orientation_{axis}": q[:, k] for k, axis in enumerate("xyzw")}
    columns |= {f"rotor_speed_cmd_{k}": np.full(ROWS, 495.2) for k in (1, 2, 3, 4)}
    return Log(name="flight", columns=columns)


def test_white_noise_alone_is_no_disagreement() -> None:
    """Sensors that differ by their white noise agree."""
    assert flight_facts(_log(0.0, 0.0), VEHICLE).differing == {}


def test_a_gap_of_the_pose_is_no_disagreement() -> None:
    """Straight lines across seconds without a pose are no motion that a sensor contradicts."""
    log = _log(0.0, 0.0)
    gone = TIME % 4.0 > 3.0
    pose = [name for name in log.columns if name.startswith(("position", "orientation"))]
    columns = {k: np.where(gone, np.nan, v) if k in pose else v for k, v in log.columns.items()}
    assert flight_facts(Log(name="gap", columns=columns), VEHICLE).differing == {}


def test_slow_errors_of_sensors_are_seen_against_the_pose(tmp_path: Path) -> None:
    """Noise of neighbouring samples does not show them; the sheet states what does."""
    log = _log(0.1, 0.3)
    facts = flight_facts(log, VEHICLE)
    for stem in ("angular_velocity", "specific_force"):
        assert facts.noise[stem] < 2.0 * WHITE[stem]
        assert facts.differing[stem] > 8.0 * WHITE[stem]
    # white noise of the same power where the motion is: sigma sqrt(2 tau / step) at most
    found = disagreement(log, facts.noise)["angular_velocity"].sigma
    assert 0.1 < found < 0.1 * np.sqrt(2.0 * 0.2 / STEP)
    place = tmp_path / "datasheet.yaml"
    told = write_datasheet(log, VEHICLE, place, replace=False)
    sheet = yaml.safe_load(place.read_text())
    stated = sheet["sensors"]["channels"]["angular_velocity"]["sigma"]
    assert stated == pytest.approx(found, rel=0.01)
    assert any("differs from the pose" in line for line in told)


def test_errors_of_the_pose_are_not_those_of_the_sensor() -> None:
    """An attitude that wobbles faster than the motion is stated for the attitude."""
    clean = _log(0.0, 0.0)
    wobble = Rotation.from_rotvec(_slow(np.random.default_rng(11), 0.02, 0.05, 3))
    turned = Rotation.from_quat(clean.channel("orientation")[:, [1, 2, 3, 0]]) * wobble
    q = turned.as_quat()
    columns = dict(clean.columns) | {f"orientation_{a}": q[:, k] for k, a in enumerate("xyzw")}
    log = Log(name="flight", columns=columns)
    found = disagreement(log, flight_facts(clean, VEHICLE).noise)["angular_velocity"]
    of_gyro = disagreement(_log(0.1, 0.0), flight_facts(clean, VEHICLE).noise)["angular_velocity"]
    # as the equivalent white noise of what the filter passes: 0.02 rad at most
    assert 0.004 < found.of_pose < 0.02 * np.sqrt(2.0 * 0.05 / STEP)
    assert found.sigma**2 < 0.15 * (found.sigma**2 + (found.of_pose / STEP) ** 2)
    assert of_gyro.of_pose < 0.2 * found.of_pose


def test_the_torque_counts_with_the_inertia_that_commands_show() -> None:
    """A vehicle twice as inert as stated: the torque beside the commanded one is twice as large."""
    rng = np.random.default_rng(5)
    thrust = 2.45 + _slow(rng, 0.1, 0.1, 4)
    arms = 0.1 * np.array([[1.0, -1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0]])
    turning = (thrust @ arms.T + _slow(rng, 0.02, 0.3, 2)) / 0.02
    gyro = lfilter([STEP], [1.0, -0.97], turning - turning.mean(axis=0), axis=0)
    stated = np.array([0.01, 0.01])
    found = disturbing_torque(thrust, gyro, STEP, inertia=stated, arms=arms.T, noise=1e-4)
    assert found is not None
    assert found.sigma == pytest.approx(0.02, rel=0.3)


def test_torque_beside_the_commanded_is_measured() -> None:
    """Lag, a weak rotor and damping are no disturbance; what commands do not tell is."""
    rng = np.random.default_rng(5)
    thrust = 2.45 + _slow(rng, 0.1, 0.1, 4)
    followed = lfilter([0.2], [1.0, -0.8], thrust, axis=0) * [1.0, 0.9, 1.0, 1.0]
    arms = 0.1 * np.array([[1.0, -1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0]])
    disturbance = _slow(rng, 0.02, 0.3, 2)
    for extra, share in ((0.0, 0.05), (1.0, 1.0)):
        turning = (followed @ arms.T + extra * disturbance) / 0.01
        gyro = lfilter([STEP], [1.0, -0.97], turning - turning.mean(axis=0), axis=0)
        gyro = gyro + 0.002 * rng.standard_normal((ROWS, 2))
        inertia = np.array([0.01, 0.01])
        found = disturbing_torque(thrust, gyro, STEP, inertia=inertia, arms=arms.T, noise=0.002)
        assert found is not None
        assert found.clear == (extra > 0.0)
        assert found.share < share
    assert found.sigma == pytest.approx(0.02, rel=0.4)
    assert found.time == pytest.approx(0.3, rel=0.6)


@pytest.mark.parametrize("whole", [False, True])
def test_a_quadratic_drag_is_no_gust(whole: bool) -> None:
    """-c v|v| an axis, and -c |v| v of the whole speed: what is left is the white noise."""
    rng = np.random.default_rng(7)
    velocity = np.stack([2.5 * np.sin(1.2 * TIME), 2.0 * np.sin(1.4 * TIME), np.cos(TIME)], axis=1)
    size = np.linalg.norm(velocity, axis=1, keepdims=True) if whole else np.abs(velocity)
    force = (-0.08 * size * velocity)[:, :2] + rng.normal(0.0, 0.02, (ROWS, 2))
    left = unexplained_force(force, velocity, np.full(ROWS, 9.81))
    assert left.std() == pytest.approx(0.02, rel=0.05)
