"""Closed forms of cut primitives against textbook formulas and independent numerical methods."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad, quad_vec
from scipy.spatial import ConvexHull, HalfspaceIntersection

from seals.hydrostatics import HullBox, HullCapsule, HullCylinder, HullMesh, HullSphere
from seals.hydrostatics.cylinder import LEAST_TILT

Vector = NDArray[np.float64]
Z = (0.0, 0.0, 1.0)


def tilted(angle: float, turn: float = 0.4) -> Vector:
    """Return a normal at ``angle`` [rad] from z, turned about z."""
    s = math.sin(angle)
    return np.array([s * math.cos(turn), s * math.sin(turn), math.cos(angle)])


@pytest.mark.parametrize("depth", [-0.29, -0.1, 0.0, 0.17, 0.299])
def test_sphere_is_a_cap(depth: float) -> None:
    """A sphere's wetted part has the volume and centroid of a spherical cap."""
    r = 0.3
    wet = HullSphere(radius=r, position=(0.0, 0.0, 1.0)).wetted(Z, 1.0 + depth)
    h = r + depth
    # cap of height h: V = pi h^2 (3 r - h) / 3, centroid 3 (2 r - h)^2 / (4 (3 r - h)) below centre
    assert wet.volume == pytest.approx(math.pi * h * h * (3 * r - h) / 3, rel=1e-12)
    below = 0.75 * (2 * r - h) ** 2 / (3 * r - h)
    assert wet.centroid[2] == pytest.approx(1.0 - below, rel=1e-12)
    assert wet.waterplane_area == pytest.approx(math.pi * (r * r - depth * depth), rel=1e-12)
    assert wet.waterplane_centroid[2] == pytest.approx(1.0 + depth, rel=1e-12)


@pytest.mark.parametrize("share", [0.001, 0.3, 0.5, 0.999])
def test_upright_cylinder_is_a_column(share: float) -> None:
    """An upright cylinder's wetted part is a shorter cylinder."""
    r, length = 0.1, 0.5
    wet = HullCylinder(radius=r, length=length).wetted(Z, (share - 0.5) * length)
    assert wet.volume == pytest.approx(math.pi * r * r * length * share, rel=1e-9)
    assert wet.centroid == pytest.approx([0, 0, 0.5 * length * (share - 1)], abs=1e-10)
    assert wet.waterplane_area == pytest.approx(math.pi * r * r, rel=1e-9)


@pytest.mark.parametrize("depth", [-0.09, -0.03, 0.0, 0.05, 0.0999])
def test_lying_cylinder_is_a_segment(depth: float) -> None:
    """A lying cylinder's wetted part is a circular segment times its length."""
    r, length = 0.1, 0.5
    wet = HullCylinder(radius=r, length=length, rpy=(0, math.pi / 2, 0)).wetted(Z, depth)
    half = math.sqrt(r * r - depth * depth)
    segment = r * r * math.acos(-depth / r) + depth * half
    # tolerance 1e-6: LEAST_TILT makes the exactly horizontal axis tilt by 3e-4 of the radius
    assert wet.volume == pytest.approx(segment * length, abs=1e-6 * math.pi * r * r * length)
    below = -2.0 / 3.0 * half**3 / segment
    assert wet.centroid == pytest.approx([0, 0, below], abs=1e-6)
    # that tilt averages the chord over w = 3e-4 r: w^2 / 24 times its curvature 2 r^2 / half^3
    slack = 1.1 * length * (LEAST_TILT * r) ** 2 / 12 * r * r / half**3
    assert wet.waterplane_area == pytest.approx(2 * half * length, abs=slack)


def disc_slice(radius: float, height: float, slope: float) -> Vector:
    """Return area, first moments (x, 1) of the disc part x * slope <= height; x along the slope."""
    if slope * radius <= abs(height):
        return np.array([math.pi * radius**2, 0.0]) if height > 0 else np.zeros(2)
    x = height / slope
    half = math.sqrt(radius**2 - x**2)
    area = radius**2 * math.acos(-x / radius) + x * half
    return np.array([area, -2.0 / 3.0 * half**3])


def sliced(profile: tuple[float, float], angle: float, level: float) -> tuple[float, Vector]:
    """Integrate disc slices along the axis of a capsule (radius, length): volume, moments."""
    radius, length = profile
    end = 0.5 * length + radius

    def slice_at(z: float) -> Vector:
        beyond = max(abs(z) - 0.5 * length, 0.0)
        r = math.sqrt(max(radius**2 - beyond**2, 0.0))
        area, moment = disc_slice(r, level - z * math.cos(angle), math.sin(angle))
        return np.array([area, moment, area * z])

    knots = np.linspace(-end, end, 41)
    parts = [quad_vec(slice_at, a, b, epsabs=1e-14)[0] for a, b in pairwise(knots)]
    total = np.sum(parts, axis=0)
    return float(total[0]), total[1:]


@pytest.mark.parametrize("angle", [1e-5, 0.02, 0.4, 1.0, 1.5, math.pi / 2 - 1e-6, 2.2, 3.0])
@pytest.mark.parametrize("share", [-0.93, -0.5, -0.1, 0.0, 0.35, 0.8])
def test_capsule_against_slices(angle: float, share: float) -> None:
    """A capsule at any tilt matches numerical integration of its circular slices."""
    r, length = 0.08, 0.3
    level = share * (r + 0.5 * length * abs(math.cos(angle)))
    volume, (across, along) = sliced((r, length), angle, level)
    hull = HullCapsule(radius=r, length=length)
    wet = hull.wetted(tilted(angle, turn=0.0), level)
    assert wet.volume == pytest.approx(volume, abs=2e-6 * hull.volume)
    moment = wet.volume * wet.centroid
    assert moment == pytest.approx([across, 0.0, along], abs=2e-6 * hull.volume * length)


@pytest.mark.parametrize("angle", [1e-4, 0.3, 0.9, 1.4, 1.57, 1.6, 2.5])
@pytest.mark.parametrize("share", [-0.9, -0.2, 0.0, 0.6])
def test_cylinder_against_columns(angle: float, share: float) -> None:
    """A cylinder at any tilt matches adaptive integration of its wetted columns."""
    r, length = 0.1, 0.35
    c, s = math.cos(angle), math.sin(angle)
    level = share * (r * s + 0.5 * length * abs(c))

    def column(x: float) -> float:
        chord = 2 * math.sqrt(max(r * r - x * x, 0.0))
        return chord * min(max((level - s * x) / abs(c) + 0.5 * length, 0.0), length)

    edges = [(level + k * 0.5 * length * abs(c)) / s for k in (-1, 1)]
    knots = sorted({-r, r, *(min(max(edge, -r), r) for edge in edges)})
    volume = sum(quad(column, a, b, epsabs=1e-13)[0] for a, b in pairwise(knots))
    hull = HullCylinder(radius=r, length=length)
    wet = hull.wetted(tilted(angle), level)
    assert wet.volume == pytest.approx(volume, abs=1e-6 * hull.volume)


def test_tilted_box_against_halfspace_intersection() -> None:
    """A tilted box cut by a plane matches a general convex-polytope intersection."""
    rng = np.random.default_rng(11)
    size = np.array([0.4, 0.2, 0.1])
    hull = HullBox(size=size.tolist())
    faces = np.vstack([np.c_[np.eye(3), -size / 2], np.c_[-np.eye(3), -size / 2]])
    for _ in range(60):
        up = rng.normal(size=3)
        up /= np.sqrt(up @ up)
        level = 0.95 * rng.uniform(-1, 1) * float(np.abs(up) @ size) / 2
        bottom = -np.sign(up) * size / 2
        inner = (
            bottom + 1e-4 * (level - up @ bottom) / float(np.abs(up) @ size) * np.sign(up) * size
        )
        cut = HalfspaceIntersection(np.vstack([faces, [*up, -level]]), inner)
        solid = ConvexHull(cut.intersections)
        wet = hull.wetted(up, level)
        assert wet.volume == pytest.approx(solid.volume, rel=1e-6, abs=1e-12)
        apex = solid.points[solid.simplices]
        middle = cut.intersections.mean(axis=0)
        pieces = np.abs(np.linalg.det(apex - middle)) / 6
        centroid = pieces @ ((apex.sum(axis=1) + middle) / 4) / pieces.sum()
        assert wet.centroid == pytest.approx(centroid, abs=1e-6)


def test_box_and_its_mesh_agree() -> None:
    """Two unrelated derivations, closed form and clipped triangles, give one box."""
    rng = np.random.default_rng(12)
    place, turn = (0.1, -0.2, 0.05), (0.3, -0.7, 1.1)
    corners = np.array([[x, y, z] for x in (-2, 2) for y in (-1, 1) for z in (-0.5, 0.5)]) / 10
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    mesh = HullMesh(vertices=corners, faces=faces, position=place, rpy=turn)
    box = HullBox(size=(0.4, 0.2, 0.1), position=place, rpy=turn)
    for _ in range(100):
        up = rng.normal(size=3)
        up /= np.sqrt(up @ up)
        level = float(up @ np.array(place)) + rng.uniform(-0.2, 0.2)
        a, b = box.wetted(up, level), mesh.wetted(up, level)
        assert a.volume == pytest.approx(b.volume, abs=1e-12 * box.volume)
        assert a.volume * a.centroid == pytest.approx(b.volume * b.centroid, abs=1e-13)
        assert a.waterplane_area == pytest.approx(b.waterplane_area, abs=1e-9)
        flat = a.waterplane_area * a.waterplane_centroid
        assert flat == pytest.approx(b.waterplane_area * b.waterplane_centroid, abs=1e-9)
