"""PyBullet client for rendering only: visual shapes without mass or contact."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import PhysicsError, optional_import
from seals.frames import quaternion_of
from seals.rendering.camera import Lens
from seals.rendering.meshes import corners_of
from seals.rendering.scene import Scene, Shape
from seals.terminal import silenced

Colour = tuple[float, float, float]
FEW = 200
"""Triangles up to which a mesh stays whole."""
MOST_CORNERS = 30_000
"""Corners in one mesh; larger ones are cut into several."""


class View(NamedTuple):
    """Camera: position [m], optical axes in the world as columns, lens."""

    origin: Floats
    axes: Floats
    lens: Lens


class _Body(NamedTuple):
    """A body with the ball around it, in axes of its frame."""

    number: int
    middle: Floats
    radius: float
    frame: int
    part: int
    colour: Colour


class Bodies:
    """Visual shapes of a scene as PyBullet bodies, one for each frame, part and colour.

    Args:
        scene: what to draw; planes are left out.
        name: of the renderer, for messages.
        plugin: file of a renderer's plug-in, loaded before anything else; it wants meshes as files.

    Attributes:
        engine: the pybullet module.
        client: physics client.
        part_of: number of the part by body number plus one, so that -1 is nothing.
    """

    def __init__(self, scene: Scene, name: str, plugin: tuple[str, str] | None = None) -> None:
        self.engine = engine(name)
        self.client = self.engine.connect(self.engine.DIRECT)
        if self.client < 0:
            raise PhysicsError(
                "PyBullet gave no client to draw in.\nClose other worlds of this process first."
            )
        self._files: Path | None = None
        self._turns: dict[int, tuple[Floats, list[float]]] = {}
        if plugin is not None:
            with silenced(), tempfile.TemporaryDirectory() as folder:
                self.engine.loadPlugin(*plugin, physicsClientId=self.client)
                self._files = Path(folder)
                self._load_all(scene)
        else:
            self._load_all(scene)

    def _load_all(self, scene: Scene) -> None:
        """Load the shapes, those of one frame, part and colour together."""
        groups: dict[tuple[int, int, Colour], list[Shape]] = {}
        for shape in scene.shapes:
            if shape.kind != "plane":
                groups.setdefault((shape.frame, shape.part, shape.colour), []).append(shape)
        found: list[_Body] = []
        for (frame, part, colour), shapes in groups.items():
            found += [_Body(*body, frame, part, colour) for body in self._load(shapes, colour)]
        self._bodies = found
        self._shown = [True] * len(found)
        self._frames = np.array([b.frame for b in found], dtype=np.intp)
        self._middles = np.array([b.middle for b in found]).reshape(-1, 3)
        self._radii = np.array([b.radius for b in found])
        self.part_of = np.zeros(max((b.number for b in found), default=-1) + 2, dtype=np.int32)
        for body in found:
            self.part_of[body.number + 1] = body.part

    def _load(self, shapes: list[Shape], colour: Colour) -> list[tuple[int, Floats, float]]:
        """Add shapes of one frame and colour to the scene; return number, centre and radius."""
        corners, normals = [], []
        for shape in shapes:
            at, out = corners_of(shape)
            turn = np.asarray(shape.rotation)
            corners.append(at @ turn.T + shape.position)
            normals.append(out @ turn.T)
        points, outward = np.concatenate(corners), np.concatenate(normals)
        p, bodies = self.engine, []
        for cut in _quarters(points):
            visual = p.createVisualShape(
                p.GEOM_MESH,
                rgbaColor=[*colour, 1.0],
                physicsClientId=self.client,
                **self._mesh(points[cut], outward[cut]),
            )
            number = p.createMultiBody(0.0, -1, visual, physicsClientId=self.client)
            middle = 0.5 * (points[cut].min(axis=0) + points[cut].max(axis=0))
            radius = float(np.linalg.norm(points[cut] - middle, axis=1).max())
            bodies.append((int(number), middle, radius))
        return bodies

    def _mesh(self, points: Floats, outward: Floats) -> dict[str, Any]:
        """Mesh in the engine's format: lists, or a file for renderers that need one."""
        if self._files is not None:
            path = self._files / f"{len(list(self._files.iterdir()))}.obj"
            lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points.tolist()]
            lines += [f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in outward.tolist()]
            triples = np.arange(1, len(points) + 1).reshape(-1, 3).tolist()
            lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in triples]
            path.write_text("\n".join([*lines, ""]), encoding="ascii")
            return {"fileName": str(path)}
        return {
            "vertices": points.tolist(),
            "normals": outward.tolist(),
            "uvs": [[0.0, 0.0]] * len(points),
            "indices": list(range(len(points))),
        }

    def place(self, position: Floats, rotation: Floats, camera: View) -> None:
        """Set the poses of all bodies in view, and hide the others.

        The camera is the origin, because drawing is in single precision.

        Args:
            position: of the frames, world [m], shape (F, 3).
            rotation: R_WF, shape (F, 3, 3).
            camera: that will look.
        """
        p, client, origin = self.engine, self.client, camera.origin
        # the frame that stands still comes last, where -1 finds it
        places = np.concatenate([position, np.zeros((1, 3))]) - origin
        turns = np.concatenate([rotation, np.eye(3)[None]])
        frames = self._frames
        middles = places[frames] + np.einsum("bij,bj->bi", turns[frames], self._middles)
        seen = self._in_view(middles @ camera.axes, camera.lens)
        for k, body in enumerate(self._bodies):
            if seen[k] != self._shown[k]:
                # TinyRenderer leaves out what is wholly transparent
                self._shown[k] = seen[k]
                rgba = [*body.colour, float(seen[k])]
                p.changeVisualShape(body.number, -1, rgbaColor=rgba, physicsClientId=client)
            if seen[k]:
                frame = body.frame
                matrix = turns[body.frame]
                before = self._turns.get(frame)
                if before is None or not np.array_equal(before[0], matrix):
                    turn: list[float] = quaternion_of(matrix).tolist()
                    self._turns[frame] = before = matrix.copy(), turn
                p.resetBasePositionAndOrientation(
                    body.number,
                    places[body.frame].tolist(),
                    before[1],
                    physicsClientId=client,
                )

    def _in_view(self, middles: Floats, lens: Lens) -> list[bool]:
        """Return whether the bounding spheres of the bodies reach into the view frustum."""
        if self._files is not None:
            return [True] * len(middles)
        reach = self._radii
        seen = (middles[:, 2] + reach > lens.near) & (middles[:, 2] - reach < lens.far)
        for axis, steep in enumerate((lens.cx / lens.fx, lens.cy / lens.fy)):
            out = np.abs(middles[:, axis]) - steep * middles[:, 2]
            seen &= out < reach * np.sqrt(1.0 + steep * steep)
        found: list[bool] = seen.tolist()
        return found

    def close(self) -> None:
        """Disconnect; a second call does nothing."""
        if self.client >= 0:
            self.engine.disconnect(physicsClientId=self.client)
        self.client = -1


def _quarters(points: Floats) -> list[NDArray[np.intp]]:
    """Split triangles into compact groups, so that groups out of view can be skipped."""
    centres = points.reshape(-1, 3, 3).mean(axis=1)
    if len(centres) < FEW:
        return [np.arange(len(points))]
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    widest = np.argsort(np.ptp(points, axis=0))[:0:-1]
    side = (centres[:, widest] > middle[widest]) @ np.array([1, 2])
    corners = 3 * np.arange(len(centres))[:, None] + np.arange(3)
    parts = [corners[side == k].ravel() for k in range(4)]
    cuts = [(part, start) for part in parts for start in range(0, len(part), MOST_CORNERS)]
    return [part[start : start + MOST_CORNERS] for part, start in cuts]


def engine(name: str) -> Any:
    """Import PyBullet without the line that it prints.

    Raises:
        MissingExtra: it is not installed.
    """
    with (
        silenced(),
        optional_import(
            f"viewer={name} needs the package pybullet",
            "Draw without it: viewer=raycast (extra 'learn'); or pip install pybullet==3.2.7",
        ),
    ):
        import pybullet
    return pybullet
