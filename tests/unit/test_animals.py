"""The animals that ship: files that belong together, legs that reach, objects that move."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from seals.api import make
from seals.check.robot import Verdict, check_robot
from seals.errors import ConfigError, RobotError
from seals.multibody.tree import forward
from seals.plugins.controllers.walking.anatomy import Anatomy, anatomy_of
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.run.build import run_settings
from seals.run.settings import RunSettings

MADE = {"crab": 18, "sea_spider": 24}
ALLOWED = {"crab": set(), "sea_spider": {"links without collision"}}
"""Remarks that are meant: a sea spider touches with toes and trunk alone."""


def run_of(name: str, *more: str) -> RunSettings:
    """Return the settings of a run with an animal."""
    return run_settings([f"robot={name}", *more])


def toes(robot: RobotModel, joints: np.ndarray) -> np.ndarray:
    """Return the places of all toes in body axes by forward kinematics."""
    origins, turns = forward(robot.tree, np.zeros((1, 3)), np.eye(3)[None], joints[None])
    legs = robot.legs.values()
    return np.array([origins[0, leg.foot] + turns[0, leg.foot] @ leg.toe for leg in legs])


@pytest.mark.parametrize(("name", "joints"), MADE.items())
def test_check_finds_nothing(name: str, joints: int) -> None:
    """The robot's own check has no fault, and no remark that is not meant."""
    settings = run_of(name)
    findings = check_robot(settings.robot, settings.actuators)
    bad = [str(f) for f in findings if f.verdict is not Verdict.OK]
    assert [line for line in bad if not any(word in line for word in ALLOWED[name])] == []
    assert build_robot(settings.robot).tree.joints == joints


@pytest.mark.parametrize("name", MADE)
def test_zero_is_a_stance(name: str) -> None:
    """With all joints at zero every toe has the same height, and they stand around the mass."""
    robot = build_robot(run_of(name).robot)
    places = toes(robot, np.zeros(robot.tree.joints))
    assert np.ptp(places[:, 2]) < 1e-4
    assert places[0, 2] < -0.015
    spread = np.abs(places[:, 1]).min()
    assert spread > 0.03
    # left and right mirror each other
    half = len(places) // 2
    assert places[:half, [0, 2]] == pytest.approx(places[half:, [0, 2]], abs=1e-5)
    assert places[:half, 1] == pytest.approx(-places[half:, 1], abs=1e-5)


@pytest.mark.parametrize("name", MADE)
def test_angles_put_the_toes_where_they_are_asked(name: str) -> None:
    """Inverse and forward kinematics agree for places that the legs can reach."""
    robot = build_robot(run_of(name).robot)
    legs = anatomy_of(robot)
    columns = legs.joints.astype(int)
    rng = np.random.default_rng(0)
    same = []
    for _ in range(200):
        joints = rng.uniform(0.8 * robot.lower, 0.8 * robot.upper)
        places = toes(robot, joints)
        again = np.zeros_like(joints)
        again[columns] = legs.angles(places)
        # a toe drawn in under its own hip may be reached by the leg's other side
        out = np.einsum("nj,nj->n", legs.basis[:, 0], places - legs.hip) > 0.012
        assert toes(robot, again)[out] == pytest.approx(places[out], abs=2e-6)
        same += [float(x) for x in np.abs(again - joints)[columns][out].max(axis=1)]
    # by the same pose, not by a mirrored knee
    assert len(same) > 600
    assert max(same) < 1e-3


def test_toes_out_of_reach_keep_the_joints_within_their_limits() -> None:
    """A leg that cannot reach stretches as far as its joints go."""
    robot = build_robot(run_of("crab").robot)
    legs = anatomy_of(robot)
    for place in (10.0, -10.0, 0.0):
        angles = legs.angles(np.full((6, 3), place))
        assert np.isfinite(angles).all()
        assert (angles >= legs.lower - 1e-12).all()
        assert (angles <= legs.upper + 1e-12).all()


def test_sides_and_ranks_of_the_legs() -> None:
    """Legs are counted from the front on either side."""
    legs: Anatomy = anatomy_of(build_robot(run_of("sea_spider").robot))
    assert legs.side.tolist() == [0, 0, 0, 0, 1, 1, 1, 1]
    assert legs.rank.tolist() == [0, 1, 2, 3, 0, 1, 2, 3]


def test_a_gait_refuses_a_robot_without_legs() -> None:
    """The refusal says how legs are named."""
    with pytest.raises(ConfigError, match="has no legs, so it cannot have a gait"):
        make(["robot=aam", "controller=gait", "guide=freeze"])


def test_a_gait_refuses_legs_of_another_build() -> None:
    """Legs of two joints, and hinges that are not parallel, are refused by name."""
    settings = run_of("crab").robot
    legs = {name: dataclasses.replace(leg) for name, leg in settings.legs.items()}
    legs["left_1"].joints = legs["left_1"].joints[:2]
    with pytest.raises(ConfigError, match="leg 'left_1' has 2 joints"):
        anatomy_of(build_robot(dataclasses.replace(settings, legs=legs)))
    legs["left_1"].joints = ["left_1_lift", "left_1_hip", "left_1_bend"]
    with pytest.raises(ConfigError, match="needs the second and the third axis parallel"):
        anatomy_of(build_robot(dataclasses.replace(settings, legs=legs)))


def test_legs_name_joints_and_feet_that_exist() -> None:
    """A wrong foot and a toe of two numbers are refused with what is there."""
    settings = run_of("crab").robot
    leg = settings.legs["left_1"]
    wrong = {"left_1": dataclasses.replace(leg, foot="left_1_dactil")}
    with pytest.raises(RobotError, match="left_1_dactyl"):
        build_robot(dataclasses.replace(settings, legs=wrong))
    flat = {"left_1": dataclasses.replace(leg, toe=[0.0, 0.1])}
    with pytest.raises(RobotError, match="is not a position"):
        build_robot(dataclasses.replace(settings, legs=flat))
