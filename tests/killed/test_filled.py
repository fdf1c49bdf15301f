"""Commands on a disk that is really full, and what becomes of them once there is room."""

from __future__ import annotations

import contextlib
import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import yaml

from benchmarks.fault_cases import CASES
from seals.logs.table import read_parquet

if TYPE_CHECKING:
    from tests.killed.conftest import Killer

SMALL, LARGE = "160k", "64m"
COMMANDS: dict[str, list[str]] = {
    "run": [
        *("run", "robot=ball", "water=fossen", "environment.tank_bottom=-0.2", "checkpoint=0.05"),
        *("initial.position=[0,0,0.2]", "time.duration=3", "time.step=0.001", "hydra.run.dir={}/a"),
    ],
    "train": [
        *("train", "env=reach", "task.duration=0.2", "count=2", "learner.hidden=[64,64]"),
        *("learner.batch=4", "learner.random_steps=4", "course.steps=40", "course.look_every=20"),
        *("course.log_every=10", "course.episodes=2", "course.checkpoint=0.01"),
        "hydra.run.dir={}/a",
    ],
    "record": ["record", "env=reach", "episodes=8", "out={}/a"],
    # the folder of the first life is whole and stays
    "record as HDF5": ["record", "env=reach", "episodes=6", "out=first", "hdf5={}/b.hdf5"],
    "evaluate": ["evaluate", "env=reach", "policy=scripted", "episodes=2", "out={}/a"],
    "convert": ["convert", "log=long.csv", "reader=csv", "out={}/a"],
    "compare": ["compare", "experiment=falling_balls", "only=[bowling_ball]", "out={}/a"],
    "add": ["add", "diagnosis=diagnosis.json", "name=other", "folder={}/a"],
    "verify": ["verify", "log=hidden_effect/flight_b", "model=models/found.yaml", "out={}/a"],
    "sweep": [
        *("run", "-m", "robot=ball", "time.step=0.01", "initial.position=[0,0,1]"),
        *("time.duration=0.5", "seed=1,2,3", "hydra.sweep.dir={}/a"),
    ],
    "render": [
        *("render", "run=flown", "viewer@renderer=raycast", "width=64", "height=48"),
        *("film=false", "fps=200", "out={}/a"),
    ],
    "diagnose": ["diagnose", "log=short", "plan=false", "processes=1", "out={}/a"],
    "teleop": [
        *("teleop", "robot=auv", "script=keys.yaml", "time.step=0.004", "hydra.run.dir={}/a"),
    ],
    "calibrate": [
        *("calibrate", "log=swum", "robot=auv", "plan=false", "report=false", "apply=true"),
        *("parameters=[effects.water_drag.coefficient_x]", "out={}/a"),
    ],
}
ROOM = {"add": "0", "verify": "16k", "sweep": "48k", "render": "16k", "calibrate": "32k"}
ROOM |= {"diagnose": "16k", "teleop": "64k", "evaluate": "16k"}
"""Room of those that write less; none at all where a single file is written."""


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of a few kilobytes, in memory."""
    place = tmp_path / "disk"
    place.mkdir()
    options = ("-t", "tmpfs", "-o", f"size={SMALL}", "tmpfs", str(place))
    if subprocess.run(["mount", *options], capture_output=True, check=False).returncode:
        pytest.skip("a disk of its own needs root")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.killed
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_on_a_full_disk(
    name: str, killer: Killer, disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ends in two lines; every file in sight is whole; with room it comes to its end."""
    monkeypatch.chdir(killer.folder)
    if name in CASES:
        CASES[name].prepare(killer.folder)
    if name in ROOM:
        _leave(disk, ROOM[name])
    (killer.folder / "keys.yaml").write_text("- {t: 0.5, hold: w, seconds: 2}\n")
    noise = np.random.default_rng(1).normal(size=40_000)
    lines = "\n".join(f"{k / 1000},{depth}" for k, depth in enumerate(noise))
    (killer.folder / "long.csv").write_text(f"t,depth\n{lines}\n")
    words = [word.format(disk) for word in COMMANDS[name]]
    code, said = killer.finish(words)
    assert code == 2, said
    assert "no space left on the disk" in said or "No space left on device" in said
    assert "Traceback" not in said
    for path in disk.rglob("*"):
        if path.is_file() and not any(p.startswith(".") for p in path.relative_to(disk).parts):
            _read(path)
    subprocess.run(["mount", "-o", f"remount,size={LARGE}", str(disk)], check=True)
    again = [word.replace("=first", "=second") for word in words]
    if name == "sweep":
        again = ["run", f"resume={disk}/a"]
    elif (disk / "a" / "checkpoint").exists():
        again = ["run", f"resume={disk}/a", f"hydra.run.dir={disk}/b"]
    code, said = killer.finish(again)
    assert code == (CASES[name].code if name in CASES else 0), said


def _leave(disk: Path, room: str) -> None:
    """Leave so much room on a disk."""
    if room != "0":
        subprocess.run(["mount", "-o", f"remount,size={room}", str(disk)], check=True)
        return
    with contextlib.suppress(OSError), (disk / ".filler").open("wb", buffering=0) as file:
        while file.write(bytes(4096)):
            pass


def _read(path: Path) -> Any:
    """Read a file to its end, as whoever uses it would."""
    if path.suffix == ".parquet":
        return read_parquet(path)
    if path.suffix in (".json", ".yaml"):
        return {".json": json.loads, ".yaml": yaml.safe_load}[path.suffix](path.read_text())
    return path.read_bytes()
