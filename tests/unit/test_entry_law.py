"""Course of an entering added mass: by waterline in runs, by the share in logs that state none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import LogError
from seals.logs.native import read_native
from seals.plugins.effects.added_mass import AddedMass, EntryLaw
from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.data.robot_description import describe_robot, describe_run
from seals.sysid.data.vehicle import read_vehicle

BALL = ("robot=ball", "water=fossen", "initial.position=[0,0,-3]", "time.duration=0.1")
SHARE = "effects.added_mass.entry=submerged_share"


def meta_of(place: Path, *words: str) -> dict[str, Any]:
    """Return the metadata of a short run of a ball."""
    assert main(["run", *BALL, *words, f"hydra.run.dir={place}"]) == 0
    return dict(read_native(place).meta)


def entries(vehicle: Any) -> set[EntryLaw]:
    """Return the courses in the stated model and in the candidates of a diagnosis."""
    found = candidate_set_of(vehicle, speeds=np.ones(3)).effects.values()
    own = [*vehicle.effects.values(), *found]
    return {e.entry for e in own if isinstance(e, AddedMass)}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ((), EntryLaw.waterline),
        ((SHARE,), EntryLaw.submerged_share),
        (("hide=[added_mass]",), EntryLaw.waterline),
    ],
)
def test_a_run_is_diagnosed_by_the_course_of_its_simulation(
    tmp_path: Path, words: tuple[str, ...], expected: EntryLaw
) -> None:
    """From the log alone, from the robot of the run, and from the robot's folder."""
    meta = meta_of(tmp_path / "run", *words)
    for robot in (None, describe_run(tmp_path / "run"), describe_robot("ball")):
        assert entries(read_vehicle(meta, robot)) == {expected}


def test_a_log_that_states_no_course_means_the_share(tmp_path: Path) -> None:
    """So the format defines it: with the vehicle of the log, and with a robot of a folder."""
    meta = meta_of(tmp_path / "run")
    del meta["simulated"]
    added = next(e for e in meta["baseline"] if e["name"] == "added_mass")
    added.pop("instance")
    assert added["options"] == {"entry": "waterline"}
    assert entries(read_vehicle(meta)) == {EntryLaw.waterline}
    assert entries(read_vehicle(meta, describe_robot("ball"))) == {EntryLaw.waterline}
    for baseline in ([added | {"options": {}}], []):
        meta["baseline"] = baseline
        for robot in (None, describe_robot("ball")):
            assert entries(read_vehicle(meta, robot)) == {EntryLaw.submerged_share}


def test_a_course_that_there_is_not_is_refused(tmp_path: Path) -> None:
    """On the command line and in a log, with the nearest word."""
    meta = meta_of(tmp_path / "run")
    added = next(e for e in meta["baseline"] if e["name"] == "added_mass")
    added["options"] = {"entry": "water_line"}
    for robot in (None, describe_robot("ball")):
        with pytest.raises(LogError, match="Did you mean 'waterline'"):
            read_vehicle(meta, robot)
