"""Pinhole camera model.

A camera sits on a link whose axes are x forward, y left, z up. Pictures have optical axes: x to the
right, y down, z along the view. The middle of the picture's upper left pixel is at (0.5, 0.5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, Floats
from seals.errors import ConfigError
from seals.state_records import state_record

OPTICAL: Floats = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""R_LO: columns are the optical x, y and z axes in the axes of the camera's link."""
OPTICAL.setflags(write=False)
LARGEST = 4096
"""Most pixels along one side of a picture."""
WIDEST = 2.9
"""Widest field of view [rad]: beyond it a plane picture is nothing but its rim."""


@state_record
@dataclass(frozen=True, kw_only=True)
class Lens:
    """Camera intrinsics; pixels are square unless both angles are given.

    Args:
        width: pixels along a row.
        height: pixels along a column.
        fov: horizontal field of view, from edge to edge [rad].
        fov_vertical: vertical field of view [rad]; None for square pixels.
        near: nearest depth that is seen [m].
        far: farthest depth that is seen [m].

    Raises:
        ConfigError: a size, an angle or a depth is out of range.

    Example:
        >>> lens = Lens(width=100, height=50, fov=2.0 * math.atan(0.5))
        >>> round(lens.fx, 6), round(lens.fy, 6), lens.cx, lens.cy
        (100.0, 100.0, 50.0, 25.0)
    """

    width: int = 128
    height: int = 128
    fov: float = 1.22
    fov_vertical: float | None = None
    near: float = 0.02
    far: float = 50.0

    def __post_init__(self) -> None:
        """Refuse image sizes, angles of view and ranges out of bounds."""
        for name in ("width", "height"):
            value = getattr(self, name)
            if not 1 <= value <= LARGEST:
                raise ConfigError(f"{name}={value} pixels.\nAllowed: from 1 to {LARGEST} pixels.")
        for name in ("fov", "fov_vertical"):
            value = getattr(self, name)
            if value is not None and not 1e-3 <= value <= WIDEST:
                hint = "  An angle in degrees?" if value > WIDEST else ""
                raise ConfigError(f"{name}={value:g} rad.\nAllowed: 0.001 to {WIDEST} rad.{hint}")
        if not 0.0 < self.near < self.far < math.inf:
            raise ConfigError(
                f"near={self.near:g} m and far={self.far:g} m.\nAllowed: 0 < near < far, finite."
            )

    @property
    def fx(self) -> float:
        """Focal length along a row [pixel]."""
        return 0.5 * self.width / math.tan(0.5 * self.fov)

    @property
    def fy(self) -> float:
        """Focal length along a column [pixel]."""
        if self.fov_vertical is None:
            return self.fx
        return 0.5 * self.height / math.tan(0.5 * self.fov_vertical)

    @property
    def cx(self) -> float:
        """Column of the optical axis [pixel]."""
        return 0.5 * self.width

    @property
    def cy(self) -> float:
        """Row of the optical axis [pixel]."""
        return 0.5 * self.height

    def project(self, points: Array) -> Array:
        """Return columns and rows of points in front of the camera [pixel], shape (..., 2).

        Args:
            points: optical axes [m], shape (..., 3).

        Example:
            >>> Lens(width=100, height=100).project(np.array([0.0, 0.0, 2.0])).tolist()
            [50.0, 50.0]
        """
        ahead = points[..., 2:]
        scale = np.array([self.fx, self.fy])
        return points[..., :2] / ahead * scale + np.array([self.cx, self.cy])

    def rays(self) -> NDArray[np.float32]:
        """Return the points at depth 1 m seen by the pixel centres, shape (H, W, 3).

        A ray times a depth is a point in optical axes.
        """
        return _rays(self)


class Cameras(NamedTuple):
    """Poses of cameras; all of one call share a lens.

    Args:
        origin: world [m], shape (N, C, 3): C cameras in each of N environments.
        rotation: R_WO, columns are the optical axes in the world, shape (N, C, 3, 3).
    """

    origin: Array
    rotation: Array

    @classmethod
    def single(cls, origin: Floats, rotation: Floats) -> Cameras:
        """Return one camera as a batch of one.

        Args:
            origin: world [m], shape (3,).
            rotation: R_WO, shape (3, 3).
        """
        return cls(np.asarray(origin)[None, None], np.asarray(rotation)[None, None])


@lru_cache(maxsize=32)
def _rays(lens: Lens) -> NDArray[np.float32]:
    x = (np.arange(lens.width) + 0.5 - lens.cx) / lens.fx
    y = (np.arange(lens.height) + 0.5 - lens.cy) / lens.fy
    rays = np.ones((lens.height, lens.width, 3), dtype=np.float32)
    rays[..., 0], rays[..., 1] = x[None, :], y[:, None]
    rays.setflags(write=False)
    return rays


@lru_cache(maxsize=32)
def lengths(lens: Lens) -> NDArray[np.float32]:
    """Return the ratio of range to depth of every pixel [1], shape (H, W)."""
    rays = _rays(lens)
    found: NDArray[np.float32] = np.sqrt((rays * rays).sum(axis=-1))
    found.setflags(write=False)
    return found


@lru_cache(maxsize=32)
def units(lens: Lens) -> NDArray[np.float32]:
    """Return the rays as unit vectors in optical axes, shape (H, W, 3)."""
    found: NDArray[np.float32] = _rays(lens) / lengths(lens)[..., None]
    found.setflags(write=False)
    return found


def mounted(
    origin: Floats, rotation: Floats, position: Floats, turn: Floats
) -> tuple[Floats, Floats]:
    """Return position and optical axes of a camera on a link.

    Args:
        origin: of the link, world [m], shape (3,).
        rotation: R_WL, shape (3, 3).
        position: of the camera in link axes [m], shape (3,).
        turn: of the camera's own axes (x along the view, z up) in link axes, shape (3, 3).

    Example:
        >>> place, axes = mounted(np.zeros(3), np.eye(3), np.array([1.0, 0.0, 0.0]), np.eye(3))
        >>> axes[:, 2].tolist()
        [1.0, 0.0, 0.0]
    """
    return origin + rotation @ position, rotation @ turn @ OPTICAL
