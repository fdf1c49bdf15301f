"""An ordinary user, an installation and a home that cannot be written to: everything runs."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import pytest

import seals
from seals.caches import HOME, TORCH
from seals.child_process import command, environment
from seals.logs.shipped import shipped_logs

NOBODY = 65534
PARTICLES = [
    "robot=ball",
    "water=particles",
    "fluid.spacing=0.05",
    "fluid.size=[0.5,0.5,0.35]",
]
TRAIN = [
    *("train", "env=reach", "learner=sac", "task.duration=0.2", "count=2", "learner.hidden=[8]"),
    *("learner.batch=4", "learner.random_steps=4", "course.steps=12", "course.look_every=12"),
    *("course.log_every=12", "course.episodes=1", "hydra.run.dir=t"),
]
DIAGNOSE = ["diagnose", "log=hidden_effect/flight_a", "plan=false", "processes=2", "out=d"]
SHORT = ["time.step=0.01", "time.duration=0.05", "initial.position=[0,0,0.3]"]


USER = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]
READS = [f"--{kind}=-all,+dac_read_search" for kind in ("inh-caps", "ambient-caps", "bounding-set")]
"""The right to read everything and no other: the interpreter may lie in root's own home."""


@pytest.fixture(scope="module")
def place() -> Iterator[Place]:
    """A working folder of a user who owns nothing else; its home is read-only."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0 or shutil.which(USER[0]) is None:
        pytest.skip("only root, with setpriv, can become another user here")
    root = Path(tempfile.mkdtemp(prefix="unprivileged-"))
    root.chmod(0o755)
    for name in ("home", "work"):
        (root / name).mkdir()
    os.chown(root / "work", NOBODY, NOBODY)
    (root / "home").chmod(0o555)
    try:
        probes = [Place(root, [*USER, *more]) for more in ([], READS)]
        found = [probe for probe in probes if probe.can_start()]
        if not found:
            pytest.skip("another user can neither read this installation nor be given the right")
        yield found[0]
    finally:
        shutil.rmtree(root)


class Place(NamedTuple):
    """Where another user works, and the words that make one.

    Args:
        root: folder with ``home`` and ``work``.
        user: command in front of another.
    """

    root: Path
    user: list[str]

    def can_start(self) -> bool:
        """Return true where the user can start a verb, and from it another process."""
        child = self.root / "work" / "child.py"
        words = "import subprocess, sys; sys.exit(subprocess.call([sys.executable, '-c', '']))"
        child.write_text(words, encoding="utf-8")
        child.chmod(0o644)
        try:
            return self.start("--version").returncode == 0 and self.python(child).returncode == 0
        finally:
            child.unlink()

    def start(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a verb to its end."""
        return self.python(Path(seals.__file__).parent / "cli" / "__main__.py", *words)

    def python(self, file: Path, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a file to its end."""
        surroundings = {**environment(), "HOME": str(self.root / "home")}
        surroundings |= {"PYTHONDONTWRITEBYTECODE": "1", "OPENBLAS_NUM_THREADS": "1"}
        for name in (HOME, *TORCH, "MPLCONFIGDIR"):
            surroundings.pop(name, None)
        return subprocess.run(
            [*self.user, *command(file, *words)],
            cwd=self.root / "work",
            env=surroundings,
            capture_output=True,
            text=True,
            check=False,
            timeout=500,
        )


@pytest.mark.thorough
@pytest.mark.parametrize(
    "commands",
    [
        [["list"]],
        [["check", "robot=ball"]],
        [["run", "robot=ball", *SHORT, "hydra.run.dir=a"], ["runs", "a"]],
        [["convert", "log=own_flight/flight_1.ulg.gz", "out=c"]],
        [["run", "robot=ball", "seed=1,2", *SHORT, "hydra.sweep.dir=s", "--multirun"]],
    ],
    ids=["list", "check", "run_runs", "convert", "run_sweep"],
)
def test_verbs_of_an_ordinary_user(place: Place, commands: list[list[str]]) -> None:
    """Nothing but the working folder is written to."""
    for words in commands:
        done = place.start(*words)
        assert done.returncode == 0, done.stderr[-2000:]
        assert "Traceback" not in done.stderr
    assert not list((place.root / "home").iterdir())


@pytest.mark.slow
def test_particles_of_an_ordinary_user(place: Place) -> None:
    """Compiled code finds a folder; that it is not kept is said once."""
    if find_spec("taichi") is None:
        pytest.skip("taichi is not installed")
    done = place.start("run", *PARTICLES, *SHORT, "hydra.run.dir=p")
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stderr.count("the cache 'taichi' is used only by this process") == 1
    assert (place.root / "work" / "p" / "log.parquet").is_file()
    assert not list((place.root / "home").iterdir())


@pytest.mark.slow
def test_a_training_of_an_ordinary_user(place: Place) -> None:
    """Nothing but the working folder is written to, by the libraries of learning either."""
    if find_spec("torchrl") is None:
        pytest.skip("the extra learn is not installed")
    done = place.start(*TRAIN)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "Traceback" not in done.stderr
    assert (place.root / "work" / "t" / "policy" / "policy.safetensors").is_file()
    assert not list((place.root / "home").iterdir())


@pytest.mark.slow
def test_a_diagnosis_of_an_ordinary_user(place: Place) -> None:
    """Processes of its own, pictures and page: the working folder holds all of it."""
    done = place.start(*DIAGNOSE)
    assert done.returncode == 10, done.stderr[-2000:]
    assert "Traceback" not in done.stderr
    assert (place.root / "work" / "d" / "report.html").is_file()
    assert not list((place.root / "home").iterdir())


@pytest.mark.slow
def test_calibration_and_verification_of_an_ordinary_user(place: Place) -> None:
    """A model of an answer is added and verified, numbers are calibrated, in the working folder."""
    wind = {"name": "wind", "parameters": {"velocity_x": {"value": 1.5, "low90": 1, "high90": 2}}}
    answer = {
        "verdict": "named",
        "effects": [wind],
        "log": {"path": str(shipped_logs()["hidden_effect/flight_a"])},
    }
    file = place.root / "work" / "diagnosis.json"
    file.write_text(json.dumps(answer), encoding="utf-8")
    file.chmod(0o644)
    calibrate = ["calibrate", "log=hidden_effect/flight_a", "parameters=[mass]", "plan=false"]
    for words, made in (
        (["add", "diagnosis=diagnosis.json", "name=m"], "models/m.yaml"),
        (["verify", "log=hidden_effect/flight_b", "model=m", "out=v"], "v/verify.json"),
        ([*calibrate, "out=k"], "k/report.html"),
    ):
        done = place.start(*words)
        assert done.returncode in (0, 14), done.stderr[-2000:]
        assert "Traceback" not in done.stderr
        assert (place.root / "work" / made).is_file()
    assert not list((place.root / "home").iterdir())


def test_the_user_of_these_tests_is_another(place: Place) -> None:
    """The switch is one: what the test may write, its child may not."""
    file = place.root / "work" / "file.py"
    file.write_text("import os\nprint(os.getuid())\nos.chdir('../home')\nopen('a', 'w')\n")
    done = place.python(file)
    assert done.stdout == f"{NOBODY}\n"
    assert "PermissionError" in done.stderr
