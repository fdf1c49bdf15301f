"""Rendered images, and the interface of renderers."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

from seals.arrays import Array
from seals.rendering.camera import Cameras, Lens
from seals.rendering.light import Light
from seals.rendering.scene import Poses, Scene
from seals.state_records import state_record


@state_record
class Picture(NamedTuple):
    """Images of C cameras in N environments; rows from the top, columns from the left.

    A single picture has the shapes without (N, C).

    Args:
        colour: linear red, green, blue, 0 to 1, shape (N, C, H, W, 3).
        depth: along the optical axis [m], infinite where nothing is met, shape (N, C, H, W).
        parts: what is met, as a place in the scene's ``names``, shape (N, C, H, W).
        normals: outward, world axes, zero where nothing is met, shape (N, C, H, W, 3); None unless
            asked for.
    """

    colour: Array
    depth: Array
    parts: Array
    normals: Array | None = None

    def of(self, environment: int, camera: int) -> Picture:
        """Return the image of one camera."""
        return Picture(*(None if x is None else x[environment, camera] for x in self))


@runtime_checkable
class Renderer(Protocol):
    """A renderer plug-in: a keyword-only dataclass, opened once for each scene."""

    def open(self, scene: Scene, light: Light) -> None:
        """Prepare a scene, releasing an earlier one.

        Raises:
            SealsError: the scene cannot be drawn, or a package or device is missing.
        """

    def render(
        self, poses: Poses, cameras: Cameras, lens: Lens, *, normals: bool = False
    ) -> Picture:
        """Return the pictures of all cameras.

        Args:
            poses: of the scene's frames, N environments.
            cameras: C in each environment.
            lens: of all cameras.
            normals: whether normals are wanted.
        """

    def close(self) -> None:
        """Release memory and devices; a second call does nothing."""
