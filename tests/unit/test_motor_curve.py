"""Motor commands of autopilots as rotor speeds, and rotor speeds against the weight."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.check import check_log
from seals.logs.log import Log
from seals.logs.motor_curve import (
    MotorCurve,
    motor_curve,
    recognised,
    with_rotor_speeds,
    with_thruster_forces,
)

FULL = 900.0
ROTORS: list[dict[str, Any]] = [
    {
        "max_speed": FULL,
        "thrust_coefficient": 1e-5,
        "axis": [0.0, 0.0, 1.0],
        "position": [x, y, 0.0],
        "direction": 1.0,
        "torque_coefficient": 1e-7,
        "time_constant": 0.03,
        "radius": 0.1,
    }
    for x, y in ((0.1, -0.1), (-0.1, 0.1), (0.1, 0.1), (-0.1, -0.1))
]


def _log(values: Any, **columns: Any) -> Log:
    rows = np.atleast_2d(np.asarray(values, dtype=float))
    named = {f"motor_pwm_{k + 1}": rows[:, k] for k in range(rows.shape[1])}
    return Log(name="a", columns={"t": 0.01 * np.arange(len(rows)), **named, **columns})


def _speeds(values: Any, curve: MotorCurve, **columns: Any) -> Any:
    log, _ = with_rotor_speeds(_log(values, **columns), curve, ROTORS)
    return log.channel("rotor_speed_cmd")


def test_kinds_of_commands_are_told_by_their_values() -> None:
    """Shares, per cent, pulse widths and DShot each; a range that fits two is refused."""
    assert recognised(np.array([[0.0, 0.61]])) == "speed_share"
    assert recognised(np.array([[0.0, 0.61]]), "thrust_share") == "thrust_share"
    assert recognised(np.array([[0.0, 61.0]])) == "percent"
    assert recognised(np.array([[1000.0, 1612.5]])) == "pwm"
    assert recognised(np.array([[0.0, 48.0, 1100.0]])) == "dshot"
    with pytest.raises(LogError, match=r"motors\.command="):
        recognised(np.array([[0.0, 31000.0]]))


def test_each_kind_of_command_becomes_a_speed() -> None:
    """Half of the range, by the law of each kind."""
    half = [0.5] * 4
    assert _speeds(half, MotorCurve(command="thrust_share"))[0] == pytest.approx(
        FULL / math.sqrt(2)
    )
    assert _speeds(half, MotorCurve(command="speed_share"))[0] == pytest.approx(FULL / 2)
    assert _speeds([1500.0] * 4, MotorCurve(command="pwm"))[0] == pytest.approx(FULL / 2)
    between = MotorCurve(command="pwm", range=[1100, 1900])
    assert _speeds([1300.0] * 4, between)[0] == pytest.approx(FULL / 4)
    assert _speeds([1047.5] * 4, MotorCurve(command="dshot"))[0] == pytest.approx(FULL / 2)
    assert _speeds([6000.0] * 4, MotorCurve(command="rpm"))[0] == pytest.approx(200 * math.pi)
    points = MotorCurve(command="percent", points=[[0, 0], [0.5, 700], [1, 800]])
    assert _speeds([75.0] * 4, points)[0] == pytest.approx(750.0)
    mixed = MotorCurve(command="speed_share", thrust_factor=0.3)
    thrust = 0.3 * 0.25 + 0.7 * 0.5
    assert _speeds(half, mixed)[0] == pytest.approx(FULL * math.sqrt(thrust))


def test_voltage_and_order_of_the_motors() -> None:
    """A battery at three quarters turns three quarters as fast; rotor 1 by the motor stated."""
    curve = MotorCurve(command="speed_share", full_voltage=16.0, order=[3, 1, 4, 2])
    log = _log([[0.1, 0.2, 0.3, 0.4]] * 3, battery_voltage=[12.0, np.nan, 8.0])
    made, said = with_rotor_speeds(log, curve, ROTORS)
    speeds = made.channel("rotor_speed_cmd")
    assert speeds[0] == pytest.approx(np.array([0.3, 0.1, 0.4, 0.2]) * FULL * 0.75)
    assert speeds[1] == pytest.approx(np.array([0.3, 0.1, 0.4, 0.2]) * FULL * 0.625)
    assert any("motors 3, 1, 4, 2" in words for words in said)
    with pytest.raises(LogError, match="battery_voltage"):
        _speeds([0.5] * 4, curve)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"comand": "pwm"}, "Did you mean 'command'"),
        ({"command": "pwms"}, "Did you mean 'pwm'"),
        ({"range": [2000, 1000]}, "low,high"),
        ({"points": [[0, 0], [1, -5]]}, "increasing"),
        ({"thrust_factor": 3}, "0 to 1"),
        ({"order": [1, 2]}, "motors.order"),
        ({"order": [1, 2, 3, 9]}, "motors.order"),
        ({"points": "all"}, "a list of lists of 2 finite numbers"),
    ],
)
def test_wrong_curves_are_refused(entry: dict[str, Any], words: str) -> None:
    """Each mistake of a data sheet is refused with what is allowed."""
    with pytest.raises(LogError, match=words):
        _speeds([0.5] * 4, motor_curve(entry))


def _hover(unit: float, mass: float) -> dict[str, str]:
    speed = math.sqrt(1.2 * 9.81 / 4e-5)
    noise = np.random.default_rng(2).normal(0.0, 0.05, 400)
    columns = {f"rotor_speed_cmd_{k}": np.full(400, speed * unit) for k in (1, 2, 3, 4)}
    columns |= {"t": 0.01 * np.arange(400), "specific_force_z": 9.81 + noise}
    found = check_log(Log(name="a", columns=columns), {"mass": mass, "rotors": ROTORS})
    return {finding.code: f"{finding.severity.value} {finding.message}" for finding in found}


def test_rpm_given_as_rad_per_second_are_found_by_the_weight() -> None:
    """Thrust 91 times the weight is told as rpm and refused; one half too much as a wrong mass."""
    assert not {"unit_rotor_speed", "thrust_unlike_weight"} & _hover(1.0, 1.0).keys()
    told = _hover(60.0 / (2.0 * math.pi), 1.2)["unit_rotor_speed"]
    assert told.startswith("refuse")
    assert "motors.command=rpm" in told
    assert _hover(1.0, 0.8)["thrust_unlike_weight"].startswith("warn")


THRUSTERS: list[dict[str, Any]] = [{"max_force": 30.0}, {"max_force": 20.0}]


def _forces(values: Any, curve: MotorCurve, **meta: Any) -> Any:
    log = _log(values)
    log.meta.update(meta)
    return with_thruster_forces(log, curve, THRUSTERS)[0].channel("thruster_cmd")


def test_pulses_of_thrusters_become_forces_both_ways() -> None:
    """1100 to 1900 us by the square or a share of it; a table with a dead zone; other ranges."""
    square = _forces([[1500.0, 1900.0], [1300.0, 1700.0]], MotorCurve())
    np.testing.assert_allclose(square, [[0.0, 20.0], [-7.5, 5.0]])
    mixed = _forces([[1700.0, 1300.0]], MotorCurve(thrust_factor=0.4))
    np.testing.assert_allclose(mixed, [[30.0 * (0.1 + 0.3), -20.0 * (0.1 + 0.3)]])
    table = [[-1, -40], [-0.1, 0], [0.1, 0], [0.5, 8], [1, 50]]
    held = _forces([[1520.0, 1480.0], [1620.0, 1100.0]], MotorCurve(points=table))
    np.testing.assert_allclose(held, [[0.0, 0.0], [4.0, -40.0]])
    shares = _forces([[0.5, -1.0]], MotorCurve(command="thrust_share"))
    np.testing.assert_allclose(shares, [[15.0, -20.0]])
    wide = MotorCurve(range=[1000, 2000])
    np.testing.assert_allclose(_forces([[2000.0, 1500.0]], wide), [[30.0, 0.0]])


def test_thrusters_are_ordered_and_turned_about() -> None:
    """By the log's own directions, which the command line overrides; other counts are refused."""
    pulses = [[1900.0, 1500.0, 1100.0]]
    swapped = MotorCurve(order=[3, 1])
    np.testing.assert_allclose(_forces(pulses, swapped), [[-30.0, 20.0]])
    np.testing.assert_allclose(_forces(pulses, swapped, motor_reverse=[3]), [[30.0, 20.0]])
    chosen = MotorCurve(order=[3, 1], reverse=[1])
    np.testing.assert_allclose(_forces(pulses, chosen, motor_reverse=[3]), [[-30.0, -20.0]])
    with pytest.raises(LogError, match=r"the robot 2 thrusters[\s\S]*motors\.order="):
        _forces([[1500.0]], MotorCurve())
    with pytest.raises(LogError, match="drives no thrusters"):
        _forces(pulses, MotorCurve(command="rpm"))
    with pytest.raises(LogError, match="not an increasing curve"):
        MotorCurve(points=[[-1, 5], [1, -5]])
