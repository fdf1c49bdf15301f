"""``seals new robot`` finds legs, gives them gains that carry, and a gait that walks."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.api import load_robot, make
from seals.experiments.own_animal.make_beetle import beetle
from seals.scaffold.robot import scaffold_robot

SHIPPED = Path(__file__).parents[2] / "experiments/own_animal/beetle_description/urdf/beetle.urdf"


def made(folder: Path, text: str) -> Path:
    """Take a URDF over and return the robot's folder."""
    (folder / "beetle.urdf").write_text(text, encoding="utf-8")
    return scaffold_robot("my_beetle", urdf=folder / "beetle.urdf", parent=folder).folder


def test_the_shipped_file_is_that_of_the_script() -> None:
    """The URDF in the folder is what the script writes."""
    assert SHIPPED.read_text(encoding="utf-8") == beetle() + "\n"


def test_six_chains_of_three_are_legs(tmp_path: Path) -> None:
    """Legs are named by what their joints share; the toe is the end of an even rod."""
    entry = yaml.safe_load((made(tmp_path, beetle()) / "robot.yaml").read_text())
    assert list(entry["legs"]) == ["l1", "l2", "l3", "r1", "r2", "r3"]
    assert entry["legs"]["l1"] == {
        "joints": ["l1_yaw", "l1_swing", "l1_knee"],
        "foot": "l1_tibia",
        "toe": [0.11, 0.0, 0.0],
    }
    assert "arms" not in entry
    assert entry["controller"]["controller"] == "gait"
    # a joint gives way by 0.07 rad under a third of the weight at the reach of the stance
    robot = load_robot(tmp_path / "my_beetle")
    reach = entry["controller"]["stroke"] / 0.65
    torque = 9.81 * float(robot.mass.sum()) / 3.0 * reach
    assert entry["actuators"]["servos"]["kp_each"][0] == pytest.approx(torque / 0.07, rel=0.01)


def test_a_chain_of_another_length_makes_arms(tmp_path: Path) -> None:
    """Where one chain has two joints, all are arms as before: nobody knows how it walks."""
    text = re.sub(r'(<joint name="l1_knee" type=)"revolute"', r'\1"fixed"', beetle())
    entry = yaml.safe_load((made(tmp_path, text) / "robot.yaml").read_text())
    assert "legs" not in entry
    assert len(entry["arms"]) == 6


def test_it_walks_at_once(tmp_path: Path) -> None:
    """The first gait makes the speed that is asked, upright."""
    folder = made(tmp_path, beetle())
    words = [f"robot={folder}", "guide=march", "guide.speed=0.2", "environment.ground_level=0"]
    world = make([*words, "initial.position=[0,0,0.065]"])
    body = world.actors["robot"].body
    for _ in range(400):
        world.step()
    start = body.read().position
    for _ in range(250):
        world.step()
    gone = body.read().position - start
    upright = body.poses().rotations[0, 0, 2, 2]
    world.close()
    assert gone[0] == pytest.approx(0.2, rel=0.12)
    assert np.abs(gone[1]) < 0.03
    assert upright > 0.98
