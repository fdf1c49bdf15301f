"""Shapes and forces of a run as Foxglove scene entities."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import solids_of
from seals.frames import quaternion_of
from seals.rendering.gather import build_scene
from seals.rendering.meshes import triangles
from seals.rendering.scene import WORLD, Detail
from seals.run.immersed import surroundings
from seals.run.settings import RunSettings
from seals.world import World
from seals.world.actor import Actor

FAINT = 1e-3
"""Force below which there is no arrow [N]."""
COLOURS = ((0.1, 0.5, 0.9), (0.9, 0.4, 0.1), (0.2, 0.7, 0.3), (0.8, 0.2, 0.6), (0.6, 0.6, 0.1))
"""Of the forces of effects, in their order."""


def solids(messages: Any, stamp: Any, settings: RunSettings, world: World) -> Iterator[Any]:
    """Yield an entity for each frame of the scene, with its shapes; planes are left out.

    Args:
        messages: module of Foxglove.
        stamp: time, as a message.
        settings: of the run.
        world: of the run.
    """
    robots = {name: actor.robot for name, actor in world.actors.items()}
    scene = build_scene(robots, solids_of(surroundings(settings)), detail=Detail.visual)
    by_frame: dict[str, list[Any]] = {}
    for shape in scene.shapes:
        if shape.kind != "plane":
            frame = "world" if shape.frame == WORLD else scene.frames[shape.frame]
            vertices, faces = triangles(shape)
            placed = vertices @ shape.rotation.T + shape.position
            red, green, blue = shape.colour
            by_frame.setdefault(frame, []).append(
                messages.TriangleListPrimitive(
                    pose=_pose(messages, np.zeros(3), np.eye(3)),
                    points=[messages.Point3(x=x, y=y, z=z) for x, y, z in placed.tolist()],
                    indices=[int(k) for k in np.reshape(faces, -1)],
                    color=messages.Color(r=red, g=green, b=blue, a=1.0),
                )
            )
    for frame, parts in by_frame.items():
        yield messages.SceneEntity(
            timestamp=stamp,
            frame_id=frame.removeprefix("robot/"),
            id=frame,
            frame_locked=True,
            triangles=parts,
        )


def arrows(messages: Any, stamp: Any, space: str, actor: Actor, scale: float) -> Iterator[Any]:
    """Yield an entity for each effect that pushes, with an arrow at each link.

    Args:
        messages: module of Foxglove.
        stamp: time, as a message.
        space: prefix of the links' frames.
        actor: whose ledger is read: the forces of the last step.
        scale: length of an arrow [m/N].
    """
    ledger = actor.ledger
    if not ledger.rows:
        return
    for k, effect in enumerate(ledger.effects):
        forces = ledger.wrenches[-1, k, :, :3]
        for link, force in zip(ledger.links, forces, strict=True):
            size = math.sqrt(float(force @ force))
            # one that fades takes its arrow away
            length = scale * size if size > FAINT else 0.0
            red, green, blue = COLOURS[k % len(COLOURS)]
            arrow = messages.ArrowPrimitive(
                pose=_pose(messages, np.zeros(3), _along(force, size)),
                shaft_length=0.8 * length,
                shaft_diameter=0.06 * length,
                head_length=0.2 * length,
                head_diameter=0.12 * length,
                color=messages.Color(r=red, g=green, b=blue, a=1.0),
            )
            yield messages.SceneEntity(
                timestamp=stamp,
                frame_id=f"{space}{link}",
                id=f"force/{space}{link}/{effect}",
                frame_locked=True,
                arrows=[arrow] if length else [],
            )


def _along(force: Floats, size: float) -> Floats:
    """Rotation whose x axis is along a force, shape (3, 3)."""
    if size <= FAINT:
        return np.eye(3)
    x = force / size
    aside = np.eye(3)[int(np.argmin(np.abs(x)))]
    y = np.cross(x, aside)
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _pose(messages: Any, place: Floats, turn: Floats) -> Any:
    x, y, z, w = quaternion_of(turn).tolist()
    a, b, c = place.tolist()
    return messages.Pose(
        position=messages.Vector3(x=a, y=b, z=c),
        orientation=messages.Quaternion(x=x, y=y, z=z, w=w),
    )
