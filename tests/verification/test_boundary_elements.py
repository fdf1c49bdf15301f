"""Boundary elements against closed forms deep under water, and Hulme's floating hemisphere."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.errors import ConfigError
from seals.experiments.water_validation.heave import HEAVE, LIMIT, SURGE_LIMIT
from seals.hydrostatics import Hull, HullBox, HullCompound, HullCylinder, HullMesh, HullSphere
from seals.scaffold.hydrodynamics import (
    Ellipsoid,
    deep_added_mass,
    extrapolated,
    panels_of,
    radiation_of,
)

pytest.importorskip("capytaine", reason="boundary elements need the extra hydro")

Floats = NDArray[np.float64]
G, RHO = 9.81, 1000.0


def deep(hull: Hull, *counts: int) -> Floats:
    """Return the added mass in the limit of many panels, from two numbers of them."""
    pair = [panels_of(hull, count) for count in counts]
    found = [deep_added_mass(one, RHO) for one in pair]
    return extrapolated(*found, len(pair[1].faces) / len(pair[0].faces))


def test_sphere() -> None:
    """A sphere off the origin carries half of what it displaces, within 2 %, at its centre."""
    found = deep(HullSphere(radius=0.3, position=(0.5, 0.0, 0.0)), 120, 300)
    half = 0.5 * RHO * 4.0 / 3.0 * np.pi * 0.3**3
    assert np.diag(found)[:3] == pytest.approx(half, rel=0.02)
    assert np.diag(found)[4:] == pytest.approx(half * 0.25, rel=0.02)
    assert found[1, 5] == pytest.approx(half * 0.5, rel=0.02)


@pytest.mark.slow
def test_ellipsoid_by_panels() -> None:
    """A tilted ellipsoid as a mesh: Lamb's closed form within 2 %, turning about its axes too."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4)
    axes = np.array([0.5, 0.25, 0.15])
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    points = (np.asarray(ball.vertices) * axes) @ turn.T
    hull = HullMesh(vertices=points, faces=np.asarray(ball.faces))
    expected = Ellipsoid(axes, np.zeros(3), turn).added_mass(RHO)
    found = deep(hull, 300, 900)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    print(np.round((found - expected) / scale, 4))
    assert np.all(np.abs(found - expected) < 0.02 * scale)


@pytest.mark.slow
def test_long_cylinder() -> None:
    """What a longer cylinder carries more across is rho pi r^2 by length, within 2 %."""
    short, long = (
        deep(HullCylinder(radius=0.1, length=n), round(200 * n), round(600 * n))[0, 0]
        for n in (1.5, 2.5)
    )
    assert long - short == pytest.approx(RHO * np.pi * 0.1**2, rel=0.02)


@pytest.mark.slow
def test_parts_that_overlap_are_one_body() -> None:
    """Two boxes that overlap carry what the box around them does, within 2 %."""
    halves = [HullBox(size=(0.6, 0.3, 0.2), position=(x, 0.0, 0.0)) for x in (-0.2, 0.2)]
    whole = np.diag(deep(HullBox(size=(1.0, 0.3, 0.2)), 200, 600))
    found = np.diag(deep(HullCompound(parts=halves), 200, 600))
    assert found == pytest.approx(whole, rel=0.02, abs=0.02 * whole[3:].max())


@pytest.mark.parametrize(
    "rows", [[3], pytest.param([1, 3, 5, 7, 9, 11, 14, 16], marks=pytest.mark.slow)]
)
def test_hemisphere(rows: list[int]) -> None:
    """A half-submerged sphere in heave: Hulme's coefficients within 2 % of the displaced mass."""
    table = HEAVE[rows]
    w = np.sqrt(G * table[:, 0])
    pair = [panels_of(HullSphere(radius=1.0), count) for count in (120, 300)]
    both = [radiation_of(one, 0.0, w, RHO, gravity=G) for one in pair]
    ratio = len(pair[1].faces) / len(pair[0].faces)
    mass = RHO * 2.0 / 3.0 * np.pi
    limit = np.diag(extrapolated(both[0].limit, both[1].limit, ratio)) / mass
    added = extrapolated(both[0].added_mass, both[1].added_mass, ratio)[:, 2, 2] / mass
    damping = extrapolated(both[0].damping, both[1].damping, ratio)[:, 2, 2] / mass / w
    print(np.round(added - table[:, 1], 4), np.round(damping - table[:, 2], 4), limit[:3])
    assert limit[:3] == pytest.approx([SURGE_LIMIT, SURGE_LIMIT, LIMIT], abs=0.02)
    assert added == pytest.approx(table[:, 1], abs=0.02)
    assert damping == pytest.approx(table[:, 2], abs=0.02)


def test_level_under_the_hull() -> None:
    """A hull above the water makes no waves, in words."""
    with pytest.raises(ConfigError, match="under water"):
        radiation_of(panels_of(HullSphere(radius=0.1), 100), -0.2, np.array([1.0]), RHO)
