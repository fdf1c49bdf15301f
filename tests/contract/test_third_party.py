"""A stranger's package adds plug-ins and configuration with nothing but its own pyproject."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from seals.cli.main import main
from seals.compare.application import settings_of
from seals.config.compose import compose
from seals.robot.build import build_robot
from seals.run.build import run_settings
from seals.sysid.candidates.catalogue import candidates_of_runs
from seals.testing import check_effect, check_robot
from seals.testing.scenes import Case


def test_the_command_lists_it(site: Path) -> None:
    """``seals list`` shows the stranger's effect with package, version and summary."""
    command = [str(Path(sys.executable).with_name("seals")), "list", "effect"]
    environment = {**os.environ, "PYTHONPATH": str(site)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    row = next(line for line in done.stdout.splitlines() if "vortex_shedding" in line)
    assert "coral-seals 0.4.0" in row
    assert "Mean sideways force" in row


def test_its_effect_composes(coral: Path, pebble: Path) -> None:
    """One override adds the stranger's effect, typed and bounded."""
    added = ["+effect@effects.extra=vortex_shedding", "effects.extra.force_y=0.7"]
    settings = run_settings([f"robot={pebble}", *added])
    assert type(settings.effects["extra"]).__module__ == "coral_seals.effects"
    assert settings.effects["extra"].force_y == 0.7


def test_its_robot_composes(coral: Path) -> None:
    """The stranger's robot is an option like any other, with an effect of its own package."""
    settings = run_settings(["robot=reef_buoy", "water=fossen"])
    assert set(settings.effects) == {"gravity", "buoyancy", "hull_drag", "wake"}
    assert settings.robot.urdf_path.is_file()


def test_its_robot_is_checked(coral: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """``seals check`` takes the stranger's robot by name, as it takes a folder."""
    assert main(["check", "robot=reef_buoy"]) == 0
    by_name = capsys.readouterr().out
    assert "floats" in by_name
    assert main(["check", f"robot={coral / 'coral_seals' / 'reef_buoy'}"]) == 0
    assert capsys.readouterr().out == by_name


def test_its_group_composes(coral: Path, pebble: Path) -> None:
    """The stranger's configuration group is found and can use its effects."""
    settings = run_settings([f"robot={pebble}", "+site=lagoon"])
    assert settings.environment.tank_bottom == -4.0
    assert settings.effects["lagoon_wake"].force_y == 0.3


def test_its_names_are_suggested(
    coral: Path, pebble: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Near misses count the stranger's names in."""
    assert main(["run", f"robot={pebble}", "+effect@effects.a=vortex_sheding"]) == 2
    assert "Did you mean 'vortex_shedding'?" in capsys.readouterr().err
    assert main(["run", f"robot={pebble}", "+site=lagon"]) == 2
    assert "Did you mean 'lagoon'?" in capsys.readouterr().err


@pytest.mark.thorough
def test_its_plugins_keep_the_contract(coral: Path) -> None:
    """The shipped checks take the stranger's effect and robot by name, as they take our own."""
    scene = Case(("surface",), False)
    report = check_effect("vortex_shedding", steps=(0.004, 0.001), cases=[scene])
    assert report.scenes[0].moved > 0.02
    assert check_effect("joint_water_drag", steps=(0.004, 0.001)).scenes[0].moved > 1e-3
    assert check_robot("reef_buoy").mass == 2.0


def test_its_effects_are_compared_on_several_runs(coral: Path) -> None:
    """A comparison of runs in water tries the stranger's force and fault, sized by their units."""
    found = compose(
        ["experiment=slocum_glider", "rivals=[sway_by_yaw,gyroscope_scale]"], root="compare"
    )
    settings = settings_of(found)
    candidate_set = candidates_of_runs(settings, build_robot(settings.robot))
    keys = {c.name: c.keys for c in candidate_set.candidates}
    assert keys["sway_by_yaw"] == ("more_sway_by_yaw_water.derivative",)
    assert len(keys["gyroscope_scale"]) == 3
    assert 0.0 < candidate_set.parameters["more_sway_by_yaw_water.derivative"].scale < 1e3
