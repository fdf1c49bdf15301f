"""A tricopter: the servo of its tail rotor balances the reaction of the others, and turns it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.control.plant import layout_of
from seals.control.tilts import FARTHEST, tilts_of
from seals.effects.binding import bind_effects
from seals.errors import ConfigError
from seals.logs import Log
from seals.robot.build import build_robot
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.scaffold.robot import scaffold_robot

TRICOPTER = Path(__file__).parents[1] / "unit/urdfs/vehicles/tricopter.urdf"
FRONT, TAIL, CENTRE = 0.15, -0.3, -0.012 / 1.3
"""Rotors and centre of gravity along x [m]."""


def robot_of(parent: Path) -> Path:
    """Return the folder of the tricopter."""
    return scaffold_robot("mine", TRICOPTER, parent=parent).folder


def hovered(parent: Path, *words: str) -> Log:
    """Hover for five seconds from level."""
    fixed = ("guide=hover", "controller=cascade", "time.step=0.008", "initial.position=[0,0,1]")
    record = simulate(run_settings([f"robot={robot_of(parent)}", *fixed, *words]))
    assert record.error is None
    return record.log


def test_the_tail_servo_balances_the_reaction_of_the_rotors(tmp_path: Path) -> None:
    """At rest its angle is that of the balance of lift, pitch and yaw.

    T_f + T_t cos d = W, T_t (l_t cos d - c sin d) = T_f l_f, T_t l_t sin d = c (T_f - T_t cos d),
    with the reaction by the thrust c, 0.12 of the radius of 0.208 m; both front rotors turn one
    way.
    """
    log = hovered(tmp_path, "time.duration=6")
    c, front, tail = 6.31e-7 / 2.53e-5, FRONT - CENTRE, CENTRE - TAIL
    angle = np.linspace(0.0, 0.3, 60001)
    by_tail = front / (tail * np.cos(angle) - c * np.sin(angle) + front * np.cos(angle))
    by_front = 1.0 - by_tail * np.cos(angle)
    moment = by_tail * tail * np.sin(angle) - c * (by_front - by_tail * np.cos(angle))
    expected = float(angle[np.argmin(np.abs(moment))])
    found = float(log.columns["joint_position_1"][-1])
    print(f"tilt {found:.5f} rad, balance {expected:.5f}")
    assert found == pytest.approx(expected, rel=0.005)
    w, x, y, z = log.channel("orientation").T
    assert abs(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))[-1]) < 1e-3
    assert log.channel("position")[-1] == pytest.approx([0.0, 0.0, 1.0], abs=0.01)


def test_a_tilt_is_a_force_across_the_hinge(tmp_path: Path) -> None:
    """The column of the servo is T h x a at the hub, within its stop and the largest tilt."""
    run = run_settings([f"robot={robot_of(tmp_path)}"])
    robot = build_robot(run.robot)
    layout = layout_of(robot, bind_effects(run.actuators, robot.links))
    tilts = tilts_of(robot, layout, 5.0)
    assert tilts.joints == (0,)
    # the hinge lies along x, the thrust along z
    assert tilts.axis[0] == pytest.approx([0.0, -1.0, 0.0])
    assert tilts.slope == pytest.approx([5.0])
    assert tilts.position[0] == pytest.approx([TAIL, 0.0, 0.05])
    assert tilts.limit == pytest.approx([FARTHEST])


def test_a_thruster_on_a_joint_is_refused(tmp_path: Path) -> None:
    """Only a rotor on one hinge may move against the base."""
    words = ["+actuator@actuators.push=thrusters", "actuators.push.links=[tail_tilt]"]
    words += ["actuators.push.first=3", "actuators.push.max_force=[5]"]
    run = run_settings([f"robot={robot_of(tmp_path)}", *words])
    robot = build_robot(run.robot)
    with pytest.raises(ConfigError, match="link 'tail_tilt' moves relative to the base"):
        layout_of(robot, bind_effects(run.actuators, robot.links))
