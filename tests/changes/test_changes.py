"""What a change of SEALS costs: patches are applied to a copy of the tree, and the new thing runs.

A patch that no longer applies is written anew for the present sources. More files than `MOST` mean
that one thing is written down in too many places.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import tomllib

ROOT = Path(__file__).parents[2]
FOLDER = Path(__file__).parent
MOST = 4
"""Most files that one of these changes may touch."""
PARTS = ("plugins", "conf", "robots", "animals", "experiments")
"""Folders that are installed as packages below `seals`."""
CHECKS = {
    "unit": """
import numpy as np
from seals.logs.units import to_si
assert to_si(np.array([2.0]), "Wh", expected="J").tolist() == [7200.0]
""",
    "log_channel": """
from seals.logs.channels import CHANNELS, column_names
assert CHANNELS["salinity"].aside and CHANNELS["salinity"].unit == "1"
assert column_names("salinity", 1, "salinity") == ["salinity"]
""",
    "step_rule": """
import numpy as np
from seals.least_squares import FixedShare, Iterate, minimise

class Halfway:
    def __init__(self):
        self.x = np.array([3.0, -8.0])
    def linearise(self, tasks):
        for task in tasks:
            task.linear = True
    def evaluate(self, tasks, proposals):
        return [[Found(self.x * (1.0 - p.share)) for p in row] for row in proposals]
    def keep(self, task, outcome):
        self.x = outcome.x

class Found:
    def __init__(self, x):
        self.x, self.cost = x, float(x @ x)

model, task = Halfway(), Iterate(cost=73.0)
minimise(model, [task], FixedShare(share=0.5), steps=20)
assert task.steps == 20
assert np.allclose(model.x, np.array([3.0, -8.0]) / 2.0**20, rtol=1e-12, atol=0.0)
""",
    "actuator": """
import numpy as np
from seals.config.build import build_from_values
from seals.motion import Inputs
from seals.registry import names
assert "jets" in names("actuator")
made = build_from_values("actuator", "jets", {"max_force": [9.0]}, {}, where="actuators.jets")
inputs = Inputs(step=0.01, joint_torque=np.zeros((2, 0)), drive=np.array([[-5.0], [7.0]]))
found = made.drives(inputs, made.constants())
assert found.thrust.ravel().tolist() == [0.0, 7.0]
""",
    "verb_option": """
from seals.run.build import run_settings
from seals.run.simulation import simulate
record = simulate(run_settings(["robot=ball", "note=calm", "time.duration=0.01"]), label="test")
assert record.log.meta["notes"] == "calm"
""",
}
"""What each change makes possible, as a program that fails without it."""


def copied(place: Path) -> Path:
    """Copy the packages of the tree, and what is installed of them, to a folder."""
    ignored = shutil.ignore_patterns("__pycache__", "*.parquet", "*.npz", "*.pyc")
    for part in ("seals", *PARTS):
        shutil.copytree(ROOT / part, place / part, ignore=ignored)
    shutil.copyfile(ROOT / "pyproject.toml", place / "pyproject.toml")
    return place


def installed(place: Path) -> None:
    """Write the metadata of a copy as an installation would, and put its packages below `seals`."""
    for part in PARTS:
        (place / "seals" / part).symlink_to(place / part, target_is_directory=True)
    project = tomllib.loads((place / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    folder = place / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    lines = [
        line
        for group, entries in project["entry-points"].items()
        for line in (f"[{group}]", *(f"{name} = {value}" for name, value in entries.items()))
    ]
    (folder / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


def ran(place: Path, program: str) -> subprocess.CompletedProcess[str]:
    """Run a program that sees the copy as the installed SEALS."""
    own = f"import seals\nassert seals.__file__.startswith({str(place)!r}), seals.__file__\n"
    return subprocess.run(
        [sys.executable, "-c", own + program],
        env={**os.environ, "PYTHONPATH": str(place)},
        cwd=place,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.mark.parametrize("name", CHECKS)
def test_a_change_touches_few_files_and_works(tmp_path: Path, name: str) -> None:
    """Its patch applies, touches up to four files, and the program that failed before passes."""
    patch = FOLDER / f"{name}.patch"
    touched = set(re.findall(r"^\+\+\+ b/(\S+)$", patch.read_text(encoding="utf-8"), re.MULTILINE))
    assert 1 <= len(touched) <= MOST
    place = copied(tmp_path.resolve() / "tree")
    without = tmp_path.resolve() / "without"
    shutil.copytree(place, without)
    installed(without)
    assert ran(without, "from seals.registry import names; names('effect')").returncode == 0
    assert ran(without, CHECKS[name]).returncode == 1
    subprocess.run(["git", "apply", str(patch)], cwd=place, check=True, timeout=60)
    installed(place)
    done = ran(place, CHECKS[name])
    assert done.returncode == 0, done.stderr


def test_every_patch_has_a_program() -> None:
    """No patch lies there that nothing runs."""
    assert {path.stem for path in FOLDER.glob("*.patch")} == set(CHECKS)
