"""The verb `calibrate`: parameters by name, and numbers that are applied."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from seals.errors import ConfigError
from seals.logs.native import read_native
from seals.logs.shipped import find_log
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.robot.settings import RobotSettings
from seals.robot.whole_body import whole_body
from seals.robot.yaml_edit import holds, with_entry, with_number
from seals.sysid.calibration.applying import Edited, base_inertial, with_inertial, write_robot
from seals.sysid.calibration.calibration import chosen
from seals.sysid.calibration.free_numbers import prior_sigma, same_number, with_free_numbers
from seals.sysid.calibration.stated import StatedNumber, stated_numbers
from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.data.vehicle import Vehicle, read_vehicle

YAML = """\
urdf: hull.urdf
effects:
  # measured in the tank
  drag: {effect: quadratic_drag, medium: water, coefficient_x: 20.0}
actuators:
  rotors:
    thrust_coefficient: [1.0e-5, 2.0e-5]
"""
URDF = """\
<?xml version="1.0"?>
<robot name="hull">
  <link name="body">
    <inertial><origin xyz="0.01 0.0 -0.02" rpy="0 0 0"/><mass value="2.0"/>
      <inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial>
  </link>
  <link name="tank">
    <inertial><mass value="0.5"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
  </link>
  <joint name="mount" type="fixed"><parent link="body"/><child link="tank"/>
    <origin xyz="0.2 0.1 0.0" rpy="0 0 0"/></joint>
</robot>
"""


def built(folder: Path, urdf: str) -> RobotModel:
    """Write a URDF and read it."""
    folder.mkdir(exist_ok=True)
    (folder / "hull.urdf").write_text(urdf, encoding="utf-8")
    return build_robot(RobotSettings(name="hull", folder=str(folder), urdf="hull.urdf"))


def test_a_number_changes_and_the_rest_of_the_file_stays() -> None:
    """One coefficient of a flow mapping, and a list by a factor; comments stay."""
    text = with_number(YAML, ["effects", "drag", "coefficient_x"], lambda old: 31.25)
    assert text == YAML.replace("20.0", "31.25")
    rotors = ["actuators", "rotors", "thrust_coefficient"]
    assert "[1.5e-05, 3e-05]" in with_number(YAML, rotors, lambda old: 1.5 * old)
    with pytest.raises(ConfigError, match="not a number"):
        with_number(YAML, ["effects", "drag"], lambda old: old)


def test_what_was_left_to_a_default_is_added() -> None:
    """A field of a flow mapping, of a block, and a section that the file lacks."""
    inline = with_entry(YAML, ["effects", "drag", "coefficient_y"], "4")
    assert "coefficient_x: 20.0, coefficient_y: 4}" in inline
    block = with_entry(YAML, ["actuators", "rotors", "time_constant"], "[0.04]")
    assert holds(block, ["actuators", "rotors", "time_constant"])
    assert holds(block, ["actuators", "rotors", "thrust_coefficient"])
    hull = with_entry(YAML, ["hulls", "body", "displaced_volume"], "0.01")
    assert hull.endswith("hulls: {body: {displaced_volume: 0.01}}\n")


def test_mass_alone_changes_nothing_else_of_the_vehicle(tmp_path: Path) -> None:
    """Centre of gravity and inertia about it stay, with another link fixed to the base."""
    before = built(tmp_path / "a", URDF)
    mass, centre, inertia = whole_body(before)
    found = base_inertial(before, 1.2, np.array([0.004, 0.0, -0.01]), centre)
    after = built(tmp_path / "b", with_inertial(URDF, "body", *found))
    heavier, there, turned = whole_body(after)
    assert heavier == pytest.approx(mass + 1.2, rel=1e-5)
    assert_allclose(there, centre, atol=1e-6)
    assert_allclose(turned, inertia + np.diag([0.004, 0.0, -0.01]), atol=1e-6)
    with pytest.raises(ConfigError, match="less than that of the links"):
        base_inertial(before, -2.1, np.zeros(3), centre)


def test_a_link_without_an_inertial_of_its_own_is_refused() -> None:
    """The refusal says where the numbers are."""
    with pytest.raises(ConfigError, match=r"calibration\.json"):
        with_inertial(URDF, "wing", 1.0, np.zeros(3), np.eye(3))


def test_the_copy_has_the_new_numbers_and_the_folder_stays(tmp_path: Path) -> None:
    """All files are copied, the edited one with its new text; a folder that is there is refused."""
    own = tmp_path / "own"
    (own / "meshes").mkdir(parents=True)
    (own / "robot.yaml").write_text(YAML, encoding="utf-8")
    (own / "meshes" / "hull.obj").write_text("v 0 0 0\n", encoding="utf-8")
    new = YAML.replace("20.0", "31.25")
    edit = Edited(folder=own, before={"robot.yaml": YAML}, after={"robot.yaml": new})
    out = write_robot(edit, tmp_path / "new")
    assert (out / "robot.yaml").read_text(encoding="utf-8") == new
    assert (out / "meshes" / "hull.obj").is_file()
    assert (own / "robot.yaml").read_text(encoding="utf-8") == YAML
    assert "+  drag: {effect: quadratic_drag, medium: water, coefficient_x: 31.25}" in edit.diff
    with pytest.raises(ConfigError, match="already exists"):
        write_robot(edit, out)


DRAG = "effects.linear_drag_air.coefficient_x"
THRUST = "actuators.rotors.thrust_coefficient"


@cache
def quadrotor() -> tuple[Vehicle, CandidateSet, dict[str, StatedNumber]]:
    """Return the quadrotor of a log that ships, its parameters and its numbers."""
    vehicle = read_vehicle(read_native(find_log("hidden_effect/flight_a")).meta)
    candidate_set = candidate_set_of(vehicle, speeds=np.ones(3))
    return vehicle, candidate_set, stated_numbers(vehicle, candidate_set)


def asked(*names: str) -> list[str]:
    """Return the names that a question means."""
    return [number.name for number in chosen(names, quadrotor()[2])]


def test_the_numbers_are_those_that_the_log_states() -> None:
    """Mass, moments of inertia, coefficients of rotors and drags, each with its value and unit."""
    vehicle, _, numbers = quadrotor()
    spec = read_native(find_log("hidden_effect/flight_a")).meta["vehicle"]
    assert numbers["mass"].value == pytest.approx(spec["mass"])
    # parameters of an effect that acts for a while are no numbers of the vehicle
    assert not [n.name for n in numbers.values() if "|" in n.name + n.key]
    assert numbers["inertia_yy"].value == pytest.approx(spec["inertia"][1][1])
    assert numbers[THRUST].value == pytest.approx(spec["rotors"][0]["thrust_coefficient"])
    assert numbers[THRUST].unit == "N/(rad/s)^2"
    lag = numbers["actuators.rotors.time_constant"]
    assert (lag.value, lag.unit) == (pytest.approx(spec["rotors"][0]["time_constant"]), "s")
    assert numbers[DRAG].value == vehicle.effects["linear_drag_air"].coefficient_x  # type: ignore[attr-defined]


def test_groups_and_patterns_mean_what_is_stated() -> None:
    """A group is all of its numbers, a pattern those that fit; a name given twice counts once."""
    assert asked("inertia") == ["inertia_xx", "inertia_yy", "inertia_zz"]
    assert asked("effects.linear_drag_air") == [DRAG[:-1] + axis for axis in "xyz"]
    assert asked("actuators.*", THRUST)[0] == THRUST
    assert len(asked("actuators.*", THRUST)) == 3
    # the log states no quadratic part of the angular drag: zero is not a number to calibrate
    drags = asked("effects.*")
    assert "effects.angular_drag_any.coefficient_x" in drags
    assert not [name for name in drags if "angular_drag_any.quadratic" in name]


def test_a_wrong_name_is_answered_with_the_nearest() -> None:
    """The refusal has two lines, the second with the name that was meant."""
    with pytest.raises(ConfigError) as refusal:
        asked("effects.linear_drag_air.coeficient_x")
    lines = str(refusal.value).splitlines()
    assert len(lines) == 2
    assert f"Did you mean '{DRAG}'?" in lines[1]
    with pytest.raises(ConfigError, match="parameters is not given"):
        asked()


def test_the_tolerance_of_a_number_goes_and_all_others_stay() -> None:
    """A free coefficient is not tied to the data sheet twice; its neighbours keep theirs."""
    vehicle, candidate_set, numbers = quadrotor()
    base = vehicle.robot.links[0]
    own = [numbers[DRAG], numbers["mass"], numbers[THRUST]]
    free = with_free_numbers(candidate_set, own, base=base, share=0.5)
    gone = set(candidate_set.tolerances) - set(free.tolerances)
    assert gone == {
        "linear_drag_air_change.coefficient_x",
        "mass.mass",
        "thrust_coefficient.relative_change",
    }
    assert same_number(candidate_set, numbers["inertia_xx"], base) == ["inertia.delta_xx"]


def test_the_tolerance_of_the_thrust_is_that_of_the_thrust_alone() -> None:
    """A common change of all thrusts must not pass for one of the reaction torques."""
    vehicle, candidate_set, numbers = quadrotor()
    torque = numbers["actuators.rotors.torque_coefficient"]
    base = vehicle.robot.links[0]
    free = with_free_numbers(candidate_set, [torque], others=numbers.values(), base=base, share=0.5)
    before = candidate_set.parameters["thrust_coefficient.relative_change"].tolerance
    assert before > 0.0
    assert free.parameters["rotors.thrust_change"].tolerance == pytest.approx(before)
    assert free.parameters["thrust_coefficient.relative_change"].tolerance == 0.0


def test_the_prior_is_as_wide_as_asked_and_keeps_masses_positive() -> None:
    """Half of the stated mass is one sigma; what the fit may reach stays above zero."""
    vehicle, candidate_set, numbers = quadrotor()
    mass = numbers["mass"]
    free = with_free_numbers(candidate_set, [mass], base=vehicle.robot.links[0], share=0.5)
    parameter = free.parameters[mass.key]
    assert 1.5 * parameter.scale == pytest.approx(0.5 * mass.value)
    assert 0.0 < mass.number(parameter.bounds[0]) < 0.1 * mass.value
    fault = numbers["sensors.accelerometer_bias.bias_x"]
    assert prior_sigma(fault, candidate_set.parameters[fault.key], share=0.5) > 0.0


def test_a_coefficient_of_rotors_is_one_factor_for_all() -> None:
    """A change by a tenth of the relative parameter is a tenth of the coefficient."""
    number = quadrotor()[2][THRUST]
    assert number.key == "rotors.thrust_change"
    assert number.number(0.1) == pytest.approx(1.1 * number.value)
    assert number.change(1.5 * number.value) == pytest.approx(0.5)
