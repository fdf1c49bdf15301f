"""The mission guide: stages from YAML, the order they come in, second tries, the memory."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping

import numpy as np
import pytest

from seals.control import Plant, Reference, RobotState
from seals.control.plant import build_plant
from seals.control.protocols import Guide
from seals.errors import ConfigError
from seals.plugins.guides.mission import Grasp, Mission
from seals.plugins.guides.mission.guide import stages_of
from seals.run.assembly import build_model
from seals.run.build import run_settings

STEP = 1.0 / 125.0


def bound(guide: Mission) -> Mission:
    """The guide, bound to the manipulator."""
    guide.bind(plant())
    return guide


@functools.cache
def plant() -> Plant:
    """The manipulator."""
    run = run_settings(["robot=aam"])
    return build_plant(*build_model(run), run.environment)


def situation(
    time: float,
    place: np.ndarray,
    joints: np.ndarray,
    *,
    cube: np.ndarray | None = None,
    pads: float = 0.0,
) -> RobotState:
    """A level robot at a place that sees a cube and feels something with all pads."""
    readings: dict[str, Mapping[str, np.ndarray]] = {}
    if cube is not None:
        readings["locator"] = {"offset": cube - place, "seen": np.ones(1)}
    zero = np.zeros(3)
    known = {
        "time": time,
        "step": STEP,
        "position": place,
        "rotation": np.eye(3),
        "joints": joints,
        "readings": readings,
        "contacts": {f"tip_{k}": pads for k in (1, 2, 3)},
    }
    # what a mission does not look at stays at rest
    return RobotState(**{name: known.get(name, zero) for name in RobotState._fields})


class Ideal:
    """A robot that is at once where its guide wants it, and holds what its hand closes about."""

    def __init__(self, guide: Mission, cube: np.ndarray, *, slippery: bool = False) -> None:
        self.guide, self.cube, self.slippery = guide, cube, slippery
        self.place, self.joints = np.array([0.3, 0.2, 0.8]), np.zeros(6)
        self.time, self.grip = 0.0, 0.0
        self.stages: list[str] = []
        self.memory = guide.start(self.situation())

    def situation(self) -> RobotState:
        """What it knows now."""
        pads = 0.0 if self.slippery or self.grip < 0.9 else 5.0
        return situation(self.time, self.place, self.joints, cube=self.cube, pads=pads)

    def run(self, seconds: float) -> bool | None:
        """Go on until the guide is done, or for some seconds."""
        for _ in range(round(seconds / STEP)):
            aim, self.memory = self.guide.aim(self.situation(), self.memory)
            self.follow(aim)
            if self.guide.stage(self.memory) not in self.stages[-1:]:
                self.stages.append(self.guide.stage(self.memory))
            if self.guide.finished(self.memory) is not None:
                break
        return self.guide.finished(self.memory)

    def follow(self, aim: Reference) -> None:
        """Move as wanted."""
        self.time += STEP
        before, self.place = self.place, np.array(self.memory.place)
        self.grip = float(aim.grip["gripper"])
        self.joints[:3] = aim.joints["arm"]
        if self.grip > 0.9 and not self.slippery:
            self.cube = self.cube + self.place - before


def test_a_grasp_goes_through_its_stages_and_brings_the_object_to_the_goal() -> None:
    """Unfold, above, descend, close, lift, carry, hold, each once, and the cube is at the goal."""
    goal = [0.5, -0.5, 1.2]
    robot = Ideal(bound(Grasp(goal=goal)), np.array([0.1, 0.1, -0.9]))
    assert robot.run(60.0) is True
    expected = ["unfold", "above", "descend", "close", "lift", "carry", "hold", "done"]
    assert robot.stages == expected
    np.testing.assert_allclose(robot.cube, goal, atol=0.02)


def test_the_hand_comes_down_on_the_object_from_above() -> None:
    """When the fingers close, the middle between the tips is at the object."""
    guide = bound(Grasp())
    robot = Ideal(guide, np.array([-0.2, 0.15, -0.9]))
    while robot.guide.stage(robot.memory) != "close":
        robot.run(STEP)
    held = robot.place + guide._hand.offset(robot.joints)
    np.testing.assert_allclose(held, robot.cube, atol=0.015)


def test_an_object_that_is_not_felt_is_reached_for_again_and_then_given_up() -> None:
    """Without a force on the pads the reach is repeated as often as stated."""
    robot = Ideal(bound(Grasp(tries=2)), np.array([0.1, 0.1, -0.9]), slippery=True)
    assert robot.run(200.0) is False
    assert robot.stages.count("above") == 2
    assert robot.stages[-1] == "given up"


def test_an_object_lost_on_the_way_is_fetched_again() -> None:
    """When the pads feel nothing any more while it carries, the mission goes back to the reach."""
    robot = Ideal(bound(Grasp()), np.array([0.1, 0.1, -0.9]))
    while robot.guide.stage(robot.memory) != "carry":
        robot.run(STEP)
    robot.slippery = True
    robot.run(2 * STEP)
    assert robot.stages[-1] == "above"
    robot.slippery = False
    assert robot.run(60.0) is True


def test_the_wanted_place_never_jumps() -> None:
    """From stage to stage, and on a second try, the way is continuous."""
    robot = Ideal(bound(Grasp(tries=2)), np.array([0.1, 0.1, -0.9]), slippery=True)
    before = robot.place
    for _ in range(round(60.0 / STEP)):
        robot.run(STEP)
        assert np.abs(robot.place - before).max() < 0.6 * STEP
        before = robot.place


def test_an_aim_does_not_change_the_memory_it_was_given() -> None:
    """The same memory and situation give the same aim twice: nothing is kept in the guide."""
    robot = Ideal(bound(Grasp()), np.array([0.1, 0.1, -0.9]))
    robot.run(3.0)
    now = robot.situation()
    first, _ = robot.guide.aim(now, robot.memory)
    robot.guide.aim(now._replace(time=now.time + 5.0), robot.memory)
    again, _ = robot.guide.aim(now, robot.memory)
    np.testing.assert_array_equal(first.velocity, again.velocity)
    assert isinstance(robot.guide, Guide)


def test_landing_ends_when_the_body_no_longer_sinks() -> None:
    """A robot that the ground holds up has landed; one that still sinks has not."""
    guide = bound(Mission(stages=[{"do": "land", "speed": 0.5}]))
    place, joints = np.array([0.0, 0.0, 1.0]), np.zeros(6)
    memory = guide.start(situation(0.0, place, joints))
    time = 0.0
    while guide.finished(memory) is None and time < 20.0:
        time += STEP
        _, memory = guide.aim(situation(time, place, joints), memory)
        place = np.maximum(memory.place, [0.0, 0.0, 0.4])
    assert guide.finished(memory) is True
    assert place[2] == pytest.approx(0.4)
    assert 0.6 / 0.5 < time < 5.0


def test_a_turn_takes_the_shorter_way() -> None:
    """A heading across the half turn goes on, not back."""
    guide = bound(Mission(stages=[{"do": "go", "to": [0, 0, 1], "yaw": [-3.0], "speed": 0.5}]))
    place, joints = np.array([1.0, 0.0, 1.0]), np.zeros(6)
    turned = np.array(
        [[math.cos(3.0), -math.sin(3.0), 0], [math.sin(3.0), math.cos(3.0), 0], [0, 0, 1]]
    )
    now = situation(0.0, place, joints)._replace(rotation=turned)
    memory, yaws = guide.start(now), []
    for k in range(700):
        aim, memory = guide.aim(now._replace(time=k * STEP, position=memory.place), memory)
        yaws.append(aim.yaw)
    assert 3.0 <= min(yaws) <= max(yaws) <= 2 * math.pi - 3.0 + 1e-9


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([{"do": "rize"}], "Did you mean 'rise'"),
        ([{"height": 1.0}], "names no action"),
        ([{"do": "rise", "hight": 1.0}], "Did you mean 'height'"),
        ([{"do": "go", "to": [1.0, 2.0]}], "3 numbers"),
        ([{"do": "close", "force": -1.0}], "force=-1"),
        ([], "is empty"),
    ],
)
def test_wrong_stages_are_refused_in_words(rows: list[object], words: str) -> None:
    """A stage that does not exist, or a value that it does not have, is named."""
    with pytest.raises(ConfigError, match=words):
        Mission(stages=rows)


def test_whole_numbers_and_names_are_taken() -> None:
    """A stage may be named, and a whole number stands for a float."""
    (stage,) = stages_of([{"do": "rise", "name": "take off", "height": 2}])
    assert stage.name == "take off"
    assert stage.height == 2.0


def test_a_missing_gripper_is_refused() -> None:
    """A gripper that the robot does not have is named with those it has."""
    with pytest.raises(ConfigError, match="gripper"):
        bound(Mission(stages=[{"do": "wait"}], gripper="claw"))
