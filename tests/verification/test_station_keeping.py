"""Station keeping with four to eight thrusters, roll and pitch passive, in both engines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.api import make
from seals.errors import ConfigError
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.scaffold.robot import scaffold_robot
from tests.unit.rov_layouts import LAYOUTS, PASSIVE, rov_folder

GOAL, YAW = (1.2, 0.8, -2.4), 1.0
COMMON = (
    "water=fossen",
    "controller=station",
    "guide=hover",
    f"guide.position=[{GOAL[0]},{GOAL[1]},{GOAL[2]}]",
    f"guide.yaw=[{YAW}]",
    "guide.speed=0.5",
    "initial.position=[0,0,-2]",
    "+effect@effects.current=current",
    "effects.current.velocity_x=0.2",
    "effects.current.velocity_y=-0.15",
    "time.step=0.02",
    "controller.rate=50",
    "guide.rate=50",
    "time.duration=14",
)
PAIRS = [("four", "pybullet"), ("five", "mujoco"), ("six", "mujoco"), ("eight", "free")]
ALL = [(name, engine) for name in LAYOUTS for engine in ("pybullet", "mujoco", "free")]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "engine"),
    [pair if pair in PAIRS else pytest.param(*pair, marks=pytest.mark.slow) for pair in ALL],
)
def test_a_vehicle_reaches_its_waypoint_and_holds_it_in_a_current(
    name: str, engine: str, tmp_path: Path
) -> None:
    """Within 5 cm and 2 degrees of x, y, z and yaw over the last four seconds; it stays upright.

    In a current of 0.25 m/s, at rest over ground, passive roll and pitch lie where the moment of
    the drag's thrust meets the restoring moment m g h sin a: below 5 degrees for these arms.
    """
    robot = rov_folder(tmp_path / name, LAYOUTS[name])
    record = simulate(run_settings([f"robot={robot}", f"backend={engine}", *COMMON]))
    assert record.error is None
    log = record.log
    late = log.time > 10.0
    away = np.linalg.norm(log.channel("position") - GOAL, axis=1)
    w, x, y, z = log.channel("orientation").T
    lean = np.degrees(np.arccos(1.0 - 2.0 * (x * x + y * y)))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    assert away[late].max() < 0.05
    assert np.degrees(np.abs(yaw[late] - YAW)).max() < 2.0
    assert lean.max() < 25.0
    # commanded, the attitude error decays with k_R / k_I = 3 s after the turn
    assert lean[-1] < (5.0 if PASSIVE[name] else 0.5)


BOAT = """<?xml version="1.0"?>
<robot name="boat">
  <link name="hull"><inertial><mass value="60"/>
    <inertia ixx="2" iyy="8" izz="9" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="1.2 0.6 0.3"/></geometry></collision></link>
  {thrusters}
</robot>"""
THRUSTER = """
  <link name="thruster_{k}"><inertial><mass value="0.1"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="t{k}" type="fixed"><parent link="hull"/><child link="thruster_{k}"/>
    <origin xyz="{x} {y} -0.1" rpy="0 0 {turn}"/></joint>"""


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ["pybullet", pytest.param("mujoco", marks=pytest.mark.slow)])
def test_a_boat_of_four_thrusters_is_held_in_its_place(engine: str, tmp_path: Path) -> None:
    """No drive pushes it up: the surface holds it, and thrusters its place in a current."""
    pytest.importorskip(engine)
    corners = ((0.5, 0.25, -0.8), (0.5, -0.25, 0.8), (-0.5, 0.25, 0.8), (-0.5, -0.25, -0.8))
    thrusters = "".join(
        THRUSTER.format(k=k, x=x, y=y, turn=turn) for k, (x, y, turn) in enumerate(corners)
    )
    (tmp_path / "boat.urdf").write_text(BOAT.format(thrusters=thrusters), encoding="utf-8")
    made = scaffold_robot("my_boat", tmp_path / "boat.urdf", parent=tmp_path)
    goal = (0.8, 0.6)
    words = [
        *(f"robot={made.folder}", f"backend={engine}", "water=fossen", "controller=station"),
        *("guide=hover", f"guide.position=[{goal[0]},{goal[1]},0]", "guide.yaw=[0.5]"),
        *("initial.position=[0,0,0.06]", "+effect@effects.current=current", "guide.speed=0.4"),
        *("effects.current.velocity_x=0.2", "effects.current.velocity_y=-0.1"),
        *("time.step=0.02", "controller.rate=50", "guide.rate=50", "time.duration=16"),
    ]
    record = simulate(run_settings(words))
    assert record.error is None
    log = record.log
    late = log.time > 12.0
    away = np.linalg.norm(log.channel("position")[:, :2] - goal, axis=1)
    assert away[late].max() < 0.05
    # 60.4 kg on 0.72 m^2: the box of 0.3 m floats with 0.084 m under water
    height = 0.15 - 60.4 / 998.2 / 0.72
    assert np.abs(log.channel("position")[late, 2] - height).max() < 0.01


def test_what_sinks_is_not_held_without_heave(tmp_path: Path) -> None:
    """The same four thrusters under a hull of twice its weight in water."""
    corners = ((0.5, 0.25, -0.8), (0.5, -0.25, 0.8), (-0.5, 0.25, 0.8), (-0.5, -0.25, -0.8))
    thrusters = "".join(
        THRUSTER.format(k=k, x=x, y=y, turn=turn) for k, (x, y, turn) in enumerate(corners)
    )
    text = BOAT.format(thrusters=thrusters).replace('mass value="60"', 'mass value="600"')
    (tmp_path / "boat.urdf").write_text(text, encoding="utf-8")
    made = scaffold_robot("my_boat", tmp_path / "boat.urdf", parent=tmp_path)
    words = [f"robot={made.folder}", "water=fossen", "controller=station", "guide=hover"]
    with pytest.raises(ConfigError, match="do not command heave"):
        make(words)
