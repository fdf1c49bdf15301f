"""Elements of a URDF against the parser that others wrote."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

import seals.robots
from seals.errors import RobotError
from seals.robot.urdf import read_urdf
from seals.robot.urdf_elements import elements_of

FILES = sorted(Path(seals.robots.__path__[0]).rglob("*.urdf"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_same_as_yourdfpy(path: Path) -> None:
    """Names, masses, poses, axes and limits of every shipped robot are those of yourdfpy."""
    from yourdfpy import URDF

    raw = path.read_bytes()
    wanted = URDF.load(
        io.BytesIO(raw),
        build_scene_graph=False,
        load_meshes=False,
        build_collision_scene_graph=False,
    ).robot
    found = elements_of(raw)
    for ours, theirs in zip(found.links, wanted.links, strict=True):
        assert (ours.name, ours.collisions) == (theirs.name, len(theirs.collisions))
        assert (ours.inertial is None) == (theirs.inertial is None)
        if ours.inertial is not None:
            origin = theirs.inertial.origin
            assert ours.inertial.pose == pytest.approx(np.eye(4) if origin is None else origin)
            assert ours.inertial.mass == theirs.inertial.mass
            assert np.array_equal(ours.inertial.inertia, theirs.inertial.inertia)
    for one, other in zip(found.joints, wanted.joints, strict=True):
        assert (one.name, one.kind, one.parent, one.child) == (
            other.name,
            other.type,
            other.parent,
            other.child,
        )
        assert one.pose == pytest.approx(np.eye(4) if other.origin is None else other.origin)
        assert np.array_equal(one.axis, other.axis)
        assert one.lower == (None if other.limit is None else other.limit.lower)


@pytest.mark.parametrize(
    "extra",
    [
        '<limit lower="-1" upper="1" effort="strong" velocity="1"/>',
        '<limit lower="-1" upper="1" effort="1" velocity="1"/><mimic joint="b" multiplier="x"/>',
        '<limit lower="-1" upper="1" effort="1" velocity="1"/><calibration rising="1;"/>',
    ],
)
def test_numbers_that_an_engine_would_read_are_checked(tmp_path: Path, extra: str) -> None:
    """A word in place of a number is refused though nothing here uses the number."""
    mass = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    links = "".join(f'<link name="{name}">{mass}</inertial></link>' for name in "ab")
    joint = f'<joint name="j" type="revolute"><parent link="a"/><child link="b"/>{extra}</joint>'
    path = tmp_path / "r.urdf"
    path.write_text(f'<robot name="r">{links}{joint}</robot>')
    with pytest.raises(RobotError, match="is no number"):
        read_urdf(path)
