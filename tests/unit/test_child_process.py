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
from seals.report.pictures import _elsewhere
from seals.run import provenance
from seals.view.live import Live

ROOT = Path(__file__).parents[2]
NAMES = ("multiprocessing", "pybullet", "numpy", "json", "mitsuba", "runpy", "subprocess", "hydra")
AT_START = ("sitecustomize", "usercustomize")
"""Modules that Python imports before anything else, from wherever it finds them."""
OTHERS = ("seals/__init__", "hydra_plugins/evil", "conf/evil", "evil_plugin", "taichi", "torch")
HOSTILE = "import pathlib\npathlib.Path({mark!r}).open('a').write({name!r} + '\\n')\n"
FILES = {
    # plug-ins are found by such a folder beside their module
    "evil-1.dist-info/METADATA": "Metadata-Version: 2.1\nName: evil\nVersion: 1\n",
    "evil-1.dist-info/entry_points.txt": "[seals.effects]\nevil = evil_plugin:Evil\n",
    "evil.pth": "import evil_plugin\n",
    "conf/config.yaml": "evil: {_target_: conf.evil.Evil}\n",
    "conf/run.yaml": "evil: {_target_: conf.evil.Evil}\n",
    "conf/robot/ball.yaml": "_target_: conf.evil.Evil\n",
    "pyvenv.cfg": "home = .\ninclude-system-site-packages = true\n",
    "matplotlibrc": "text.usetex: true\nlines.linewidth: 77\n",
    ".git/config": "[core]\nfsmonitor = touch ran.txt\n",
    "__pycache__/numpy.cpython-311.pyc": "",
}
PICTURE = """
import os, sys
if sys.path[0] == os.path.dirname(__file__):
    del sys.path[0]
here = os.getcwd()
from seals.report.pictures import figure_class
figure_class()
import matplotlib
assert os.getcwd() == here
print(matplotlib.rcParams["text.usetex"], matplotlib.rcParams["lines.linewidth"])
"""
SHORT = ["run", "robot=ball", "time.step=0.01", "time.duration=0.05", "initial.position=[0,0,1]"]


@pytest.fixture(autouse=True)
def mark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory full of modules that tell when they run; return where they tell it."""
    folder, mark = tmp_path / "received", tmp_path / "ran.txt"
    folder.mkdir()
    texts = {
        f"{n}.py": HOSTILE.format(mark=str(mark), name=n) for n in (*NAMES, *AT_START, *OTHERS)
    }
    for file, text in {**texts, **FILES}.items():
        (folder / file).parent.mkdir(exist_ok=True, parents=True)
        (folder / file).write_text(text)
    monkeypatch.chdir(folder)
    # an empty entry is the working directory, too
    monkeypatch.setenv("PYTHONPATH", f"{os.pathsep}{tmp_path / 'nothing'}")
    monkeypatch.delenv(SAFE, raising=False)
    return mark


def test_the_directory_is_hostile(mark: Path) -> None:
    """Python by itself runs what lies there: modules, its own first, and plug-ins."""
    program = (
        "import importlib.metadata as m, pybullet; "
        "[point.load() for point in m.entry_points(group='seals.effects', name='evil')]"
    )
    subprocess.run([sys.executable, "-c", program], capture_output=True, check=False)
    assert {"sitecustomize", "pybullet", "evil_plugin"} <= set(mark.read_text().split())


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
    program = Path(seals.__file__).parent / "cli" / "__main__.py"
    more = {**environment(), "SEALS_DEBUG": "1"}
    for words, said in ((["--version"], "seals "), (["list", "effect"], "quadratic_drag")):
        line = command(program, *words)
        done = subprocess.run(line, env=more, capture_output=True, check=True, text=True)
        assert said in done.stdout
        assert "evil" not in done.stdout + done.stderr
    assert not mark.exists()


def test_no_configuration_of_it_is_composed(mark: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder ``conf`` of the same names is not looked at."""
    assert main(["run", "robot=ball", "--cfg", "job"]) == 0
    assert "evil" not in capsys.readouterr().out
    assert not mark.exists()


@pytest.mark.parametrize(
    "kind",
    [
        "settings",
        "pipe",
        *(pytest.param(k, marks=pytest.mark.thorough) for k in ("device", "bytes")),
    ],
)
def test_pictures_know_none_of_its_settings(mark: Path, tmp_path: Path, kind: str) -> None:
    """Settings of Matplotlib can have LaTeX run, which runs what they say; a pipe would hang it."""
    settings = Path("matplotlibrc")
    if kind == "bytes":
        settings.write_bytes(b"\xff\xfe")
    elif kind != "settings":
        settings.unlink()
        os.mkfifo(settings) if kind == "pipe" else settings.symlink_to("/dev/zero")
    file = tmp_path / "picture.py"
    file.write_text(PICTURE)
    done = subprocess.run(
        command(file), env=environment(), capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout == "False 1.5\n"
    assert not mark.exists()


def test_settings_are_out_of_reach_of_the_import(monkeypatch: pytest.MonkeyPatch) -> None:
    """Matplotlib looks for settings where it is imported, which is elsewhere then."""
    monkeypatch.delitem(sys.modules, "matplotlib", raising=False)
    here = Path.cwd()
    with _elsewhere():
        assert not Path("matplotlibrc").exists()
    assert Path.cwd() == here
    Path("matplotlibrc").unlink()
    with _elsewhere():
        assert Path.cwd() == here


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
    from seals.plugins.viewers.bullet.renderer import try_out

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
