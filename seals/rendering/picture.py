"""Rendered images, their PNG files of 8 and 16 bits, and the interface of renderers."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array
from seals.errors import ConfigError
from seals.rendering.camera import Cameras, Lens
from seals.rendering.light import Light
from seals.rendering.optics import to_bytes
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
        normals: outward, world axes, zero if nothing is met, shape (N, C, H, W, 3); None unless
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


MILLIMETRE = 1e-3
"""Unit of a depth file [m]; 0 stands for nothing met, or farther than 65.535 m."""
QUICK = 1
"""Level of compression: higher ones take ten times as long for a tenth less."""


def png(image: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """Return an image as the bytes of a PNG file.

    Args:
        image: grey (H, W) of 8 or 16 bits, or colour (H, W, 3) of 8 bits.

    Raises:
        ConfigError: another shape or type.

    Example:
        >>> png(np.zeros((2, 3), dtype=np.uint16))[1:4].decode()
        'PNG'
    """
    colour = image.ndim == 3 and image.shape[2] == 3
    if image.dtype not in (np.uint8, np.uint16) or not (image.ndim == 2 or colour):
        raise ConfigError(
            f"an image of shape {image.shape} and type {image.dtype} cannot be written as PNG.\n"
            "Allowed: grey of 8 or 16 bits, colour of 8 bits."
        )
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image)).save(file, "PNG", compress_level=QUICK)
    return file.getvalue()


def millimetres(depth: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Return depth [m] in whole millimetres; 0 for nothing.

    Example:
        >>> millimetres(np.array([1.2344, np.inf, 70.0], dtype=np.float32)).tolist()
        [1234, 0, 0]
    """
    whole = np.rint(np.where(np.isfinite(depth), depth, 0.0) / MILLIMETRE)
    return np.where(whole > 65535.0, 0.0, whole).astype(np.uint16)


def images(picture: Picture, what: tuple[str, ...]) -> Mapping[str, bytes]:
    """Return the files of a picture by the ending of their names.

    Args:
        picture: a single one.
        what: ``rgb``, ``depth``, ``segmentation``, ``normals``.
    """
    out = {}
    if "rgb" in what:
        out[".png"] = png(to_bytes(np.asarray(picture.colour)))
    if "depth" in what:
        out["_depth.png"] = png(millimetres(np.asarray(picture.depth)))
    if "segmentation" in what:
        out["_parts.png"] = png(np.asarray(picture.parts).astype(np.uint16))
    if "normals" in what and picture.normals is not None:
        levels = np.rint(127.5 * (np.asarray(picture.normals) + 1.0))
        out["_normals.png"] = png(levels.astype(np.uint8))
    return out
