"""A responsibility has one implementation: its like is found nowhere else."""

from __future__ import annotations

import functools
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "architecture.md"
ONE = {
    r"class \w*Allocation\b": {"seals/control/allocation.py"},
    r"class \w*Cascade\b": {"plugins/controllers/cascade/controller.py"},
    r"class \w*Kinematics\b": {"seals/multibody/kinematics.py"},
    r"class \w*Environments\b": {"seals/learn/environments/batch.py"},
    # a folder and a log's description go through one builder; held links are merged in the other
    r"\bRobotModel\(": {"seals/robot/build.py", "seals/robot/fusing.py"},
    r"def lean_\w+": {"seals/control/attitude.py"},
    r"\blean_for\(": {
        "seals/control/attitude.py",
        "plugins/controllers/cascade/controller.py",
        "plugins/controllers/station.py",
    },
    r"class \w*Gains\b": {"plugins/controllers/cascade/gains.py"},
    r"def (runge_kutta|rosenbrock|midpoint)\w*": {"seals/batch/state.py"},
    r"\bImage\.open\(": {"seals/picture_files.py"},
    r"\btrimesh\.load\w*\(": {"seals/hydrostatics/meshes.py"},
    # files of ours are read as typed values, by `read_file`
    r"\bread_plain_yaml\(": {
        "seals/untrusted_io.py",
        "seals/config/strangers.py",
        "seals/sweep/job.py",
        "seals/sweep/metrics.py",
    },
    r"def stowed\(": {"seals/control/limbs.py"},
    # states moved by errors: trajectories, start states, linearisation
    r"exponential\((d|error|deviations?)\[:, 3:6\]\)": {"seals/batch/state.py"},
    r'"a law"': {"seals/errors.py"},
    r"with a decimal point": {"seals/robot/structure.py"},
    r"does not name its \{": {"seals/robot/robot_file.py"},
    r"def column_names\(": {"seals/logs/channels.py"},
    # places of links on the base; the other makes kinematics of them
    r"forward\(.*np\.eye\(3\)\[None\]": {
        "seals/multibody/tree.py",
        "seals/effects/joint_inertia.py",
    },
    r"exists already\.\\n": {"seals/file_names.py", "seals/logs/atomic.py"},
    r"is not given\.\\nSay which: \{": {"seals/errors.py"},
    r"get\(\)\.runtime\.output_dir": {"seals/config/compose.py", "seals/cli/hydra_app.py"},
    r'"diagnosis\.json"': {"seals/file_names.py"},
    r"np\.cumprod\(np\.where\(dots": {"seals/logs/resample.py"},
    r'"\.bag"': {"seals/file_names.py"},
    # numbers of a dataclass out of order: `check_order`
    r"\.nearest < self\.farthest": set(),
    r"\bsetrlimit\(": {
        "seals/isolated_reading.py",
        # a copy of this process that tries native code, and reads nothing
        "plugins/backends/pybullet/trial.py",
    },
}
"""What marks a responsibility, and the files that may hold it."""
TWINS = re.compile(r"(^|_)(batched|many|single)(_|$)")
"""Names of modules that held a law once more, for one robot or for many."""
PLACES = ("seals/control", "seals/multibody", "seals/batch", "plugins/controllers")


@functools.cache
def sources() -> dict[str, str]:
    """Return the text of every module of the core and the plug-ins, by its path."""
    return {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for top in ("seals", "plugins")
        for path in (ROOT / top).rglob("*.py")
    }


@pytest.mark.parametrize("mark", ONE)
def test_what_marks_a_responsibility_stands_in_its_module(mark: str) -> None:
    """There, and nowhere else."""
    assert {path for path, text in sources().items() if re.search(mark, text)} == ONE[mark]


def test_no_law_has_a_module_for_many_beside_the_one() -> None:
    """One robot is a batch of one."""
    found = [p for p in sources() if p.startswith(PLACES) and TWINS.search(Path(p).stem)]
    assert found == []


def test_the_modules_that_the_page_names_are_there() -> None:
    """Each path of the table "One of each", from the root or from the core."""
    table = (
        PAGE.read_text(encoding="utf-8")
        .partition("## One implementation of each responsibility")[2]
        .partition("\n## ")[0]
    )
    rows = [line for line in table.splitlines() if line.startswith("| ")]
    paths = re.findall(r"`([\w/]+(?:\.py|/))`", "\n".join(rows))
    assert len(paths) > 15
    lost = [
        path
        for path in paths
        if not any((ROOT / top / path).exists() for top in ("", "seals", "seals/control"))
    ]
    assert lost == []
