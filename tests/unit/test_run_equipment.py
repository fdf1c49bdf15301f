"""The log of a controlled run states drives, servos and battery, and can be diagnosed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from seals.api import make
from seals.cli.main import main
from seals.robot.whole_body import place_on_base
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.schema import parameters_of
from seals.sysid.data.robot_description import describe_robot, stated_robot
from seals.sysid.data.vehicle import Vehicle, read_vehicle

QUAD = (
    "robot=crazyflie",
    "controller=cascade",
    "guide=waypoints",
    "guide.places=[[1.0,0.0,1.0],[1.0,1.0,1.5],[0.0,1.0,1.0],[0.0,0.0,1.5]]",
    "guide.speed=1.5",
    "guide.rest=0.2",
    "guide.delay=0.5",
    "guide.repeat=true",
    "initial.position=[0.0,0.0,1.0]",
    "actuators.rotors.time_constant=[0.03]",
    "sensors.imu.rate=100.0",
    "sensors.imu.accelerometer_noise=0.01",
    "sensors.imu.gyroscope_noise=1.2e-3",
    "time.step=0.004",
)


def meta_of(*words: str) -> dict[str, Any]:
    """Metadata of a short run."""
    record = simulate(run_settings([*words, "time.duration=0.02"]), label="test")
    return dict(record.log.meta)


def test_rotors_servos_and_battery_are_stated() -> None:
    """The manipulator's drives are those of its folder, each with its place and coefficients."""
    meta = meta_of("robot=aam", "guide=hover")
    rotors, servos = (meta["robot"]["actuators"][name] for name in ("rotors", "servos"))
    assert rotors["direction"] == [1.0, -1.0, 1.0, -1.0]
    assert rotors["position"][0] == [0.1697, -0.1697, 0.07]
    assert (rotors["thrust_coefficient"], rotors["radius"]) == ([1.42e-5], [0.127])
    assert servos["kp_each"] == [40.0, 25.0, 10.0, 2.0, 2.0, 2.0]
    assert meta["robot"]["arms"]["arm"]["stowed"] == [1.55, 0.0, 0.0]
    assert meta["robot"]["effects"]["battery"]["capacity"] == 22320.0
    first = stated_robot(meta)["rotors"][0]
    assert (first["time_constant"], first["spin_down"], first["max_speed"]) == (0.05, 0.08, 940.0)
    assert [b["name"] for b in meta["baseline"]][-2:] == ["rotor_thrust", "arm"]


def test_an_inertial_sensor_on_a_link_fixed_to_the_base_is_that_of_the_body() -> None:
    """Its readings have the log's own names, and its place is told in body axes."""
    meta = meta_of("robot=auv", "water=fossen", "sensors.imu.position=[0.1,0.0,0.0]")
    assert {"specific_force", "angular_velocity"} <= set(meta["sensors"]["channels"])
    assert meta["sensors"]["imu"]["position"] == [0.1, 0.0, 0.0]
    assert list(meta["tolerance"]) == ["sensor_delay"]
    robot = describe_robot("auv").robot
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turns = np.repeat(quarter[None], len(robot.links), axis=0)
    tree = replace(robot.tree, origin=robot.tree.origin + 0.5, rotation=turns)
    origin, turn = place_on_base(replace(robot, tree=tree), "imu_link") or (None, None)
    assert np.array_equal(origin, [0.5] * 3)
    assert np.array_equal(turn, quarter)
    assert place_on_base(describe_robot("free_arm").robot, "fore") is None


@pytest.mark.parametrize(
    "words",
    [
        ("robot=aam", "guide=hover", "water=fossen"),
        ("robot=auv", "guide=hover", "water=fossen"),
        ("robot=hexacopter", "guide=hover", "water=none"),
        ("robot=ball", "water=fossen"),
    ],
)
def test_what_a_run_states_of_its_vehicle_is_the_robot_of_its_folder(
    words: tuple[str, ...],
) -> None:
    """Bodies, joints, hulls, drives, gains and laws are the same read either way."""
    meta = meta_of(*words)
    stated = read_vehicle(meta)
    folder = read_vehicle(meta, describe_robot(words[0].partition("=")[2]))
    one, other = stated.robot, folder.robot
    assert one.joints == other.joints
    assert one.links[1:] == other.links[1:]
    for name in ("mass", "centre", "inertia", "lower", "upper"):
        assert np.allclose(getattr(one, name), getattr(other, name), rtol=1e-12, atol=1e-15)
    for name in ("parent", "prismatic", "axis", "origin", "rotation", "drive_inertia"):
        assert np.allclose(getattr(one.tree, name), getattr(other.tree, name), atol=1e-15)
    for own, its in zip(one.hulls, other.hulls, strict=True):
        assert (own is None) == (its is None)
        if own is not None and its is not None:
            assert own.volume == pytest.approx(its.volume, rel=1e-12)
            assert own.centroid == pytest.approx(its.centroid, abs=1e-12)
    assert np.array_equal(stated.lag, folder.lag)
    assert stated.commands == folder.commands
    assert {k: x.tolist() for k, x in stated.servo.items()} == {
        k: x.tolist() for k, x in folder.servo.items()
    }
    assert laws(stated) == laws(folder)


def laws(vehicle: Vehicle) -> set[tuple[Any, ...]]:
    """Return class, links and values of every effect."""
    base = vehicle.robot.links[0]
    return {
        (
            type(effect),
            frozenset("root" if name == base else name for name in effect.links),
            *(float(getattr(effect, p)) for p in parameters_of(effect)),
            *(x for _, c in sorted(effect.constants().items()) for x in np.ravel(c).tolist()),
        )
        for effect in vehicle.effects.values()
    }


def test_thrusters_are_stated() -> None:
    """An underwater vehicle lists its thrusters and no rotors."""
    vehicle = stated_robot(meta_of("robot=auv", "guide=hover", "water=fossen"))
    assert len(vehicle["thrusters"]) == 6
    assert vehicle["rotors"] == []
    assert all(t["max_force"] > 0.0 for t in vehicle["thrusters"])


def test_drives_that_stand_still_are_not_stated() -> None:
    """Without a guide no commands are logged, and nothing claims that rotors act."""
    meta = meta_of("robot=aam")
    assert not read_vehicle(meta).commands
    assert "rotor_thrust" not in [b["name"] for b in meta["baseline"]]


def test_rotors_that_carry_from_the_start_leave_the_height(tmp_path: Path) -> None:
    """Rotors at the speed of hovering keep the height that rotors at rest lose."""
    words = ["robot=aam", "guide=hover", "initial.position=[0.0,0.0,2.0]"]
    words += ["initial.joint_position=[1.55,0.0,0.0,-0.6,-0.6,-0.6]"]
    lost = {}
    for start in ("rest", "carrying"):
        world = make([*words, f"initial.drives={start}"])
        lowest = 2.0
        for _ in range(150):
            world.step()
            lowest = min(lowest, float(world.actors["robot"].body.read().position[2]))
        world.close()
        lost[start] = 2.0 - lowest
    assert lost["rest"] > 0.05
    assert lost["carrying"] < 0.01


@pytest.mark.slow
def test_an_effect_in_a_run_is_named_from_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A drag that the stated model lacks is named from the folder of a simulated flight."""
    monkeypatch.chdir(tmp_path)
    drag = [f"effects.hidden.coefficient_{axis}=0.01" for axis in "xyz"]
    hidden = ["+effect@effects.hidden=linear_drag", "effects.hidden.medium=air", *drag]
    words = ["run", *QUAD, *hidden, "time.duration=12.0", "hydra.run.dir=flight"]
    assert main(words) == 0
    place = Path("flight/meta.yaml")
    meta = yaml.safe_load(place.read_text(encoding="utf-8"))
    meta["baseline"] = [b for b in meta["baseline"] if b.get("instance") != "hidden"]
    place.write_text(yaml.safe_dump(meta), encoding="utf-8")
    assert main(["diagnose", "log=flight", "out=answer"]) == 10
    said = capsys.readouterr().out
    assert "linear_drag" in said
    answer = yaml.safe_load(Path("answer/diagnosis.json").read_text(encoding="utf-8"))
    assert [effect["name"] for effect in answer["effects"]] == ["linear_drag"]
    for value in answer["effects"][0]["parameters"].values():
        assert abs(value["value"] - 0.01) < 5e-4
