"""Four legs that hang straight at zero: geometry, forces of the feet, trot and crawl."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from seals.api import load_robot
from seals.config.compose import compose
from seals.control import RobotState
from seals.learn.metadata import world_config
from seals.multibody.tree import forward
from seals.plugins.controllers.walking.anatomy import Anatomy, anatomy_of
from seals.plugins.controllers.walking.pattern import Pattern, duty_of, phases_of
from seals.plugins.controllers.walking.walker import LIGHT, Support
from seals.robot.limbs import standing
from seals.robot.model import RobotModel
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.scaffold.robot import scaffold_robot

VEHICLES = Path(__file__).with_name("urdfs") / "vehicles"
FILES = ["quadruped.xml", "quadruped.urdf"]


class Taken(NamedTuple):
    """Folder of a robot that was taken over, and what was read from it."""

    folder: Path
    robot: RobotModel
    legs: Anatomy


@pytest.fixture(params=FILES, scope="module")
def taken(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Taken:
    """Take a quadruped over."""
    parent = tmp_path_factory.mktemp("quadruped")
    folder = scaffold_robot("mine", VEHICLES / request.param, parent=parent).folder
    robot = load_robot(folder)
    return Taken(folder, robot, anatomy_of(robot))


def toes(robot: RobotModel, joints: np.ndarray) -> np.ndarray:
    """Return the places of the toes in body axes by the robot's own kinematics."""
    origins, turns = forward(robot.tree, np.zeros((1, 3)), np.eye(3)[None], joints[None])
    return np.array(
        [origins[0, leg.foot] + turns[0, leg.foot] @ leg.toe for leg in robot.legs.values()]
    )


def test_angles_and_jacobian_are_those_of_the_tree(taken: Taken) -> None:
    """Joint values come back from the toes that they place; columns are differences of places."""
    robot, legs, rng = taken.robot, taken.legs, np.random.default_rng(4)
    columns, stands = legs.joints.astype(int), standing(robot.legs, robot.tree.joints)
    assert legs.angles(legs.toe) == pytest.approx(stands[columns], abs=1e-6)
    step = 1e-6
    for _ in range(20):
        joints = stands + rng.uniform(-0.3, 0.3, len(stands))
        assert legs.angles(toes(robot, joints)) == pytest.approx(joints[columns], abs=1e-6)
        jacobian = legs.jacobian(joints[columns])
        for k in range(3):
            moved = joints.copy()
            moved[columns[:, k]] += step
            rate = (toes(robot, moved) - toes(robot, joints)) / step
            assert jacobian[:, :, k] == pytest.approx(rate, abs=1e-5)


def state_of(robot: RobotModel, tilt: float = 0.0) -> RobotState:
    """Return a robot that stands, rolled by an angle."""
    c, s = np.cos(tilt), np.sin(tilt)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    known = {
        "rotation": turn,
        "angular_velocity": np.zeros(3),
        "mass": float(robot.mass.sum()),
        "centre": np.array([0.01, -0.004, -0.02]),
        "inertia": np.diag([0.05, 0.2, 0.2]),
    }
    return RobotState(**{name: known.get(name, 0.0) for name in RobotState._fields})


@pytest.mark.parametrize("standing_legs", [(0, 1, 2, 3), (0, 1, 2)])
def test_feet_carry_the_weight_and_turn_the_body_back(
    taken: Taken, standing_legs: tuple[int, ...]
) -> None:
    """The torques are those of forces that sum up to m g, with the wanted moment about the centre.

    Rolled by 0.05 rad at a bandwidth of 8 rad/s it is -I k^2 0.05 N m. Each force is solved from
    the three torques of its own leg.
    """
    legs, robot = taken.legs, taken.robot
    stance = np.where(np.isin(np.arange(4), standing_legs), 0.5, 1.5)
    for tilt in (0.0, 0.05):
        s = state_of(robot, tilt)
        stiff = np.full((4, 3), 100.0)
        support = Support(legs, stiff, 9.81, share=1.0, level=8.0)
        torque = -support.offsets(s, legs.toe, stance) * stiff
        jacobian = legs.jacobian(legs.angles(legs.toe))
        force = np.linalg.solve(jacobian.transpose(0, 2, 1), torque[:, :, None])[:, :, 0]
        up = s.rotation[2]
        assert force.sum(axis=0) == pytest.approx(s.mass * 9.81 * up, rel=1e-3)
        arm = legs.toe - s.centre
        moment = (arm[:, 1] @ (force @ up), -arm[:, 0] @ (force @ up))
        wanted = -0.05 * 64.0 * np.sin(tilt)
        assert moment[0] == pytest.approx(wanted, abs=0.01)
        assert moment[1] == pytest.approx(0.0, abs=0.01)
        assert np.abs(force[stance > 1.0]).max(initial=0.0) < 1e-9
    assert LIGHT > 0.0


def test_trot_and_crawl_stand_on_two_and_three(taken: Taken) -> None:
    """A trot has its diagonals on the ground, overlapping; a crawl at least three of its legs."""
    for pattern, least in ((Pattern.trot, 2), (Pattern.crawl, 3)):
        phases = phases_of(pattern, taken.legs)
        times = (np.arange(400) + 0.5) / 400.0
        stands = np.mod(times[:, None] + phases, 1.0) < duty_of(pattern, 4)
        assert stands.sum(axis=1).min() == least
    # FR with RL, FL with RR
    trot = phases_of(Pattern.trot, taken.legs)
    assert trot[0] == trot[3] != trot[1] == trot[2]
    # each fore leg a quarter of the cycle after its hind leg, the sides half a cycle apart
    crawl = dict(zip(taken.robot.legs, phases_of(Pattern.crawl, taken.legs), strict=True))
    assert np.mod(crawl["RR"] - crawl["FR"], 1.0) == pytest.approx(0.25)
    assert np.mod(crawl["FR"] - crawl["FL"], 1.0) == pytest.approx(0.5)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("pattern", "speed", "duration"),
    [("trot", 0.3, 3.0), pytest.param("crawl", 0.1, 6.0, marks=pytest.mark.slow)],
)
def test_a_quadruped_walks_as_fast_as_it_is_told(
    taken: Taken, pattern: str, speed: float, duration: float
) -> None:
    """Along a straight line, level within 6 degrees, at three quarters of the speed or more."""
    pytest.importorskip("pybullet")
    words = ("guide=march", f"guide.speed={speed}", "environment.ground_level=0")
    height = -taken.legs.toe[:, 2].mean() + 0.02
    place = f"initial.position=[0,0,{height:.4f}]"
    gait = f"controller.pattern={pattern}"
    settings = [f"robot={taken.folder}", *words, place, f"time.duration={duration}", gait]
    log = simulate(run_settings(settings)).log
    path, (_, x, y, _) = log.channel("position"), log.channel("orientation").T
    late = log.time > 1.5
    gone = path[late][-1] - path[late][0]
    took = log.time[late][-1] - log.time[late][0]
    lean = np.degrees(np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)).max())
    print(f"{pattern}: {gone[0] / took:.3f} m/s of {speed}, lean {lean:.1f} deg")
    assert 0.75 * speed < gone[0] / took < 1.1 * speed
    assert abs(gone[1]) < 0.06
    assert lean < 6.0
    assert abs(path[late, 2] - height).max() < 0.015


def test_worlds_from_before_keep_their_hash() -> None:
    """Fields at the defaults that they got later are no part of a world; other values are."""
    for words, named in (([], False), (["controller.support=1"], True)):
        world = world_config(compose(["env=crab_walk", *words], root="learn"))
        assert ("support" in world["controller"]) is named
        assert "stance" not in world["robot"]["legs"]["left_1"]
