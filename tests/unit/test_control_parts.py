"""Parts of the controllers: live mass, attitude, lags, reach, limbs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.api import load_robot
from seals.control import Reference
from seals.control.attitude import attitude_error, lean_for
from seals.control.filters import Lag
from seals.control.limbs import Reckoned, joint_targets, stowed, way_of
from seals.control.mass_properties import MassPropertyEstimator
from seals.control.tracking import minimum_jerk
from seals.errors import ConfigError, RobotError
from seals.frames import exponential, matrix_of, quaternion_of
from seals.multibody.tree import forward
from seals.robot.limbs import build_arms, build_grippers
from seals.robot.model import RobotModel
from seals.robot.settings import ArmSettings, GripperSettings
from seals.run.build import run_settings

STEP = 1e-6


def robot_of(name: str) -> RobotModel:
    """Build an installed robot."""
    return load_robot(name)


def placed(robot: RobotModel, q: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
    """Centres of mass and rotations of all links, base at the origin."""
    origins, turns = forward(robot.tree, np.zeros((1, 3)), np.eye(3)[None], q[None])
    return origins[0] + np.einsum("lij,lj->li", turns[0], robot.centre), turns[0]


@pytest.mark.parametrize("name", ["free_arm", "aam", "pendulum"])
def test_live_mass_properties_are_those_of_the_links_one_by_one(name: str) -> None:
    """Centre, inertia, their change and the joints' momentum agree with sums over the links."""
    robot, rng = robot_of(name), np.random.default_rng(5)
    q, rate = rng.uniform(-0.6, 0.6, robot.tree.joints), rng.normal(size=robot.tree.joints)
    live = MassPropertyEstimator(robot).at(q)
    place, turn = placed(robot, q)
    ahead, behind = placed(robot, q + STEP * rate), placed(robot, q - STEP * rate)
    mass = robot.mass.sum()
    centre = robot.mass @ place / mass
    inertia, momentum = np.zeros((3, 3)), np.zeros(3)
    for k in range(len(robot.links)):
        r, own = place[k] - centre, turn[k] @ robot.inertia[k] @ turn[k].T
        inertia += own + robot.mass[k] * (r @ r * np.eye(3) - np.outer(r, r))
        velocity = (ahead[0][k] - behind[0][k]) / (2.0 * STEP)
        spin = (ahead[1][k] - behind[1][k]) / (2.0 * STEP) @ turn[k].T
        momentum += own @ [spin[2, 1], spin[0, 2], spin[1, 0]]
        momentum += robot.mass[k] * np.cross(r, velocity)
    assert live.mass == pytest.approx(mass)
    np.testing.assert_allclose(live.centre, centre, atol=1e-12)
    np.testing.assert_allclose(live.inertia, inertia, atol=1e-12)
    moved = robot.mass @ (ahead[0] - behind[0]) / mass / (2.0 * STEP)
    np.testing.assert_allclose(live.centre_map @ rate, moved, atol=1e-8)
    np.testing.assert_allclose(live.momentum_map @ rate, momentum, atol=1e-8)


def test_a_lean_pushes_along_the_wanted_force_with_the_wanted_heading() -> None:
    """The z axis lies along the force; body x points to the heading; a pull leans the other way."""
    force = np.array([2.0, -1.0, 9.0])
    lean = lean_for(force, 0.7, tilt=1.0, least=1.0)
    np.testing.assert_allclose(lean[:, 2], force / np.linalg.norm(force))
    np.testing.assert_allclose(lean.T @ lean, np.eye(3), atol=1e-14)
    assert np.arctan2(lean[1, 0], lean[0, 0]) == pytest.approx(0.7, abs=0.06)
    np.testing.assert_allclose(
        lean_for(-force, 0.0, tilt=1.0, least=1.0)[:, 2], force / np.linalg.norm(force)
    )
    flat = lean_for(np.array([5.0, 0.0, 1e-9]), 0.0, tilt=1.0, least=1.0)
    assert flat[2, 2] == pytest.approx(1.0)


def test_a_lean_stops_at_the_largest() -> None:
    """However far aside the force points, the robot leans no further than allowed."""
    lean = lean_for(np.array([50.0, 0.0, 5.0]), 0.0, tilt=0.4, least=1.0)
    assert np.arccos(lean[2, 2]) == pytest.approx(0.4)


@pytest.mark.parametrize("angle", [1e-4, 0.5, 2.0, 3.1])
def test_the_attitude_error_is_the_rotation_vector(angle: float) -> None:
    """From small turns to nearly upside down the error grows with the angle."""
    axis = np.array([0.36, 0.48, 0.8])
    turn = matrix_of(exponential(angle * axis[None]))[0]
    np.testing.assert_allclose(attitude_error(turn, np.eye(3)), angle * axis, rtol=1e-9)
    flipped = np.diag([1.0, -1.0, -1.0])
    assert np.linalg.norm(attitude_error(flipped, np.eye(3))) == pytest.approx(np.pi)


def test_a_quaternion_comes_back_from_its_matrix() -> None:
    """Matrix to quaternion and back, near every axis and near half a turn."""
    rng = np.random.default_rng(0)
    for q in [*rng.normal(size=(50, 4)), *np.eye(4), [1.0, 1e-9, 0.0, 0.0]]:
        unit = np.asarray(q) / np.linalg.norm(q)
        found = quaternion_of(matrix_of(unit[None])[0])
        np.testing.assert_allclose(found * np.sign(found @ unit), unit, atol=1e-12)


def test_quickened_drives_settle_as_much_faster() -> None:
    """A lag of 50 ms made three times as quick reaches 1 - 1/e after 50/3 ms, up and down."""
    lag, bounds = Lag(np.array([0.05]), np.array([0.08])), (np.array([0.0]), np.array([1e4]))
    for start, goal in ((100.0, 110.0), (110.0, 100.0)):
        state = np.array([start])
        for _ in range(1000):
            command = lag.quickened(np.array([goal]), state, 3.0, bounds)
            state = lag.followed(state, command, 0.05 / 3.0 / 1000.0)
        assert (state[0] - start) / (goal - start) == pytest.approx(1.0 - np.exp(-1.0), abs=1e-3)


def test_reckoned_joints_lag_and_keep_to_their_speed() -> None:
    """The motion reckoned from targets lags by the servo's time and never outruns its speed."""
    arm = Reckoned(np.zeros(1), np.zeros(1))
    arm = arm.next(np.array([0.1]), way_of(np.array([0.05]), 0.05), 100.0, 0.05)
    assert arm.position[0] == pytest.approx(0.1 * (1.0 - np.exp(-1.0)))
    fast = Reckoned(np.zeros(1), np.zeros(1)).next(
        np.array([9.0]), way_of(np.array([0.05]), 0.01), 6.0, 0.01
    )
    assert fast.rate[0] == 6.0
    assert fast.position[0] == pytest.approx(0.06)


def test_targets_keep_what_the_aim_leaves_out_and_stay_within_limits() -> None:
    """Arms and grippers that an aim does not name keep theirs; values beyond limits are held."""
    robot = robot_of("aam")
    rest = stowed(robot)
    arm, gripper = robot.arms["arm"], robot.grippers["gripper"]
    np.testing.assert_allclose(rest[list(arm.joints)], arm.stowed)
    np.testing.assert_allclose(rest[list(gripper.joints)], gripper.open)
    aim = Reference(joints={"arm": np.array([9.0, 0.0, 0.0])}, grip={"gripper": 1.0})
    found = joint_targets(aim, rest, robot)
    assert found[arm.joints[0]] == robot.upper[arm.joints[0]]
    np.testing.assert_allclose(found[list(gripper.joints)], gripper.closed)
    np.testing.assert_allclose(joint_targets(Reference(), found, robot), found)


def test_an_aim_for_a_limb_that_is_not_there_is_refused() -> None:
    """The refusal names the nearest arm."""
    robot = robot_of("aam")
    with pytest.raises(ConfigError, match=r"no arm 'amr'\.\nDid you mean 'arm'"):
        joint_targets(Reference(joints={"amr": np.zeros(3)}), stowed(robot), robot)


def test_limbs_with_unknown_parts_are_refused_with_the_nearest_name() -> None:
    """Unknown joints, links and wrong numbers of values are refused in words."""
    links, joints = ["body", "palm"], ["shoulder", "elbow"]
    arm = ArmSettings(joints=["sholder"], tool="palm")
    with pytest.raises(RobotError, match=r"robot.arms.a.joints: .*'sholder'.*\n.*'shoulder'"):
        build_arms({"a": arm}, links, joints)
    with pytest.raises(RobotError, match=r"robot.arms.a.tool: .*'plam'.*\n.*'palm'"):
        build_arms({"a": ArmSettings(joints=["elbow"], tool="plam")}, links, joints)
    hand = GripperSettings(joints=["elbow"], open=[0.0, 1.0], closed=[0.0])
    with pytest.raises(RobotError, match=r"robot.grippers.g.open=\[0.0, 1.0\] has 2 values"):
        build_grippers({"g": hand}, links, joints)


def test_a_way_of_least_jerk_starts_and_ends_at_rest() -> None:
    """Velocity and acceleration vanish at both ends; the velocity is the slope of the place."""
    a, b = np.array([0.0, 1.0, 2.0]), np.array([1.0, -1.0, 2.5])
    for time in (0.0, 3.0):
        place = minimum_jerk(a, b, 3.0, time)
        assert np.abs(place.velocity).max() < 1e-12
        assert np.abs(place.acceleration).max() < 1e-12
    ahead, behind = (minimum_jerk(a, b, 3.0, 1.0 + d) for d in (STEP, -STEP))
    here = minimum_jerk(a, b, 3.0, 1.0)
    np.testing.assert_allclose((ahead.position - behind.position) / (2 * STEP), here.velocity)
    np.testing.assert_allclose(
        (ahead.velocity - behind.velocity) / (2 * STEP), here.acceleration, rtol=1e-6
    )


def test_the_controller_section_of_a_robot_gives_way_to_the_command_line(tmp_path: Path) -> None:
    """Gains of robot.yaml are used, and single ones can be overridden."""
    folder = Path(run_settings(["robot=crazyflie"]).robot.folder)
    for name in ("robot.yaml", "crazyflie.urdf"):
        (tmp_path / name).write_text((folder / name).read_text(encoding="utf-8"), encoding="utf-8")
    with (tmp_path / "robot.yaml").open("a", encoding="utf-8") as file:
        file.write("controller: {controller: cascade, torque_lead: 0.01, quicker: 2.0}\n")
    chosen = [f"robot={tmp_path}", "guide=hover"]
    assert run_settings(chosen).controller.torque_lead == 0.01
    assert run_settings([*chosen, "controller.quicker=4"]).controller.quicker == 4.0
