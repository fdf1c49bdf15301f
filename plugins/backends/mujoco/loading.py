"""Conversion of a robot model to MuJoCo's model description."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError
from seals.frames import quaternion_of
from seals.plugins.backends.mujoco.contact_law import impedance, reference
from seals.robot.model import RobotModel
from seals.robot.pieces import Piece, collision_pieces

FAR = 1e9
"""Stands for a joint limit that is not there [rad or m]."""


class Description(NamedTuple):
    """Names of a robot's parts in the model description.

    Args:
        bodies: of every link; the frame of a free base stands in its centre of mass.
        joints: of every movable joint.
        shapes: names of collision shapes, and the row of their link.
    """

    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    shapes: tuple[tuple[str, int], ...]


def principal(inertia: Floats) -> tuple[Floats, Floats]:
    """Return principal moments [kg m^2], shape (3,), and their axes, shape (3, 3), right-handed."""
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0.0:
        axes = axes * np.array([1.0, 1.0, -1.0])
    return np.maximum(moments, 0.0), axes


def describe(engine: Any, spec: Any, robot: RobotModel, number: int, step: float) -> Description:
    """Add bodies, joints and collision shapes of a robot; masses are written after compilation.

    Args:
        engine: the mujoco module.
        spec: model description.
        robot: model to add.
        number: of the robot, for unique names.
        step: h [s].

    Raises:
        RobotError: a collision mesh cannot be used.
    """
    tree = robot.tree
    parts: list[Any] = []
    # the engine integrates the way of a free base's frame: that of its centre of mass is exact
    shift = np.zeros((len(robot.links), 3))
    shift[0] = 0.0 if tree.fixed_base else robot.centre[0]
    names = [f"{number}/{link}" for link in robot.links]
    joints = [f"{number}/{joint}" for joint in robot.joints]
    for k, name in enumerate(names):
        parent = spec.worldbody if k == 0 else parts[tree.parent[k]]
        place = tree.origin[k] - shift[tree.parent[k]] if k else np.zeros(3)
        body = parent.add_body(name=name, pos=place, quat=_wxyz(tree.rotation[k]))
        # mass and moments of one until the model is compiled: the engine refuses frames without
        body.explicitinertial, body.mass, body.inertia = True, 1.0, [1.0, 1.0, 1.0]
        body.ipos = robot.centre[k] - shift[k]
        body.iquat = _wxyz(principal(robot.inertia[k])[1])
        # otherwise a single body keeps the diagonal of its inertia only, and added inertia has more
        body.simple = 0
        if k == 0 and tree.fixed_base:
            body.mocap = True
        elif k == 0:
            body.add_joint(name=f"{number}/", type=engine.mjtJoint.mjJNT_FREE, align=0)
        elif tree.joint[k] >= 0:
            j = tree.joint[k]
            kind = (
                engine.mjtJoint.mjJNT_SLIDE
                if robot.tree.prismatic[j]
                else engine.mjtJoint.mjJNT_HINGE
            )
            joint = body.add_joint(name=joints[j], type=kind, axis=robot.tree.axis[j])
            # the range is written after compilation: the engine refuses two stops at one place
            joint.limited, joint.range = any(np.isfinite(limits(robot)[j])), [-1.0, 1.0]
            joint.solref_limit, joint.solimp_limit = reference(step), impedance()
        parts.append(body)
    shapes = []
    for k, pieces in enumerate(collision_pieces(robot)):
        for count, piece in enumerate(pieces):
            name = f"{names[k]}/{count}"
            moved = piece._replace(position=piece.position - shift[k])
            _shape(engine, spec, parts[k], moved, name=name, robot=robot)
            shapes.append((name, k))
    return Description(tuple(names), tuple(joints), tuple(shapes))


def limits(robot: RobotModel) -> Floats:
    """Return the limits of all joints [rad or m], shape (J, 2)."""
    return np.stack((robot.lower, robot.upper), axis=1)


def _wxyz(rotation: Floats) -> Floats:
    """Return a rotation matrix (3, 3) as a quaternion in the engine's order."""
    x, y, z, w = quaternion_of(rotation)
    return np.array([w, x, y, z])


def _shape(
    engine: Any, spec: Any, body: Any, piece: Piece, *, name: str, robot: RobotModel
) -> None:
    """Add a collision shape that touches only the shapes of its contact pairs."""
    geom = body.add_geom(
        name=name,
        pos=piece.position,
        quat=_wxyz(piece.rotation),
        contype=0,
        conaffinity=0,
        mass=0.0,
    )
    geom.type, geom.size = form(engine, piece.kind, piece.size)
    if piece.kind == "mesh":
        geom.meshname = name
        _mesh(engine, spec, piece, name, robot)


def form(engine: Any, kind: str, size: Sequence[float]) -> tuple[Any, list[float]]:
    """Return the engine's type and sizes of a plane, box, sphere, cylinder, capsule or mesh."""
    radius, length = (*size, 0.0, 0.0)[:2]
    sizes = {"box": [0.5 * edge for edge in size], "plane": [0.0, 0.0, 1.0], "mesh": [0.0] * 3}
    kinds = getattr(engine.mjtGeom, f"mjGEOM_{kind.upper()}")
    return kinds, sizes.get(kind, [radius, 0.5 * length, 0.0])


def _mesh(engine: Any, spec: Any, piece: Piece, name: str, robot: RobotModel) -> None:
    """Add the convex hull of a mesh as collision shape."""
    from scipy.spatial import ConvexHull, QhullError

    points = np.asarray(piece.vertices, dtype=float)
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError) as cause:
        raise RobotError(
            f"the collision mesh {name.partition('/')[2]} of '{robot.name}' has no volume.\n"
            "Give the link a box, or a mesh with a thickness."
        ) from cause
    corners = points[hull.vertices]
    row = np.zeros(len(points), dtype=int)
    row[hull.vertices] = np.arange(len(corners))
    faces = row[hull.simplices]
    # every triangle is turned outward
    a, b, c = (corners[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    mesh = spec.add_mesh(name=name)
    mesh.uservert, mesh.userface = corners.ravel(), faces.ravel()
    mesh.inertia = engine.mjtMeshInertia.mjMESH_INERTIA_CONVEX
