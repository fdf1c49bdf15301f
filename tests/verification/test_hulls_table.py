"""Batched lookups against the exact cut, in each array library."""

from __future__ import annotations

import importlib
from typing import Any

import array_api_strict
import numpy as np
import pytest
from numpy.typing import NDArray

from seals.hydrostatics import (
    Hull,
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullMesh,
    HullSamples,
    HullSphere,
    HullTable,
)

Vector = NDArray[np.float64]
PLACE, TURN = (0.03, -0.05, 0.08), (0.3, -0.7, 1.1)
KINDS = ["sphere", "box", "cylinder", "capsule", "compound", "box mesh", "capsule mesh", "egg mesh"]


@pytest.fixture(scope="module")
def hulls() -> dict[str, Hull]:
    """Return the hulls; tables stay cached on them for the whole file."""
    import trimesh

    def mesh(shape: Any) -> HullMesh:
        return HullMesh(vertices=shape.vertices, faces=shape.faces, position=PLACE, rpy=TURN)

    egg = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    egg.vertices = egg.vertices * [2.0, 1.0, 0.6]
    tube = HullCylinder(radius=0.05, length=0.41, position=(0, 0.12, -0.02), rpy=(0, np.pi / 2, 0))
    return {
        "sphere": HullSphere(radius=0.1, position=PLACE),
        "box": HullBox(size=(0.4, 0.2, 0.1), position=PLACE, rpy=TURN),
        "cylinder": HullCylinder(radius=0.1, length=0.4, position=PLACE, rpy=TURN),
        "capsule": HullCapsule(radius=0.1, length=0.4, position=PLACE, rpy=TURN),
        "compound": HullCompound(
            parts=[HullBox(size=(0.37, 0.21, 0.13)), tube],
            displaced_volume=0.011,
            centre_of_buoyancy=(0.0, 0.0, 0.02),
        ),
        "box mesh": mesh(trimesh.creation.box(extents=(0.4, 0.2, 0.1))),
        "capsule mesh": mesh(trimesh.creation.capsule(radius=0.1, height=0.4, count=[16, 16])),
        "egg mesh": mesh(egg),
    }


def poses(hull: Hull, count: int, seed: int = 8) -> tuple[Vector, Vector]:
    """Return random normals (N, 3) and levels (N, 1), some of them dry or wholly wet."""
    rng = np.random.default_rng(seed)
    up = rng.normal(size=(count, 3))
    up /= np.sqrt((up * up).sum(axis=1))[:, None]
    span = 1.2 * (hull.reach - float(np.sqrt(hull.centroid @ hull.centroid)))
    return up, (up @ hull.centroid)[:, None] + span * rng.uniform(-1, 1, (count, 1))


@pytest.mark.thorough
@pytest.mark.parametrize("kind", KINDS)
def test_table_is_within_a_thousandth(hulls: dict[str, Hull], kind: str) -> None:
    """Volume and first moments are within 0.1 % of the whole, for random normals and depths."""
    hull = hulls[kind]
    up, level = poses(hull, 1500)
    volume, centroid, area, _ = HullTable.build(hull).lookup(up, level)
    exact = [hull.wetted(u, h) for u, h in zip(up, level[:, 0].tolist(), strict=True)]
    size = hull.volume ** (1 / 3)
    true = np.array([wet.volume for wet in exact])
    moments = true[:, None] * np.array([wet.centroid for wet in exact])
    flat = np.array([wet.waterplane_area for wet in exact])
    worst = np.abs(volume[:, 0] - true).max() / hull.volume
    lever = np.abs(volume * centroid - moments).max() / (hull.volume * size)
    spread = np.sqrt(np.mean((area[:, 0] - flat) ** 2)) / size**2
    print(f"{kind}: volume {worst:.1e}, moment {lever:.1e}, area (rms) {spread:.1e}")
    assert worst < 1e-3
    assert lever < 1e-3
    assert spread < 5e-3


@pytest.mark.parametrize("kind", KINDS)
def test_area_of_the_table_is_the_slope_of_its_volume(hulls: dict[str, Hull], kind: str) -> None:
    """The area looked up is d(volume looked up)/d(level), so that its rate can be trusted."""
    hull = hulls[kind]
    table = HullTable.build(hull)
    up, level = poses(hull, 800, seed=9)
    step = 1e-7
    ahead, behind = table.lookup(up, level + step), table.lookup(up, level - step)
    slope = (ahead[0] - behind[0]) / (2 * step)
    area = table.lookup(up, level)[2]
    # one pose in a hundred may straddle a kink; rounding of V / step is about 1e-9
    error = np.abs(area - slope) / hull.volume ** (2 / 3)
    assert np.quantile(error, 0.99) < 1e-5


@pytest.mark.parametrize("kind", ["box", "capsule", "compound", "egg mesh"])
def test_strict_array_api_gives_the_same(hulls: dict[str, Hull], kind: str) -> None:
    """The lookup uses nothing beyond the array standard, and gives NumPy's numbers."""
    hull = hulls[kind]
    up, level = poses(hull, 50)
    plain = HullTable.build(hull).lookup(up, level)
    strict = HullTable.build(hull).lookup(
        array_api_strict.asarray(up), array_api_strict.asarray(level)
    )
    for one, other in zip(plain, strict, strict=True):
        assert one.shape == other.shape
        assert np.asarray(other) == pytest.approx(one, abs=1e-12)


@pytest.mark.parametrize("kind", ["box", "capsule", "compound", "egg mesh"])
def test_torch_gives_the_same(hulls: dict[str, Hull], kind: str) -> None:
    """The lookup in torch float64 gives NumPy's numbers, where torch is installed."""
    pytest.importorskip("torch")
    torch: Any = importlib.import_module("torch")
    hull = hulls[kind]
    up, level = poses(hull, 50)
    plain = HullTable.build(hull).lookup(up, level)
    other = HullTable.build(hull).lookup(torch.asarray(up), torch.asarray(level))
    for one, two in zip(plain, other, strict=True):
        assert two.numpy() == pytest.approx(one, abs=1e-12)


def test_layout_and_precision_of_the_input(hulls: dict[str, Hull]) -> None:
    """Transposed views give the same numbers; float32 comes back as float32."""
    for kind in ("box", "egg mesh"):
        table = HullTable.build(hulls[kind])
        up, level = poses(hulls[kind], 200)
        plain = table.lookup(up, level)
        turned = table.lookup(np.asfortranarray(up), level)
        short = table.lookup(up.astype(np.float32), level.astype(np.float32))
        for one, two, three in zip(plain, turned, short, strict=True):
            assert np.array_equal(one, two)
            assert three.dtype == np.float32
        assert short[0] == pytest.approx(plain[0], abs=1e-5 * table.volume)


def test_normals_on_the_axes_and_edges_are_found(hulls: dict[str, Hull]) -> None:
    """Normals on the table's seams, where signs and cells change, give the exact volume."""
    import trimesh

    egg = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    hull = HullMesh(vertices=egg.vertices * [2.0, 1.0, 0.6], faces=egg.faces)
    grid = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)], float)
    up = np.delete(grid, 13, axis=0)
    up /= np.sqrt((up * up).sum(axis=1))[:, None]
    up = np.concatenate((up, up * -1.0 + 0.0, up + np.array([1e-17, -0.0, 0.0])))
    level = np.full((len(up), 1), 0.02)
    volume = HullTable.build(hull).lookup(up, level)[0]
    exact = [hull.wetted(u, 0.02).volume for u in up]
    assert volume[:, 0] == pytest.approx(exact, abs=1e-3 * hull.volume)


def test_tables_are_cached_and_deterministic(hulls: dict[str, Hull]) -> None:
    """A second build returns the same object, and a table of an equal hull the same bits."""
    hull = hulls["egg mesh"]
    assert HullTable.build(hull) is HullTable.build(hull)
    import trimesh

    egg = trimesh.creation.icosphere(subdivisions=1, radius=0.1)
    tables = [
        HullTable.build(HullMesh(vertices=egg.vertices, faces=egg.faces), cells=8, depths=8)
        for _ in range(2)
    ]
    up, level = poses(hull, 20)
    first, second = (table.lookup(up, level) for table in tables)
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_samples_have_a_table_too() -> None:
    """A table of a sampled sphere follows the samples themselves within one per cent."""
    hull = HullSamples.inside(
        lambda p: (p * p).sum(axis=1) < 0.01, low=(-0.1, -0.1, -0.1), high=(0.1, 0.1, 0.1)
    )
    table = HullTable.build(hull, cells=12, depths=20)
    up, level = poses(hull, 200)
    exact = [hull.wetted(u, h).volume for u, h in zip(up, level[:, 0].tolist(), strict=True)]
    volume = table.lookup(up, level)[0][:, 0]
    assert volume == pytest.approx(exact, abs=1e-2 * hull.volume)
