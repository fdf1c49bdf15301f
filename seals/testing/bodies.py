"""Test bodies in general position: mass off the origin, tilted axes, moving links."""

from __future__ import annotations

from pathlib import Path

from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.robot.settings import HullSettings, RobotSettings, ShapeSettings, ShapeType

_LINK = """
  <link name="{name}">
    <inertial><origin xyz="{centre}"/><mass value="{mass}"/>
      <inertia ixx="{i[0]}" iyy="{i[1]}" izz="{i[2]}"
        ixy="{i[3]}" ixz="{i[4]}" iyz="{i[5]}"/></inertial>
  </link>"""
_JOINT = """
  <joint name="{name}" type="continuous">
    <parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
  </joint>"""
_TILTED = (2.4e-3, 2.8e-3, 2.0e-3, 2e-4, -1e-4, 1.5e-4)


def free_body(folder: Path) -> RobotModel:
    """Return a body of 1 kg with a box hull that displaces 1.2 kg of water.

    Args:
        folder: where its URDF is written; rigid-body engines read it there.
    """
    links = _LINK.format(name="base", centre="0.004 -0.006 0.005", mass=1.0, i=_TILTED)
    hulls = {
        "base": HullSettings(shapes=[ShapeSettings(type=ShapeType.box, size=[0.1, 0.1, 0.12])])
    }
    return _build(folder, "free_body", links, hulls)


def moving_arm(folder: Path) -> RobotModel:
    """Return a body of 1 kg with two swinging links of 0.2 and 0.15 kg, all with hulls.

    Args:
        folder: where its URDF is written.
    """
    parts = [
        _LINK.format(name="base", centre="0.01 -0.02 0.015", mass=1.0, i=_TILTED),
        _LINK.format(
            name="upper", centre="0 0 -0.06", mass=0.2, i=(3e-4, 3e-4, 4e-5, 0.0, 0.0, 0.0)
        ),
        _LINK.format(
            name="fore", centre="0 0 -0.06", mass=0.15, i=(2e-4, 2e-4, 3e-5, 0.0, 0.0, 0.0)
        ),
        _JOINT.format(
            name="shoulder",
            parent="base",
            child="upper",
            xyz="0.02 0 -0.06",
            rpy="0 0 0",
            axis="0 1 0",
        ),
        _JOINT.format(
            name="elbow", parent="upper", child="fore", xyz="0 0 -0.13", rpy="0.3 0 0", axis="1 0 0"
        ),
    ]
    rod = {"type": ShapeType.cylinder, "position": [0.0, 0.0, -0.06]}
    hulls = {
        "base": HullSettings(shapes=[ShapeSettings(type=ShapeType.box, size=[0.12, 0.12, 0.09])]),
        "upper": HullSettings(shapes=[ShapeSettings(size=[0.02, 0.12], **rod)]),  # type: ignore[arg-type]
        "fore": HullSettings(shapes=[ShapeSettings(size=[0.015, 0.12], **rod)]),  # type: ignore[arg-type]
    }
    return _build(folder, "moving_arm", "".join(parts), hulls)


def _build(folder: Path, name: str, parts: str, hulls: dict[str, HullSettings]) -> RobotModel:
    (folder / f"{name}.urdf").write_text(
        f'<?xml version="1.0"?>\n<robot name="{name}">{parts}\n</robot>\n'
    )
    return build_robot(
        RobotSettings(name=name, folder=str(folder), urdf=f"{name}.urdf", hulls=hulls)
    )
