"""Range finder and the rays under it against closed-form geometry."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from seals.effects.effect import MediumKind
from seals.environment.settings import EnvironmentSettings, ObstacleSettings, SolidType
from seals.frames import matrix_of, quaternion_of_rpy
from seals.hydrostatics import (
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullMesh,
    HullSphere,
)
from seals.plugins.sensors.range_finder import SensorRangeFinder
from seals.plugins.waves.airy import WaveAiry
from seals.sensors.protocol import SensorInput
from seals.sensors.rays import distances, shapes_of_hull
from seals.sensors.surroundings import Surroundings

QUIET: dict[str, Any] = {"noise": 0.0, "noise_share": 0.0, "resolution": 0.0}
DOWN = [0.0, math.pi / 2.0, 0.0]
STILL = np.zeros(3)


def read(sensor: SensorRangeFinder, around: Surroundings, position: Any, rpy: Any = STILL) -> Any:
    """The range [m], or None where the sensor says that there is none."""
    turn = matrix_of(quaternion_of_rpy(np.array([rpy], dtype=float)))[0]
    here = np.asarray(position, dtype=float)
    felt = SensorInput(0.0, 0.004, here, turn, STILL, STILL, STILL, STILL, around=around)
    rng = np.random.default_rng(0)
    found, _ = sensor.sense(felt, sensor.start(rng), rng, due=True)
    assert found is not None
    assert ("range" in found) is bool(found["range_valid"][0])
    return float(found["range"][0]) if "range" in found else None


@pytest.mark.parametrize("tilt", [0.0, 0.3, -0.6])
def test_a_tilted_altimeter_reads_the_slant(tilt: float) -> None:
    """Above level ground at 3 m the range is 3 / cos(tilt)."""
    around = Surroundings(EnvironmentSettings(ground_level=0.0))
    found = read(SensorRangeFinder(rpy=DOWN, **QUIET), around, [1.0, 2.0, 3.0], [tilt, 0.0, 0.5])
    assert found == pytest.approx(3.0 / math.cos(tilt), rel=1e-12)


def test_a_cone_reads_the_nearest_point() -> None:
    """A cone of 0.5 rad tilted by 0.7: its edge is at 0.45, so 3 / cos(0.45)."""
    around = Surroundings(EnvironmentSettings(ground_level=0.0))
    cone = SensorRangeFinder(rpy=DOWN, beam_width=0.5, **QUIET)
    # the tilt lies in the plane of one of the spokes
    assert read(cone, around, [0.0, 0.0, 3.0], [0.7, 0.0, 0.0]) == pytest.approx(
        3.0 / math.cos(0.45), rel=1e-12
    )
    assert read(cone, around, [0.0, 0.0, 3.0]) == pytest.approx(3.0, rel=1e-12)


def test_an_obstacle_comes_before_the_ground() -> None:
    """A ball of 0.5 m with its centre 4 m ahead and 0.3 m aside: 4 - sqrt(0.5^2 - 0.3^2)."""
    ball = ObstacleSettings(type=SolidType.sphere, size=[0.5], position=[4.0, 0.3, 2.0])
    around = Surroundings(EnvironmentSettings(ground_level=0.0, obstacles={"ball": ball}))
    sensor = SensorRangeFinder(**QUIET)
    assert read(sensor, around, [0.0, 0.0, 2.0]) == pytest.approx(4.0 - 0.4, rel=1e-12)
    assert read(sensor, around, [0.0, 0.0, 2.0], [0.0, 0.0, math.pi]) is None


def test_out_of_range_is_said() -> None:
    """Too near, too far and nothing there: no range, and a flag of zero."""
    around = Surroundings(EnvironmentSettings(ground_level=0.0))
    sensor = SensorRangeFinder(rpy=DOWN, nearest=0.2, farthest=5.0, **QUIET)
    found = [read(sensor, around, [0.0, 0.0, z]) for z in (0.19, 0.21, 4.99, 5.01)]
    assert found == [None, pytest.approx(0.21), pytest.approx(4.99), None]
    assert read(sensor, Surroundings(EnvironmentSettings()), [0.0, 0.0, 1.0]) is None


def test_the_water_surface_returns_sound_from_either_side() -> None:
    """From the air 2 m above still water, and from 3 m below it looking up."""
    around = Surroundings(EnvironmentSettings(water_level=0.0, tank_bottom=-4.0))
    sensor = SensorRangeFinder(rpy=DOWN, **QUIET)
    assert read(sensor, around, [0.0, 0.0, 2.0]) == pytest.approx(2.0)
    assert read(sensor, around, [0.0, 0.0, -3.0], [math.pi, 0.0, 0.0]) == pytest.approx(3.0)
    light = SensorRangeFinder(rpy=DOWN, meets_surface=False, **QUIET)
    assert read(light, around, [0.0, 0.0, 2.0]) is None
    assert read(light, around, [0.0, 0.0, -3.0]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("medium", "height", "works"),
    [("water", 1.0, False), ("water", -1.0, True), ("air", 1.0, True)],
)
def test_a_range_finder_works_in_its_medium(medium: str, height: float, works: bool) -> None:
    """An altimeter for water says in the air that it has no range."""
    around = Surroundings(EnvironmentSettings(water_level=0.0, tank_bottom=-2.0))
    sensor = SensorRangeFinder(rpy=DOWN, medium=MediumKind(medium), **QUIET)
    assert (read(sensor, around, [0.0, 0.0, height]) is not None) is works


def test_a_slanted_ray_finds_the_surface_of_a_wave() -> None:
    """The first root of z(s) - a cos(k x(s)) along the ray, by a root finder of its own."""
    wave = WaveAiry(amplitude=0.3, period=3.0)
    around = Surroundings(EnvironmentSettings(water_level=0.0), wave)
    k, tilt = wave.wavenumber, 0.5
    sensor = SensorRangeFinder(**QUIET)
    found = read(sensor, around, [1.0, 0.0, 2.0], [0.0, tilt, 0.0])

    def above(s: float) -> float:
        return 2.0 - s * math.sin(tilt) - 0.3 * math.cos(k * (1.0 + s * math.cos(tilt)))

    grid = np.linspace(0.0, 12.0, 4001)
    first = next(b for a, b in itertools.pairwise(grid) if above(a) * above(b) <= 0.0)
    assert found == pytest.approx(brentq(above, first - 12.0 / 4000, first), abs=1e-7)


def test_errors_of_a_range_finder() -> None:
    """Scale, then bias, then whole steps."""
    around = Surroundings(EnvironmentSettings(ground_level=0.0))
    options = {**QUIET, "gain_error": 0.02, "bias": 0.05, "resolution": 0.1}
    assert read(SensorRangeFinder(rpy=DOWN, **options), around, [0, 0, 4.0]) == pytest.approx(4.1)


def test_noise_grows_with_the_distance() -> None:
    """sqrt(0.03^2 + (0.02 x 4)^2) at 4 m, from 4,000 readings."""
    around = Surroundings(EnvironmentSettings(ground_level=0.0))
    sensor = SensorRangeFinder(rpy=DOWN, noise=0.03, noise_share=0.02, resolution=0.0)
    here = np.array([0.0, 0.0, 4.0])
    felt = SensorInput(0.0, 0.004, here, np.eye(3), STILL, STILL, STILL, STILL, around=around)
    rng, rows = np.random.default_rng(1), []
    for _ in range(4000):
        found, _ = sensor.sense(felt, sensor.start(rng), rng, due=True)
        rows.append(found["range"][0])  # type: ignore[index]
    # known to 1.1 %
    assert np.std(rows) == pytest.approx(math.hypot(0.03, 0.08), rel=0.045)


def _cube_mesh() -> HullMesh:
    corners = [(x, y, z) for x in (-0.3, 0.3) for y in (-0.2, 0.2) for z in (-0.1, 0.1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    return HullMesh(vertices=corners, faces=faces, position=(1.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.4))


def test_a_mesh_and_a_box_of_one_shape_are_met_alike() -> None:
    """300 rays from one point: the same hits at the same distances."""
    rng = np.random.default_rng(2)
    ways = rng.normal(size=(300, 3)) * [0.3, 0.3, 0.2] + [1.0, 0.0, 0.0]
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    box = HullBox(size=(0.6, 0.4, 0.2), position=(1.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.4))
    start = np.array([-1.0, 0.1, 0.05])
    found = [
        distances(shape, start, ways)
        for hull in (box, _cube_mesh())
        for shape in shapes_of_hull(hull)
    ]
    assert 20 < np.isfinite(found[0]).sum() < 280
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12)


def test_cylinder_and_capsule_are_met_at_side_and_end() -> None:
    """Radius 0.5, length 2, upright: side at 0.5, flat end at 1, round end at 1.5."""
    side, top = np.array([[-1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, -1.0]])
    for hull, end in (
        (HullCylinder(radius=0.5, length=2.0), 1.0),
        (HullCapsule(radius=0.5, length=2.0), 1.5),
    ):
        (shape,) = shapes_of_hull(hull)
        assert distances(shape, np.array([3.0, 0.0, 0.2]), side) == pytest.approx(2.5)
        assert distances(shape, np.array([0.0, 0.0, 4.0]), top) == pytest.approx(4.0 - end)
        assert distances(shape, np.array([3.0, 0.0, 1.6]), side)[0] == math.inf
    (round_end,) = shapes_of_hull(HullCapsule(radius=0.5, length=2.0))
    # 0.3 above the centre of the upper ball
    found = distances(round_end, np.array([3.0, 0.0, 1.3]), side)
    assert found == pytest.approx(3.0 - 0.4)


def test_parts_of_a_compound_are_all_seen() -> None:
    """Two balls side by side: each by the ray that points at it."""
    pair = [HullSphere(radius=0.1, position=(1.0, y, 0.0)) for y in (-0.5, 0.5)]
    shapes = shapes_of_hull(HullCompound(parts=pair))
    ways = np.array([[1.0, y, 0.0] for y in (-0.5, 0.5, 0.0)])
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    found = np.min([distances(s, STILL, ways) for s in shapes], axis=0)
    np.testing.assert_allclose(found, [math.hypot(1, 0.5) - 0.1] * 2 + [math.inf])
