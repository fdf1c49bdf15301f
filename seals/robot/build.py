"""Builds the robot model from a robot folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from seals.errors import RobotError, refuse_unlisted
from seals.hydrostatics import (
    Hull,
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullSphere,
    hull_from_mesh,
)
from seals.multibody.tree import Tree
from seals.robot.limbs import build_arms, build_grippers, build_legs
from seals.robot.model import RobotModel
from seals.robot.settings import RobotSettings, ShapeSettings
from seals.robot.urdf import Urdf, UrdfJoint, read_urdf


def build_robot(settings: RobotSettings, urdf: Urdf | None = None) -> RobotModel:
    """Build the model of a robot.

    Args:
        settings: of its folder, or of a description that has none.
        urdf: links and joints of a description without a URDF file; left out, the file is read.

    Raises:
        RobotError: the URDF, a mesh or a hull cannot be used.
    """
    where = f"robot '{settings.name}'" if urdf else f"URDF {settings.urdf_path}"
    path = "" if urdf else str(settings.urdf_path)
    urdf = urdf or read_urdf(settings.urdf_path)
    names = [link.name for link in urdf.links]
    for link in settings.hulls:
        refuse_unlisted(link, names, f"robot.hulls: there is no link '{link}'", error=RobotError)
    hulls = tuple(_hull(settings, name) for name in names)
    tree, joints = _tree(urdf, settings.fixed_base)
    moving = [j for j in urdf.joints if j.moves]
    mass = np.array([link.mass for link in urdf.links])
    if not settings.fixed_base and mass[0] <= 0.0:
        raise RobotError(
            f"{where}: the base link '{names[0]}' has no mass.\nGive it an <inertial> element."
        )
    return RobotModel(
        name=settings.name or urdf.name,
        urdf=path,
        links=tuple(names),
        joints=joints,
        tree=tree,
        mass=mass,
        centre=np.array([link.centre for link in urdf.links]),
        inertia=np.array([link.inertia for link in urdf.links]),
        lower=np.array([j.lower for j in moving]),
        upper=np.array([j.upper for j in moving]),
        hulls=hulls,
        has_collision=tuple(link.collides for link in urdf.links),
        arms=build_arms(settings.arms, names, joints),
        grippers=build_grippers(settings.grippers, names, joints),
        legs=build_legs(settings.legs, names, joints),
    )


def _tree(urdf: Urdf, fixed_base: bool) -> tuple[Tree, tuple[str, ...]]:
    """Structure of the links and names of the movable joints."""
    index = {link.name: k for k, link in enumerate(urdf.links)}
    parent, joint = [-1], [-1]
    moving: list[UrdfJoint] = []
    for above in urdf.joints:
        parent.append(index[above.parent])
        joint.append(len(moving) if above.moves else -1)
        if above.moves:
            moving.append(above)
    tree = Tree(
        parent=tuple(parent),
        joint=tuple(joint),
        prismatic=tuple(j.prismatic for j in moving),
        axis=np.array([j.axis for j in moving]).reshape(-1, 3),
        origin=np.array([np.zeros(3), *(j.origin for j in urdf.joints)]),
        rotation=np.array([np.eye(3), *(j.rotation for j in urdf.joints)]),
        fixed_base=fixed_base,
    )
    return tree, tuple(j.name for j in moving)


def _hull(settings: RobotSettings, link: str) -> Hull | None:
    """Hull of one link, or None."""
    spec = settings.hulls.get(link)
    if spec is None or not spec.shapes:
        return None
    shapes = [_shape(settings, link, shape) for shape in spec.shapes]
    stated = (spec.displaced_volume, spec.centre_of_buoyancy, spec.plan_area)
    if len(shapes) == 1 and stated == (None, None, None):
        return shapes[0]
    return HullCompound(
        parts=shapes,
        displaced_volume=spec.displaced_volume,
        centre_of_buoyancy=spec.centre_of_buoyancy,
        plan_area=spec.plan_area,
    )


def _shape(settings: RobotSettings, link: str, shape: ShapeSettings) -> Hull:
    """One primitive."""
    kind = shape.type.value
    if kind == "mesh":
        if not shape.file:
            raise RobotError(
                f"robot.hulls.{link}: a shape of type mesh needs a file.\nSay file: NAME.stl"
            )
        folder = Path(settings.folder).resolve()
        if not (folder / shape.file).resolve().is_relative_to(folder):
            raise RobotError(
                f"robot.hulls.{link}: '{shape.file}' is outside {folder}.\n"
                "Keep meshes in the robot's folder."
            )
        return hull_from_mesh(folder / shape.file, position=shape.position, rpy=shape.rpy).hull
    need = {"sphere": 1, "box": 3, "cylinder": 2, "capsule": 2}[kind]
    if len(shape.size) != need:
        raise RobotError(
            f"robot.hulls.{link}: {kind} has the size {list(shape.size)}.\nAllowed: {need} numbers "
            "(sphere radius; box edges x, y, z; cylinder and capsule radius, length)."
        )
    position, rpy, size = shape.position, shape.rpy, shape.size
    if kind == "sphere":
        return HullSphere(radius=size[0], position=position)
    if kind == "box":
        return HullBox(size=size, position=position, rpy=rpy)
    if kind == "cylinder":
        return HullCylinder(radius=size[0], length=size[1], position=position, rpy=rpy)
    return HullCapsule(radius=size[0], length=size[1], position=position, rpy=rpy)
