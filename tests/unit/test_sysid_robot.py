"""Stated model of a vehicle from its robot folder: joints, branches, fixed parts, known waves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.log import Log
from seals.robot.whole_body import whole_body
from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.data.known_sea import sea_laws
from seals.sysid.data.robot_description import RobotDescription, describe_robot
from seals.sysid.data.samples import read_samples
from seals.sysid.data.vehicle import read_vehicle

BOX = '<inertia ixx="{0}" ixy="0" ixz="0" iyy="{0}" iyz="0" izz="{0}"/>'


def link(name: str, mass: float, place: str = "0 0 0") -> str:
    """A link with its mass at a place."""
    inertia = BOX.format(0.01 * mass)
    return (
        f'<link name="{name}"><inertial><origin xyz="{place}" rpy="0 0 0"/>'
        f'<mass value="{mass}"/>{inertia}</inertial></link>'
    )


def joint(name: str, kind: str, parent: str, child: str, place: str) -> str:
    """A joint about y."""
    limit = "" if kind == "fixed" else '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{place}" rpy="0 0 0"/><axis xyz="0 1 0"/>{limit}</joint>'
    )


ROBOT = """
urdf: own.urdf
hulls:
  body: {shapes: [{type: box, size: [0.4, 0.3, 0.2]}]}
effects:
  water_drag: {effect: quadratic_drag, medium: water, coefficient_x: 11.0}
  mooring: {effect: tether, anchor_z: -4.0, length: 3.0, stiffness: 50.0}
actuators:
  screws:
    actuator: thrusters
    position: [[0.0, 0.1, 0.0], [0.0, -0.1, 0.0]]
    axis: [[1.0, 0.0, 0.0]]
    time_constant: [0.1, 0.2]
  servos: {actuator: servos, kp_each: [5.0, 2.0, 1.0], armature_each: [0.003, 0.002, 0.001]}
"""


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> RobotDescription:
    """A body with a pod bolted to it, an arm, and two jaws that branch off the arm."""
    folder = tmp_path_factory.mktemp("own")
    # the file lists the right jaw and the joints of the jaws before the arm's
    parts = [
        link("body", 10.0, "0.01 0 -0.02"),
        link("pod", 2.0),
        link("arm", 0.5, "0 0 -0.1"),
        link("left", 0.1, "0 0 -0.05"),
        link("right", 0.1, "0 0 -0.05"),
        joint("right_joint", "revolute", "arm", "right", "0 -0.02 -0.2"),
        joint("left_joint", "revolute", "arm", "left", "0 0.02 -0.2"),
        joint("shoulder", "revolute", "body", "arm", "0 0 -0.1"),
        joint("pod_mount", "fixed", "body", "pod", "0 0.3 0"),
    ]
    (folder / "own.urdf").write_text(f'<robot name="own">{"".join(parts)}</robot>')
    (folder / "robot.yaml").write_text(ROBOT)
    return describe_robot(str(folder))


def meta(**changes: Any) -> dict[str, Any]:
    """Metadata of a log that say nothing of the vehicle."""
    channels = {n: {"sigma": 0.01} for n in ("position", "orientation", "joint_position")}
    return {
        "environment": {"gravity": [0.0, 0.0, -9.81], "water_level": 0.0},
        "battery": {"full_voltage": 16.0},
        "sensors": {"channels": channels, "imu": {"position": [0.1, 0.0, 0.0]}},
        "tolerance": {"tether_stiffness": {"sigma": 0.1}, "tether_length": {"sigma": 0.02}},
        **changes,
    }


def test_fixed_parts_are_merged_and_branches_stay(own: RobotDescription) -> None:
    """Of five links four are left; mass, centre and inertia of the whole are those of before."""
    vehicle = read_vehicle(meta(), own)
    assert vehicle.robot.links == ("body", "arm", "right", "left")
    assert vehicle.robot.tree.parent == (-1, 0, 1, 1)
    for found, stated in zip(whole_body(vehicle.robot), whole_body(own.robot), strict=True):
        assert np.allclose(found, stated, atol=1e-12)
    assert vehicle.robot.centre[0] == pytest.approx([10.0 * 0.01 / 12.0, 0.05, -0.2 / 12.0])


def test_effects_are_found_under_the_names_of_a_log(own: RobotDescription) -> None:
    """Drag, thrusters, servos, weight and buoyancy; each knows its key in robot.yaml."""
    vehicle = read_vehicle(meta(), own)
    assert vehicle.effects["quadratic_drag_water"].coefficient_x == 11.0  # type: ignore[attr-defined]
    assert {"gravity", "buoyancy", "thrusters", "servos", "tether"} <= set(vehicle.effects)
    assert vehicle.written["thrusters"] == "actuators.screws"
    assert vehicle.written["quadratic_drag_water"] == "effects.water_drag"
    assert vehicle.commands == "thruster_cmd"
    assert vehicle.lag.tolist() == [0.1, 0.2]
    assert vehicle.servo["kp"].tolist() == [5.0, 2.0, 1.0]
    assert vehicle.robot.tree.drive_inertia == (0.003, 0.002, 0.001)
    assert vehicle.full_voltage == 16.0


def test_an_effect_of_another_robot_acts_on_the_base(own: RobotDescription) -> None:
    """A run of another robot drags a pod; here the pod is part of the base."""
    drag = {"name": "linear_drag", "medium": "air", "parameters": {"coefficient_x": 0.1}}
    vehicle = read_vehicle(meta(baseline=[{**drag, "instance": "pod_drag", "links": ["pod"]}]), own)
    assert vehicle.effects["linear_drag_air"].links == ["root"]
    assert vehicle.bound.names == tuple(vehicle.effects)


def test_joint_columns_follow_the_urdf(own: RobotDescription) -> None:
    """The log lists joints as the file does; the model as the tree does. Names in it rule."""
    vehicle = read_vehicle(meta(), own)
    assert own.listed == ("right_joint", "left_joint", "shoulder")
    assert vehicle.robot.joints == ("shoulder", "right_joint", "left_joint")
    rows = np.arange(20.0)
    columns = {"t": 0.01 * rows} | {f"joint_position_{k}": rows + 100 * k for k in (1, 2, 3)}
    columns |= {f"joint_position_cmd_{k}": rows + 1000 * k for k in (1, 2, 3)}
    columns |= {f"thruster_cmd_{k}": 0.0 * rows for k in (1, 2)}
    columns |= {f"position_{a}": 0.0 * rows for a in "xyz"}
    columns |= {f"orientation_{a}": 0.0 * rows + (a == "w") for a in "wxyz"}
    samples = read_samples(Log(name="own", columns=columns, meta=meta()), vehicle)
    assert samples.channels["joint_position"][0].tolist() == [300.0, 100.0, 200.0]
    assert samples.joint_command[0].tolist() == [3000.0, 1000.0, 2000.0]
    named = read_vehicle(meta(joints=["shoulder", "right_joint", "left_joint"]), own)
    assert named.columns == (0, 1, 2)
    with pytest.raises(LogError, match="not 'left_joint'"):
        read_vehicle(meta(joints=["shoulder", "right_joint"]), own)


def test_joints_that_no_log_measures_are_held(own: RobotDescription) -> None:
    """Without joint angles the whole robot is one body of the same mass."""
    vehicle = read_vehicle(meta(sensors={"channels": {"position": {"sigma": 0.01}}}), own)
    assert vehicle.robot.links == ("body",)
    assert vehicle.mass == pytest.approx(12.7)
    assert "servos" not in vehicle.effects
    assert not vehicle.servo


def test_a_mooring_has_its_tolerances_and_a_tether_may_be_missing_beside_it(
    own: RobotDescription,
) -> None:
    """Stiffness and length of the mooring move within what the log states."""
    candidates = candidate_set_of(read_vehicle(meta(), own), speeds=np.ones(3))
    assert candidates.parameters["tether.stiffness"].tolerance == pytest.approx(5.0)
    assert candidates.parameters["tether.length"].tolerance == pytest.approx(0.02)
    assert candidates.effects["tether"].stiffness == 50.0  # type: ignore[attr-defined]
    assert any(c.name == "tether" for c in candidates.candidates)


def test_known_waves_are_those_of_each_log(own: RobotDescription) -> None:
    """At one point the surface is that of the log to which the time belongs, on its own time."""
    parts = [
        {
            "name": name,
            "rows": 10,
            "begin": begin,
            "shift": begin - first,
            "sigma": {},
            "baseline": [
                {
                    "name": "waves",
                    "medium": "water",
                    "parameters": {"amplitude": 0.1, "period": 2.0, "phase": phase},
                }
            ],
        }
        for name, begin, first, phase in (("a", 0.0, 7.0, 0.3), ("b", 40.0, 2.0, 1.1))
    ]
    vehicle = read_vehicle(meta(logs=parts), own)
    time = np.array([[0.5], [40.5]])
    found = vehicle.sea.at(np.zeros((2, 3)), time, 0.0).elevation[:, 0]
    angles = np.array([0.3 - np.pi * 7.5, 1.1 - np.pi * 2.5])
    crest = 0.5 * np.pi**2 / 9.81 * 0.1**2
    expected = 0.1 * np.cos(angles) + crest * np.cos(2.0 * angles)
    assert found == pytest.approx(expected, abs=1e-12)
    names = {c.name for c in candidate_set_of(vehicle, speeds=np.ones(3)).candidates}
    assert "waves" not in names


def test_waves_of_a_log_have_sharper_crests() -> None:
    """A crest of Stokes' second order is higher by k a^2 / 2, and a trough as much less deep."""
    law = sea_laws()["waves"]
    linear = law(amplitude=0.1, period=2.0)
    sharp = law.of_log(amplitude=0.1, period=2.0, direction=0.0, phase=0.0)
    for time, side in ((0.0, 1.0), (1.0, -1.0)):
        at = (np.zeros((1, 3)), np.array([[time]]), 0.0)
        before, after = linear.at(*at).elevation[0, 0], sharp.at(*at).elevation[0, 0]
        assert before == pytest.approx(side * 0.1)
        assert after - before == pytest.approx(0.5 * linear.wavenumber * 0.01)


def test_the_rise_of_sharp_crests_is_the_rate_of_the_surface() -> None:
    """Speed along the normal and slope agree with differences of the elevation."""
    sea = sea_laws()["waves"].of_log(amplitude=0.1, period=2.0, direction=0.4, phase=0.2)
    place, step = np.array([[0.3, -0.2, 0.0]]), 1e-6

    def height(shift: float, time: float) -> float:
        moved = place + shift * np.array([[np.cos(0.4), np.sin(0.4), 0.0]])
        return float(sea.at(moved, np.array([[time]]), 0.0).elevation[0, 0])

    found = sea.at(place, np.array([[0.7]]), 0.0)
    rate = (height(0.0, 0.7 + step) - height(0.0, 0.7 - step)) / (2 * step)
    slope = (height(step, 0.7) - height(-step, 0.7)) / (2 * step)
    assert found.rise[0, 0] == pytest.approx(rate / np.hypot(1.0, slope), rel=1e-6)
    assert found.normal[0, 0] / found.normal[0, 2] == pytest.approx(-slope * np.cos(0.4), rel=1e-6)


def test_links_of_a_folder_float_in_a_run_that_lists_buoyancy() -> None:
    """A run lists one buoyancy for all links; without it nothing floats."""
    entry = {"name": "buoyancy", "instance": "buoyancy", "links": ["*"], "medium": "water"}
    others = [{"name": "gravity", "instance": "gravity", "links": ["*"]}]
    aam = describe_robot("aam")
    made = read_vehicle(meta(baseline=[*others, entry]), aam).effects
    assert made["buoyancy"].links == ["root"]
    assert {"upper", "fore", "palm"} <= set(made["buoyancy_links"].links)
    assert not any("buoyancy" in name for name in read_vehicle(meta(baseline=others), aam).effects)


def test_commands_of_a_run_act_at_their_row(own: RobotDescription) -> None:
    """Those of another log up to a millisecond later."""
    assert read_vehicle(meta(), own).command_latency == pytest.approx(0.5e-3)
    run = read_vehicle(meta(simulated={"seed": 0, "step": 0.004, "run": "run"}), own)
    assert run.command_latency == 0.0
    assert run.simulated_step == pytest.approx(0.004)
