"""The vehicle that a diagnosis reads from a log's description: its arm, and what is refused."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.diagnosis import parameters


def link(name: str, parent: str, **joint: Any) -> dict[str, Any]:
    """A link of 100 g with a joint above it."""
    hinge = {"name": f"to_{name}", "parent": parent, "axis": [0, 1, 0], "lower": -1, "upper": 1}
    return {
        "name": name,
        "mass": 0.1,
        "centre_of_gravity": [0.0, 0.0, -0.05],
        "inertia": np.diag([1e-4, 1e-4, 1e-5]).tolist(),
        "joint": {"origin": [0.0, 0.0, -0.1], **hinge, **joint},
    }


def described(links: list[dict[str, Any]], **gains: Any) -> dict[str, Any]:
    """A body with an arm."""
    usual = {"kp": 9.0, "kd": 0.2, "torque_limit": 2.5, "armature": 0.002}
    sigma = {"position": 0.003, "joint_position": 1e-3}
    return {
        "vehicle": {
            "base": {"mass": 2.0, "centre_of_gravity": [0, 0, 0], "inertia": np.eye(3).tolist()},
            "arm": {"links": links, "controller": {**usual, **gains}},
        },
        "environment": {"water_level": None},
        "baseline": [{"name": "gravity"}, {"name": "arm"}],
        "sensors": {"channels": {k: {"sigma": v} for k, v in sigma.items()}},
        "tolerance": {"joint_kp": {"sigma": 0.02}},
    }


def test_gains_may_differ_from_joint_to_joint() -> None:
    """A list of gains reaches every servo, its armature every joint, and the slack of a gear."""
    links = [link("upper", "body"), link("fore", "upper")]
    vehicle = read_vehicle(described(links, kp=[9.0, 4.0], armature=[0.002, 0.001]))
    servos: Any = vehicle.effects["servos"]
    assert servos.of_joints("kp", 2).tolist() == [9.0, 4.0]
    assert servos.of_joints("kd", 2).tolist() == [0.2, 0.2]
    assert tuple(vehicle.robot.tree.drive_inertia) == (0.002, 0.001)
    candidate_set = candidate_set_of(vehicle, speeds=np.ones(3))
    slack: Any = candidate_set.effects["joint_backlash_2"]
    assert slack.kp == 4.0
    assert "servos.kp" not in candidate_set.parameters
    alike = candidate_set_of(read_vehicle(described(links)), speeds=np.ones(3))
    assert alike.parameters["servos.kp"].tolerance == pytest.approx(0.02 * 9.0)


def test_branches_are_read_and_a_fixed_link_becomes_part_of_its_parent() -> None:
    """Two fingers on one link; a tip of 100 g bolted 0.1 m below the second one.

    Its centre of mass is that of 0.1 kg at -0.05 m and 0.1 kg at -0.1 - 0.05 m.
    """
    tip = {**link("tip", "right"), "joint": {"parent": "right", "origin": [0.0, 0.0, -0.1]}}
    links = [link("upper", "body"), link("left", "upper"), link("right", "upper"), tip]
    robot = read_vehicle(described(links, kp=[9.0, 4.0, 4.0])).robot
    assert robot.links == ("base", "upper", "left", "right")
    assert robot.tree.parent == (-1, 0, 1, 1)
    assert robot.mass.tolist() == [2.0, 0.1, 0.1, 0.2]
    assert robot.centre[3] == pytest.approx([0.0, 0.0, -0.1])


def test_an_effect_of_a_run_stays_on_its_links() -> None:
    """The drag of an arm is one beside that of the base, not in its place."""
    log = described([link("upper", "body"), link("fore", "upper")])
    drag = {"name": "linear_drag", "medium": "air", "parameters": {"coefficient_x": 0.1}}
    log["baseline"] += [
        {**drag, "instance": "air_drag", "links": ["body"]},
        {**drag, "instance": "arm_drag", "links": ["upper", "fore"]},
    ]
    effects = read_vehicle(log).effects
    assert effects["linear_drag_air"].links == ["root"]
    assert effects["arm_drag"].links == ["upper", "fore"]


def test_a_joint_is_read_as_a_run_writes_it() -> None:
    """A rail that is turned against its parent and has no stops: a flag, a rotation, no limits."""
    turned = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    rail = link("rail", "body", prismatic=True, rotation=turned)
    rail["joint"] = {k: v for k, v in rail["joint"].items() if k not in ("lower", "upper")}
    robot = read_vehicle(described([rail, link("arm", "rail")])).robot
    assert robot.tree.prismatic == (True, False)
    assert robot.tree.rotation[1].tolist() == turned
    assert robot.tree.rotation[2].tolist() == np.eye(3).tolist()
    assert robot.lower.tolist() == [-math.inf, -1.0]
    assert robot.upper.tolist() == [math.inf, 1.0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"arm": None}, "baseline lists 'arm', but vehicle states no servos"),
        ({"hull": {"primitives": []}}, "hull has no primitives"),
        ({"hull": {"primitives": [{"type": "mesh", "file": "a.stl"}]}}, "holds a 'mesh'"),
    ],
)
def test_a_description_that_lacks_a_part_is_refused(change: dict[str, Any], words: str) -> None:
    """What the baseline holds is described, and a hull consists of shapes without files."""
    log = described([link("upper", "body")])
    body = log["vehicle"]["base"]
    log["vehicle"] = {**log["vehicle"], **body, **change}
    with pytest.raises(LogError, match=words):
        read_vehicle(log)


@pytest.mark.parametrize(("name", "parent"), [("upper", "upper"), ("fore", "nowhere")])
def test_links_in_disorder_are_refused(name: str, parent: str) -> None:
    """A second 'upper' is ambiguous; a link with an unknown parent has no place."""
    with pytest.raises(LogError, match=f"vehicle.arm: '{name}' has the parent '{parent}'"):
        read_vehicle(described([link("upper", "body"), link(name, parent)]))


def test_a_list_of_gains_of_another_length_is_refused() -> None:
    """Two joints and three gains do not go together."""
    links = [link("upper", "body"), link("fore", "upper")]
    with pytest.raises(LogError, match="kd has 3 numbers for 2 joints"):
        read_vehicle(described(links, kd=[1.0, 2.0, 3.0]))


def test_a_load_is_added_never_taken() -> None:
    """A payload of negative mass is no payload: the bounds forbid it."""
    links = [link("upper", "body")]
    parameters = candidate_set_of(read_vehicle(described(links)), speeds=np.ones(3)).parameters
    loads = [f for k, f in parameters.items() if k.startswith("payload") and k.endswith(".mass")]
    assert loads
    assert all(f.bounds[0] == 0.0 for f in loads)


def test_a_load_is_sought_where_the_vehicle_has_its_mass() -> None:
    """A long body carries loads far along its length: the spread of its own mass, from its centre.

    A rod of mass m and length 2 m has a second moment m 4/12 along it.
    """
    rod = described([link("upper", "body")])
    rod["vehicle"]["base"] |= {
        "centre_of_gravity": [0.0, 0.1, 0.0],
        "inertia": np.diag([2.0 * 4.0 / 12.0, 1e-9, 2.0 * 4.0 / 12.0]).tolist(),
    }
    candidate_set = candidate_set_of(read_vehicle(rod), speeds=np.ones(3))
    load = next(
        c for c in candidate_set.candidates if c.name == "payload" and not c.variant["link"]
    )
    spread = [candidate_set.parameters[k].scale for k in load.nuisance]
    assert spread == pytest.approx([0.0, math.sqrt(4.0 / 12.0), 0.0], abs=1e-3)
    effect: Any = candidate_set.effects[load.instance]
    assert effect.position_y == pytest.approx(0.1)
    # the place means nothing without a mass, so that the fit starts from some
    assert load.starts
    assert all(start[0] > 0.0 for start in load.starts)


def test_waves_are_told_in_their_units() -> None:
    """They belong to the water, not to an effect: metres, seconds and radians all the same."""
    floating = described([link("upper", "body")])
    box = {"type": "box", "position": [0, 0, 0], "rpy": [0, 0, 0], "size": [0.3, 0.2, 0.1]}
    floating["vehicle"]["hull"] = {
        "displaced_volume": 0.006,
        "centre_of_buoyancy": [0, 0, 0],
        "plan_area": 0.06,
        "primitives": [box],
    }
    floating["environment"] = {"water_level": 0.0}
    candidate_set = candidate_set_of(read_vehicle(floating), speeds=np.ones(3))
    waves = next(c for c in candidate_set.candidates if c.name == "waves")
    fit: Any = SimpleNamespace(values=dict.fromkeys(waves.keys, 1.0), robust_spread=lambda key: 0.1)
    fitter = SimpleNamespace(
        candidate_set=candidate_set, trajectory=SimpleNamespace(joint_velocity=np.zeros((2, 1)))
    )
    hypothesis: Any = SimpleNamespace(fitter=fitter)
    found = parameters(waves, fit, hypothesis)
    assert [found[k]["unit"] for k in ("amplitude", "period", "direction")] == ["m", "s", "rad"]
