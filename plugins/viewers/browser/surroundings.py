"""Scenery of the page: displayed extent of the world, sky, and first view."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.rendering.meshes import triangles
from seals.view import Stage
from seals.view.session import Session

ZENITH, HORIZON = (178, 206, 230), (228, 237, 243)
"""Displayed colours of the sky overhead and at the horizon."""
FAR = 40.0
"""Way of a run, in radii of its robot, beyond which one view does not show it all [1]."""
SAMPLES = 60
"""Times at which the way of a run is looked up."""


class Extent(NamedTuple):
    """Displayed extent of the world.

    Args:
        middle: of the shown ground, x and y [m], shape (2,).
        half: of its edge [m].
        arrow: length of the arrow of a usual force [m].
        focus: what the first view looks at, shape (3,) [m].
        distance: from which it looks [m].
        far: whether the run goes so far that the view had better follow the robot.
    """

    middle: Floats
    half: float
    arrow: float
    focus: Floats
    distance: float
    far: bool

    @classmethod
    def of(cls, session: Session, before: Extent | None) -> Extent:
        """Return the extent of the world to display for a run.

        A run whose end is not known yet is taken as it stands; the first one sets the view.
        """
        size = _size_of(session.stage)
        times = np.linspace(0.0, max(session.end, 0.0), SAMPLES) if session.replay else [0.0]
        ways = [session.poses(float(t)) for t in times]
        places = np.array([np.asarray(p.position[0, 0]) for p in ways if p is not None])
        low, high = places.min(axis=0), places.max(axis=0)
        level = session.water.level
        if level is not None:
            low[2], high[2] = min(low[2], level), max(high[2], level)
        span = float(np.linalg.norm(high - low))
        focus = places[0] if session.replay is None else 0.5 * (low + high)
        far = span > FAR * size
        distance = 6.0 * size if far else 1.4 * span + 4.0 * size
        if session.replay is None:
            distance = max(distance, 12.0 * size)
        half = max(8.0 * distance, 1.5 * span)
        if before is not None:
            half = max(half, before.half)
        return cls(
            middle=0.5 * (low + high)[:2],
            half=half,
            arrow=min(1.6 * size, 0.4 * distance),
            focus=places[0] if far else focus,
            distance=distance,
            far=far,
        )


def _size_of(stage: Stage) -> float:
    """Return the radius of the drawn robot around its base [m].

    The objects of a run do not count: they may be rafts.
    """
    reach = 0.0
    robot = next(iter(stage.robots.values()))
    for shape in stage.scene.shapes:
        if 0 <= shape.frame < len(robot.links):
            corners = triangles(shape)[0] + np.asarray(shape.position)
            reach = max(reach, float(np.linalg.norm(corners, axis=1).max()))
    return max(reach, 0.01)


def look_at(server: Any, extent: Extent) -> None:
    """Set the initial camera in front of the robot and slightly above it."""
    way = np.array([0.75, -1.0, 0.45])
    camera = server.initial_camera
    camera.up = (0.0, 0.0, 1.0)
    camera.position = extent.focus + extent.distance * way / np.linalg.norm(way)
    camera.look_at = extent.focus
    camera.near, camera.far = 0.01 * extent.distance, 100.0 * extent.half
    camera.fov = float(np.radians(50.0))
    # the surface has no edge, it fades into the sky
    server.scene.configure_fog(4.0 * extent.distance, 0.9 * extent.half, color=HORIZON)
    for client in server.get_clients().values():
        client.camera.position = camera.position
        client.camera.look_at = camera.look_at


def set_sky(server: Any) -> None:
    """Set sky background and lights, without downloaded textures."""
    fade = np.linspace(0.0, 1.0, 64)[:, None]
    column = (1.0 - fade) * np.array(ZENITH) + fade * np.array(HORIZON)
    server.scene.set_background_image(
        np.repeat(np.rint(column).astype(np.uint8)[:, None], 4, axis=1), format="png"
    )
    server.scene.set_up_direction("+z")
    server.gui.configure_theme(show_logo=False, show_share_button=False)
