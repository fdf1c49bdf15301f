"""Identities that hold for any hull: derivatives, symmetry, metacentre, conservation."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from seals.hydrostatics import (
    Hull,
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullMesh,
    HullSphere,
)

Vector = NDArray[np.float64]
PLACE, TURN = (0.03, -0.05, 0.08), (0.3, -0.7, 1.1)


def hulls() -> dict[str, Hull]:
    """Return one hull of each kind, off the origin and turned."""
    import trimesh

    ring = trimesh.creation.torus(0.2, 0.06, major_sections=24, minor_sections=10)
    box = HullBox(size=(0.4, 0.2, 0.1), position=PLACE, rpy=TURN)
    can = HullCylinder(radius=0.08, length=0.3, position=PLACE, rpy=TURN)
    return {
        "sphere": HullSphere(radius=0.1, position=PLACE),
        "box": box,
        "cylinder": can,
        "capsule": HullCapsule(radius=0.08, length=0.3, position=PLACE, rpy=TURN),
        "mesh": HullMesh(vertices=ring.vertices, faces=ring.faces, position=PLACE, rpy=TURN),
        "compound": HullCompound(parts=[box, can], displaced_volume=0.012),
    }


KINDS = list(hulls())


def random_up(rng: np.random.Generator) -> Vector:
    """Return a random unit vector."""
    up = rng.normal(size=3)
    return np.asarray(up / np.sqrt(up @ up))


def partly_wet(hull: Hull, rng: np.random.Generator) -> tuple[Vector, float]:
    """Return a pose in which between 3 and 97 per cent of the hull are wet."""
    while True:
        up = random_up(rng)
        level = float(up @ hull.centroid) + rng.uniform(-1, 1) * hull.volume ** (1 / 3)
        if 0.03 < hull.wetted(up, level).volume / hull.volume < 0.97:
            return up, level


def flat_moment(hull: Hull, up: Vector, level: float) -> Vector:
    """Return the waterplane's first moments [m^3]."""
    wet = hull.wetted(up, level)
    return wet.waterplane_area * wet.waterplane_centroid


def moment(hull: Hull, up: Vector, level: float) -> Vector:
    """Return the wetted volume's first moments [m^4]."""
    wet = hull.wetted(up, level)
    return wet.volume * wet.centroid


@pytest.mark.parametrize("kind", KINDS)
def test_waterplane_is_the_derivative_of_the_volume(kind: str) -> None:
    """The derivative dV/dlevel is the waterplane area, and d(moment)/dlevel its first moments."""
    hull, rng = hulls()[kind], np.random.default_rng(3)
    step = 1e-6
    for _ in range(40):
        up, level = partly_wet(hull, rng)
        ahead, behind = hull.wetted(up, level + step), hull.wetted(up, level - step)
        rate = (ahead.volume - behind.volume) / (2 * step)
        # central difference: the error is bounded by the change of area within the step
        slack = abs(ahead.waterplane_area - behind.waterplane_area) + 1e-7
        assert hull.wetted(up, level).waterplane_area == pytest.approx(rate, abs=slack)
        drift = (moment(hull, up, level + step) - moment(hull, up, level - step)) / (2 * step)
        assert flat_moment(hull, up, level) == pytest.approx(drift, abs=slack)


@pytest.mark.parametrize("kind", KINDS)
def test_buoyancy_has_a_potential(kind: str) -> None:
    """Turning the surface changes the volume by minus the waterplane moment."""
    hull, rng = hulls()[kind], np.random.default_rng(4)
    step = 1e-6
    for _ in range(30):
        up, level = partly_wet(hull, rng)
        along = random_up(rng)
        # V(n, level) for a normal n of any length is V(n/|n|, level/|n|)
        ends = []
        for sign in (1.0, -1.0):
            normal = up + sign * step * along
            size = math.sqrt(normal @ normal)
            ends.append(hull.wetted(normal / size, level / size))
        rate = (ends[0].volume - ends[1].volume) / (2 * step)
        slack = abs(ends[0].waterplane_area - ends[1].waterplane_area) + 1e-7
        assert -along @ flat_moment(hull, up, level) == pytest.approx(rate, abs=slack)


@pytest.mark.parametrize("kind", KINDS)
def test_work_over_a_closed_cycle_is_zero(kind: str) -> None:
    """Heaving and rolling round a closed cycle, buoyancy does no net work."""
    hull = hulls()[kind]
    phases = np.linspace(0.0, 2 * math.pi, 721)
    tilt, level = 0.9 + 0.5 * np.sin(phases), 0.05 + 0.05 * np.cos(phases)
    work, size = 0.0, 0.0
    turns = 0.5 * (tilt[1:] + tilt[:-1])
    for angle, height, dl, da in zip(
        turns, 0.5 * (level[1:] + level[:-1]), np.diff(level), np.diff(tilt), strict=True
    ):
        up = np.array([math.sin(angle), 0.0, math.cos(angle)])
        sideways = np.array([math.cos(angle), 0.0, -math.sin(angle)])
        wet = hull.wetted(up, height)
        # potential P(up, level) = integral of (level - up . x) dV: dP = V dlevel - moment . dup
        gain = wet.volume * (dl - wet.centroid @ sideways * da)
        work, size = work + gain, size + abs(gain)
    # the midpoint rule on 720 steps is second order: 1e-5 of the exchanged work
    assert abs(work) < 1e-4 * size


@pytest.mark.parametrize("kind", KINDS)
def test_wet_and_dry_parts_make_the_whole(kind: str) -> None:
    """What is wet seen from above and from below adds up to the whole body."""
    hull, rng = hulls()[kind], np.random.default_rng(5)
    for _ in range(40):
        up, level = partly_wet(hull, rng)
        below, above = hull.wetted(up, level), hull.wetted(-up, -level)
        assert below.volume + above.volume == pytest.approx(hull.volume, rel=1e-9)
        assert below.waterplane_area == pytest.approx(above.waterplane_area, rel=1e-6, abs=1e-9)
        both = below.volume * below.centroid + above.volume * above.centroid
        assert both == pytest.approx(hull.volume * hull.centroid, abs=1e-8 * hull.volume)


@pytest.mark.parametrize("kind", ["box", "cylinder", "capsule"])
def test_moving_the_hull_moves_the_answer(kind: str) -> None:
    """A hull moved and turned in its link answers as the unmoved one seen from the moved frame."""
    rng = np.random.default_rng(6)
    build: Callable[..., Hull] = {
        "box": lambda **k: HullBox(size=(0.4, 0.2, 0.1), **k),
        "cylinder": lambda **k: HullCylinder(radius=0.1, length=0.4, **k),
        "capsule": lambda **k: HullCapsule(radius=0.1, length=0.4, **k),
    }[kind]
    plain = build()
    for _ in range(30):
        place, rpy = rng.uniform(-1, 1, 3), rng.uniform(-3, 3, 3)
        turn = Rotation.from_euler("xyz", rpy).as_matrix()
        moved = build(position=place.tolist(), rpy=rpy.tolist())
        up, level = partly_wet(plain, rng)
        here = plain.wetted(up, level)
        there = moved.wetted(turn @ up, level + float(turn @ up @ place))
        assert there.volume == pytest.approx(here.volume, rel=1e-9)
        assert there.centroid == pytest.approx(turn @ here.centroid + place, abs=1e-9)
        assert there.waterplane_area == pytest.approx(here.waterplane_area, rel=1e-6)


@pytest.mark.parametrize("heel", [1e-2, 1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("axis", [0, 1])
def test_metacentric_radius_of_a_box(heel: float, axis: int) -> None:
    """A floating box's centre of buoyancy moves sideways by BM times the heel, BM = I / V."""
    x, y, z, draught = 0.5, 0.3, 0.2, 0.12
    hull = HullBox(size=(x, y, z))
    up = np.array([0.0, 0.0, math.cos(heel)])
    up[axis] = math.sin(heel)
    wet = hull.wetted(up, (draught - 0.5 * z) * math.cos(heel))
    across, along = ((x, y), (y, x))[axis]
    radius = along * across**3 / 12 / (x * y * draught)
    # wall-sided formula: the shift is -BM tan(heel) for as long as the deck stays dry
    assert wet.centroid[axis] == pytest.approx(-radius * math.tan(heel), rel=2e-4)


@pytest.mark.parametrize("heel", [1e-2, 1e-4, 1e-6, 1e-8])
def test_metacentric_radius_of_a_lying_cylinder(heel: float) -> None:
    """A lying cylinder trims with the longitudinal BM = I / V of its rectangular waterplane."""
    r, length, depth = 0.1, 0.6, 0.03
    hull = HullCylinder(radius=r, length=length, rpy=(0, math.pi / 2, 0))
    wet = hull.wetted((math.sin(heel), 0.0, math.cos(heel)), depth)
    half = math.sqrt(r * r - depth * depth)
    area = r * r * math.acos(-depth / r) + depth * half
    radius = 2 * half * length**3 / 12 / (area * length)
    # 1e-3: at 0.01 rad the waterplane already narrows towards one end
    assert wet.centroid[0] == pytest.approx(-radius * math.tan(heel), rel=1e-3)
