"""Rotors, thrusters and servos: their maps, their lists, their columns among all drives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from seals.arrays import Array
from seals.config.build import build
from seals.config.compose import compose
from seals.effects import Effect, bind_effects
from seals.effects.evaluation import thrust_wrench
from seals.errors import ConfigError
from seals.motion import Inputs, Joints
from seals.plugins.actuators.rotors import Rotors
from seals.plugins.actuators.servos import Servos
from seals.plugins.actuators.thrusters import Thrusters

PAIR: dict[str, Any] = {
    "position": [[0.1, -0.2, 0.0], [-0.1, 0.2, 0.0]],
    "thrust_coefficient": [1e-5, 2e-5],
    "torque_coefficient": [1e-7],
}


def params(effect: Effect, batch: int = 1, **values: Array) -> Any:
    """Return the parameter arrays of one effect, some of them batched."""
    bound = bind_effects({"it": effect}, ["base"])
    given = {f"it.{name}": value for name, value in values.items()}
    return bound.with_values(given, np.zeros(1), batch).bound[0].params


def inputs(drive: Any = None, command: Any = None) -> Inputs:
    """Return inputs with drive states or joint commands alone."""
    drive = None if drive is None else np.asarray(drive, dtype=float)
    return Inputs(0.004, np.zeros((1, 1)), drive, None, command)


def test_thrust_and_reaction_grow_with_the_square_of_the_speed() -> None:
    """500 and 1000 rad/s give 2.5 N and 20 N, and reactions against the sense of rotation."""
    rotors = Rotors(direction=[1.0, -1.0], **PAIR)
    found = Rotors.drives(inputs([[500.0, 1000.0]]), params(rotors))
    assert_allclose(found.thrust, [[2.5, 20.0]], rtol=1e-14)
    assert_allclose(found.torque, [[-0.025, 0.1]], rtol=1e-14)
    assert_allclose(found.axis, [[0.0, 0.0, 1.0]] * 2)
    assert_allclose(found.radius, [0.12, 0.12])


def test_the_wrench_of_two_rotors_is_that_of_their_levers() -> None:
    """Forces add up; rolling and pitching moments are place times thrust; yaw is the reaction."""
    rotors = Rotors(direction=[1.0, -1.0], **PAIR)
    force, torque = thrust_wrench(Rotors.drives(inputs([[500.0, 1000.0]]), params(rotors)))
    assert force is not None
    assert torque is not None
    assert_allclose(force, [[0.0, 0.0, 22.5]], atol=1e-14)
    # (y, -x) T summed: -0.2 2.5 + 0.2 20 = 3.5 and -0.1 2.5 + 0.1 20 = 1.75
    assert_allclose(torque, [[3.5, 1.75, 0.075]], atol=1e-14)


def test_a_changed_torque_coefficient_changes_reactions_alone() -> None:
    """A change by 20 % in one row of a batch shows in its reaction, not in its thrust."""
    found = Rotors.drives(
        inputs([[500.0, 1000.0]]),
        params(Rotors(**PAIR), 2, torque_change=np.array([0.0, 0.2])),
    )
    assert_allclose(found.torque, [[-0.025, -0.1], [-0.03, -0.12]], rtol=1e-14)
    assert_allclose(found.thrust, [[2.5, 20.0]], rtol=1e-14)


def test_a_changed_thrust_coefficient_changes_thrusts_alone() -> None:
    """A change by 20 % in one row of a batch shows in its thrust, not in its reaction."""
    found = Rotors.drives(
        inputs([[500.0, 1000.0]]),
        params(Rotors(**PAIR), 2, thrust_change=np.array([0.0, 0.2])),
    )
    assert_allclose(found.thrust, [[2.5, 20.0], [3.0, 24.0]], rtol=1e-14)
    assert_allclose(found.torque, [[-0.025, -0.1]], rtol=1e-14)


def test_each_actuator_reads_its_own_columns() -> None:
    """Thrusters that come after two rotors start at the third column."""
    state = inputs([[500.0, 1000.0, 7.0, -3.0]])
    thrusters = Thrusters(
        position=[[0.0, 0.3, 0.0], [0.0, -0.3, 0.0]], axis=[[2.0, 0.0, 0.0]], first=2
    )
    jets = Thrusters.drives(state, params(thrusters))
    assert_allclose(jets.thrust, [[7.0, -3.0]])
    assert_allclose(jets.torque, 0.0)
    assert_allclose(jets.radius, 0.0)
    force, torque = thrust_wrench(jets)
    assert force is not None
    assert torque is not None
    assert_allclose(force, [[4.0, 0.0, 0.0]])
    assert_allclose(torque, [[0.0, 0.0, -3.0]], atol=1e-14)
    assert Rotors.drives(state, params(Rotors(**PAIR))).thrust.shape == (1, 2)


def test_one_number_stands_for_all_drives() -> None:
    """Lags and limits have one entry a drive, from a list of one or of all."""
    rotors = Rotors(time_constant=[0.05], max_speed=[900.0, 800.0], **PAIR)
    assert_allclose(rotors.lag, [0.05, 0.05])
    assert_allclose(rotors.limit, [900.0, 800.0])
    thrusters = Thrusters(position=[[0.0, 0.0, 0.0]] * 3, time_constant=[0.1, 0.2, 0.3])
    assert thrusters.count == 3
    assert_allclose(thrusters.lag, [0.1, 0.2, 0.3])
    assert_allclose(thrusters.limit, [50.0] * 3)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"radius": [0.1, 0.1, 0.1]}, r"rotors.radius=\[0.1, 0.1, 0.1\] has 3 numbers"),
        ({"thrust_coefficient": [0.0]}, "finite and positive"),
        ({"time_constant": [-0.1]}, "finite and not negative"),
        ({"torque_coefficient": [float("nan")]}, "rotors.torque_coefficient"),
        ({"direction": [0.5]}, "1 or -1 for each"),
        ({"axis": [[0.0, 0.0, 0.0]]}, "axis of no length"),
        ({"position": [[0.0, 0.0], [1.0, 0.0]]}, "rows of three numbers"),
        ({"position": []}, "rows of three numbers"),
        ({"axis": [[0.0, 0.0, 1.0]] * 3}, "one for each of 2 drives"),
        ({"position": [[0.0, 0.0, float("inf")]] * 2}, "finite numbers"),
        ({"first": -1}, "0 to 10,000"),
    ],
)
def test_lists_that_fit_no_rotors_are_refused(values: dict[str, Any], words: str) -> None:
    """Each refusal names the list and what is allowed."""
    with pytest.raises(ConfigError, match=words):
        Rotors(**{**PAIR, **values})


def test_rotors_come_out_of_a_configuration() -> None:
    """An actuator composes by name and is built with its lists."""
    cfg = compose(
        [
            "robot=ball",
            "+actuator@actuators.up=rotors",
            "actuators.up.position=[[0.1,0.0,0.0],[-0.1,0.0,0.0]]",
        ]
    )
    assert build(cfg.actuators.up, where="actuators.up").count == 2


def test_a_servo_pulls_toward_its_command_up_to_its_limit() -> None:
    """9 (0.5 - 0.4) - 0.2 0.5 = 0.8 N m; a far command gives the limit of either sign."""
    servos = params(Servos(kp=9.0, kd=0.2, torque_limit=2.5))
    joints = Joints(np.array([[0.4, 0.0, 0.0]]), np.array([[0.5, 0.0, 0.0]]))
    command = np.array([[0.5, 1.0, -1.0]])
    torque, memory = Servos.joint_loads(joints, inputs(command=command), None, servos)
    assert_allclose(torque, [[0.8, 2.5, -2.5]], rtol=1e-14)
    assert memory is None


def test_a_servo_without_a_command_is_limp() -> None:
    """No command, no torque, moving or not."""
    joints = Joints(np.array([[0.4]]), np.array([[0.5]]))
    torque, _ = Servos.joint_loads(joints, inputs(), None, params(Servos()))
    assert_allclose(torque, 0.0)
