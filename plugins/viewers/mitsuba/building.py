"""Conversion of a frame to Mitsuba's scene dictionary: mesh files with their poses, and textures.

Textures are a sandy floor with caustics of sunlight, and an environment map of sky and sun.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.rendering import Lens, Poses
from seals.rendering.meshes import triangles
from seals.rendering.optics import Optics, Surface, to_linear
from seals.rendering.optics.caustics import Patch, pattern
from seals.rendering.scene import WORLD, Scene, Shape
from seals.run.surface import Mesh, write_ply
from seals.view.films import Frame, Viewpoint

SHINE = 0.45
"""Roughness of painted and moulded surfaces [1]."""
METAL = 0.06
"""Spread of the three colours under which a dark surface is taken for metal or rubber [1]."""


def write_shapes(scene: Scene, folder: Path) -> list[tuple[int, Shape, Path]]:
    """Write every shape but level planes to a file; return number, shape and file of each."""
    import trimesh

    found = []
    for number, shape in enumerate(scene.shapes):
        if shape.kind == "plane":
            continue
        corners, faces = triangles(shape)
        points = np.asarray(corners) @ np.asarray(shape.rotation).T + shape.position
        path = folder / f"shape_{number}.ply"
        if shape.kind != "sphere":
            # faces that meet at more than 40 degrees share no corners: such keep their edge
            body: Any = trimesh.Trimesh(points, faces, process=True)
            smooth = trimesh.graph.smooth_shade(body, angle=np.radians(40.0))
            points, faces = smooth.vertices, smooth.faces
        write_ply(path, Mesh(np.array(points, dtype=float), np.array(faces, dtype=np.int64)))
        found.append((number, shape, path))
    return found


def material(colour: tuple[float, float, float]) -> Mapping[str, Any]:
    """Return the surface material of a link of a displayed colour."""
    grey = max(colour) - min(colour) < METAL
    metal = 0.7 if grey and 0.35 < max(colour) < 0.75 else 0.0
    return {
        "type": "twosided",
        "bsdf": {
            "type": "principled",
            "base_color": {"type": "rgb", "value": to_linear(np.array(colour)).tolist()},
            "roughness": SHINE,
            "metallic": metal,
            "specular": 0.5,
        },
    }


def pose_of(shape: Shape, position: Floats, rotation: Floats) -> Floats:
    """Return the pose of a shape's file in the world as a 4 x 4 matrix."""
    place = np.eye(4)
    if shape.frame != WORLD:
        place[:3, :3], place[:3, 3] = rotation[shape.frame], position[shape.frame]
    return place


CELLS = 512
"""Texels of the floor's picture along an edge."""
HALF = 4.0
"""Half the edge of the place that the picture covers [m]."""
GRAIN = 0.16
"""Standard deviation of the sand's brightness over its mean [1]."""
BRIGHTEST = 0.95
EVERYWHERE = ((-math.inf, -math.inf), (math.inf, math.inf))
SIZE = (256, 512)
"""Rows and columns of the picture."""
BELOW = 0.25
"""Radiance under the horizon over that at the horizon: haze over a far sea [1]."""
EDGE = 0.25
"""Share of the sun's radius over which it fades [1]."""


def sand(
    colour: tuple[float, float, float],
    middle: tuple[float, float],
    depth: float,
    light: tuple[Optics, Surface | None, float],
    wet: tuple[tuple[float, float], tuple[float, float]] = EVERYWHERE,
) -> NDArray[np.float32]:
    """Return the reflectance of a level floor, linear, shape (CELLS, CELLS, 3), rows from south.

    Caustics are added to it, as `seals.rendering.optics` adds them to every picture.

    Args:
        colour: as displayed.
        middle: of the place, east and north [m].
        depth: of the floor under the water [m]; zero or less for dry land.
        light: optics, surface of the water and time [s].
        wet: corners of the place that the water fills, east and north [m]; none has caustics
            outside.
    """
    optics, surface, time = light
    base = to_linear(np.array(colour)) * (1.0 + GRAIN * _faded() * _grains())[..., None]
    if depth > 0.0 and surface is not None and optics.caustics:
        east, north, half = (np.array([x]) for x in (*middle, HALF))
        patch = Patch(east, north, half, np.array([[max(depth, 1e-3), depth + 1e-3]]))
        bright = pattern(patch, surface, time, optics.sun, cells=CELLS, rays=1)[0, 0].T
        share = optics.sun_share * math.exp(-optics.fading * depth)
        along = HALF * ((2.0 * np.arange(CELLS) + 1.0) / CELLS - 1.0)
        x, y = (((m + along > a) & (m + along < b)) for m, a, b in zip(middle, *wet, strict=True))
        weight = share * _faded() * (y[:, None] & x)
        base = base * (1.0 + weight * (bright - 1.0))[..., None]
    found: NDArray[np.float32] = np.clip(base, 0.0, BRIGHTEST).astype(np.float32)
    return found


@lru_cache(maxsize=1)
def _grains() -> NDArray[np.float64]:
    """Return multi-scale noise with mean 0 and standard deviation 1."""
    rng = np.random.default_rng(7)
    rate = np.hypot(*np.meshgrid(np.fft.fftfreq(CELLS), np.fft.fftfreq(CELLS), indexing="ij"))
    rate[0, 0] = 1.0
    waves = np.fft.fft2(rng.normal(size=(CELLS, CELLS))) / rate**0.7
    waves[0, 0] = 0.0
    noise: NDArray[np.float64] = np.real(np.fft.ifft2(waves))
    noise /= noise.std()
    return noise


@lru_cache(maxsize=1)
def _faded() -> NDArray[np.float64]:
    """Weight that fades to zero at the edges, which hides them."""
    along = np.abs(np.arange(CELLS) + 0.5 - 0.5 * CELLS) / (0.5 * CELLS)
    edge = np.clip((1.0 - along) / 0.25, 0.0, 1.0)
    weight: NDArray[np.float64] = edge[:, None] * edge[None, :]
    return weight


def sky_map(optics: Optics, sun_radius: float) -> NDArray[np.float32]:
    """Return the radiance from all directions, shape (H, W, 3).

    Rows go from straight up to straight down, columns from north over east. The irradiance of the
    sun on level ground is pi times its share of the daylight, however large the disc.

    Args:
        optics: sky and sun.
        sun_radius: radius of the disc [rad].
    """
    rows, columns = SIZE
    theta = (np.arange(rows) + 0.5) * (math.pi / rows)
    phi = (np.arange(columns) + 0.5) * (2.0 * math.pi / columns)
    flat = np.sin(theta)[:, None]
    ways = np.stack(
        [flat * np.sin(phi), flat * np.cos(phi), np.cos(theta)[:, None] + 0.0 * phi], axis=-1
    )
    light = np.asarray(optics.sky(ways[None])[0], dtype=float)
    light[ways[..., 2] < 0.0] *= BELOW
    return (light + _sun_disc(optics, ways, sun_radius)[..., None]).astype(np.float32)


def _sun_disc(optics: Optics, ways: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Return the radiance of the sun in the directions of a sky map, shape (H, W)."""
    toward = -np.array(optics.sun.ray())
    angle = np.arccos(np.clip(ways @ toward, -1.0, 1.0))
    shape = np.clip((radius - angle) / (EDGE * radius), 0.0, 1.0)
    rows, columns = ways.shape[:2]
    solid = np.sin((np.arange(rows) + 0.5) * (math.pi / rows)) * (2.0 * math.pi**2 / rows / columns)
    level = float(np.sum(shape * np.maximum(ways[..., 2], 0.0) * solid[:, None]))
    found: NDArray[np.float64] = shape * (math.pi * optics.sun_share / max(level, 1e-9))
    return found


INDEX = 1.333
"""Of refraction of water [1]."""
WIDE = 300.0
"""Half the edge of a level plane [m]."""
LOWER = 0.003
"""How far the wide plane lies under the picture of the floor [m]."""
FURTHEST = 0.95
"""Largest mean cosine of the phase function: beyond it is no scattering worth the name."""


class Crop(NamedTuple):
    """Rows of an image to draw: first row and number of rows."""

    first: int
    rows: int


class Build:
    """Builder of the scene dictionaries of one film.

    Args:
        mi: the mitsuba module.
        shapes: number, shape and file of everything that is not a plane.
        planes: level planes.
        optics: light.
        sun_radius: radius of the sun's disc [rad].
        folder: for the surfaces of the water.
    """

    def __init__(
        self,
        mi: Any,
        *,
        shapes: list[tuple[int, Shape, Path]],
        planes: list[Shape],
        optics: Optics,
        sun_radius: float,
        folder: Path,
    ) -> None:
        self.mi, self.shapes, self.planes = mi, shapes, planes
        self.optics, self.folder = optics, folder
        self._sky = mi.Bitmap(sky_map(optics, sun_radius))
        self._medium = medium_of(optics)

    @property
    def fog(self) -> float:
        """Mean extinction of the water [1/m]."""
        medium = self._medium
        return (
            0.0 if medium is None else medium["scale"] * float(np.mean(medium["sigma_t"]["value"]))
        )

    def links(self, poses: Poses) -> dict[str, Any]:
        """Return links and solids at their poses."""
        place, turn = np.asarray(poses.position)[0], np.asarray(poses.rotation)[0]
        return {
            f"shape_{number}": {
                "type": "ply",
                "filename": str(path),
                "to_world": self._placed(pose_of(shape, place, turn)),
                "bsdf": material(shape.colour),
            }
            for number, shape, path in self.shapes
        }

    def sky(self) -> dict[str, Any]:
        """Return sky and sun as an environment map, whose pole is along y."""
        turn = self.mi.ScalarTransform4f().rotate([1.0, 0.0, 0.0], 90.0)
        return {"sky": {"type": "envmap", "bitmap": self._sky, "to_world": turn}}

    def water(self, frame: Frame) -> dict[str, Any]:
        """Return the water surface with the participating medium below it."""
        if frame.water is None:
            return {}
        path = self.folder / "water.ply"
        write_ply(path, Mesh(frame.water.vertices, frame.water.triangles))
        surface: dict[str, Any] = {
            "type": "ply",
            "filename": str(path),
            "bsdf": {"type": "dielectric", "int_ior": INDEX, "ext_ior": 1.0},
        }
        if self._medium is None:
            return {"water": surface}
        surface["interior"] = {"type": "ref", "id": "medium"}
        return {"medium": dict(self._medium), "water": surface}

    def ground(self, frame: Frame) -> dict[str, Any]:
        """Return level planes, with caustics on those under water."""
        out: dict[str, Any] = {}
        for k, plane in enumerate(self.planes):
            height = float(plane.position[2])
            # the intersection of the view with a level plane, near the camera
            origin, ahead = frame.view.origin, frame.view.axes[:, 2]
            far = (origin[2] - height) / max(-float(ahead[2]), 0.05)
            reach = float(np.clip(far, 0.0, 0.7 * HALF))
            x, y = (origin + reach * ahead)[:2]
            # whole cells of the picture: grains of sand stay where they are
            cell = 0.25
            middle = cell * round(float(x) / cell), cell * round(float(y) / cell)
            water = frame.water
            depth = (water.surface.level - height) if water is not None else 0.0
            light = self.optics, None if water is None else water.surface, frame.time
            wet = EVERYWHERE if water is None else (water.lower, water.upper)
            image = sand(plane.colour, middle, depth, light, wet)
            near = np.eye(4)
            near[0, 0] = near[1, 1] = HALF
            near[:3, 3] = *middle, height
            wide = near.copy()
            wide[0, 0] = wide[1, 1] = WIDE
            wide[2, 3] -= LOWER
            # grain and caustics have faded at the edge of the picture
            mean = image[0].mean(axis=0).tolist()
            # rows of a bitmap go from the top of the texture down
            picture = self.mi.Bitmap(np.ascontiguousarray(image[::-1]))
            texture = {"type": "bitmap", "bitmap": picture, "raw": True}
            out[f"ground_{k}"] = self._floor(near, texture)
            out[f"ground_{k}_wide"] = self._floor(wide, {"type": "rgb", "value": mean})
        return out

    def _floor(self, place: Floats, reflectance: Any) -> dict[str, Any]:
        to_world = self._placed(place)
        return {"type": "rectangle", "to_world": to_world, "bsdf": _matt(reflectance)}

    def sensor(self, frame: Frame, crop: Crop, *, wet: bool, samples: int) -> dict[str, Any]:
        """Return the camera, inside the medium where it is under water."""
        found = camera(self.mi, frame.view, frame.lens, near=frame.port, crop=crop)
        found["sampler"] = {"type": "independent", "sample_count": samples}
        if wet and self._medium is not None and frame.water is not None:
            found["medium"] = {"type": "ref", "id": "medium"}
        return found

    def _placed(self, matrix: Floats) -> Any:
        return self.mi.ScalarTransform4f(matrix.tolist())


def camera(mi: Any, view: Viewpoint, lens: Lens, *, near: float, crop: Crop) -> dict[str, Any]:
    """Return a pinhole camera without sampler.

    Args:
        mi: the mitsuba module.
        view: where it is.
        lens: of the camera.
        near: depth from which on it sees [m].
        crop: rows that are drawn.
    """
    right, down, ahead = view.axes.T
    film = {
        "type": "hdrfilm",
        "width": lens.width,
        "height": lens.height,
        "crop_offset_x": 0,
        "crop_offset_y": crop.first,
        "crop_width": lens.width,
        "crop_height": crop.rows,
        "rfilter": {"type": "box"},
        "component_format": "float32",
    }
    matrix = np.eye(4)
    # its x axis points to the left, y up
    matrix[:3, :3] = np.column_stack([-right, -down, ahead])
    matrix[:3, 3] = view.origin
    return {
        "type": "perspective",
        "fov": float(np.degrees(2.0 * np.arctan(0.5 * lens.width / lens.fx))),
        "fov_axis": "x",
        "near_clip": near,
        "far_clip": max(lens.far, 10.0 * near),
        "to_world": mi.ScalarTransform4f(matrix.tolist()),
        "film": film,
    }


def plain_colour(colour: tuple[float, float, float]) -> dict[str, Any]:
    """Return a matt surface of a displayed colour."""
    return _matt({"type": "rgb", "value": to_linear(np.array(colour)).tolist()})


def _matt(reflectance: Any) -> dict[str, Any]:
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}


def medium_of(optics: Optics) -> Mapping[str, Any] | None:
    """Return the medium of the water; None for water as clear as air.

    Equation:
        Extinction a + (1 - f) b, albedo (1 - f) b over it; f, the share that goes on nearly
        straight, is not scattered, as in `seals.rendering.optics`. The phase function is that of
        Henyey and Greenstein whose backward share is b_b / ((1 - f) b).
    """
    water, medium = optics.water, optics.medium
    if water is None or medium is None:
        return None
    scattered = [(1.0 - optics.forward_share) * b for b in water.scattering]
    back = [v - a for v, a in zip(medium.veiling, water.absorption, strict=True)]
    albedo = [s / max(t, 1e-9) for s, t in zip(scattered, medium.direct, strict=True)]
    # colours are at most one: the size goes into the scale
    scale = max(*medium.direct, 1e-6)
    return {
        "type": "homogeneous",
        "scale": scale,
        "sigma_t": {"type": "rgb", "value": [max(t / scale, 1e-6) for t in medium.direct]},
        "albedo": {"type": "rgb", "value": [min(max(x, 0.0), 0.999) for x in albedo]},
        "phase": {"type": "hg", "g": mean_cosine(back[1] / max(scattered[1], 1e-9))},
    }


def mean_cosine(backward: float) -> float:
    """Return the Henyey-Greenstein parameter g for a given backscatter fraction.

    Equation:
        B(g) = (1 - g) / (2 g) ((1 + g) / sqrt(1 + g^2) - 1).

    Args:
        backward: share of the light that is turned by more than a right angle [1].

    Example:
        >>> round(mean_cosine(0.5), 3), round(backward_share(mean_cosine(0.07)), 4)
        (0.0, 0.07)
    """
    low, high = 1e-4, FURTHEST
    if backward >= backward_share(low):
        return 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if backward_share(middle) > backward else (low, middle)
    return 0.5 * (low + high)


def backward_share(g: float) -> float:
    """Return the backscatter fraction of a Henyey-Greenstein phase function [1]."""
    return (1.0 - g) / (2.0 * g) * ((1.0 + g) / float((1.0 + g * g) ** 0.5) - 1.0)
