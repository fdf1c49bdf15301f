"""Meshes and URDFs that name devices, pipes and files elsewhere: refused before anything reads."""

from __future__ import annotations

import json
import os
import struct
import time
from pathlib import Path
from typing import Any

import pytest

from seals.errors import RobotError
from seals.hydrostatics.meshes import hull_from_mesh, load_triangles, refuse_strange_format
from seals.hydrostatics.references import without_references
from seals.robot.urdf import read_urdf

PATIENCE = 2.0
"""Most processor time that a refusal may take [s]."""
SHAPE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
URDF = """<robot name="r"><link name="base"><inertial><mass value="1"/>
<inertia ixx="1e-2" ixy="0" ixz="0" iyy="1e-2" iyz="0" izz="1e-2"/></inertial>
<visual><geometry><mesh filename="meshes/a.obj"/></geometry>{}</visual></link></robot>"""
DAE = '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">{}</COLLADA>'
PLY = "ply\nformat ascii 1.0\n{}element vertex 0\nend_header\n"


def _glb(content: Any) -> bytes:
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A)
    return head + text


def _node(number: int) -> str:
    inside = f'<instance_node url="#n{number + 1}"/>' * 2 if number < 40 else ""
    return f'<node id="n{number}">{inside}<instance_geometry url="#g"/></node>'


_DOUBLED = DAE.format(
    "<library_nodes>" + "".join(map(_node, range(41))) + "</library_nodes><library_visual_scenes>"
    '<visual_scene id="s"><instance_node url="#n0"/></visual_scene></library_visual_scenes>'
)
_PART: dict[str, Any] = {"attributes": {"POSITION": 0}}
_BUFFER = {"accessors": [{"count": 9_000}]}
_MANY = _glb({**_BUFFER, "nodes": [{"mesh": 0}] * 9_000, "meshes": [{"primitives": [_PART]}]})
_AGAIN = _glb({**_BUFFER, "meshes": [{"primitives": [_PART] * 9_000}]})


def _placed(corners: int, copies: int) -> str:
    shape = (
        f'<geometry id="g"><mesh><triangles><p>{"0 " * corners}</p></triangles></mesh></geometry>'
    )
    nodes = '<node><instance_geometry url="#g"/></node>' * copies
    scene = f"<visual_scene>{nodes}</visual_scene>"
    return DAE.format(f"<library_geometries>{shape}</library_geometries>{scene}")


HOSTILE: dict[str, tuple[str, str | bytes, str]] = {
    "materials of a device": ("a.obj", "mtllib /dev/zero\n" + SHAPE, "not name a nearby file"),
    "after blanks": ("a.obj", SHAPE + " \t mtllib \t /dev/zero \n", "not name a nearby file"),
    "old line ends": ("a.obj", SHAPE.replace("\n", "\r") + "mtllib /dev/zero\r", "not name a"),
    "joined lines": ("a.obj", "mtl\\\nlib /dev/zero\n" + SHAPE, "not name a nearby file"),
    "behind joined lines": ("a.obj", SHAPE + "v 0 0 0 \\\nmtllib /dev/zero\n", "not name a"),
    "second of two": ("a.obj", "mtllib a.mtl /dev/zero\n" + SHAPE, "not name a nearby file"),
    "large letters": ("a.obj", "MTLLIB /dev/zero\n" + SHAPE, "not name a nearby file"),
    "a way out": ("a.obj", "mtllib ../../../../../dev/zero\n" + SHAPE, "is in another folder"),
    "a way out by windows": ("a.obj", "mtllib ..\\..\\..\\a\n" + SHAPE, "is in another folder"),
    "home": ("a.obj", "mtllib ~/.ssh/id_rsa\n" + SHAPE, "not name a nearby file"),
    "a link to a device": ("a.obj", "mtllib zeros.mtl\n" + SHAPE, "is in another folder"),
    "a pipe": ("a.obj", "mtllib pipe.mtl\n" + SHAPE, "is not a regular file"),
    "a huge one": ("a.obj", "mtllib huge.mtl\n" + SHAPE, "the limit is"),
    "a shell": ("a.obj", "csh rm -rf .\n" + SHAPE, "holds the command csh"),
    "another file": ("a.obj", "call other.obj\n" + SHAPE, "holds the command call"),
    "a picture in the materials": ("a.obj", "mtllib bad.mtl\n" + SHAPE, "names '/dev/zero'"),
    "picture of a PLY": ("a.ply", PLY.format("comment TextureFile /dev/zero\n"), "not name a"),
    "picture of a COLLADA": (
        "a.dae",
        DAE.format("<image><init_from>/dev/zero</init_from></image>"),
        "not name a nearby file",
    ),
    "address in a COLLADA": (
        "a.dae",
        DAE.format('<instance_geometry url="http://a.b/c.dae#d"/>'),
        "not name a nearby file",
    ),
    "file in a COLLADA": (
        "a.dae",
        DAE.format("<init_from>file:///dev/zero</init_from>"),
        "not name a nearby file",
    ),
    "copies of copies": ("a.dae", _DOUBLED, "places more than 10,000 parts"),
    "buffer of a glTF": ("a.glb", _glb({"buffers": [{"uri": "/dev/zero"}]}), "not name a"),
    "picture of a glTF": ("a.glb", _glb({"images": [{"uri": "http://a/b.png"}]}), "not name a"),
    "numbers without bytes": ("a.glb", _glb({"accessors": [{"count": 10**9}]}), "elements"),
    "one part without end": ("a.glb", _MANY, "too many for their size"),
    "one part again": ("a.glb", _AGAIN, "too many for their size"),
    "no such numbers": ("a.glb", _glb({"meshes": [{"primitives": [_PART]}]}), "does not contain"),
    "no such mesh": ("a.glb", _glb({"nodes": [{"mesh": 0}]}), "does not contain"),
    "large copies": ("a.dae", _placed(90_000, 400), "20,000,000 corners"),
    "other signs": ("a.dae", '<?xml version="1.0" encoding="cp500"?>' + DAE, "is not UTF-8"),
    "wide faces": ("a.obj", SHAPE + "f" + " 1 2 3" * 700_000, "more than 2,000,000 triangles"),
    "groups": ("a.obj", SHAPE + "o a\nusemtl b\nf 1 2 3\n" * 6_000, "more than 10,000 groups"),
    "empty lines": ("a.obj", SHAPE + "\n" * 2_100_000, "2,100,008 lines"),
    "old empty lines": ("a.obj", SHAPE + "\r" * 2_100_000, "2,100,008 lines"),
    "words of an OFF": ("a.off", "OFF\n2800000 1 0\n" + "0 0 0 " * 2_800_000, "8,400,00. words"),
    "lines of a PLY": ("a.ply", PLY.format("") + "0\n" * 2_100_000, "lines"),
    "solids": ("a.stl", "solid a\nendsolid a\n" * 1_100, "more than 1,000 solids"),
    "deep glTF": ("a.glb", _glb(json.loads("[" * 60 + "]" * 60)), "nested deeper"),
    "glTF that declares more": ("a.glb", _glb({})[:12] + b"\xff" * 8, "declares more"),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A robot's folder with a good mesh, and beside it all that a bad one may name."""
    meshes = tmp_path / "robot" / "meshes"
    meshes.mkdir(parents=True)
    (meshes / "a.obj").write_text("mtllib a.mtl absent.mtl\n" + SHAPE)
    (meshes / "a.mtl").write_text("newmtl a\nmap_Kd ../pictures/absent.png\n")
    (meshes / "bad.mtl").write_text("newmtl a\nmap_Kd -s 1 1 1 /dev/zero\n")
    (meshes / "zeros.mtl").symlink_to("/dev/zero")
    os.mkfifo(meshes / "pipe.mtl")
    with (meshes / "huge.mtl").open("wb") as stream:
        stream.truncate(1 << 34)
    return meshes.parent


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_mesh_is_refused_before_it_is_loaded(folder: Path, name: str) -> None:
    """In words, at once; no library and no engine opens what it names."""
    file, content, words = HOSTILE[name]
    path = folder / "meshes" / file
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    start = time.process_time()
    with pytest.raises(RobotError, match=words):
        refuse_strange_format(path, "mesh")
    if file == "a.obj":
        (folder / "r.urdf").write_text(URDF.format(""))
        with pytest.raises(RobotError, match=words):
            read_urdf(folder / "r.urdf")
    assert time.process_time() - start < PATIENCE


def test_materials_of_an_obj_make_no_parts(folder: Path) -> None:
    """Each was a copy of its own: 10,000 in a file of 200 kB took 20 s of processor time."""
    path = folder / "meshes" / "a.obj"
    path.write_text(SHAPE + "".join(f"usemtl m{k}\nf 1 3 2\n" for k in range(5_000)))
    start = time.process_time()
    assert len(load_triangles(path, where="mesh").faces) == 5_004
    assert time.process_time() - start < PATIENCE


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.dae", DAE.format("<a>" * 50_000 + "</a>" * 50_000)),
        ("a.off", "OFF\n99999999999 1 0\n0 0 0\n"),
        ("a.obj", SHAPE + "f 1 2 " + "9" * 400 + "\n"),
    ],
)
def test_whatever_a_loader_says_is_one_kind_of_error(
    tmp_path: Path, name: str, content: str
) -> None:
    """Each format's loader has errors of its own; a deep COLLADA ended `seals check`."""
    (tmp_path / name).write_text(content)
    with pytest.raises((ValueError, RobotError)):
        load_triangles(tmp_path / name, where="mesh")
    with pytest.raises(RobotError):
        hull_from_mesh(tmp_path / name)


def test_copies_of_a_usual_file_are_no_reason(folder: Path) -> None:
    """Large parts, and many small ones, may be placed."""
    for k, text in enumerate((_placed(300_000, 1), _placed(30_000, 100), _placed(30, 4_000))):
        path = folder / "meshes" / f"{k}.dae"
        path.write_text(text)
        refuse_strange_format(path, "mesh")


PICTURE = '<material name="m"><texture {}="{}"/></material>'
NAMES = {
    "/dev/zero": "not name a nearby file",
    "file:///dev/zero": "not name a nearby file",
    "../../../../../../../dev/zero": "is in another folder",
    "http://a.b/c.png": "not name a nearby file",
    "meshes/zeros.mtl": "is in another folder",
    "meshes/pipe.mtl": "is not a regular file",
    "meshes/huge.mtl": "the limit is",
    "~/a.png": "not name a nearby file",
    "C:/a.png": "not name a nearby file",
    "package:///dev/zero": "not name a nearby file",
}


@pytest.mark.parametrize("key", ["filename", "file", "uri", "url"])
@pytest.mark.parametrize("name", NAMES)
def test_a_picture_elsewhere_is_refused(folder: Path, name: str, key: str) -> None:
    """The engine opens the pictures of materials by itself."""
    (folder / "r.urdf").write_text(URDF.format(PICTURE.format(key, name)))
    with pytest.raises(RobotError, match=NAMES[name]):
        read_urdf(folder / "r.urdf")


def test_materials_near_a_mesh_are_no_harm(folder: Path) -> None:
    """Materials and pictures that lie near, or are lost, pass; other programs' elements too."""
    more = PICTURE.format("filename", "package://robot/absent.png")
    text = URDF.format(more).replace("</robot>", '<gazebo><a url="http://b"/></gazebo></robot>')
    (folder / "r.urdf").write_text(text)
    assert [link.name for link in read_urdf(folder / "r.urdf").links] == ["base"]
    for name, content in {
        "b.dae": DAE.format('<init_from>a.png</init_from><channel target="a/b"/>').encode(),
        "b.glb": _glb({"buffers": [{"uri": "data:,"}], "accessors": [{"count": 12}]}),
        "b.ply": PLY.format("comment TextureFile a.png\n").encode(),
    }.items():
        (folder / "meshes" / name).write_bytes(content)
        refuse_strange_format(folder / "meshes" / name, "mesh")


def test_a_urdf_taken_over_is_read_within_bounds(folder: Path) -> None:
    """Neither a huge file nor one of the kernel, and no other coding."""
    from seals.scaffold.takeover import Takeover

    for target, words in (
        (folder / "meshes" / "huge.mtl", "the limit is"),
        (Path("/proc/self/maps"), "is empty"),
        (folder / "odd.urdf", "is not UTF-8 text"),
    ):
        (folder / "odd.urdf").write_bytes(b"\xff")
        with pytest.raises(RobotError, match=words):
            Takeover(target, {})


def test_a_mesh_taken_over_is_stripped(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``seals new robot`` copies the shape, and not what it names."""
    from seals.scaffold.takeover import Takeover

    (folder / "meshes" / "a.obj").write_text("mtllib /dev/zero\n" + SHAPE + "usemtl a\n")
    (folder / "r.urdf").write_text(URDF.format(PICTURE.format("filename", "/dev/zero")))
    made = folder / "made"
    made.mkdir()
    taken = Takeover(folder / "r.urdf", {})
    taken.copy_meshes(made)
    taken.write(made / "r.urdf")
    assert (made / "meshes" / "a.obj").read_text() == SHAPE
    assert "texture" not in (made / "r.urdf").read_text()
    assert without_references(b"v 0 0 0 \\\nmtllib a\n") == b"v 0 0 0 "
    assert without_references(b"mtl\\\nlib b\n") == b""
    assert without_references(b"v 0 0 0\r\nUSEMTL a\r\n") == b"v 0 0 0\n"


@pytest.mark.parametrize("name", ["mem", "clear_refs", "maps"])
def test_a_urdf_that_only_seems_to_be_a_file_is_refused(folder: Path, name: str) -> None:
    """Files of /proc have no size; reading some of them fails, or waits for ever."""
    if not Path("/proc/self/mem").exists():
        pytest.skip("there is no /proc here")
    (folder / "r.urdf").symlink_to(f"/proc/self/{name}")
    with pytest.raises(RobotError, match="is empty"):
        read_urdf(folder / "r.urdf")
