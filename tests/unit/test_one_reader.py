"""Pictures, meshes and arrays of strangers have one reader each, which is bounded."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from seals.cli.main import main
from seals.control.key_events import read_track
from seals.errors import ConfigError, LogError, RobotError, SealsError
from seals.hydrostatics.meshes import load_triangles
from seals.learn.comparison.runs import read_table
from seals.picture_files import read_picture
from seals.run.provenance import digest, noted_digest
from seals.view.instants import _places

pytestmark = pytest.mark.usefixtures("elsewhere")

ROOT = Path(__file__).parents[2]
EPS = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 4 4\n%%EndComments\nshowpage\n%%EOF\n"
FORBIDDEN = {
    ("Image", "open"): {"seals/picture_files.py"},
    ("trimesh", "load"): {"seals/hydrostatics/meshes.py"},
    ("trimesh", "load_mesh"): set[str](),
    # a stream from an own process, and an archive whose sizes were compared before
    ("np", "load"): {"seals/view/live.py", "experiments/visual_catch/pictures.py"},
    ("np", "fromfile"): set[str](),
    ("np", "loadtxt"): set[str](),
    # a rival in an interpreter of its own, without readers of ours, for which the log was written
    ("np", "genfromtxt"): {"experiments/naming_benchmark/mujoco_sysid.py"},
    ("plt", "imread"): set[str](),
    ("pd", "read_csv"): set[str](),
}
"""Readers without a bound, or that choose a decoder by content, and who may call them."""
OWN = {
    "experiments/five_seeds/shipping.py",
    "experiments/learning_study/running.py",
    "experiments/soak/running.py",
    "experiments/visual_catch/judged.py",
    "experiments/water_drag_loop/__init__.py",
    "experiments/water_validation/page.py",
    "robots/workshop/files.py",
    "seals/caches.py",
    "seals/cli/describe.py",
    "seals/cli/installed_files.py",
    "seals/cli/listing.py",
    "seals/config/roots.py",
    "seals/hydrostatics/octahedron.py",
    "seals/registry.py",
    "seals/report/page.py",
    "seals/scaffold/writing.py",
    "experiments/naming_benchmark/mujoco_sysid.py",
    "seals/sweep/job.py",
    "seals/sysid/report/threads.py",
    "seals/isolated_reading.py",
    "seals/untrusted_io.py",
}
"""Modules that open files of the installation, of this machine, or that they wrote themselves."""
CHECKED = {
    "plugins/backends/mujoco/scene.py",
    "plugins/backends/pybullet/backend.py",
    "plugins/readers/balls.py",
    "plugins/readers/mcap_file.py",
    "plugins/readers/recording.py",
    "seals/check/robot.py",
    "seals/hydrostatics/meshes.py",
    "seals/hydrostatics/references.py",
    "seals/learn/environments/posterior.py",
    "seals/learn/metadata.py",
    "seals/logs/content.py",
    "seals/logs/datasets.py",
    "seals/logs/table.py",
    "seals/robot/macros_child.py",
    "seals/robot/urdf.py",
    "seals/run/checkpoint.py",
    "seals/run/folder.py",
    "seals/run/replay_config.py",
    "seals/scaffold/hydrodynamics/link.py",
    "seals/scaffold/meshes.py",
    "seals/sysid/validation/writing.py",
    "seals/view/films/files.py",
}
"""Modules that open a file after its kind and size were looked at."""


def calls() -> Iterator[tuple[str, ast.Call]]:
    """Every call in the sources, with its file."""
    for top in ("seals", "plugins", "experiments", "animals", "robots"):
        for path in sorted((ROOT / top).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call):
                    yield name, node


def opens(call: ast.Call) -> bool:
    """Whether a call opens a file to read it."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name in ("read_text", "read_bytes"):
        return isinstance(call.func, ast.Attribute)
    modes = [a.value for a in call.args if isinstance(a, ast.Constant) and isinstance(a.value, str)]
    mode = modes[0] if modes else ""
    bare = isinstance(call.func, ast.Name)
    return name == "open" and (mode or "r").startswith("r") and (bare or mode in ("r", "rb", "rt"))


def test_strangers_files_have_one_reader_each() -> None:
    """No module but the reader opens pictures, meshes, arrays or files of strangers by itself."""
    strange = set()
    for name, call in calls():
        func = call.func
        if isinstance(func, ast.Attribute) and isinstance(func.value, ast.Name):
            allowed = FORBIDDEN.get((func.value.id, func.attr))
            if allowed is not None and name not in allowed:
                strange.add(f"{name}:{call.lineno} {ast.unparse(func)}")
        if opens(call) and name not in OWN | CHECKED:
            strange.add(f"{name}:{call.lineno} {ast.unparse(call)[:60]}")
    assert not strange


@pytest.fixture
def postscript(monkeypatch: pytest.MonkeyPatch) -> Path:
    """A Ghostscript that leaves a mark when it is started."""
    folder = Path("bin").absolute()
    folder.mkdir()
    mark = Path("mark").absolute()
    (folder / "gs").write_text(f"#!/bin/sh\ntouch '{mark}'\nexit 1\n")
    (folder / "gs").chmod(0o755)
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)
    from PIL import EpsImagePlugin

    monkeypatch.setattr(EpsImagePlugin, "gs_binary", None)
    return mark


@pytest.mark.skipif(sys.platform == "win32", reason="a program of the shell")
def test_a_picture_starts_no_program(postscript: Path) -> None:
    """The decoder is that of PNG, whatever the content."""
    Path("a.png").write_bytes(EPS)
    with pytest.raises(LogError, match="not a valid PNG"):
        read_picture("a.png")
    assert not postscript.exists()
    with Image.open("a.png") as bare, pytest.raises(subprocess.CalledProcessError):
        bare.load()
    assert postscript.exists(), "the test itself: Pillow alone starts it"


KINDS = [
    "BMP",
    "DIB",
    "EPS",
    "GIF",
    "ICNS",
    "ICO",
    "JPEG",
    "PCX",
    "PPM",
    "SGI",
    "TGA",
    "TIFF",
    "WEBP",
]


@pytest.mark.parametrize("kind", KINDS)
def test_a_name_chooses_no_decoder(kind: str) -> None:
    """Pillow knows some forty kinds by their content; of a stranger's picture one is read."""
    Image.new("RGB", (16, 16), (9, 8, 7)).save("a.png", format=kind)
    with pytest.raises(LogError, match="not a valid PNG"):
        read_picture("a.png")


@pytest.mark.parametrize(
    "start", [b"<svg xmlns='http://www.w3.org/2000/svg'/>", b"%PDF-1.4", b"\x00\x00\x01\xba", b""]
)
def test_what_is_no_picture_is_not_read_as_one(start: bytes) -> None:
    """Documents, films and nothing."""
    Path("a.png").write_bytes(start)
    with pytest.raises(LogError):
        read_picture("a.png")


@pytest.mark.skipif(sys.platform == "win32", reason="a program of the shell")
def test_a_texture_starts_no_program(postscript: Path) -> None:
    """Materials and pictures of a mesh are left alone."""
    Path("t.png").write_bytes(EPS)
    Path("a.mtl").write_text("newmtl m\nmap_Kd t.png\n")
    Path("a.obj").write_text(
        "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
    )
    assert len(load_triangles(Path("a.obj"), where="mesh").faces) == 1
    urdf = (
        '<robot name="r"><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" '
        'izz="1" ixy="0" ixz="0" iyz="0"/></inertial><visual><geometry><mesh filename="a.obj"/>'
        '</geometry></visual><collision><geometry><mesh filename="a.obj"/></geometry></collision>'
        "</link></robot>"
    )
    Path("r").mkdir()
    for name in ("t.png", "a.mtl", "a.obj"):
        Path(name).rename(Path("r") / name)
    Path("r/r.urdf").write_text(urdf)
    Path("r/robot.yaml").write_text("urdf: r.urdf\n")
    main(["check", "robot=r"])
    assert not postscript.exists()


def test_pictures_inside_a_mesh_stay_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A glTF holds its own, whose decoder would go by their content."""
    import trimesh

    shape = trimesh.creation.box()
    shape.visual = trimesh.visual.TextureVisuals(
        uv=np.zeros((8, 2)), image=Image.new("RGB", (4, 4))
    )
    Path("a.glb").write_bytes(shape.export(file_type="glb"))
    opened: list[Any] = []
    monkeypatch.setattr(Image, "open", lambda *given, **_: opened.append(given))
    assert len(load_triangles(Path("a.glb"), where="mesh").faces) == 12
    assert not opened


def test_pictures_are_bounded() -> None:
    """A small file that declares a wall of pixels is refused before it is unpacked."""
    Image.new("L", (6_000, 6_000)).save("a.png")
    with pytest.raises(LogError, match="declares 6000 by 6000"):
        read_picture("a.png")
    Image.new("RGBA", (3, 2), (9, 8, 7, 255)).save("b.png")
    assert read_picture("b.png").tolist() == [[[9, 8, 7]] * 3] * 2
    os.mkfifo("c.png")
    with pytest.raises(LogError, match="not a regular file"):
        read_picture("c.png")


def test_places_of_particles_are_bounded() -> None:
    """A pipe, and a shape of terabytes, end in words."""
    head = str({"descr": "<f8", "fortran_order": False, "shape": (400_000_000_000, 3)}).encode()
    head += b" " * (117 - len(head)) + b"\n"
    Path("b.npy").write_bytes(b"\x93NUMPY\x01\x00v\x00" + head)
    with pytest.raises(SealsError, match="declares an array"):
        _places("b.npy")
    np.save("c.npy", np.ones((2, 3), dtype=np.float32))
    assert _places("c.npy").shape == (2, 3)
    os.mkfifo("a.npy")
    with pytest.raises(SealsError, match="not a regular file"):
        _places("a.npy")


@pytest.fixture
def sparse() -> Path:
    """A file of 30 GB that takes no room."""
    path = Path("robot/sparse.stl")
    path.parent.mkdir()
    with path.open("wb") as file:
        file.truncate(30 << 30)
    return path.absolute()


def test_checksums_are_bounded(sparse: Path) -> None:
    """run.json names files near the robot, of the size of such files."""
    with pytest.raises(LogError, match="the limit is"):
        digest(sparse)
    assert digest(Path("/proc/self/pagemap")) == digest(Path("/proc/version"))
    assert digest(Path("/dev/zero")) is None
    for name in ("/etc/passwd", "../../etc/passwd", "a\0b"):
        with pytest.raises(LogError, match="is in another folder"):
            noted_digest(sparse.parent, name)


def test_a_run_that_names_files_elsewhere_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """A stranger's run.json has nothing read but its robot's files."""
    assert main(["run", "robot=ball", "time.duration=0.02", "out=one"]) == 0
    facts = json.loads(Path("one/run.json").read_text())
    facts["robot"]["files"] = {"/proc/self/pagemap": "0"}
    Path("one/run.json").write_text(json.dumps(facts))
    assert main(["run", "repeat=one"]) == 2
    assert "is in another folder" in capsys.readouterr().err


def test_scripts_and_curves_are_bounded(sparse: Path) -> None:
    """Text of a script of keys and of a training's curves is read up to a size."""
    for name in ("a.yaml", "a.csv"):
        sparse.rename(name)
        with pytest.raises(ConfigError, match="the limit is"):
            read_track(Path(name))
        with pytest.raises(LogError, match="the limit is"):
            read_table(Path(name))
        Path(name).rename(sparse)
    with pytest.raises(ConfigError, match=r"is empty|cannot be read"):
        read_track(Path("/proc/self/pagemap"))


def test_meshes_are_bounded(sparse: Path) -> None:
    """A mesh of any reader has a bearable size, and is an ordinary file."""
    with pytest.raises(LogError, match="the limit is"):
        load_triangles(sparse, where="mesh")
    os.mkfifo("a.ply")
    with pytest.raises(LogError, match="not a regular file"):
        load_triangles(Path("a.ply"), where="mesh")
    Path("a.3mf").write_bytes(b"x")
    with pytest.raises(RobotError, match="not a mesh file"):
        load_triangles(Path("a.3mf"), where="mesh")
