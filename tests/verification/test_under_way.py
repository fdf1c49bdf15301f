"""A vehicle with passive pitch stays level under way below the speed of its Munk moment alone."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from seals.check.robot import Verdict, check_robot
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.scaffold.robot import scaffold_robot

FILE = Path(__file__).parents[1] / "unit/urdfs/vehicles/rov3.urdf"
WEIGHT, RAISED = 10.05 * 9.81, 0.0194527
"""Weight [N]; centre of buoyancy above that of gravity: (9.9 x 0.02 - 0.05 x 0.05) / 10.05 [m]."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the robot."""
    parent = tmp_path_factory.mktemp("rov")
    return scaffold_robot("rov3", FILE, parent=parent, medium="water").folder


def bound(folder: Path) -> tuple[float, Verdict]:
    """Speed and verdict of ``seals check``."""
    run = run_settings([f"robot={folder}"])
    found = check_robot(run.robot, run.actuators, run.effects)
    (one,) = (each for each in found if each.subject == "under way")
    match = re.search(r"up to ([\d.]+) m/s", str(one))
    assert match
    return float(match[1]), one.verdict


def test_speed_of_the_check_is_the_closed_form(folder: Path) -> None:
    """W GM = (A_z - A_x) u^2 with the added mass of its file."""
    text = (folder / "robot.yaml").read_text()
    mass = {axis: float(m) for axis, m in re.findall(r"mass_([xz]): ([\d.]+)", text)}
    speed, verdict = bound(folder)
    assert speed == pytest.approx(math.sqrt(WEIGHT * RAISED / (mass["z"] - mass["x"])), rel=0.02)
    assert verdict is Verdict.WARN


@pytest.mark.thorough
@pytest.mark.parametrize(("share", "level"), [(0.7, True), (1.5, False)])
def test_it_stays_level_below_and_turns_above(folder: Path, share: float, level: bool) -> None:
    """Along a level leg from rest, with nothing but the list of its file to begin with."""
    speed, _ = bound(folder)
    words = (
        *(f"robot={folder}", "water=fossen", "controller=autopilot", "guide=los"),
        *("guide.places=[[0.1,0,-3],[40,0,-3]]", "initial.position=[0,0,-3]", "time.step=0.01"),
        *(f"guide.speed={share * speed}", "time.duration=30"),
    )
    record = simulate(run_settings(list(words)))
    assert record.error is None
    w, x, y, z = record.log.channel("orientation").T
    pitch = np.degrees(np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)))
    most = float(np.abs(pitch).max())
    print(f"{share:g} of {speed:g} m/s: pitch up to {most:.1f} deg")
    assert (most < 20.0) is level
    assert (most > 45.0) is not level
