"""Joints that stand still make a robot one body, in the posture that was measured."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.logs.log import Log
from seals.sysid.data.robot_description import describe_robot
from seals.sysid.data.samples import Samples, _followed
from seals.sysid.data.standing import joints_at_rest, still_joints
from seals.sysid.data.vehicle import read_vehicle

SIGMA = 1e-3
META: dict[str, Any] = {
    "environment": {"water_level": 0.0},
    "sensors": {"channels": {"position": {"sigma": 1e-3}, "joint_position": {"sigma": SIGMA}}},
}


def _log(swing: float) -> Log:
    rng, time = np.random.default_rng(3), np.arange(0.0, 4.0, 0.01)
    joints = np.array([0.7, -0.4]) + SIGMA * rng.standard_normal((time.size, 2))
    joints[:, 1] += swing * np.sin(3.0 * time)
    columns = {f"joint_position_{k + 1}": joints[:, k] for k in range(2)}
    return Log(name="held", columns={"t": time, **columns}, meta=META)


def test_noise_is_no_motion() -> None:
    """A motion of a few times the noise is one, of one joint is enough."""
    robot = describe_robot("free_arm")
    stands = still_joints(_log(0.5 * SIGMA), robot, errors=3.0)
    assert list(stands) == list(robot.listed)
    assert list(stands.values()) == pytest.approx([0.7, -0.4], abs=2e-4)
    assert still_joints(_log(4.0 * SIGMA), robot, errors=3.0) == {}
    # an arm that swings within its noise shakes the base all the same
    assert still_joints(_log(1.2 * SIGMA), robot, errors=3.0) == {}
    assert still_joints(_log(0.0), None, errors=3.0) == {}


def test_a_robot_that_holds_still_is_one_body_in_its_posture() -> None:
    """No joint is left, and the mass hangs elsewhere than with the joints at zero."""
    robot = describe_robot("free_arm")
    held = read_vehicle(META, robot, still=still_joints(_log(0.0), robot, errors=3.0))
    moving = read_vehicle(META, robot)
    assert held.robot.tree.joints == 0
    assert moving.robot.tree.joints == 2
    assert held.mass == pytest.approx(moving.mass)
    assert not held.columns
    stowed = read_vehicle({**META, "sensors": {"channels": {"position": {"sigma": 1e-3}}}}, robot)
    shift = _centre(held.robot) - _centre(stowed.robot)
    assert np.linalg.norm(shift) > 1e-3


@pytest.mark.parametrize(
    ("swing", "step", "rest"), [(1.2, 0.0, {1, 2}), (4.0, 0.0, {1}), (0.0, 9.0, {1})]
)
def test_effects_of_joints_that_show_noise_alone_are_not_searched(
    swing: float, step: float, rest: set[int]
) -> None:
    """A joint that is told to move and does not may be stuck: that one stays."""
    log = _log(swing * SIGMA)
    measured = np.stack([log.columns[f"joint_position_{k}"] for k in (1, 2)], axis=1)
    command = np.zeros_like(measured)
    command[200:, 1] = step * SIGMA
    samples = Samples(
        time=log.columns["t"],
        step=0.01,
        runs=(),
        channels={"joint_position": measured},
        command=np.zeros((400, 0)),
        voltage=None,
        joint_command=command,
    )
    assert joints_at_rest(samples, SIGMA, quiet=2.0) == rest


def test_a_servo_of_limited_speed_follows_a_jump_along_a_ramp() -> None:
    """Means of the ramp between rows; a simulated servo moves at the start of each of its steps."""
    time = 0.1 * np.arange(6)
    command, speed = np.array([[0.0], [1.0], [1.0], [1.0], [0.0], [0.0]]), np.array([4.0])
    # 0.4 a row, the last 0.2 in half of one
    ramp = np.array([0.0, 0.2, 0.6, 0.95, 0.8, 0.4])
    assert _followed(command, time, speed, None)[:, 0] == pytest.approx(ramp, abs=2e-3)
    ahead = _followed(command, time, speed, 0.025)[:, 0]
    assert ahead[:3] - ramp[:3] == pytest.approx([0.0, 0.05, 0.05])  # half of 4.0 x 0.025
    slow = np.array([[0.0], [0.3], [0.6], [0.6], [0.6], [0.6]])
    assert _followed(slow, time, speed, None) is slow


def test_commands_of_a_run_begin_with_the_run() -> None:
    """Rows know the first row of their run, the earliest whose command may still act."""
    samples = Samples(
        time=np.arange(5.0),
        step=1.0,
        runs=((0, 2), (2, 5)),
        channels={},
        command=np.zeros((5, 0)),
        voltage=None,
        joint_command=np.zeros((5, 0)),
    )
    assert samples.begins.tolist() == [0, 0, 2, 2, 2]


def test_a_servo_does_not_move_from_one_run_to_the_next() -> None:
    """Where time goes back it starts at its command; over a gap of one run it goes on."""
    command, speed = np.array([[0.0], [0.0], [1.0], [1.0]]), np.array([4.0])
    other = _followed(command, np.array([0.0, 0.1, 0.0, 0.1]), speed, None)
    assert other[:, 0].tolist() == [0.0, 0.0, 1.0, 1.0]
    gap = _followed(command, np.array([0.0, 0.1, 0.302, 0.402]), speed, None)
    # 0.4 in the unseen 0.1 s, then along the ramp
    assert gap[:, 0] == pytest.approx([0.0, 0.0, 0.6, 0.95], abs=5e-3)


def _centre(robot: Any) -> Any:
    origins = np.array([[0.0, 0.0, 0.0], *robot.tree.origin[1:]])
    turns = robot.tree.rotation
    place = [origins[0] + robot.centre[0]]
    seen = {0: (origins[0], np.eye(3))}
    for k in range(1, len(robot.links)):
        at, turn = seen[robot.tree.parent[k]]
        seen[k] = (at + turn @ origins[k], turn @ turns[k])
        place.append(seen[k][0] + seen[k][1] @ robot.centre[k])
    return np.average(place, axis=0, weights=robot.mass)
