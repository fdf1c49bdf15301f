"""A PyBullet client that holds nothing but what is seen: no contact, no mass, no step."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import MissingExtra, PhysicsError
from seals.frames import quaternion_of
from seals.sight.meshes import corners_of
from seals.sight.scene import WORLD, Scene, Shape

_LEVEL = [0.0, 0.0, 0.0, 1.0]
MOST_CORNERS = 30_000
"""Corners in one mesh; larger ones are cut into several."""


class Bodies:
    """The shapes of a scene as PyBullet bodies, one for each frame, part and colour.

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
        """Load all meshes."""
        self.engine = engine(name)
        self.client = self.engine.connect(self.engine.DIRECT)
        if self.client < 0:
            raise PhysicsError(
                "PyBullet gave no client to draw in.\nClose other worlds of this process first."
            )
        self._files: Path | None = None
        self._turns: dict[int, tuple[Floats, list[float]]] = {}
        if plugin is not None:
            with quiet(), tempfile.TemporaryDirectory() as folder:
                self.engine.loadPlugin(*plugin, physicsClientId=self.client)
                self._files = Path(folder)
                self._load_all(scene)
        else:
            self._load_all(scene)

    def _load_all(self, scene: Scene) -> None:
        """Load the shapes, those of one frame, part and colour together."""
        groups: dict[tuple[int, int, tuple[float, float, float]], list[Shape]] = {}
        for shape in scene.shapes:
            if shape.kind != "plane":
                groups.setdefault((shape.frame, shape.part, shape.colour), []).append(shape)
        found: dict[int, int] = {}
        by_frame: dict[int, list[int]] = {}
        for (frame, part, colour), shapes in groups.items():
            for body in self._load(shapes, colour):
                found[body] = part
                by_frame.setdefault(frame, []).append(body)
        self._carried = list(by_frame.items())
        self.part_of = np.zeros(max(found, default=-1) + 2, dtype=np.int32)
        for body, part in found.items():
            self.part_of[body + 1] = part

    def _load(self, shapes: list[Shape], colour: tuple[float, float, float]) -> list[int]:
        """Put shapes of one frame and colour into the scene, in axes of the frame."""
        corners, normals = zip(*(_placed(shape) for shape in shapes), strict=True)
        points, outward = np.concatenate(corners), np.concatenate(normals)
        p, bodies = self.engine, []
        for start in range(0, len(points), MOST_CORNERS):
            cut = slice(start, start + MOST_CORNERS)
            visual = p.createVisualShape(
                p.GEOM_MESH,
                rgbaColor=[*colour, 1.0],
                physicsClientId=self.client,
                **self._mesh(points[cut], outward[cut]),
            )
            bodies.append(p.createMultiBody(0.0, -1, visual, physicsClientId=self.client))
        return bodies

    def _mesh(self, points: Floats, outward: Floats) -> dict[str, Any]:
        """A mesh as the engine takes it: as lists, or as a file for a renderer that wants one."""
        if self._files is not None:
            path = self._files / f"{len(list(self._files.iterdir()))}.obj"
            path.write_text(_obj(points, outward), encoding="ascii")
            return {"fileName": str(path)}
        return {
            "vertices": points.tolist(),
            "normals": outward.tolist(),
            "uvs": [[0.0, 0.0]] * len(points),
            "indices": list(range(len(points))),
        }

    def place(self, position: Floats, rotation: Floats, origin: Floats) -> None:
        """Move all bodies; the camera is the origin, because drawing is in single precision.

        Args:
            position: of the frames, world [m], shape (F, 3).
            rotation: R_WF, shape (F, 3, 3).
            origin: of the camera, world [m], shape (3,).
        """
        move, client = self.engine.resetBasePositionAndOrientation, self.client
        for frame, bodies in self._carried:
            place, turn = (-origin).tolist(), _LEVEL
            if frame != WORLD:
                place = (position[frame] - origin).tolist()
                turn = self._turn(frame, rotation[frame])
            for body in bodies:
                move(body, place, turn, physicsClientId=client)

    def _turn(self, frame: int, rotation: Floats) -> list[float]:
        """Quaternion of a frame; several cameras ask for the same one."""
        before = self._turns.get(frame)
        if before is None or not np.array_equal(before[0], rotation):
            turn: list[float] = quaternion_of(rotation).tolist()
            self._turns[frame] = before = rotation.copy(), turn
        return before[1]

    def close(self) -> None:
        """Disconnect; a second call does nothing."""
        if self.client >= 0:
            self.engine.disconnect(physicsClientId=self.client)
        self.client = -1


def _obj(points: Floats, outward: Floats) -> str:
    """Triangles with normals as the text of an OBJ file."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points.tolist()]
    lines += [f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in outward.tolist()]
    triples = np.arange(1, len(points) + 1).reshape(-1, 3).tolist()
    lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in triples]
    return "\n".join([*lines, ""])


def _placed(shape: Shape) -> tuple[Floats, Floats]:
    """Corners and normals of a shape in axes of its frame."""
    corners, normals = corners_of(shape)
    turn = np.asarray(shape.rotation)
    return corners @ turn.T + shape.position, normals @ turn.T


def engine(name: str) -> Any:
    """Import PyBullet, without the line that its C code prints on the first import.

    Raises:
        MissingExtra: it is not installed.
    """
    with quiet():
        try:
            import pybullet
        except ImportError as cause:
            raise MissingExtra(
                f"viewer={name} needs the package pybullet, which is not installed.\n"
                "Draw without it: viewer=raycast (extra 'learn'); or pip install pybullet==3.2.7"
            ) from cause
    return pybullet


@contextmanager
def quiet() -> Iterator[None]:
    """Swallow what C code prints: a first import and drivers talk."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept, silent = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    try:
        for number in (1, 2):
            os.dup2(silent, number)
        yield
    finally:
        for number, before in enumerate(kept, start=1):
            os.dup2(before, number)
            os.close(before)
        os.close(silent)
