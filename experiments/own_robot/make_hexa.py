"""Generator of ``hexa_description``: a hexacopter as a ROS package.

The hull is drawn in millimetres, the propellers are COLLADA, the rotors hang on continuous joints
and the base is an empty frame, as in many descriptions that are passed around.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

RING, HULL, HEIGHT = 0.28, 0.11, 0.09
"""Radius of the circle of rotors, radius and height of the hull [m]."""
BOOM, BLADE = 0.012, 0.127
"""Radius of the booms, and of the propellers, which are 10 inches across [m]."""
MOTOR, HUB = 0.016, 0.06
"""Radius of a motor as drawn, and height of the propellers above the middle of the hull [m]."""
BODY_MASS, ROTOR_MASS = 2.1, 0.05
"""Hull with battery, booms and skids; one propeller with its motor's bell [kg]."""

LINK = """  <link name="{name}">
    <inertial>
      <origin xyz="{centre}" rpy="0 0 0"/>
      <mass value="{mass}"/>
      <inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/>
    </inertial>
{shapes}  </link>
"""
SHAPE = """    <{kind}>
      <origin xyz="{xyz}" rpy="{rpy}"/>
      <geometry>{geometry}</geometry>{colour}
    </{kind}>
"""
ORANGE, DARK, LIGHT = (f'\n      <material name="{name}"/>' for name in ("orange", "dark", "light"))
JOINT = """  <joint name="rotor_{k}_joint" type="continuous">
    <parent link="base_link"/>
    <child link="rotor_{k}"/>
    <origin xyz="{xyz}" rpy="0 0 0"/>
    <axis xyz="0 0 1"/>
    <limit effort="10" velocity="900"/>
  </joint>
  <transmission name="rotor_{k}_trans">
    <type>transmission_interface/SimpleTransmission</type>
    <joint name="rotor_{k}_joint">
      <hardwareInterface>EffortJointInterface</hardwareInterface>
    </joint>
    <actuator name="rotor_{k}_motor"/>
  </transmission>
"""
HEAD = """<?xml version="1.0"?>
<!-- A hexacopter with a sealed hull. -->
<robot name="hexa">
  <material name="orange"><color rgba="0.9 0.4 0.1 1"/></material>
  <material name="dark"><color rgba="0.16 0.17 0.2 1"/></material>
  <material name="light"><color rgba="0.65 0.67 0.7 1"/></material>
  <link name="base_footprint"/>
  <joint name="base_joint" type="fixed">
    <parent link="base_footprint"/>
    <child link="base_link"/>
    <origin xyz="0 0 0.1" rpy="0 0 0"/>
  </joint>
"""
TAIL = """  <gazebo reference="base_link"><material>Gazebo/Orange</material></gazebo>
</robot>
"""
PACKAGE = "package://hexa_description/meshes/"


def main(folder: Path) -> None:
    """Write meshes and URDF."""
    _meshes(folder / "meshes")
    text = HEAD + _body()
    for k in range(6):
        text += _rotor(k)
    (folder / "urdf" / "hexa.urdf").write_text(text + TAIL, encoding="utf-8")


def _meshes(folder: Path) -> None:
    import trimesh
    from trimesh import transformations

    turning: Any = transformations.rotation_matrix
    moving: Any = transformations.translation_matrix
    hull = trimesh.creation.cylinder(radius=HULL, height=HEIGHT, sections=6)
    hull.apply_scale(1000.0)
    hull.export(folder / "hull.stl")
    blade = trimesh.creation.box(extents=(BLADE, 0.02, 0.002))
    parts = [trimesh.creation.cylinder(radius=0.008, height=0.012, sections=12)]
    for half in (0.0, math.pi):
        # both are pitched by 14 degrees, leading edge up
        pitch = turning(0.25, (1, 0, 0), (0, 0, 0))
        out = moving((BLADE / 2.0, 0, 0))
        parts.append(blade.copy().apply_transform(turning(half, (0, 0, 1)) @ out @ pitch))
    blades: Any = trimesh.util.concatenate(parts)
    blades.export(folder / "propeller.dae")


def _body() -> str:
    hull = f'<mesh filename="{PACKAGE}hull.stl" scale="0.001 0.001 0.001"/>'
    shapes = ""
    # what touches and displaces ends at the circle around the hull; what is drawn meets its sides
    for kind, colour, dark, start in (
        ("visual", ORANGE, DARK, 0.8 * HULL),
        ("collision", "", "", HULL),
    ):
        boom = f'<cylinder radius="{BOOM}" length="{RING - start:.3f}"/>'
        shapes += SHAPE.format(kind=kind, xyz="0 0 0", rpy="0 0 0", geometry=hull, colour=colour)
        for k in range(6):
            angle = _angle(k)
            middle = (RING + start) / 2.0
            xyz = f"{middle * math.cos(angle):.4f} {middle * math.sin(angle):.4f} 0.03"
            rpy = f"0 {math.pi / 2:.5f} {angle:.5f}"
            shapes += SHAPE.format(kind=kind, xyz=xyz, rpy=rpy, geometry=boom, colour=dark)
        for side in (-0.09, 0.09):
            skid = '<box size="0.24 0.015 0.06"/>'
            xyz = f"0 {side} -0.07"
            shapes += SHAPE.format(kind=kind, xyz=xyz, rpy="0 0 0", geometry=skid, colour=dark)
    motor = f'<cylinder radius="{MOTOR}" length="{HUB - BOOM:.3f}"/>'
    for k in range(6):
        x, y = RING * math.cos(_angle(k)), RING * math.sin(_angle(k))
        xyz = f"{x:.4f} {y:.4f} {(HUB + BOOM) / 2.0:.3f}"
        shapes += SHAPE.format(kind="visual", xyz=xyz, rpy="0 0 0", geometry=motor, colour=LIGHT)
    # a hull of even density carries the battery low; booms and skids widen it
    return LINK.format(
        name="base_link",
        centre="0 0 -0.02",
        mass=BODY_MASS,
        ixx=0.016,
        iyy=0.016,
        izz=0.026,
        shapes=shapes,
    )


def _rotor(k: int) -> str:
    angle = _angle(k)
    geometry = f'<mesh filename="{PACKAGE}propeller.dae"/>'
    shapes = SHAPE.format(kind="visual", xyz="0 0 0", rpy="0 0 0", geometry=geometry, colour="")
    # a thin rod of that mass and length
    across = f"{ROTOR_MASS * (2.0 * BLADE) ** 2 / 12.0:.3e}"
    link = LINK.format(
        name=f"rotor_{k}",
        centre="0 0 0",
        mass=ROTOR_MASS,
        ixx="1e-05",
        iyy=across,
        izz=across,
        shapes=shapes,
    )
    xyz = f"{RING * math.cos(angle):.4f} {RING * math.sin(angle):.4f} {HUB}"
    return link + JOINT.format(k=k, xyz=xyz)


def _angle(k: int) -> float:
    return math.radians(30.0 + 60.0 * k)


if __name__ == "__main__":
    main(Path(__file__).parent / "hexa_description")
