"""A broken robot file is refused in words, quickly, and nothing is written anywhere."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from seals.cli.main import main

BASE = """<link name="base"><inertial><mass value="1"/>
<inertia ixx="1e-2" ixy="0" ixz="0" iyy="1e-2" iyz="0" izz="1e-2"/></inertial></link>"""
ARM = BASE.replace("base", "arm")


def robot(inside: str) -> bytes:
    """Return a URDF around some elements."""
    return f'<?xml version="1.0"?>\n<robot name="r">{inside}</robot>'.encode()


def joint(name: str, parent: str, child: str, more: str = "", kind: str = "continuous") -> str:
    """Return a joint element."""
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{more}<axis xyz="0 0 1"/></joint>'


def mesh(name: str) -> bytes:
    """Return a URDF whose base shows a mesh."""
    shape = f'<visual><geometry><mesh filename="{name}"/></geometry></visual></link>'
    return robot(BASE.replace("</link>", shape))


def mass(value: str, inertia: str = 'ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"') -> bytes:
    """Return a URDF of one link with this mass and inertia."""
    inertial = f'<inertial><mass value="{value}"/><inertia {inertia}/></inertial>'
    return robot(f'<link name="base">{inertial}</link>')


LAUGHS = b"""<?xml version="1.0"?>
<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;">]>
<robot name="&c;"><link name="base"/></robot>"""
LIMITS = '<limit lower="{}" upper="{}" effort="1" velocity="1"/>'
CHAIN = BASE + "".join(
    f'<link name="l{k}"/>' + joint(f"j{k}", "base" if k == 0 else f"l{k - 1}", f"l{k}")
    for k in range(600)
)

BROKEN: dict[str, tuple[bytes, str]] = {
    "cycle": (robot(BASE + ARM + joint("a", "base", "arm") + joint("b", "arm", "base")), "cycle"),
    "cycle aside": (
        robot(
            BASE
            + ARM
            + ARM.replace("arm", "fore")
            + joint("a", "fore", "arm")
            + joint("b", "arm", "fore")
        ),
        "cycle",
    ),
    "missing mesh": (mesh("hull.stl"), "mesh 'hull.stl' does not exist"),
    "mesh outside": (mesh("../../../../etc/passwd"), "lies outside the robot's folder"),
    "mesh outside, absolute": (mesh("/etc/passwd"), "lies outside the robot's folder"),
    "mesh outside, file": (mesh("file:///etc/passwd"), "lies outside the robot's folder"),
    "mesh outside, package": (mesh("package://../../etc/passwd"), "outside the robot's folder"),
    "huge mesh": (mesh("huge.stl"), "has, or declares, 200 MB"),
    "mesh cut short": (mesh("short.stl"), "declares 5084 bytes and holds 84"),
    "negative mass": (mass("-1"), "mass -1 kg is negative"),
    "mass not a number": (mass("heavy"), "value='heavy' is not a finite number"),
    "mass NaN": (mass("nan"), "value='nan' is not a finite number"),
    "mass infinite": (mass("inf"), "value='inf' is not a finite number"),
    "inertia NaN": (mass("1", 'ixx="nan" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"'), "ixx='nan'"),
    "inertia negative": (mass("1", 'ixx="-1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"'), "negative"),
    "triangle": (mass("1", 'ixx="9" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"'), "triangle"),
    "inertia incomplete": (mass("1", 'ixx="1"'), "inertia: ixy is missing"),
    "origin not numbers": (
        robot(BASE.replace("<inertial>", '<inertial><origin xyz="0 a 0"/>')),
        "xyz='0 a 0' is not 3 finite numbers",
    ),
    "origin short": (
        robot(BASE.replace("<inertial>", '<inertial><origin xyz="0 0"/>')),
        "xyz='0 0'",
    ),
    "entities": (LAUGHS, "declares a DOCTYPE or an ENTITY"),
    "doctype": (b"<!doctype robot>" + robot(BASE), "declares a DOCTYPE or an ENTITY"),
    "not UTF-8": (robot(BASE).replace(b'"r"', b'"\xff\xfe"'), "not UTF-8"),
    "UTF-16 entities": (LAUGHS.decode().encode("utf-16"), "not UTF-8"),
    "empty": (b"", "is empty"),
    "blank": (b" \n\t ", "is empty"),
    "not XML": (b"links: [base]\n", "cannot be read"),
    "cut off": (robot(BASE)[:-20], "cannot be read as XML"),
    "another document": (b"<sdf version='1.7'><model/></sdf>", "contains a <sdf>, not a <robot>"),
    "no links": (robot(""), "has no links"),
    "huge": (robot(BASE) + b" " * 6_000_000, "6000"),
    "many links": (robot(CHAIN), "601 links"),
    "xacro": (
        b'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property/></robot>',
        "xacro model.urdf.xacro > model.urdf",
    ),
    "two roots": (robot(BASE + ARM), "2 base links: base, arm"),
    "two parents": (
        robot(BASE + ARM + joint("a", "base", "arm") + joint("b", "base", "arm")),
        "two parent joints",
    ),
    "same name twice": (robot(BASE + BASE), "the link 'base' occurs twice"),
    "same joint twice": (
        robot(
            BASE
            + ARM
            + ARM.replace("arm", "fore")
            + joint("a", "base", "arm")
            + joint("a", "base", "fore")
        ),
        "twice",
    ),
    "joint to nowhere": (robot(BASE + ARM + joint("a", "bass", "arm")), "Did you mean 'base'?"),
    "joint without child": (
        robot(BASE + '<joint name="a" type="fixed"><parent link="base"/></joint>'),
        "has no child link",
    ),
    "joint type": (
        robot(BASE + ARM + joint("a", "base", "arm", kind="revolut")),
        "Did you mean 'revolute'?",
    ),
    "joint planar": (robot(BASE + ARM + joint("a", "base", "arm", kind="planar")), "'planar'"),
    "limits swapped": (
        robot(BASE + ARM + joint("a", "base", "arm", kind="revolute", more=LIMITS.format(1, -1))),
        "lower limit 1 is above the upper limit -1",
    ),
    "limits NaN": (
        robot(
            BASE + ARM + joint("a", "base", "arm", kind="revolute", more=LIMITS.format("nan", 1))
        ),
        "limit: lower='nan' is not a finite number",
    ),
    "axis zero": (
        robot(BASE + ARM + joint("a", "base", "arm").replace("0 0 1", "0 0 0")),
        "axis is zero",
    ),
    "no limit": (
        robot(BASE + ARM + joint("a", "base", "arm", kind="revolute")),
        "revolute and has no <limit>",
    ),
    "box of nothing": (
        robot(
            BASE.replace(
                "</link>", '<collision><geometry><box size="1 0 1"/></geometry></collision></link>'
            )
        ),
        "size='1 0 1'",
    ),
    "base without mass": (robot('<link name="base"/>'), "has no mass"),
}


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[bytes], Path]:
    """Write a robot folder around a URDF and step into an empty folder beside it."""
    folder, elsewhere = tmp_path / "broken", tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    monkeypatch.delenv("SEALS_DEBUG", raising=False)

    def build(urdf: bytes) -> Path:
        folder.mkdir()
        (folder / "robot.yaml").write_text("urdf: broken.urdf\n", encoding="utf-8")
        (folder / "broken.urdf").write_bytes(urdf)
        # a header that declares 200 MB of triangles
        count = (200_000_000 // 50).to_bytes(4, "little")
        (folder / "huge.stl").write_bytes(b"\0" * 80 + count)
        (folder / "short.stl").write_bytes(b"\0" * 80 + (100).to_bytes(4, "little"))
        return folder

    return build


def everything(folder: Path) -> dict[str, int]:
    """Return all that lies below a folder, files with the time of their last change."""
    return {
        str(path): path.stat().st_mtime_ns if path.is_file() else 0 for path in folder.rglob("*")
    }


@pytest.mark.parametrize("verb", ["run", "check"])
@pytest.mark.parametrize("name", list(BROKEN))
def test_broken_robot_is_refused(
    name: str,
    verb: str,
    make: Callable[[bytes], Path],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Two lines, the reason among them, exit code 2, soon, nothing written, no traceback."""
    urdf, words = BROKEN[name]
    folder = make(urdf)
    before = everything(tmp_path)
    start = time.process_time()
    code = main([verb, f"robot={folder}"])
    spent = time.process_time() - start
    out, err = capfd.readouterr()
    assert (code, out) == (2, ""), err
    assert words in err
    assert len(err.splitlines()) == 2
    assert err.startswith(("RobotError: ", "ConfigError: "))
    assert "Traceback" not in err
    assert spent < 2.0
    assert everything(tmp_path) == before


@pytest.mark.parametrize("verb", ["run", "check"])
def test_urdf_that_is_a_folder(
    verb: str, make: Callable[[bytes], Path], capfd: pytest.CaptureFixture[str]
) -> None:
    """A folder where the URDF should be is refused with the URDF files there are."""
    folder = make(robot(BASE))
    (folder / "robot.yaml").write_text("urdf: deep\n", encoding="utf-8")
    (folder / "deep").mkdir()
    assert main([verb, f"robot={folder}"]) == 2
    err = capfd.readouterr().err
    assert "urdf 'deep' is not a file" in err
    assert "broken.urdf" in err


def test_the_robot_of_a_log_has_no_meshes_that_only_show_it(
    make: Callable[[bytes], Path], capfd: pytest.CaptureFixture[str]
) -> None:
    """A run with such a folder is led to the robot itself."""
    folder = make(mesh("hull.stl"))
    (folder.parent / "meta.yaml").write_text("format: log\n", encoding="utf-8")
    assert main(["run", f"robot={folder}"]) == 2
    err = capfd.readouterr().err
    assert "'hull.stl' does not exist" in err
    assert "give the folder or name of the robot itself" in err


def test_hull_mesh_outside_the_folder(
    make: Callable[[bytes], Path], capfd: pytest.CaptureFixture[str]
) -> None:
    """The hull's mesh may not lie outside the robot's folder either."""
    folder = make(robot(BASE))
    hull = "{base: {shapes: [{type: mesh, file: ../../../etc/passwd}]}}"
    text = f"urdf: broken.urdf\nhulls: {hull}\n"
    (folder / "robot.yaml").write_text(text, encoding="utf-8")
    assert main(["run", f"robot={folder}"]) == 2
    assert "is outside" in capfd.readouterr().err


def test_refusal_through_the_process(make: Callable[[bytes], Path]) -> None:
    """The installed command itself ends with code 2, two lines and no traceback."""
    folder = make(BROKEN["cycle"][0])
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys; from seals.cli.main import main; sys.exit(main())",
            "run",
            f"robot={folder}",
        ],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={**os.environ, "SEALS_DEBUG": ""},
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 2, done.stderr
