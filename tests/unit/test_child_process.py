"""Code that lies in the working directory runs in no process that the program starts."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import seals
from seals.child_process import SAFE, command, environment
from seals.cli.main import main
from seals.errors import MissingExtra
from seals.run import provenance
from seals.view.live import Live

ROOT = Path(__file__).parents[2]
NAMES = ("multiprocessing", "pybullet", "numpy", "json", "mitsuba", "runpy", "subprocess", "hydra")
HOSTILE = "import pathlib\npathlib.Path({mark!r}).open('a').write({name!r} + '\\n')\n"
SHORT = ["run", "robot=ball", "time.step=0.01", "time.duration=0.05", "initial.position=[0,0,1]"]


@pytest.fixture(autouse=True)
def mark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory full of modules that tell when they run; return where they tell it."""
    folder, mark = tmp_path / "received", tmp_path / "ran.txt"
    folder.mkdir()
    for name in NAMES:
        (folder / f"{name}.py").write_text(HOSTILE.format(mark=str(mark), name=name))
    monkeypatch.chdir(folder)
    # an empty entry is the working directory, too
    monkeypatch.setenv("PYTHONPATH", f"{os.pathsep}{tmp_path / 'nothing'}")
    monkeypatch.delenv(SAFE, raising=False)
    return mark


def test_the_directory_is_hostile(mark: Path) -> None:
    """Python by itself runs what lies there."""
    subprocess.run([sys.executable, "-c", "import pybullet"], check=True)
    assert mark.read_text() == "pybullet\n"


def test_a_child_runs_none_of_it(mark: Path, tmp_path: Path) -> None:
    """A file of the program finds the modules that are installed."""
    file = tmp_path / "file.py"
    text = "import os, sys\nif sys.path[0] == os.path.dirname(__file__):\n    del sys.path[0]\n"
    file.write_text(f"{text}import json, numpy\nprint(json.__file__)\n")
    done = subprocess.run(command(file), env=environment(), capture_output=True, check=True)
    assert not done.stdout.startswith(os.fsencode(Path.cwd()))
    assert not mark.exists()


def test_the_command_line_runs_none_of_it(mark: Path) -> None:
    """The program itself, as its own processes start it, lists what is installed."""
    line = command(Path(seals.__file__).parent / "cli" / "__main__.py", "--version")
    done = subprocess.run(line, env=environment(), capture_output=True, check=True, text=True)
    assert done.stdout.startswith("seals ")
    assert not mark.exists()


def test_a_followed_run_runs_none_of_it(mark: Path) -> None:
    """The process behind a page; it tells its frames, and that it is done."""
    assert main([*SHORT, "hydra.run.dir=a"]) == 0
    mark.unlink(missing_ok=True)
    live = Live(Path("a"))
    frames = []
    for _ in range(600):
        frames += live.heard()
        if live.over:
            break
        time.sleep(0.1)
    live.stop()
    assert (live.over, live.failure) == (True, "")
    assert [frame.time for frame in frames] == sorted(frame.time for frame in frames)
    assert frames[0].position.shape[1] == 3
    assert not mark.exists()


def test_the_trial_of_egl_runs_none_of_it(mark: Path) -> None:
    """The process that tries out a driver, whether there is one or not."""
    from seals.plugins.viewers.bullet.egl import try_out

    with pytest.raises(MissingExtra):
        try_out("/no/such/plug-in.so")
    assert not mark.exists()


def test_the_trial_of_mitsuba_runs_none_of_it(mark: Path) -> None:
    """The process that tries out a variant, whether it is installed or not."""
    from seals.plugins.viewers.mitsuba.variant import trial

    trial.cache_clear()
    assert trial("no_such_variant")
    assert not mark.exists()


def test_children_of_libraries_run_none_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Launchers and compilers start Python by themselves: the environment tells them."""
    monkeypatch.setattr(sys, "argv", ["seals", "--version"])
    assert main(["--version"]) == 0
    assert SAFE not in os.environ
    assert main() == 0
    assert os.environ.pop(SAFE) == "1"


def test_a_repository_around_the_installation_is_not_asked(tmp_path: Path) -> None:
    """Settings of a repository start programs: that of a stranger is none of ours."""
    place = tmp_path / "received" / "venv" / "site" / "seals"
    place.mkdir(parents=True)
    run = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-C", str(tmp_path / "received")]
    for words in (["init", "-q"], ["commit", "-q", "--allow-empty", "-m", "a"]):
        subprocess.run([*run, *words], check=True)
    assert provenance.revision(tmp_path / "received") is not None
    assert provenance.revision(place) is None


def test_no_source_starts_python_in_another_way() -> None:
    """Neither ``python -c`` and ``-m`` nor processes that multiprocessing spawns."""
    loose = re.compile(r"sys\.executable|[\"']spawn[\"']|forkserver")
    found = {
        str(path.relative_to(ROOT))
        for room in ("seals", "plugins", "experiments", "robots", "animals")
        for path in (ROOT / room).rglob("*.py")
        if loose.search(path.read_text(encoding="utf-8"))
    }
    assert found == {"seals/child_process.py"}
