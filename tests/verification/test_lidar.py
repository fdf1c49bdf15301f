"""Lidar against closed forms of plane and sphere, and its stated errors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seals.environment.settings import EnvironmentSettings, ObstacleSettings, SolidType
from seals.plugins.sensors.lidar import SensorLidar
from seals.sensors.casting import cast
from seals.sensors.protocol import SensorInput
from seals.sensors.rays import Shape
from seals.sensors.surroundings import Surroundings

ZERO = np.zeros(3)
EXACT: dict[str, Any] = {"noise": 0.0, "missed": 0.0}


def scan(lidar: SensorLidar, height: float, **environment: Any) -> Any:
    """Ranges of one turn at a height above the origin."""
    around = Surroundings(EnvironmentSettings(**environment))
    here = np.array([0.0, 0.0, height])
    felt = SensorInput(0.0, 0.004, here, np.eye(3), ZERO, ZERO, ZERO, ZERO, around=around)
    return lidar.scan(felt, np.random.default_rng(0))


def test_the_range_of_level_ground() -> None:
    """Ranges h / sin(depression) to rounding; rings that look up or graze see nothing."""
    lidar = SensorLidar(rings=16, points=90, **EXACT)
    ranges = scan(lidar, 2.0, ground_level=0.0)
    for ring, rise in zip(ranges, lidar.elevations, strict=True):
        way = 2.0 / math.sin(max(-rise, 1e-9))
        if way < 100.0 * math.sqrt(2.0 / way):
            np.testing.assert_allclose(ring, way, rtol=1e-12)
        else:
            assert np.isnan(ring).all()
    assert 4 < np.isfinite(ranges[:, 0]).sum() < 8


def test_the_range_of_a_sphere() -> None:
    """D cos(p) - sqrt(R^2 - D^2 sin(p)^2) at bearing p, to rounding."""
    ball = ObstacleSettings(type=SolidType.sphere, size=[1.5], position=[6.0, 0.0, 0.0])
    lidar = SensorLidar(points=721, sector=0.6, **EXACT)
    ranges = scan(lidar, 0.0, obstacles={"ball": ball})[0]
    across = 1.5**2 - (6.0 * np.sin(lidar.bearings)) ** 2
    expected = 6.0 * np.cos(lidar.bearings) - np.sqrt(np.maximum(across, 0.0))
    seen = np.isfinite(ranges)
    np.testing.assert_allclose(ranges[seen], expected[seen], rtol=1e-12)
    # the limb itself is grazed, and lost: cos(i) < (r / 100 m)^2
    assert seen.sum() > 0.98 * (across > 0.0).sum()
    assert not seen[across < 0.0].any()


def test_slanting_surfaces_are_lost_earlier() -> None:
    """A wall at d is seen to the bearing p where d / cos(p) = farthest sqrt(cos(p))."""
    wall = ObstacleSettings(size=[1.0, 400.0, 9.0], position=[50.5, 0.0, 0.0])
    lidar = SensorLidar(points=3001, sector=3.0, **EXACT)
    seen = lidar.bearings[np.isfinite(scan(lidar, 0.0, obstacles={"wall": wall})[0])]
    # cos(p)^(3/2) = 1 / 2
    assert seen[0] == pytest.approx(math.acos(0.5 ** (2.0 / 3.0)), abs=0.002)


def test_noise_and_losses_are_as_stated() -> None:
    """Deviation 3 cm within 2 %, 20 % of the returns lost within 1 %."""
    shell = ObstacleSettings(type=SolidType.sphere, size=[1.0], position=[4.0, 0.0, 0.0])
    lidar = SensorLidar(points=20000, sector=0.2, missed=0.2)
    exact = scan(SensorLidar(points=20000, sector=0.2, **EXACT), 0.0, obstacles={"a": shell})
    ranges = scan(lidar, 0.0, obstacles={"a": shell})
    assert np.nanstd(ranges - exact) == pytest.approx(0.03, rel=0.02)
    assert np.isnan(ranges).mean() == pytest.approx(0.2, abs=0.01)


def test_water_swallows_the_light() -> None:
    """Over water nothing is seen, not even the bottom; a wall above it is."""
    wall = ObstacleSettings(size=[1.0, 20.0, 20.0], position=[6.0, 0.0, 0.0])
    lidar = SensorLidar(rings=3, points=1, sectors=1, vertical_width=1.0, **EXACT)
    found = scan(lidar, 1.0, water_level=0.0, tank_bottom=-1.0, obstacles={"wall": wall})[:, 0]
    assert found[1] == pytest.approx(5.5)
    assert np.isfinite(found[0])
    assert np.isnan(found[2])


def test_a_mesh_is_met_as_the_solid_that_it_is() -> None:
    """Distances and normals of a box of triangles are those of the box, in single precision."""
    from trimesh.creation import box

    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    place, size = np.array([4.0, 0.3, 0.0]), (1.0, 2.0, 3.0)
    solid = Shape("box", size, place, turn, np.zeros((0, 3, 3)))
    mesh = Shape("mesh", (), place, turn, np.array(box(size).triangles))
    rng = np.random.default_rng(1)
    ways = np.array([1.0, 0.0, 0.0]) + 0.4 * rng.standard_normal((500, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    a, b = (cast([shape], ZERO, ways, 20.0) for shape in (solid, mesh))
    both = np.isfinite(a.distance) & np.isfinite(b.distance)
    assert both.sum() > 100
    assert (np.isfinite(a.distance) != np.isfinite(b.distance)).mean() < 0.01
    np.testing.assert_allclose(b.distance[both], a.distance[both], rtol=1e-5)
    np.testing.assert_allclose(b.normal[both], a.normal[both], atol=1e-6)
