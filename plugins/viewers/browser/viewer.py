"""Viewer in the browser: scenery, robots, water and forces in the page, draw loop and controls."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import SealsError
from seals.frames import quaternion_of
from seals.picture_files import read_picture
from seals.plugins.viewers.browser.panel import Panel
from seals.plugins.viewers.browser.server import open_server
from seals.rendering.meshes import triangles
from seals.rendering.scene import WORLD, Poses, Shape
from seals.report.style import colours_of
from seals.schema import setting
from seals.view import Stage
from seals.view.forces import Arrows, Forces
from seals.view.session import Session
from seals.view.water import Patch, Water

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


STONE = 0.86
"""Lightness of the second colour of a tiled plane over that of the first [1]."""
GLASS = 0.1
"""Opacity of the walls of a tank [1]."""
TILES = 24
"""Tiles along an edge of a plane."""


class _Solids:
    """Shapes of a scene in the page.

    Args:
        server: viser's.
        stage: of the run.
        middle: of the ground that is shown, x and y [m].
        half: of its edge [m].
    """

    def __init__(self, server: Any, stage: Stage, middle: Floats, half: float) -> None:
        self._handles: list[Any] = []
        self._frames = []
        scene = server.scene
        for name in stage.scene.frames:
            frame = scene.add_frame(f"/scene/{name}", show_axes=False)
            self._frames.append(frame)
            self._handles.append(frame)
        for k, shape in enumerate(stage.scene.shapes):
            if shape.kind == "plane":
                self._handles += _plane(scene, f"/scene/ground_{k}", shape, middle, half)
                continue
            carried = shape.frame != WORLD
            home = f"/scene/{stage.scene.frames[shape.frame]}" if carried else "/scene"
            glass = shape.part in stage.walls
            vertices, faces = triangles(shape)
            xyzw = quaternion_of(np.asarray(shape.rotation))
            self._handles.append(
                scene.add_mesh_simple(
                    f"{home}/shape_{k}",
                    vertices=vertices,
                    faces=faces,
                    color=shape.colour,
                    # edges of boxes and meshes stay sharp, round primitives round
                    flat_shading=shape.kind in ("box", "mesh", "cylinder"),
                    side="double" if shape.kind == "mesh" else "front",
                    opacity=GLASS if glass else None,
                    cast_shadow=not glass,
                    position=np.asarray(shape.position),
                    wxyz=xyzw[[3, 0, 1, 2]],
                )
            )

    def place(self, poses: Poses) -> None:
        """Move all frames."""
        places, turns = np.asarray(poses.position[0]), np.asarray(poses.rotation[0])
        for frame, place, turn in zip(self._frames, places, turns, strict=True):
            frame.position, frame.wxyz = place, quaternion_of(turn)[[3, 0, 1, 2]]

    def remove(self) -> None:
        """Remove all shapes from the page."""
        for handle in reversed(self._handles):
            handle.remove()


def _plane(scene: Any, name: str, shape: Shape, middle: Floats, half: float) -> list[Any]:
    """A piece of a level plane as tiles of two colours."""
    cells = np.arange(TILES * TILES).reshape(TILES, TILES)
    row, column = np.divmod(cells, TILES)
    edge = np.linspace(-half, half, TILES + 1)
    # every tile has corners of its own, so that neighbours may differ
    corners = np.stack(
        [
            np.stack([middle[0] + edge[column + i], middle[1] + edge[row + j]], axis=-1)
            for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))
        ],
        axis=2,
    )
    handles = []
    for side, lightness in ((0, 1.0), (1, STONE)):
        flat = corners[(row + column) % 2 == side].reshape(-1, 2)
        vertices = np.column_stack([flat, np.full(len(flat), float(shape.position[2]))])
        first = 4 * np.arange(len(flat) // 4)
        faces = np.concatenate([first[:, None] + [0, 1, 2], first[:, None] + [0, 2, 3]])
        colour = tuple(lightness * c for c in shape.colour)
        handles.append(
            scene.add_mesh_simple(
                f"{name}_{side}", vertices=vertices, faces=faces, color=colour, cast_shadow=False
            )
        )
    return handles


COLOUR = (0.01, 0.24, 0.36)
"""Displayed colour of the water."""
DROPS = (0.30, 0.62, 0.85)
"""Displayed colour of its particles."""
CELLS = 64
"""Cells along an edge of the patch of waves."""


class _Sea:
    """Water of a run in the page.

    Args:
        server: viser's.
        water: of the run.
        middle: of the piece that is shown, x and y [m].
        half: of its edge [m].
        opacity: of the surface [1].
    """

    def __init__(
        self, server: Any, water: Water, middle: Floats, half: float, opacity: float
    ) -> None:
        self._scene, self._water, self._opacity = server.scene, water, opacity
        self._middle, self._half = middle, half
        self._surface: Any = None
        self._drops: Any = None
        self._drawn: Patch | None = None

    def show(self, time: float, particles: Floats | None) -> None:
        """Draw the water at a time [s].

        Args:
            time: [s].
            particles: places of the water that is simulated [m], or None.
        """
        if particles is not None and not self._water.meshes:
            if self._drops is None:
                # distance of neighbours as if the particles filled the box around them [m]
                span = np.maximum(np.ptp(particles, axis=0), 1e-3)
                self._drops = self._scene.add_point_cloud(
                    "/water/particles",
                    points=particles,
                    colors=tuple(round(255 * c) for c in DROPS),
                    point_size=0.4 * float((np.prod(span) / max(len(particles), 1)) ** (1.0 / 3.0)),
                    point_shape="circle",
                )
            else:
                self._drops.points = particles.astype(np.float32)
            return
        if self._drawn is not None and not self._water.moves:
            return
        mesh = self._water.mesh(time)
        cells = CELLS if self._water.moves else 2
        patch = mesh or self._water.patch(time, self._middle, self._half, cells)
        if patch is None:
            return
        same = self._drawn is not None and patch.faces is self._drawn.faces
        if same:
            self._surface.vertices = patch.vertices.astype(np.float32)
        else:
            if self._surface is not None:
                self._surface.remove()
            self._surface = self._scene.add_mesh_simple(
                "/water/surface",
                vertices=patch.vertices,
                faces=patch.faces,
                color=COLOUR,
                opacity=self._opacity,
                # facets: without them waves hardly show
                flat_shading=True,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
        self._drawn = patch

    def remove(self) -> None:
        """Remove the water from the page."""
        for handle in (self._surface, self._drops):
            if handle is not None:
                handle.remove()
        self._surface = self._drops = self._drawn = None


LEAST, MOST = 0.01, 3.0
"""Shares of the usual length below which an arrow is left out, above which it is cut off [1]."""
SHAFT, HEAD, TIP = 0.018, 0.05, 0.13
"""Radius of the shaft, radius and length of the head over the usual length [1]."""


class _Pushes:
    """Force arrows of a run.

    Args:
        server: viser's.
        forces: of the run.
        length: of the arrow of a usual force [m].

    Attributes:
        colours: of the effects, red, green and blue up to 255.
    """

    def __init__(self, server: Any, forces: Forces, length: float) -> None:
        self._scene, self._usual, self._length = server.scene, forces.usual, length
        self.colours = {
            name: (int(c[1:3], 16), int(c[3:5], 16), int(c[5:7], 16))
            for name, c in colours_of(list(forces.effects)).items()
        }
        self._handles: dict[str, Any] = {}

    def show(self, arrows: dict[str, Arrows], stretch: float) -> None:
        """Draw the arrows of some effects and remove those of the others.

        Args:
            arrows: by effect.
            stretch: of all arrows [1].
        """
        for effect in set(self._handles) - set(arrows):
            self._handles.pop(effect).remove()
        scale = stretch * self._length / max(self._usual, 1e-12)
        for effect, (origins, vectors) in arrows.items():
            shafts = vectors * scale
            length = np.linalg.norm(shafts, axis=1, keepdims=True)
            cut = shafts * np.minimum(1.0, MOST * self._length / np.maximum(length, 1e-12))
            seen = length[:, 0] > LEAST * self._length
            points: Floats = np.stack([origins, origins + cut], axis=1)[seen].astype(np.float32)
            handle = self._handles.get(effect)
            if handle is not None and len(handle.points) == len(points) and len(points):
                handle.points = points
                continue
            if handle is not None:
                self._handles.pop(effect).remove()
            if len(points):
                long = self._length
                self._handles[effect] = self._scene.add_arrows(
                    f"/forces/{effect}",
                    points=points,
                    colors=self.colours[effect],
                    shaft_radius=SHAFT * long,
                    head_radius=HEAD * long,
                    head_length=TIP * long,
                )

    def remove(self) -> None:
        """Remove all arrows from the page."""
        self.show({}, 1.0)


REST = 0.5
"""Time a slider rests before the run starts anew [s]: nobody wants a run for every pixel."""


@dataclass(kw_only=True)
class ViewerBrowser:
    """Viewer in the web browser, by viser.

    Args:
        rate: pictures in a second.
        opacity: of the water surface.
    """

    rate: float = setting(20.0, "Hz", bounds=(1.0, 60.0), source="chosen: a forwarded port")
    opacity: float = setting(0.55, "1", bounds=(0.05, 1.0), source="chosen: robots show below")

    def show(self, session: Session, *, host: str, port: int) -> None:
        """Show a session until it is interrupted."""
        server = open_server(host, port)
        try:
            page = _Page(server, session, self.opacity)
            print(f"seals view: {server.address}  (Ctrl-C ends it)", flush=True)
            while True:
                began = time.perf_counter()
                page.draw()
                time.sleep(max(0.005, 1.0 / self.rate - (time.perf_counter() - began)))
        finally:
            server.stop()


class _Page:
    """Contents of the page and the displayed time.

    Args:
        server: viser's.
        session: what there is to see.
        opacity: of the water surface [1].
    """

    def __init__(self, server: Any, session: Session, opacity: float) -> None:
        self._server, self._session, self._opacity = server, session, opacity
        self.panel = Panel(server, session)
        self.now = 0.0
        self._clock = time.perf_counter()
        self._shown = -1
        self._parts: list[Any] = []
        self._extent: Extent | None = None
        self._pending: dict[str, float] = {}
        self._changed = 0.0
        self._pictures: dict[str, Path | None] = {}
        self._base: Floats | None = None
        self._sent: tuple[Any, ...] = ()
        # set sky background and lights, without downloaded textures
        fade = np.linspace(0.0, 1.0, 64)[:, None]
        column = (1.0 - fade) * np.array(ZENITH) + fade * np.array(HORIZON)
        server.scene.set_background_image(
            np.repeat(np.rint(column).astype(np.uint8)[:, None], 4, axis=1), format="png"
        )
        server.scene.set_up_direction("+z")
        server.gui.configure_theme(show_logo=False, show_share_button=False)

    def draw(self) -> None:
        """Apply the controls, advance the time, and draw."""
        session = self._session
        self._obey()
        session.follow()
        self._pass()
        poses = session.poses(self.now)
        if session.shown != self._shown and poses is not None:
            self._build()
            poses = session.poses(self.now)
        if poses is None:
            self.panel.tell(self.now)
            return
        self._draw(poses)
        self._follow(np.asarray(poses.position[0, 0]))
        for camera in self._session.shots.cameras:
            file = self._session.shots.last(camera, self.now)
            if file is not None and self._pictures.get(camera) != file:
                self._pictures[camera] = file
                self.panel.picture(camera, read_picture(file))
        self.panel.tell(self.now)
        self._server.flush()

    def _draw(self, poses: Poses) -> None:
        """Send what has changed since the last picture."""
        wanted = self.panel.chosen()
        stretch = self.panel.stretch.value if wanted else 1.0
        state = (self._shown, self.now, self.panel.water.value, frozenset(wanted), stretch)
        if state == self._sent:
            return
        self._sent, session = state, self._session
        solids, sea, pushes = self._parts
        with self._server.atomic():
            solids.place(poses)
            if self.panel.water.value:
                sea.show(self.now, session.particles(self.now))
            else:
                sea.remove()
            arrows = session.forces.at(self.now, poses) if wanted else {}
            pushes.show({n: a for n, a in arrows.items() if n in wanted}, stretch)

    def _obey(self) -> None:
        """Jump to the chosen time, and restart a run once its sliders have stopped moving."""
        chosen = self.panel.grabbed()
        if chosen is not None:
            self.now, self.panel.playing.value = chosen, False
        turned = self.panel.turned()
        if turned:
            self._pending |= turned
            self._changed = time.perf_counter()
        if self._pending and time.perf_counter() - self._changed > REST:
            changes, self._pending = self._pending, {}
            try:
                self._session.turn(changes)
            except SealsError as refusal:
                self._session.note = " ".join(str(refusal).split())
                return
            self.now, self.panel.playing.value = 0.0, True

    def _pass(self) -> None:
        """Advance the displayed time."""
        clock = time.perf_counter()
        passed, self._clock = clock - self._clock, clock
        if self.panel.playing.value:
            self.now += passed * float(self.panel.speed.value)
        end = self._session.end
        if self.now > end:
            # a run that goes on is waited for, one that has ended begins again
            again = self.panel.playing.value and self._session.live is None and end > 0.0
            # not at exactly 0: a person who chose that very time would not be noticed
            self.now = self.now % end if again else end

    def _build(self) -> None:
        """Build the displayed run in the page."""
        session = self._session
        for part in self._parts:
            part.remove()
        first = self._extent is None
        extent = self._extent = Extent.of(session, self._extent)
        self._parts = [
            _Solids(self._server, session.stage, extent.middle, extent.half),
            _Sea(self._server, session.water, extent.middle, extent.half, self._opacity),
            _Pushes(self._server, session.forces, extent.arrow),
        ]
        self.panel.begin(self._parts[2].colours)
        self._shown, self._pictures = session.shown, {}
        if first:
            look_at(self._server, extent)
            self.panel.follow.value = extent.far

    def _follow(self, base: Floats) -> None:
        """Move the views with the robot, where that is wanted."""
        before, self._base = self._base, base
        if before is None or not self.panel.follow.value:
            return
        for client in self._server.get_clients().values():
            # the point looked at goes along
            client.camera.position = client.camera.position + (base - before)
