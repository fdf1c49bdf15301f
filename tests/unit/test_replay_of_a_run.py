"""Replay of a run through the surface: the simulator repeats itself from the log alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.arrays import Floats
from seals.cli.main import main
from seals.frames import rpy_of
from seals.logs.log import Log
from seals.logs.native import read_native
from seals.sysid.data.robot_description import describe_robot, describe_run
from seals.sysid.data.samples import read_samples
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.data.vehicle import Vehicle, read_vehicle
from seals.sysid.validation.model import nominal
from seals.sysid.validation.replay import Track, replay
from seals.sysid.validation.scene import urdf_of

ARM, FINGERS = slice(0, 3), slice(3, 6)
START = 100
"""Row from which how the rotors turned before the log no longer matters."""


@pytest.fixture(scope="module")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The AAM sinks through the surface, arm backwards, while its rotors touch the water."""
    place = tmp_path_factory.mktemp("runs") / "crossing"
    words = ["robot=aam", "water=fossen", "guide=waypoints", "guide.delay=0.0", "guide.speed=1.5"]
    words += ["guide.places=[[0.0,0.0,-0.5]]", "initial.position=[0.0,0.0,0.55]"]
    words += ["initial.velocity=[0.0,0.0,-1.2]", "initial.drives=carrying", "time.duration=0.62"]
    words += ["initial.joint_position=[1.55,0.0,0.0,-0.6,-0.6,-0.6]"]
    assert main(["run", *words, f"hydra.run.dir={place}"]) == 0
    return place


def repeated(vehicle: Vehicle, log: Log, start: int = START, higher: float = 0.0) -> Track:
    """The log simulated once more from the truth at one row, or from some metres above it."""

    def truth(name: str) -> Floats:
        return log.channel(name)

    trajectory = Trajectory(
        position=truth("position") + np.array((0.0, 0.0, higher)),
        quaternion=truth("orientation")[:, [1, 2, 3, 0]],
        velocity=truth("velocity"),
        angular_velocity=truth("angular_velocity"),
        joints=truth("joint_position"),
        joint_velocity=truth("joint_velocity"),
    )
    rows: Any = np.arange(start, log.rows)[None]
    return replay(nominal(vehicle), read_samples(log, vehicle), trajectory, rows)


@pytest.mark.thorough
@pytest.mark.parametrize("source", ["run", "folder"])
def test_a_run_is_repeated_through_the_surface(crossing: Path, source: str) -> None:
    """Pose, joints and accelerometer, with the robot of the run and with that of its folder."""
    log = read_native(crossing)
    height = log.channel("position")[START:, 2]
    assert height.max() > 0.1
    assert height.min() < 0.04
    given = describe_run(crossing) if source == "run" else describe_robot("aam")
    track = repeated(read_vehicle(log.meta, given), log)
    error = np.abs(track.error[0])
    # half of what the diagnosis takes for the resolution of a run's truth
    assert error[:, :3].max() < 5e-4
    assert error[:, 3:6].max() < 5e-4
    assert error[:, 12:][:, ARM].max() < 5e-4
    assert error[:, 12:][:, FINGERS].max() < 5e-4
    force = log.channel("specific_force")[START:]
    assert np.ptp(force[:, 2]) > 10.0
    apart = np.abs(track.reading[0, 1:, 3:] - force[1:]).max(axis=1)
    # the force sets in where a face touches: 12 m/s^2 in the first millimetre
    touched = 1 + int(np.argmax(apart))
    assert np.count_nonzero(apart > 0.5) < 2
    assert apart.max() < 2e4 * error[touched, 2]
    again = repeated(read_vehicle(log.meta, given), log, higher=-track.error[0][touched, 2])
    assert np.abs(again.reading[0, 1:, 3:] - force[1:]).max() < 0.5


def test_joints_of_a_replay_keep_their_turned_frames() -> None:
    """The second finger of the gripper stands 120 degrees round the palm."""
    robot = describe_robot("aam").robot
    k = robot.links.index("finger_2")
    text = urdf_of(robot).split('<child link="finger_2"/>')[1].split('rpy="')[1].split('"')[0]
    found = np.array([float(x) for x in text.split()])
    assert found == pytest.approx(rpy_of(robot.tree.rotation[k]))
    assert found[2] == pytest.approx(2.0944, abs=1e-3)
