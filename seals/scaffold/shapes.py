"""Hulls of a new robot, from the collision shapes of its URDF."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError
from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel
from seals.scaffold.meshes import load_mesh
from seals.scaffold.plug_ins import Displacement, Hydrodynamics
from seals.scaffold.takeover import Takeover
from seals.scaffold.urdf import Element, UrdfDraft, pose_of, refuse_unknown, triple_of
from seals.scaffold.writing import plain

MOST_FACES = 400
"""Triangles of a hull above which a convex one of fewer takes its place."""
_DIRECTIONS = 80


class Box(NamedTuple):
    """Bounding box of one shape, in link axes.

    Args:
        centre: [m], shape (3,).
        edges: along its own axes [m], shape (3,).
        turn: own axes as columns, shape (3, 3).
    """

    centre: Floats
    edges: Floats
    turn: Floats

    @property
    def areas(self) -> Floats:
        """Projected area along each link axis [m^2], shape (3,)."""
        x, y, z = self.edges
        shadow: Floats = np.abs(self.turn) @ np.array([y * z, x * z, x * y])
        return shadow

    @property
    def size(self) -> Floats:
        """Edges of the enclosing box aligned with the link axes [m], shape (3,)."""
        return np.abs(self.turn) @ self.edges


class LinkHull(NamedTuple):
    """Hull shapes of one link.

    Args:
        shapes: entries of ``hulls:`` in ``robot.yaml``.
        boxes: box around each shape.
        volumes: of each shape [m^3].
        stated: volume [m^3] and centre of buoyancy [m] as a file states them, and its source.
    """

    shapes: list[dict[str, Any]]
    boxes: list[Box]
    volumes: list[float]
    stated: Mapping[str, Any] = {}

    @property
    def volume(self) -> float:
        """Volume [m^3]: the stated one, or the sum over the shapes."""
        return float(self.stated.get("displaced_volume", sum(self.volumes)))


def hulls_of(robot: UrdfDraft, folder: Path, skip: Collection[str] = ()) -> dict[str, LinkHull]:
    """Return the hull of each link: its collision shapes, or its visual ones if it has no others.

    Args:
        robot: a URDF whose meshes lie in the folder.
        folder: of the robot.
        skip: links that displace nothing worth counting, such as rotors.
    """
    found = {}
    for name, link in robot.links.items():
        parts = link.findall("collision") or link.findall("visual")
        entries = [e for part in parts if (e := _entry(part, folder, name)) is not None]
        if name in skip or not entries:
            continue
        shapes, boxes, volumes = map(list, zip(*entries, strict=True))
        found[name] = LinkHull(shapes, boxes, volumes)
    return found


def with_volumes(
    hulls: Mapping[str, LinkHull], robot: RobotModel, source: Takeover
) -> dict[str, LinkHull]:
    """Return hulls with the displaced volumes that plug-ins state.

    A stated volume is that of the link with all that is fixed to it.
    """
    found = dict(hulls)
    for each in source.stated.displacements:
        link = stated_link(each, robot, source)
        volume = each.volume
        if each.neutral:
            volume = float(f"{volume * robot.mass[_part_of(robot, link)].sum():.9g}")
        stated: dict[str, Any] = {"displaced_volume": volume}
        centre = each.centre
        if centre is not None and each.from_mass:
            # of the link with all that is fixed to it in a URDF, which Gazebo makes one body
            own = [robot.links.index(link)]
            part = _part_of(robot, link, source.spun) if source.lumps else own
            centre = centre + _centre_of(robot, part)
        if centre is not None:
            stated["centre_of_buoyancy"] = rounded(centre)
        if link not in found:
            radius = (0.75 * volume / np.pi) ** (1.0 / 3.0)
            place = np.zeros(3) if centre is None else centre
            shape = {"type": "sphere", "size": rounded([radius]), "position": rounded(place)}
            box = Box(place, np.full(3, 2.0 * radius), np.eye(3))
            found[link] = LinkHull([shape], [box], [volume])
        found[link] = found[link]._replace(stated={**stated, "source": each.source})
    rows = {name: k for k, name in enumerate(robot.links)}
    for name in [n for n in found if not found[n].stated]:
        above = rows[name]
        while robot.tree.joint[above] < 0 < above:
            above = robot.tree.parent[above]
            if robot.links[above] in found and found[robot.links[above]].stated:
                del found[name]
                break
    return found


def stated_link(each: Displacement | Hydrodynamics, robot: RobotModel, source: Takeover) -> str:
    """Return the link of which a plug-in states something: the base where it names none.

    Raises:
        RobotError: it names a link that is not there.
    """
    link = robot.links[0] if each.link in (*source.dropped, "") else each.link
    refuse_unknown(each.source, "link", link, robot.links)
    return link


def _part_of(robot: RobotModel, link: str, without: Collection[str] = ()) -> list[int]:
    """Return the rows of a link, first, and of all that is fixed to it, but some links."""
    part = [robot.links.index(link)]
    for k in range(len(robot.links)):
        fixed = robot.tree.joint[k] < 0 and robot.links[k] not in without
        if fixed and robot.tree.parent[k] in part:
            part.append(k)
    return part


def _centre_of(robot: RobotModel, part: list[int]) -> Floats:
    """Return the centre of mass of links in axes of the first of them [m], shape (3,)."""
    origins, turns = poses_in_base(robot.tree)
    mass = robot.mass[part]
    if mass.sum() <= 0.0:
        return np.zeros(3)
    places = np.array([origins[k] + turns[k] @ robot.centre[k] for k in part])
    centre: Floats = turns[part[0]].T @ (mass @ places / mass.sum() - origins[part[0]])
    return centre


def extents_of(robot: UrdfDraft, folder: Path) -> Mapping[str, float]:
    """Return the largest extent of the visual and collision shapes of each link [m]."""
    found: dict[str, float] = {}
    for name, link in robot.links.items():
        for part in (*link.findall("collision"), *link.findall("visual")):
            entry = _entry(part, folder, "")
            if entry is not None:
                found[name] = max(found.get(name, 0.0), float(entry[1].edges.max()))
    return found


def _entry(part: Element, folder: Path, link: str) -> tuple[dict[str, Any], Box, float] | None:
    """One shape as an entry of a hull, its bounding box and volume; None for an empty element."""
    geometry = part.find("geometry")
    shape = None if geometry is None else next(iter(geometry), None)
    if shape is None or not isinstance(shape.tag, str):
        return None
    if shape.tag == "mesh":
        entry, low, high, volume = _mesh(shape, folder, link)
    else:
        entry, half, volume = _primitive(shape)
        low, high = -half, half
    origin = part.find("origin")
    position, rpy = triple_of(origin, "xyz"), triple_of(origin, "rpy")
    if np.any(position):
        entry["position"] = rounded(position)
    if np.any(rpy):
        entry["rpy"] = rounded(rpy)
    turn = pose_of(origin)[:3, :3]
    return entry, Box(turn @ (low + high) / 2.0 + position, high - low, turn), volume


def _primitive(shape: Element) -> tuple[dict[str, Any], Floats, float]:
    def number(key: str) -> float:
        return float(shape.get(key, "0"))

    if shape.tag == "box":
        size = np.array([float(word) for word in shape.get("size", "").split()])
        return {"type": "box", "size": rounded(size)}, size / 2.0, float(size.prod())
    radius = number("radius")
    if shape.tag == "sphere":
        volume = 4.0 / 3.0 * np.pi * radius**3
        return {"type": "sphere", "size": rounded([radius])}, np.full(3, radius), volume
    length = number("length")
    caps = radius if shape.tag == "capsule" else 0.0
    half = np.array([radius, radius, length / 2.0 + caps])
    volume = np.pi * radius**2 * (length + 4.0 / 3.0 * caps)
    return {"type": shape.tag, "size": rounded([radius, length])}, half, volume


def _mesh(shape: Element, folder: Path, link: str) -> tuple[dict[str, Any], Floats, Floats, float]:
    """A mesh as a hull: itself if closed, small and unscaled, else its convex hull, in a file."""
    file = str(shape.get("filename"))
    mesh = load_mesh(folder / file)
    scale = np.array([float(word) for word in shape.get("scale", "1 1 1").split()])
    points = np.asarray(mesh.vertices) * scale
    ready = mesh.is_watertight and mesh.volume > 0.0 and len(mesh.faces) <= MOST_FACES
    if not (ready and np.all(scale == 1.0)):
        mesh = _convex(points)
        if link:
            file = f"meshes/hull_{plain(link)}_{Path(file).stem}.obj"
            (folder / file).write_text(
                str(mesh.export(file_type="obj", include_normals=False)), encoding="utf-8"
            )
    entry = {"type": "mesh", "file": file}
    return entry, points.min(axis=0), points.max(axis=0), float(abs(mesh.volume))


def _convex(points: Floats) -> Any:
    """Convex hull of points; with too many faces, that of the farthest in fixed directions."""
    import trimesh
    from scipy.spatial import QhullError

    cloud: Any = trimesh.PointCloud
    try:
        hull = cloud(points).convex_hull
    except (QhullError, ValueError) as cause:
        raise RobotError(
            "a mesh is flat: it encloses no volume.\n"
            "Give its link a <collision> of another shape, or leave the mesh out."
        ) from cause
    if len(hull.faces) <= MOST_FACES:
        return hull
    k = np.arange(_DIRECTIONS) + 0.5
    height, turn = 1.0 - 2.0 * k / _DIRECTIONS, np.pi * (1.0 + 5.0**0.5) * k
    wide = np.sqrt(1.0 - height**2)
    ways = np.stack((wide * np.cos(turn), wide * np.sin(turn), height), axis=1)
    corners = np.asarray(hull.vertices)
    far = np.unique(np.argmax(corners @ ways.T, axis=0))
    return cloud(corners[far]).convex_hull


def rounded(values: Any) -> list[float]:
    """Return numbers rounded to six decimals, as lists for YAML."""
    return [round(float(value), 6) + 0.0 for value in np.asarray(values)]
