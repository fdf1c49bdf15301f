"""Camera images of a run: rendered, then passed through the water optics."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.rendering.camera import Cameras, Lens, lengths, units
from seals.rendering.light import Light
from seals.rendering.optics import Optics, Sight, Surface, SurfaceStill
from seals.rendering.picture import Picture, Renderer, images
from seals.rendering.scene import Poses, Scene
from seals.state_records import state_record


class Recorded(Protocol):
    """Image of a sensor, stored next to the log, with number, time and pose."""

    @property
    def number(self) -> int:
        """Number, from 0 on."""

    @property
    def time(self) -> float:
        """Time at which it was taken [s]."""

    @property
    def position(self) -> Floats:
        """Place of the sensor, world [m], shape (3,)."""

    @property
    def axes(self) -> Floats:
        """Axes of the image in the world as columns, shape (3, 3)."""

    def files(self) -> Mapping[str, bytes]:
        """Return the files by the ending of their names."""


@state_record
class Shot(NamedTuple):
    """Image of a camera, with time and number.

    Args:
        number: of the picture, from 0 on.
        time: at which it was taken [s].
        picture: a single one.
        lens: of the camera.
        what: kinds of images that the camera gives: ``rgb``, ``depth``, ``segmentation``,
            ``normals``.
        position: of the camera, world [m], shape (3,).
        axes: optical axes in the world as columns, shape (3, 3).
    """

    number: int
    time: float
    picture: Picture
    lens: Lens
    what: tuple[str, ...]
    position: Floats
    axes: Floats

    def files(self) -> Mapping[str, bytes]:
        """Return the files of the images by the ending of their names."""
        return images(self.picture, self.what)


class SceneView:
    """Scene of a run, rendered on demand for its cameras.

    Args:
        renderer: that draws; opened here.
        scene: what to draw.
        poses: gives the poses of the scene's frames as they stand now.
        optics: of water and sensor.
        surface: of the water; None without water.

    Raises:
        SealsError: the renderer cannot draw here.
    """

    renderer: Renderer
    scene: Scene
    poses: Callable[[], Poses]
    optics: Optics
    light: Light

    def __init__(
        self,
        renderer: Renderer,
        scene: Scene,
        poses: Callable[[], Poses],
        *,
        optics: Optics,
        surface: Surface | None,
    ) -> None:
        self.renderer, self.scene, self.poses = renderer, scene, poses
        dry = surface is None
        self.optics = dataclasses.replace(optics, water_type="none") if dry else optics
        self.surface: Surface = SurfaceStill() if surface is None else surface
        self.light = Light(azimuth=optics.sun_azimuth, height=0.5 * np.pi - optics.sun_zenith)
        renderer.open(scene, self.light)

    def see(
        self,
        camera: tuple[Floats, Floats],
        lens: Lens,
        time: float,
        rng: np.random.Generator,
        *,
        normals: bool = False,
    ) -> Picture:
        """Render the image of one camera, with the water optics.

        Args:
            camera: its place, world [m], shape (3,), and its optical axes as columns, shape (3, 3).
            lens: of the camera.
            time: [s].
            rng: random state of the sensor's noise.
            normals: whether normals are wanted.
        """
        views = Cameras.single(*camera)
        batch = self.renderer.render(self.poses(), views, lens, normals=normals)
        drawn = Picture(*(None if x is None else np.asarray(x)[0] for x in batch))
        ways = _directions(camera[1], lens)[None]
        colour, empty = np.asarray(drawn.colour), drawn.parts == 0
        if empty.any():
            # the sky of the optics is seen where nothing was met
            sky = np.asarray(self.optics.sky(ways), dtype=np.float32)
            colour = np.where(empty[..., None], sky, colour)
        view = Sight(
            colour,
            drawn.depth * lengths(lens),
            np.asarray(views.origin[0], dtype=np.float32),
            ways,
            drawn.normals,
        )
        image = self.optics.look(view, self.surface, time, rng)
        whole = drawn._replace(colour=np.asarray(image, dtype=np.float32))
        return Picture(*(None if x is None else x[0] for x in whole))

    def close(self) -> None:
        """Release the renderer."""
        self.renderer.close()


class CameraView:
    """View of one camera; stores its last picture.

    Args:
        scene: of the run, with its renderer; None for a sensor that makes its images itself.

    Attributes:
        shot: the last picture, None before the first.
    """

    def __init__(self, scene: SceneView | None) -> None:
        self.view = scene
        self.shot: Recorded | None = None

    def see(self, *camera: Any, normals: bool = False) -> Picture:
        """Render the image of this camera, see `SceneView.see`."""
        assert self.view is not None
        return self.view.see(*camera, normals=normals)

    def keep(self, shot: Recorded) -> None:
        """Store an image until the next."""
        self.shot = shot


def _directions(axes: Floats, lens: Lens) -> NDArray[np.float32]:
    """Return unit vectors along the pixel rays, world axes, shape (H, W, 3).

    Args:
        axes: optical axes in the world as columns, shape (3, 3).
        lens: of the camera.

    Example:
        >>> from seals.rendering.camera import OPTICAL
        >>> _directions(OPTICAL, Lens(width=1, height=1))[0, 0].tolist()
        [1.0, 0.0, 0.0]
    """
    ways: NDArray[np.float32] = units(lens) @ np.asarray(axes, dtype=np.float32).T
    return ways
