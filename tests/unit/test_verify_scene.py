"""The vehicle of a log as URDF: what is written is read back as the same robot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seals.frames import matrix_of, quaternion_of_rpy
from seals.robot.urdf import read_urdf
from seals.sysid.data.robot_description import describe_robot
from seals.sysid.validation.scene import urdf_of

TURNS = ((0.3, -0.4, 2.0), (0.1, np.pi / 2.0, 0.7), (-2.0, 0.5, 0.1))


@pytest.mark.parametrize("name", ["auv", "free_arm", "hexacopter"])
def test_links_keep_their_places_and_axes(name: str, tmp_path: Path) -> None:
    """Fixed links stay fixed, and frames that are turned against their parents stay turned."""
    robot = describe_robot(name).robot
    turns = np.array(TURNS[: len(robot.links) - 1])
    rotation = robot.tree.rotation.copy()
    rotation[1 : 1 + len(turns)] = matrix_of(quaternion_of_rpy(turns))
    robot = replace(robot, tree=replace(robot.tree, rotation=rotation))
    path = tmp_path / "again.urdf"
    path.write_text(urdf_of(robot), encoding="utf-8")
    again = {joint.child: joint for joint in read_urdf(path).joints}
    for k, link in enumerate(robot.links[1:], start=1):
        joint = again[link]
        assert joint.moves == (robot.tree.joint[k] >= 0)
        assert joint.parent == robot.links[robot.tree.parent[k]]
        assert np.allclose(joint.rotation, robot.tree.rotation[k], atol=1e-9)
        assert np.allclose(joint.origin, robot.tree.origin[k])
