"""Axes, clocks and even rows of a conversion, against a motion in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from seals.errors import LogError
from seals.logs.accelerations import filtered_alike, second_derivative
from seals.logs.axes import AxesSettings, with_axes
from seals.logs.check import check_log
from seals.logs.finding import Severity
from seals.logs.log import Log
from seals.logs.resample import even_rows
from seals.logs.time_offset import time_offset

Columns = dict[str, NDArray[np.float64]]
ROWS, STEP = 2400, 0.01
NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""From north, east, down to east, north, up, and back."""
FRD = np.diag([1.0, -1.0, -1.0])


def _motion(time: NDArray[np.float64]) -> tuple[NDArray[np.float64], Rotation]:
    place = np.stack([1.5 * np.sin(0.9 * time), np.cos(1.3 * time), 0.8 * np.sin(0.7 * time)], 1)
    angles = np.stack([0.3 * np.sin(1.1 * time), 0.2 * np.sin(0.8 * time), 0.5 * np.sin(time)], 1)
    return place, Rotation.from_euler("xyz", angles)


def _flight(late: float = 0.0, *, world: object = None, body: object = None) -> Log:
    """A wandering body; its IMU late by some time, its axes by two matrices from ENU and FLU."""
    rng = np.random.default_rng(3)
    time = np.arange(ROWS) * STEP
    place, turn = _motion(time)
    h = 1e-3
    before, middle, after = (_motion(time - late + s)[0] for s in (-h, 0.0, h))
    early, then, later = (_motion(time - late + s)[1] for s in (-1e-5, 0.0, 1e-5))
    force = then.inv().apply((before - 2 * middle + after) / h**2 + [0.0, 0.0, 9.81])
    rate = (early.inv() * later).as_rotvec() / 2e-5
    w = np.eye(3) if world is None else np.asarray(world)
    b = np.eye(3) if body is None else np.asarray(body)
    quaternion = (Rotation.from_matrix(w.T) * turn * Rotation.from_matrix(b)).as_quat()
    place, force, rate = place @ w, force @ b, rate @ b
    columns: Columns = {"t": time}
    for k, axis in enumerate("xyz"):
        columns[f"position_{axis}"] = place[:, k] + rng.normal(0.0, 0.003, ROWS)
        columns[f"specific_force_{axis}"] = force[:, k] + rng.normal(0.0, 0.1, ROWS)
        columns[f"angular_velocity_{axis}"] = rate[:, k] + rng.normal(0.0, 0.01, ROWS)
    columns |= {f"orientation_{axis}": quaternion[:, k] for k, axis in enumerate("xyzw")}
    return Log(name="flight", columns=columns)


def _found(log: Log) -> dict[str, str]:
    found = (finding for finding in check_log(log) if finding.severity.value != "note")
    return {finding.code: finding.message for finding in found}


def test_ned_and_frd_become_enu_and_flu() -> None:
    """A log in north-east-down and forward-right-down is that of ENU and FLU after the map."""
    true = _flight()
    log, said = with_axes(_flight(world=NED, body=FRD), AxesSettings(world="ned", body="frd"))
    for stem in ("position", "specific_force", "angular_velocity"):
        # the noise of both was drawn alike but along other axes
        assert np.abs(log.channel(stem) - true.channel(stem)).max() < 1.0
        assert np.abs(log.channel(stem) - true.channel(stem)).mean() < 0.15
    dots = np.sum(log.channel("orientation") * true.channel("orientation"), axis=1)
    assert np.abs(dots).min() == pytest.approx(1.0, abs=1e-12)
    assert _found(log) == {}
    assert len(said) == 2
    assert "frame_down" in _found(_flight(world=NED, body=FRD))


@pytest.mark.parametrize(
    "axes", [("y", "x", "z"), ("y", "x", "-z"), ("-x", "y", "z"), ("-y", "x", "z")]
)
def test_swapped_axes_of_the_position_are_found_and_mended(axes: tuple[str, ...]) -> None:
    """East for north, down for up, a mirror, a quarter turn: each with the option that mends it."""
    wrong, _ = with_axes(_flight(), AxesSettings(position=list(axes)))
    message = _found(wrong)["position_axes"]
    option = message.split("axes.position=[")[1].split("]")[0].split(",")
    mended, _ = with_axes(wrong, AxesSettings(position=option))
    assert "position_axes" not in _found(mended)
    assert np.array_equal(mended.channel("position"), _flight().channel("position"))


def test_a_turned_world_is_found_and_turned_back() -> None:
    """A tracking system whose axes are 40 degrees off those of the compass."""
    wrong, _ = with_axes(_flight(), AxesSettings(heading=-0.7))
    assert "position_axes" not in _found(wrong)
    angle = float(_found(wrong)["position_heading"].split("axes.heading=")[1].split(",")[0])
    assert angle == pytest.approx(0.7, abs=0.03)
    assert _found(with_axes(wrong, AxesSettings(heading=angle))[0]) == {}


@pytest.mark.parametrize("option", ["axes.quaternion=xyzw", "axes.inverse=true"])
def test_quaternions_are_told_without_a_gyroscope(option: str) -> None:
    """Order and inverse by accelerometer and position alone; the named option mends them."""
    log = _flight()
    columns = {k: v for k, v in log.columns.items() if not k.startswith("angular")}
    q = dict(zip("xyzw", (columns[f"orientation_{x}"] for x in "xyzw"), strict=True))
    if "inverse" in option:
        q |= {axis: -q[axis] for axis in "xyz"}
    else:
        q = dict(zip("wxyz", q.values(), strict=True))
    wrong = Log(name="a", columns=columns | {f"orientation_{x}": v for x, v in q.items()})
    assert option in _found(wrong)["attitude_convention"]
    axes = AxesSettings(quaternion="xyzw") if "xyzw" in option else AxesSettings(inverse=True)
    assert _found(with_axes(wrong, axes)[0]) == {}


def test_accelerations_are_filtered_like_positions_without_a_shift() -> None:
    """Of a sine both filters leave the same but for the error of a sum, w^2 h^2 / 12."""
    time, w = np.arange(1200) * 0.01, 4.0
    place, bend = np.sin(w * time)[:, None], -w * w * np.sin(w * time)[:, None]
    left = (filtered_alike(bend) - second_derivative(place))[60:-60]
    assert np.abs(left).max() < 2 * w**2 * w**2 * 0.01**2 / 12


def test_a_late_clock_is_found_and_mended() -> None:
    """Inertial channels 60 ms late against the pose: found within 5 ms, mended by the option."""
    log = _flight(late=0.06)
    message = _found(log)["time_offset"]
    shift = float(message.split("position: ")[1].split(",")[0])
    assert shift == pytest.approx(-0.06, abs=0.005)
    mended = even_rows(log, 0.0, {"position": shift, "orientation": shift})
    assert "time_offset" not in _found(mended)
    assert "time_offset" not in _found(_flight())


@pytest.mark.parametrize(("late", "refused"), [(0.1, False), (-0.03, False), (-0.1, True)])
def test_a_pose_too_late_for_any_fit_is_refused(late: float, refused: bool) -> None:
    """Late sensors are an effect; sensors ahead of the pose are a clock, to be set first."""
    found = next(f for f in check_log(_flight(late=late)) if f.code == "time_offset")
    assert (found.severity is Severity.REFUSE) == refused
    assert "late={position" in found.message


@pytest.mark.parametrize("rate", [0.0, 0.12])
def test_a_body_that_turns_steadily_tells_no_offset_of_its_clocks(rate: float) -> None:
    """A level circle, nose first, and swings of 0.12 rad/s at most: nothing late is claimed."""
    rng = np.random.default_rng(8)
    time = np.arange(1800) * 0.02
    yaw = 0.42 * time + rate / 0.9 * np.sin(0.9 * time)
    turn = Rotation.from_euler("z", yaw[:, None]) * Rotation.from_rotvec(
        rng.normal(0.0, 0.004, (1800, 3))
    )
    columns: Columns = {"t": time}
    columns |= {f"orientation_{a}": turn.as_quat()[:, k] for k, a in enumerate("xyzw")}
    spin = 0.42 + rate * np.cos(0.9 * time)
    gyro = np.stack([0.0 * time, 0.0 * time, spin], 1) + rng.normal(0.0, 0.02, (1800, 3))
    columns |= {f"angular_velocity_{a}": gyro[:, k] for k, a in enumerate("xyz")}
    offset = time_offset(Log(name="circle", columns=columns))
    assert offset is None or abs(offset.late) < 0.01


def test_even_rows_keep_slow_channels_sparse_and_bridge_no_gap() -> None:
    """Ragged stamps become even; a slow channel stands in rows near its samples; a gap stays."""
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.uniform(0.003, 0.007, 2000))
    time = time[(time < 4.0) | (time > 4.5)]
    slow = np.where(np.arange(time.size) % 20 == 0, np.cos(time), np.nan)
    command = np.floor(time)
    columns = {"t": time, "depth": np.sin(time), "range": slow, "thruster_cmd_1": command}
    log = even_rows(Log(name="a", columns=columns), 100.0)
    assert np.allclose(np.diff(log.time), 0.01)
    held = np.isfinite(log.columns["depth"])
    assert not held[(log.time > 4.02) & (log.time < 4.48)].any()
    assert held[(log.time > 0.01) & (log.time < 3.98)].all()
    assert np.abs(log.columns["depth"] - np.sin(log.time))[held].max() < 1e-4
    there = np.isfinite(log.columns["range"])
    assert 0.07 < there.mean() < 0.15
    assert np.abs(log.columns["range"] - np.cos(log.time))[there].max() < 2e-3
    sent = (log.time - np.floor(log.time) > 0.02) & ((log.time < 4.0) | (log.time > 4.51))
    assert np.array_equal(log.columns["thruster_cmd_1"][sent], np.floor(log.time[sent]))


def test_euler_angles_and_world_velocity() -> None:
    """Yaw, pitch, roll about own axes make the attitude; a world velocity turns into the body."""
    angles = np.array([[0.3, -0.2, 1.1]])
    turn = Rotation.from_euler("ZYX", angles[:, ::-1])
    speed = np.array([1.0, 2.0, 3.0])
    names = ("roll", "pitch", "yaw", *(f"velocity_{axis}" for axis in "xyz"))
    columns = {"t": [0.0], **{n: [v] for n, v in zip(names, (*angles[0], *speed), strict=True)}}
    log, said = with_axes(
        Log(name="a", columns=columns),  # type: ignore[arg-type]
        AxesSettings(euler="ZYX", velocity="world"),
    )
    assert log.channel("orientation")[0] == pytest.approx(np.roll(turn.as_quat()[0], 1))
    assert log.channel("velocity")[0] == pytest.approx(turn.inv().apply(speed)[0])
    assert len(said) == 2


def test_a_component_that_was_not_measured_gets_no_column() -> None:
    """North and east of a vehicle that measures its depth: no empty ``position_z``."""
    columns = {"t": [0.0], "position_x": [1.0], "position_y": [2.0]}
    log, _ = with_axes(Log(name="a", columns=columns), AxesSettings(world="ned"))  # type: ignore[arg-type]
    assert {name: values.tolist() for name, values in log.columns.items()} == {
        "t": [0.0],
        "position_x": [2.0],
        "position_y": [1.0],
    }


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        ({"world": "nde"}, "axes.world=nde"),
        ({"body": "fru"}, "axes.body=fru"),
        ({"position": ["x", "x", "z"]}, "once each"),
        ({"quaternion": "wzyx"}, "axes.quaternion"),
        ({"euler": "ZYX"}, "needs the column"),
        ({"euler": "321"}, "axes.euler=321"),
    ],
)
def test_wrong_axes_are_refused(axes: dict[str, object], words: str) -> None:
    """Unknown names, doubled axes and absent angles are refused in words."""
    log = Log(name="a", columns={"t": [0.0], "position_x": [1.0]})  # type: ignore[dict-item]
    with pytest.raises(LogError, match=words):
        with_axes(log, AxesSettings(**axes))  # type: ignore[arg-type]
