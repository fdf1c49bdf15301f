"""Thinning of fast logs: what it keeps, smooths and averages."""

from __future__ import annotations

import numpy as np
import pytest

from seals.logs.log import Log
from seals.sysid.data.decimation import ROWS, decimated, longest_step
from seals.sysid.data.join import join_logs

STEP, MANY = 0.0025, ROWS + 1


def log(**columns: np.ndarray) -> Log:
    """A run at 400 Hz whose pose is stated to be good to 1 mm."""
    time = STEP * np.arange(len(next(iter(columns.values()))))
    channels = {"position": {"sigma": 1e-3}, "specific_force": {"sigma": 0.02}}
    return Log(name="run", columns={"t": time, **columns}, meta={"sensors": {"channels": channels}})


def test_slow_or_short_logs_stay_as_they_are() -> None:
    """No row is lost of what is short, nor of what is sampled at 100 Hz."""
    short = log(position_x=np.zeros(100))
    assert decimated(short, short.rows) is short
    slow = Log(name="slow", columns={"t": 0.01 * np.arange(MANY), "position_x": np.zeros(MANY)})
    assert decimated(slow, MANY) is slow


def test_a_cubic_is_kept_and_its_noise_falls_as_stated() -> None:
    """A local parabola leaves a cubic as it is; white noise falls to what the metadata say."""
    x = np.linspace(-1.0, 1.0, 40_000)
    exact = decimated(log(position_x=x**3 - x), MANY)
    inside = slice(1, -1)
    assert exact.time[1] - exact.time[0] == pytest.approx(4 * STEP)
    there = np.interp(exact.time, STEP * np.arange(40_000), x)
    assert exact.columns["position_x"][inside] == pytest.approx(
        (there**3 - there)[inside], abs=1e-9
    )
    noise = np.random.default_rng(3).normal(0.0, 1e-3, 40_000)
    noisy = decimated(log(position_x=x**3 - x + noise), MANY)
    left = (noisy.columns["position_x"] - exact.columns["position_x"])[inside]
    stated = noisy.meta["sensors"]["channels"]["position"]["sigma"]
    # of n numbers the standard deviation is known to 1 / sqrt(2 n)
    assert left.std() == pytest.approx(stated, rel=5.0 / np.sqrt(2 * left.size))
    assert stated < 0.75e-3


def test_rows_with_the_samples_of_a_slow_sensor_are_kept() -> None:
    """A sensor read in every fourth row, from the third on, loses no sample and no noise."""
    slow = np.full(MANY, np.nan)
    slow[2::4] = np.arange(slow[2::4].size)
    found = decimated(log(position_x=np.zeros(MANY), specific_force_x=slow), MANY)
    assert np.array_equal(found.columns["specific_force_x"], slow[2::4])
    assert found.meta["sensors"]["channels"]["specific_force"]["sigma"] == 0.02


def test_sensors_read_at_other_times_keep_every_row() -> None:
    """Two slow sensors that take turns leave no rows to drop."""
    one, two = np.full(MANY, np.nan), np.full(MANY, np.nan)
    one[0::4], two[1::4] = 1.0, 1.0
    given = log(position_x=one, specific_force_x=two)
    assert decimated(given, MANY) is given


def test_a_command_is_averaged_until_the_next_row() -> None:
    """A step of a command between kept rows counts for the share that it acts; gaps are held."""
    command = np.zeros(MANY)
    command[6:] = 8.0
    command[7] = np.nan
    found = decimated(log(position_x=np.zeros(MANY), rotor_speed_cmd_1=command), MANY)
    assert found.columns["rotor_speed_cmd_1"][:4].tolist() == [0.0, 4.0, 8.0, 8.0]


@pytest.mark.parametrize(
    ("reach", "noise", "step"),
    [
        (0.5, 0.0, 0.002),
        (0.5, 1e-3, 0.006),
        (2.0, 1e-3, 0.002),
        (0.3, 1e-3, 0.01),
        (0.0, 0.0, 0.01),
    ],
)
def test_rows_are_closer_where_servos_move(reach: float, noise: float, step: float) -> None:
    """Joints that swing fast are followed at 2 ms, slow ones at 10: seven noises a row."""
    time = 0.001 * np.arange(MANY)
    joint = 0.2 + reach * np.sin(3.0 * time)
    arm = {"joint_position_1": joint, "joint_position_cmd_1": joint}
    meta = {"sensors": {"channels": {"joint_position": {"sigma": noise}}}} if noise else {}
    given = Log(name="arm", columns={"t": time, "position_x": np.zeros(MANY), **arm}, meta=meta)
    found = decimated(given, MANY)
    assert found.time[1] - found.time[0] == pytest.approx(step)


def test_a_light_finger_may_move_faster_than_an_arm() -> None:
    """The gains of the servos say what a joint's way does to the rest of the body."""
    time = 0.001 * np.arange(MANY)
    swing, rest = 0.5 * np.sin(10.0 * time), np.zeros(MANY)
    meta = {
        "sensors": {"channels": {"joint_position": {"sigma": 1e-3}}},
        "vehicle": {"arm": {"controller": {"kp": [40.0, 2.0]}}},
    }
    for commands, longest in (((swing, rest), 0.002), ((rest, swing), 0.01)):
        columns = {f"joint_position_cmd_{k + 1}": c for k, c in enumerate(commands)}
        given = Log(name="arm", columns={"t": time, **columns}, meta=meta)
        assert longest_step(given) == pytest.approx(longest, rel=0.1)


@pytest.mark.parametrize("kp", [None, "stiff", [1.0], [40.0, "2"], [[40.0], 2.0], [0.0, 0.0]])
def test_gains_that_fit_no_joints_weigh_all_alike(kp: object) -> None:
    """A log is thinned before its vehicle is checked: what is no list of gains does not matter."""
    time = 0.001 * np.arange(MANY)
    columns = {f"joint_position_cmd_{k}": 0.3 * k * np.sin(3.0 * time) for k in (1, 2)}
    meta = {"sensors": {"channels": {"joint_position": {"sigma": 1e-3}}}}
    alike = longest_step(Log(name="arm", columns={"t": time, **columns}, meta=meta))
    given = {**meta, "vehicle": {"arm": {"controller": {"kp": kp}}}}
    found = longest_step(Log(name="arm", columns={"t": time, **columns}, meta=given))
    assert found == alike
    assert 0.002 < found < 0.01


def test_logs_that_are_joined_keep_one_step() -> None:
    """Where the arm swings in one of two logs, both keep the rows that it asks for."""
    time = 0.001 * np.arange(MANY)
    still = np.zeros(MANY)
    logs = [
        Log(
            name=name,
            columns={"t": time, "position_x": still, "joint_position_cmd_1": way},
            meta={"vehicle": {"name": "arm"}},
        )
        for name, way in (("still", still), ("swung", np.sin(9.0 * time)))
    ]
    joined = join_logs(logs)
    steps = [np.diff(part.time) for part in joined.segments()]
    assert [float(np.median(x)) for x in steps] == pytest.approx([0.002, 0.002])


def test_quaternions_may_change_their_sign() -> None:
    """The attitude is smoothed as the rotation that it is."""
    angle = 0.3 * np.sin(0.01 * np.arange(MANY))
    sign = np.where(np.arange(MANY) % 7 < 3, -1.0, 1.0)
    given = log(orientation_w=sign * np.cos(angle / 2), orientation_z=sign * np.sin(angle / 2),
                orientation_x=np.zeros(MANY), orientation_y=np.zeros(MANY))  # fmt: skip
    given.meta["sensors"]["channels"]["orientation"] = {"sigma": 1e-3}
    found = decimated(given, MANY)
    turned = 2.0 * np.arctan2(found.columns["orientation_z"], found.columns["orientation_w"])
    turned = np.angle(np.exp(1j * turned))
    assert turned[1:-1] == pytest.approx(angle[::4][1:-1], abs=1e-6)
