"""A run that hides an effect from its log, and the stated model that a diagnosis reads there."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import ConfigError, LogError, RobotError
from seals.logs.native import read_native, write_native
from seals.run.hidden import hide
from seals.sysid.data.robot_description import describe_robot, describe_run, described_by
from seals.sysid.data.vehicle import read_vehicle

ENTRIES = [
    {"name": "quadratic_drag", "instance": "water_drag"},
    {"name": "current", "instance": "drift"},
]


@pytest.fixture(scope="module")
def drifting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A box that a current carries along, which its log does not know."""
    place = tmp_path_factory.mktemp("runs") / "drifting"
    words = ["robot=box", "water=fossen", "wave=airy", "time.duration=0.4", "hide=[current]"]
    more = ["+effect@effects.drift=current", "effects.drift.velocity_x=1.0"]
    assert main(["run", *words, *more, f"hydra.run.dir={place}"]) == 0
    return place


def test_what_is_hidden_acts_and_is_not_listed(drifting: Path) -> None:
    """The box is carried east; the log's stated model holds all but the current."""
    log = read_native(drifting)
    assert log.columns["position_x"][-1] > 0.01
    listed = {entry["instance"] for entry in log.meta["baseline"] if "instance" in entry}
    assert {"gravity", "buoyancy", "water_drag", "added_mass"} <= listed
    assert "drift" not in listed


def test_the_nominal_model_of_a_run_is_its_own_without_what_was_hidden(drifting: Path) -> None:
    """Robot, effects and waves are those of the run, under the names that a diagnosis uses."""
    vehicle = read_vehicle(read_native(drifting).meta, describe_run(drifting))
    names = set(vehicle.effects)
    assert {"gravity", "buoyancy", "quadratic_drag_water", "added_mass_water"} <= names
    assert not any("current" in name or name == "drift" for name in names)
    assert vehicle.sea.amplitude == 0.05
    # the waves of a run push where the water is displaced
    assert "wave_moment" not in names


def test_a_log_of_another_source_is_no_run(tmp_path: Path) -> None:
    """Without the folder of its robot nothing is described."""
    assert describe_run(tmp_path) is None


def test_names_of_effects_and_of_instances_hide() -> None:
    """Both are understood; waves are hidden by that word."""
    none: Any = None
    assert hide(["current"], ENTRIES, none) == ({"drift"}, {})
    assert hide(["water_drag"], ENTRIES, none) == ({"water_drag"}, {})
    assert hide(["waves"], ENTRIES, {"name": "airy"}) == (set(), {"wave": None})


@pytest.mark.parametrize("name", ["curent", "waves"])
def test_what_is_not_there_cannot_be_hidden(name: str) -> None:
    """The refusal says what there is."""
    with pytest.raises(ConfigError, match=f"without={name}.*no such effect") as refusal:
        hide([name], ENTRIES, None, key="without")
    assert "drift" in str(refusal.value)


def test_still_water_has_no_waves_to_hide() -> None:
    """They would be listed as hidden, and a diagnosis would look for them."""
    assert hide(["waves"], ENTRIES, {"wave": "airy"}) == (set(), {"wave": None})
    with pytest.raises(ConfigError, match=r"hide=waves.*no such effect"):
        hide(["waves"], ENTRIES, {"wave": "still"})


def test_a_robot_beside_its_run_keeps_what_the_run_lists(tmp_path: Path) -> None:
    """``robot=`` lifts the links of an arm as the run's own folder does."""
    words = ["robot=free_arm", "water=fossen", "initial.position=[0,0,-2]", "time.duration=0.1"]
    assert main(["run", *words, f"hydra.run.dir={tmp_path / 'swung'}"]) == 0
    meta = read_native(tmp_path / "swung").meta
    own, named = describe_run(tmp_path / "swung"), describe_robot("free_arm")
    assert set(read_vehicle(meta, named).effects) == set(read_vehicle(meta, own).effects)
    assert "buoyancy_links" in read_vehicle(meta, named).effects


def test_joints_that_nobody_describes_are_refused() -> None:
    """A log of links that swing: the robot's folder is asked for."""
    with pytest.raises(LogError, match=r"states no controller[^$]*robot=FOLDER"):
        read_vehicle({"vehicle": {"arm": {"links": []}}, "environment": {}})


def test_a_robot_moves_with_its_log(tmp_path: Path) -> None:
    """A copy of log, metadata and robot says as much as the run's folder, overrides included."""
    words = ["robot=hexacopter", "effects.air_drag.coefficient_x=0.05", "time.duration=0.02"]
    assert main(["run", *words, f"hydra.run.dir={tmp_path / 'flown'}"]) == 0
    write_native(read_native(tmp_path / "flown"), tmp_path / "copy")
    shutil.rmtree(tmp_path / "flown")
    log = read_native(tmp_path / "copy")
    vehicle = read_vehicle(log.meta)
    assert vehicle.name == "hexacopter"
    assert vehicle.effects["quadratic_drag_air"].coefficient_x == 0.05  # type: ignore[attr-defined]
    own = described_by(log.meta)
    assert own is not None
    assert own.robot.links == describe_robot("hexacopter").robot.links


@pytest.mark.parametrize("name", ["/etc/hostname", "../meta.yaml"])
def test_a_robot_in_a_log_reads_nothing_elsewhere(tmp_path: Path, name: str) -> None:
    """Neither the description nor a copy of the log takes a file from outside its folder."""
    assert main(["run", "robot=ball", "time.duration=0.01", f"hydra.run.dir={tmp_path / 'a'}"]) == 0
    place = tmp_path / "a" / "robot" / "robot.yaml"
    place.write_text(place.read_text().replace("ball.urdf", name), encoding="utf-8")
    log = read_native(tmp_path / "a")
    with pytest.raises(RobotError, match="urdf"):
        read_vehicle(log.meta)
    with pytest.raises(LogError, match="outside"):
        write_native(log, tmp_path / "b")
    assert not (tmp_path / "b").exists()


@pytest.mark.parametrize("inside", [True, False])
def test_a_urdf_by_its_full_path_comes_into_the_log(
    tmp_path: Path, pebble: Path, inside: bool
) -> None:
    """A run with ``robot.urdf=`` of its own keeps its log, and the log its robot."""
    (own,) = pebble.glob("*.urdf")
    urdf = own if inside else tmp_path / "elsewhere" / "other.urdf"
    if not inside:
        urdf.parent.mkdir()
        shutil.copyfile(own, urdf)
    words = [f"robot={pebble}", f"robot.urdf={urdf}", "time.duration=0.02"]
    assert main(["run", *words, f"out={tmp_path / 'out'}"]) == 0
    stated = described_by(read_native(tmp_path / "out").meta)
    assert stated is not None
    assert stated.robot.mass.sum() > 0.0
    (copy,) = (tmp_path / "out" / "robot").rglob("*.urdf")
    assert copy.read_bytes() == own.read_bytes()


def test_a_folder_called_robot_stays_its_owners(tmp_path: Path) -> None:
    """A run refuses to write its robot over one that somebody put there."""
    (tmp_path / "robot").mkdir()
    (tmp_path / "robot" / "mine.txt").write_text("mine")
    assert main(["run", "robot=ball", "time.duration=0.01", f"hydra.run.dir={tmp_path}"]) == 2
    assert (tmp_path / "robot" / "mine.txt").read_text() == "mine"


def test_servos_of_a_run_without_a_guide_stand_still(tmp_path: Path) -> None:
    """Nothing commanded them: no commands are asked for, and the motors' inertia stays."""
    words = ["robot=sea_spider", "water=fossen", "initial.position=[0,0,-2]", "time.duration=0.1"]
    assert main(["run", *words, f"hydra.run.dir={tmp_path / 'limp'}"]) == 0
    vehicle = read_vehicle(read_native(tmp_path / "limp").meta, describe_run(tmp_path / "limp"))
    assert not vehicle.servo
    assert vehicle.robot.tree.drive_inertia == (2e-6,) * 24


def test_a_baseline_with_drives_that_the_vehicle_lacks_is_refused() -> None:
    """In words, with what to do."""
    body = {"mass": 1.0, "centre_of_gravity": [0.0] * 3, "inertia": np.eye(3)}
    meta = {"vehicle": body, "environment": {}, "baseline": [{"name": "rotor_thrust"}]}
    with pytest.raises(LogError, match=r"vehicle states no rotors[^$]*robot=FOLDER"):
        read_vehicle(meta)
