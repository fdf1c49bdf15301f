"""A vehicle with wings that takes off upright: four rotors lift it, and one that pushes rests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.api import make
from seals.check.reach import reach_of
from seals.errors import ConfigError
from seals.run.build import run_settings
from seals.run.simulation import simulate

URDF = """<robot name="quadplane"><link name="body"><inertial><mass value="3"/>
<inertia ixx="0.12" iyy="0.08" izz="0.18" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.6 0.2 0.12"/></geometry></collision></link></robot>"""
YAML = """urdf: quadplane.urdf
actuators:
  rotors:
    actuator: rotors
    position: [[0.3, -0.3, 0], [-0.3, 0.3, 0], [0.3, 0.3, 0], [-0.3, -0.3, 0], [-0.35, 0, 0.02]]
    axis: [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0]]
    direction: [1, 1, -1, -1, 1]
    thrust_coefficient: [2.0e-05, 2.0e-05, 2.0e-05, 2.0e-05, 1.0e-05]
    torque_coefficient: [3.0e-07, 3.0e-07, 3.0e-07, 3.0e-07, 1.0e-07]
    max_speed: [1100.0]
    time_constant: [0.02]
effects:
  wing: {effect: lift, coefficient: 2.0, medium: air, links: [body]}
  air_drag: {effect: quadratic_drag, medium: air, coefficient_x: 0.02, coefficient_z: 0.5}
"""


@pytest.fixture
def quadplane(tmp_path: Path) -> Path:
    """Folder of a body with wings, four rotors that lift it and one that pushes it ahead."""
    folder = tmp_path / "quadplane"
    folder.mkdir()
    (folder / "quadplane.urdf").write_text(URDF)
    (folder / "robot.yaml").write_text(YAML)
    return folder


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ["mujoco", pytest.param("pybullet", marks=pytest.mark.slow)])
def test_it_takes_off_to_a_height_and_holds_it(quadplane: Path, engine: str) -> None:
    """From rest on the ground to 3 m, straight up, and there it stays; the pusher rests."""
    pytest.importorskip(engine)
    words = (
        *(f"robot={quadplane}", f"backend={engine}", "controller=cascade", "guide=waypoints"),
        *("guide.places=[[0,0,3]]", "guide.speed=1", "guide.delay=0.5", "guide.rest=10"),
        *("environment.ground_level=0", "initial.position=[0,0,0.06]", "time.duration=8"),
        "time.step=0.004",
    )
    record = simulate(run_settings(words))
    assert record.error is None
    log = record.log
    held = log.channel("position")[log.time > 6.5]
    np.testing.assert_allclose(held, np.broadcast_to([0.0, 0.0, 3.0], held.shape), atol=0.02)
    assert np.abs(log.channel("position")[:, :2]).max() < 0.02
    orders = log.channel("rotor_speed_cmd")
    assert not orders[:, 4].any()
    assert orders[log.time > 6.5, :4].min() > 500.0


def test_check_sends_it_to_the_cascade(quadplane: Path) -> None:
    """The first run that its import prints is a hover."""
    settings = run_settings([f"robot={quadplane}"])
    from seals.robot.build import build_robot

    found = reach_of(build_robot(settings.robot), settings.actuators, settings.effects)
    assert found is not None
    assert "controller=cascade" in found.first_run()


def test_three_that_lift_are_too_few(quadplane: Path) -> None:
    """A rotor that pushes ahead does not count among the four."""
    level = "actuators.rotors.axis=[[0,0,1],[0,0,1],[0,0,1],[1,0,0],[1,0,0]]"
    words = (f"robot={quadplane}", "controller=cascade", "guide=hover", level)
    with pytest.raises(ConfigError, match="5 rotors, 3 of them upright"):
        make(words)
