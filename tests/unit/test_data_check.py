"""What the check of a log notices, and what it must not complain about."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from seals.logs import Log, Severity, check_log

Columns = dict[str, NDArray[np.float64]]
STEP = 0.01
ROWS = 3000
GRAVITY = 9.81


def _flight() -> Columns:
    """A body that turns about all axes around hover; closed-form attitude, its rate from SciPy."""
    rng = np.random.default_rng(11)
    time = np.arange(ROWS) * STEP
    phases = np.outer(time, [1.1, 0.7, 0.5])
    angles = np.array([0.5, 0.4, 1.2]) * np.sin(phases)
    turn = Rotation.from_euler("xyz", angles)
    later = Rotation.from_euler(
        "xyz", np.array([0.5, 0.4, 1.2]) * np.sin(phases + 1e-5 * np.array([1.1, 0.7, 0.5]))
    )
    rate = (turn.inv() * later).as_rotvec() / 1e-5 + rng.normal(0.0, 0.01, (ROWS, 3))
    force = turn.inv().apply([0.0, 0.0, GRAVITY]) + rng.normal(0.0, 0.08, (ROWS, 3))
    x, y, z, w = turn.as_quat().T
    columns = {"t": time, "orientation_w": w, "orientation_x": x}
    columns |= {"orientation_y": y, "orientation_z": z}
    height = np.sin(0.3 * time)
    columns |= {"position_z": height, "depth": -height + rng.normal(0.0, 0.005, ROWS)}
    for k, axis in enumerate("xyz"):
        columns[f"angular_velocity_{axis}"] = rate[:, k]
        columns[f"specific_force_{axis}"] = force[:, k]
    return columns


def _codes(columns: Mapping[str, object], least: Severity = Severity.WARN) -> dict[str, Severity]:
    log = Log(name="flight", columns=columns)  # type: ignore[arg-type]
    wanted = [Severity.REFUSE] if least is Severity.REFUSE else [Severity.REFUSE, Severity.WARN]
    return {found.code: found.severity for found in check_log(log) if found.severity in wanted}


def _without(columns: Columns, *stems: str) -> Columns:
    return {key: value for key, value in columns.items() if not key.startswith(stems)}


def test_a_sound_flight_is_not_complained_about() -> None:
    """The flight that every case below is made from gives no warning."""
    assert _codes(_flight()) == {}


def test_gyro_in_degrees_is_refused_against_the_attitude() -> None:
    """A gyroscope in deg/s reads 57 times the rate of the attitude."""
    columns = _flight()
    for axis in "xyz":
        columns[f"angular_velocity_{axis}"] *= 180.0 / np.pi
    assert _codes(columns)["unit_rate"] is Severity.REFUSE


def test_gyro_in_degrees_alone_is_suspected() -> None:
    """Without attitude, rates beyond 40 rad/s raise the question."""
    columns = _without(_flight(), "orientation")
    for axis in "xyz":
        # a brisk flight: twice the rates of the one above, 1.5 rad/s
        columns[f"angular_velocity_{axis}"] *= 2.0 * 180.0 / np.pi
    assert _codes(columns)["unit_rate"] is Severity.WARN


def test_wrong_quaternion_order_is_refused() -> None:
    """x, y, z, w written into the columns w, x, y, z is told from the gyroscope."""
    columns = _flight()
    parts = [columns[f"orientation_{axis}"] for axis in "xyzw"]
    columns |= {f"orientation_{axis}": part for axis, part in zip("wxyz", parts, strict=True)}
    assert _codes(columns)["attitude_convention"] is Severity.REFUSE


@pytest.mark.parametrize(
    ("stems", "axes", "code"),
    [
        # world-to-body instead of body-to-world is told from the gyroscope
        (("orientation",), "xyz", "attitude_convention"),
        # a gyroscope in FRD with an attitude in FLU
        (("angular_velocity",), "yz", "attitude_convention"),
        # FRD and NED agree with one another; only the direction of gravity tells
        (("angular_velocity", "specific_force", "orientation"), "yz", "frame_down"),
    ],
)
def test_other_axes_are_refused(stems: tuple[str, ...], axes: str, code: str) -> None:
    """Components with the wrong sign are told from the other channels."""
    columns = _flight()
    for name in (f"{stem}_{axis}" for stem in stems for axis in axes):
        columns[name] = -columns[name]
    assert _codes(columns)[code] is Severity.REFUSE


def test_a_gyroscope_that_is_mounted_turned_is_told_with_its_angles() -> None:
    """Sensor axes at roll, pitch and yaw against the body: the words for robot.yaml hold them."""
    columns = _flight()
    spin = np.stack([columns[f"angular_velocity_{a}"] for a in "xyz"], axis=1)
    seen = Rotation.from_euler("xyz", [0.2, -0.3, 1.5]).inv().apply(spin)
    columns |= {f"angular_velocity_{a}": seen[:, k] for k, a in enumerate("xyz")}
    told = [f for f in check_log(Log(name="x", columns=columns)) if f.code == "mounting"]
    angles = [float(v) for v in str(told[0].message).partition("rpy: [")[2].rstrip("]}").split(",")]
    assert angles == pytest.approx([0.2, -0.3, 1.5], abs=0.02)


def test_sign_of_the_quaternion_may_flip() -> None:
    """The attitudes q and -q are the same: no complaint when the sign flips at random."""
    columns = _flight()
    sign = np.random.default_rng(2).choice([-1.0, 1.0], ROWS)
    for axis in "wxyz":
        columns[f"orientation_{axis}"] = sign * columns[f"orientation_{axis}"]
    assert _codes(columns) == {}


def test_slow_sensors_written_as_nan_are_not_complained_about() -> None:
    """A position at a tenth of the rate is noted, not warned about."""
    columns = _flight()
    columns["position_z"] = np.where(np.arange(ROWS) % 10, np.nan, columns["position_z"])
    assert _codes(columns) == {}


def test_accelerometer_in_g_is_seen_through_missing_rows() -> None:
    """The unit is told although nine of ten rows have no sample."""
    columns = _without(_flight(), "orientation", "angular_velocity")
    quiet = np.random.default_rng(4).normal(0.0, 0.005, ROWS)
    gone = np.arange(ROWS) % 10 > 0
    for axis in "xyz":
        rest = 1.0 if axis == "z" else 0.0
        columns[f"specific_force_{axis}"] = np.where(gone, np.nan, rest + quiet)
    assert _codes(columns)["unit_acceleration"] is Severity.REFUSE


def test_free_fall_is_not_taken_for_a_wrong_unit() -> None:
    """A drop with light drag, 0 to 1 m/s^2 of specific force, is not refused."""
    time = np.arange(300) * STEP
    noise = np.random.default_rng(5).normal(0.0, 0.08, 300)
    columns = {"t": time, "specific_force_z": 0.1 * time**2 + noise}
    assert _codes(columns, Severity.REFUSE) == {}


def test_depth_with_the_wrong_sign_is_refused() -> None:
    """Depth that rises with height is refused."""
    columns = _flight()
    columns["depth"] = -columns["depth"]
    assert _codes(columns)["depth_sign"] is Severity.REFUSE


def test_clipped_sensor_is_seen_and_a_slow_top_is_not() -> None:
    """A sine cut at 80 % is saturated; a coarse but whole sine is not."""
    time = np.arange(ROWS) * STEP
    sine = np.sin(4.0 * time) + 1e-4 * np.random.default_rng(6).normal(size=ROWS)
    assert "saturated" in _codes({"t": time, "depth": np.clip(sine, -2.0, 0.8)})
    assert "saturated" not in _codes({"t": time, "depth": sine})
    assert "saturated" not in _codes({"t": time, "depth": np.round(sine, 2)})


@pytest.mark.parametrize(
    ("column", "values", "code"),
    [
        ("depth", np.full(ROWS, 3.0), "constant"),
        ("depth", np.full(ROWS, np.nan), "no_samples"),
        ("pitch", np.linspace(-30.0, 30.0, ROWS), "unit_angle"),
        ("joint_position_1", np.linspace(0.0, 90.0, ROWS), "unit_angle"),
        ("rotor_speed_cmd_1", np.linspace(5e3, 9e3, ROWS), "unit_rotor_speed"),
    ],
)
def test_suspicious_columns_are_warned_about(
    column: str, values: NDArray[np.float64], code: str
) -> None:
    """Constant, empty and oversized columns each have their own warning."""
    assert _codes({**_flight(), column: values})[code] is Severity.WARN


def test_constant_command_is_no_reason_to_warn() -> None:
    """A command may stay the same for the whole log."""
    assert _codes({**_flight(), "thruster_cmd_1": np.zeros(ROWS)}) == {}


def test_time_is_judged_within_each_segment() -> None:
    """Two drops that both start at zero are no step backwards."""
    time = np.tile(np.arange(100) * STEP, 2)
    noise = np.random.default_rng(8).normal(size=200)
    columns = {"t": time, "position_z": noise}
    segment = np.repeat([0, 1], 100)
    assert check_log(Log(name="a", columns=columns, segment=segment))[0].severity is Severity.NOTE
    grave = check_log(Log(name="a", columns=columns))[0]
    assert (grave.code, grave.count) == ("time_backwards", 1)
    assert grave.where == pytest.approx(0.99)


def test_gaps_jitter_and_milliseconds_are_warned_about() -> None:
    """A hole of 1 s, ragged stamps and times in milliseconds each have their warning."""
    value = np.random.default_rng(9).normal(size=ROWS)
    time = np.arange(ROWS) * STEP
    gap = np.where(np.arange(ROWS) >= 1000, time + 1.0, time)
    found = {f.code: f for f in check_log(Log(name="a", columns={"t": gap, "depth": value}))}
    assert found["gaps"].count == 1
    assert found["gaps"].where == pytest.approx(9.99)
    ragged = time + np.random.default_rng(1).uniform(0.0, 0.9 * STEP, ROWS)
    assert "jitter" in _codes({"t": ragged, "depth": value})
    assert "time_unit" in _codes({"t": time * 1000.0, "depth": value})


def test_misspelt_channel_is_noted_with_the_right_name() -> None:
    """An unknown channel is noted, with the nearest known name."""
    columns = {**_flight(), "baterry_voltage": _flight()["position_z"]}
    notes = [f for f in check_log(Log(name="a", columns=columns)) if f.code == "unknown_channel"]
    assert len(notes) == 1
    assert "battery_voltage" in notes[0].message
    assert str(notes[0]).startswith("[note] baterry_voltage")


def test_euler_angles_are_pointed_at_the_option_that_reads_them() -> None:
    """The nearest channel to ``yaw`` is a command, which no log of angles means."""
    columns = {**_flight(), "yaw": _flight()["position_z"]}
    (note,) = (f for f in check_log(Log(name="a", columns=columns)) if f.code == "unknown_channel")
    assert "axes.euler=ZYX" in note.message
    assert "aim_yaw" not in note.message
