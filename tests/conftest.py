"""Shared fixtures: installed packages for one test only, a small robot folder, freed memory."""

from __future__ import annotations

import builtins
import ctypes
import gc
import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from seals import registry

ROOT = str(Path(__file__).parents[1])
if ROOT not in sys.path:
    # last: the benchmarks lie there, and the package itself is tested as it is installed
    sys.path.append(ROOT)

STRANGER = Path(__file__).parent / "thirdparty" / "coral-seals"

URDF = """<?xml version="1.0"?>
<robot name="pebble">
  <link name="base">
    <inertial>
      <mass value="0.3"/>
      <inertia ixx="3e-4" ixy="0" ixz="0" iyy="3e-4" iyz="0" izz="3e-4"/>
    </inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision>
  </link>
</robot>
"""

ROBOT = """
summary: A pebble
urdf: pebble.urdf
hulls:
  base: {shapes: [{type: sphere, size: [0.05]}]}
effects:
  hull_drag: {effect: quadratic_drag, medium: water, links: [base], coefficient_x: 3.1}
"""


# PyTorch's compiler would build three programs with vectors to see whether any runs here: its own
# list of what this processor has is enough, and a first compilation takes half the time
os.environ.setdefault("TORCHINDUCTOR_VEC_ISA_OK", "1")
STATM = Path("/proc/self/statm")
GROWTH = 100e6
"""Growth of a test process from which on unreachable objects are looked for [byte]."""
_kept, _file = [0.0], [""]


def resident() -> float:
    """Return the resident memory of this process [byte]; 0 where the system does not tell."""
    if not STATM.exists():
        return 0.0
    return float(STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def pytest_collection_finish() -> None:
    """Leave out what the imports made when the collector looks for cycles: it takes a tenth less.

    Half a million objects of libraries stay for good; each full pass would look at them all.
    """
    _give_back()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


# a shell ignores Ctrl-C for what it starts in the background, and so would every process from here
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder that the test runs in, without the user's own settings."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    monkeypatch.chdir(folder)
    monkeypatch.delenv("SEALS_DEBUG", raising=False)
    return folder


@pytest.fixture
def absent(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """A function that lets packages be absent: importing one fails."""
    real = builtins.__import__

    def hide(*gone: str) -> None:
        def without(name: str, *rest: Any, **more: Any) -> Any:
            if name.partition(".")[0] in gone:
                raise ImportError(f"No module named '{name}'", name=name)
            return real(name, *rest, **more)

        monkeypatch.setattr(builtins, "__import__", without)

    return hide


@pytest.fixture
def drawn() -> None:
    """Pictures of runs in this process are drawn, not only named."""


@pytest.fixture(autouse=True)
def pictures_named(request: pytest.FixtureRequest) -> Iterator[None]:
    """Leave pictures of runs in this process empty: they take longer than most of the runs.

    Runs in a process of their own draw them, and so does a test that asks for ``drawn``.
    """
    with pytest.MonkeyPatch.context() as patch:
        if "seals.run.report" in sys.modules and "drawn" not in request.fixturenames:
            patch.setattr("seals.run.report.write_picture", named)
        yield


def named(path: Path, charts: object) -> Path:
    """Write an empty file in the place of a picture."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch()
    return path


@pytest.fixture(autouse=True)
def memory_given_back() -> Iterator[None]:
    """Free what a test has left in reference cycles or in pools of libraries, once it is large.

    Environments of learning hold tables of a gigabyte for the hulls of their robot, in cycles that
    the collector comes to late: it counts objects, not their size.
    """
    yield
    if resident() > _kept[0] + GROWTH:
        _give_back()
        _kept[0] = resident()
    _kept[0] = min(_kept[0], resident())


def pytest_runtest_logstart(location: tuple[str, int | None, str]) -> None:
    """Free what the fixtures of the last file have held, before the first test of another one."""
    if location[0] != _file[0] and resident() > _kept[0] + 0.25 * GROWTH:
        _give_back()
        _kept[0] = resident()
    _file[0] = location[0]


def _give_back() -> None:
    """Free unreachable objects, and give freed memory back to the system."""
    gc.collect()
    if "pyarrow" in sys.modules:
        sys.modules["pyarrow"].default_memory_pool().release_unused()
    if sys.platform.startswith("linux"):
        # of the C library; others than GNU's have no such call
        getattr(ctypes.CDLL(None), "malloc_trim", int)(0)


@pytest.fixture
def pebble(tmp_path: Path) -> Path:
    """A robot folder without any Python."""
    folder = tmp_path / "robots_of_mine" / "pebble"
    folder.mkdir(parents=True)
    (folder / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    (folder / "pebble.urdf").write_text(URDF, encoding="utf-8")
    return folder


@pytest.fixture
def install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[str, str, dict[str, str]], Path]]:
    """A function that puts a package with entry points on the path: name, entry points, files."""
    site = tmp_path / "site"
    modules = set(sys.modules)

    def put(name: str, points: str, files: dict[str, str]) -> Path:
        info = site / f"{name}-1.0.dist-info"
        info.mkdir(parents=True)
        metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n"
        (info / "METADATA").write_text(metadata, encoding="utf-8")
        (info / "entry_points.txt").write_text(textwrap.dedent(points), encoding="utf-8")
        for path, text in files.items():
            (site / path).parent.mkdir(parents=True, exist_ok=True)
            (site / path).write_text(textwrap.dedent(text), encoding="utf-8")
        monkeypatch.syspath_prepend(str(site))
        registry.refresh()
        return site

    yield put
    monkeypatch.undo()
    registry.refresh()
    for module in set(sys.modules) - modules:
        if str(site) in str(getattr(sys.modules[module], "__file__", "")):
            del sys.modules[module]


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The stranger's package, built and installed by pip into a folder of its own."""
    if int(version("setuptools").partition(".")[0]) < 77 or not importlib.util.find_spec("wheel"):
        pytest.skip("building a package offline needs setuptools >= 77 and wheel (extra dev)")
    folder = tmp_path_factory.mktemp("stranger")
    shutil.copytree(STRANGER, folder / "source")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--target", str(folder / "site")]
    subprocess.run([*command, *options, str(folder / "source")], check=True, capture_output=True)
    return folder / "site"


@pytest.fixture
def coral(site: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The stranger's package on the path of this process."""
    monkeypatch.syspath_prepend(str(site))
    registry.refresh()
    yield site
    monkeypatch.undo()
    registry.refresh()
