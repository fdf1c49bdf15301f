"""A torpedo and a boat along a course in both engines: line of sight, depth, heading."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.logs import Log
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.scaffold.robot import scaffold_robot
from tests.unit.rov_layouts import LAYOUTS, rov_folder

SURVEY = Path(__file__).parents[1] / "unit/urdfs/vehicles/survey_auv.sdf"

COMMON = ("water=fossen", "guide=los", "controller=autopilot", "time.step=0.02")
ENGINES = ["pybullet", *(pytest.param(name, marks=pytest.mark.slow) for name in ("mujoco", "free"))]
TORPEDO = (
    "robot=torpedo",
    "guide.speed=1.5",
    "guide.acceptance=8",
    "initial.velocity=[1.5,0,0]",
    "guide.places=[[0.1,0,-4],[90,0,-4]]",
)
BOAT = ("robot=boat", "guide.speed=1", "guide.acceptance=8", "guide.places=[[0.1,0,0],[90,0,0]]")


def driven(*words: str) -> Log:
    """Simulate a run and return its log."""
    record = simulate(run_settings([*COMMON, *words]))
    assert record.error is None
    return record.log


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ENGINES)
def test_a_torpedo_goes_to_its_depth_within_the_stated_overshoot(engine: str) -> None:
    """A step of 2 m in depth: overshoot below 5 %, within 10 % after 18 s, straight ahead."""
    log = driven(*TORPEDO, f"backend={engine}", "initial.position=[0,0,-2]", "time.duration=18")
    place = log.channel("position")
    assert -4.0 - place[:, 2].min() < 0.05 * 2.0
    assert abs(place[-1, 2] + 4.0) < 0.1 * 2.0
    assert np.abs(place[:, 1]).max() < 0.05
    assert log.channel("velocity")[-1, 0] == pytest.approx(1.5, abs=0.05)


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ENGINES)
def test_a_torpedo_comes_back_to_its_leg_by_its_fins(engine: str) -> None:
    """Four metres beside the leg at first, within 0.3 m after 20 s, and it rolls back upright."""
    log = driven(*TORPEDO, f"backend={engine}", "initial.position=[0,4,-4]", "time.duration=20")
    place = log.channel("position")
    assert abs(place[-1, 1]) < 0.3
    assert place[:, 1].min() > -0.8
    assert abs(place[-1, 2] + 4.0) < 0.3
    commands = [log.columns[f"joint_position_cmd_{k}"] for k in range(1, 5)]
    assert np.nanmax(np.abs(commands)) <= 0.24 + 1e-9


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ENGINES)
def test_a_boat_with_two_thrusters_keeps_its_course(engine: str) -> None:
    """Three metres beside the leg at first, within 0.3 m after 24 s, at its speed."""
    log = driven(*BOAT, f"backend={engine}", "initial.position=[0,3,0.05]", "time.duration=24")
    place = log.channel("position")
    assert abs(place[-1, 1]) < 0.3
    assert place[:, 1].min() > -0.6
    assert log.channel("velocity")[-1, 0] == pytest.approx(1.0, abs=0.05)
    # it commands surge and yaw by two thrusters within their limits
    forces = [log.columns[f"thruster_cmd_{k}"] for k in (1, 2)]
    assert np.nanmax(np.abs(forces)) <= 30.0


@pytest.mark.thorough
def test_a_stable_vehicle_stays_upright_on_fins_that_give_way(tmp_path: Path) -> None:
    """Its weight rights it with 5 N m/rad, as much as its fins can do: they must not cancel that.

    Fins that the flow turns further than commanded would then heel it by half a radian.
    """
    robot = scaffold_robot("mine", SURVEY, parent=tmp_path).folder
    course = ("guide.speed=0.8", "guide.places=[[20,3,-3]]", "initial.velocity=[1,0,0]")
    log = driven(
        f"robot={robot}",
        *course,
        "initial.position=[0,0,-2]",
        "time.duration=8",
        "time.step=0.004",
    )
    # twice the first part of the quaternion is the angle of roll
    assert np.abs(2.0 * log.columns["orientation_x"]).max() < 0.1
    assert log.channel("position")[-1, 0] > 6.0


@pytest.mark.thorough
def test_three_thrusters_go_to_a_depth_and_hold_it(tmp_path: Path) -> None:
    """Surge, heave and yaw: 1.5 m down along a leg with a bend, within 5 cm of depth and leg."""
    layout = [LAYOUTS["four"][k] for k in (0, 1, 3)]
    robot = rov_folder(tmp_path / "rov", layout)
    course = ("guide.speed=0.4", "guide.lookahead=1.2", "guide.climb_lookahead=1.5")
    places = "guide.places=[[6,0,-3],[10,4,-3]]"
    log = driven(
        f"robot={robot}",
        *course,
        places,
        "guide.acceptance=0.5",
        "initial.position=[0,0,-1.5]",
        "time.duration=30",
    )
    place = log.channel("position")
    late = log.time > 18.0
    assert np.abs(place[late, 2] + 3.0).max() < 0.05
    assert place[:, 2].min() > -3.0 - 0.05 * 1.5
    # on the second leg, across it: exp(-U t / lookahead) leaves 1 % after its 14 s
    assert abs((place[-1, 1] - (place[-1, 0] - 6.0)) * np.sqrt(0.5)) < 0.05


def test_three_thrusters_hold_depth_and_heading_at_rest(tmp_path: Path) -> None:
    """Without sway the station keeps what surge, heave and yaw can hold, in still water."""
    layout = [LAYOUTS["four"][k] for k in (0, 1, 3)]
    words = ("controller=station", "guide=hover", "guide.position=[0.5,0,-2.5]")
    log = driven(
        f"robot={rov_folder(tmp_path / 'rov', layout)}",
        *words,
        "initial.position=[0,0,-2]",
        "time.duration=12",
        "time.step=0.008",
    )
    assert log.channel("position")[-1] == pytest.approx([0.5, 0.0, -2.5], abs=0.01)
