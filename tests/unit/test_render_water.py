"""The water of a film: surfaces of particles cut, cleared of voids, and joined to the sea."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.rendering.optics import SurfaceAiry, SurfaceStill
from seals.run.build import run_settings
from seals.run.surface import Mesh, write_ply
from seals.view.films.water import (
    FAR,
    Patched,
    WaterOverTime,
    cut,
    outer,
    raster,
    read_mesh,
    sea_mesh,
)
from seals.view.instants import Instants

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


def box(low: Any, high: Any, *, inside_out: bool = False) -> Mesh:
    """A closed box."""
    faces = FACES[:, ::-1] if inside_out else FACES
    return Mesh(np.array(low) + CORNERS * (np.array(high) - np.array(low)), faces)


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes in one."""
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles + s for m, s in zip(meshes, starts[:-1], strict=True)]),
    )


def areas(mesh: Mesh) -> Any:
    """Summed area vectors of the triangles."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return 0.5 * np.cross(b - a, c - a)


def water_run(*words: str) -> Any:
    """Settings of a run with water."""
    return run_settings(["robot=ball", *words])


def test_voids_go_and_drops_stay() -> None:
    """Of a block with a hole inside and a drop above, block and drop are kept."""
    block, drop = box([0, 0, -1], [4, 3, 0]), box([1, 1, 0.5], [1.1, 1.1, 0.6])
    void = box([1, 1, -0.6], [1.5, 1.5, -0.3], inside_out=True)
    found = outer(joined(block, void, drop))
    assert len(found.triangles) == 24
    np.testing.assert_allclose(np.abs(areas(found)).sum(), 2 * (12 + 4 + 3) + 0.06)
    assert not np.any(np.all(np.isclose(found.vertices, [1.5, 1.5, -0.3]), axis=1))


def test_a_block_that_is_cut_at_its_sides_keeps_its_top_alone() -> None:
    """The sheet that looks down is the floor; the rim lies on the rectangle."""
    found = outer(cut(box([0, 0, -1], [4, 3, 0]), (0.5, 0.5), (3.5, 2.0)))
    np.testing.assert_allclose(areas(found).sum(axis=0), [0.0, 0.0, 4.5], atol=1e-12)
    np.testing.assert_allclose(found.vertices[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(found.vertices[:, 0].min(), 0.5)
    np.testing.assert_allclose(found.vertices[:, 1].max(), 2.0)


def test_the_sea_looks_up_and_leaves_its_place_out() -> None:
    """Every triangle looks up; what is missing is the hole; the rim stands on the waves."""
    waves = SurfaceAiry([0.1], [[1.5, 0.5]], [4.0], [0.3])
    fine = ((-1.0, 1.5), (-0.5, 0.5))
    whole, gap = (Mesh(*sea_mesh(waves, 0.7, fine, hole=hole)) for hole in (False, True))
    assert (areas(whole)[:, 2] > 0.0).all()
    assert (areas(gap)[:, 2] > 0.0).all()
    np.testing.assert_allclose(areas(whole)[:, 2].sum() - areas(gap)[:, 2].sum(), 2.5, rtol=1e-9)
    x, y, z = whole.vertices.T
    near = np.hypot(x - 0.25, y) < 20.0
    np.testing.assert_allclose(z[near], waves.height(x[near], y[near], 0.7), atol=1e-12)
    assert x.min() < -FAR
    assert np.ptp(z[np.hypot(x, y) > 65.0]) == 0.0


def test_a_raster_takes_the_highest_and_fills_gaps() -> None:
    """A plateau with a step comes back, cells without a vertex take their neighbour's height."""
    x, y = np.meshgrid(np.arange(0.05, 2.0, 0.1), np.arange(0.05, 1.0, 0.1), indexing="ij")
    z = np.where(x < 1.0, 0.0, 0.3)
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    holes = np.ones(len(points), dtype=bool)
    holes[[33, 157]] = False
    below = points - [0.0, 0.0, 0.5]
    mesh = Mesh(np.concatenate([points[holes], below]), np.zeros((0, 3), dtype=np.int64))
    found = raster(mesh, np.zeros(2), 0.1, (20, 10))
    assert found[:9].max() < 0.01 or np.isclose(found[3, 3], 0.0)
    np.testing.assert_allclose(found[12:18, 2:8], 0.3)


def test_calm_water_is_level_everywhere() -> None:
    """A run in still water has a level sea; points under it are wet."""
    water = WaterOverTime(water_run("water=fossen"), Path("nowhere"), np.zeros(3)).at(0.0)
    assert water is not None
    np.testing.assert_array_equal(water.vertices[:, 2], 0.0)
    points = np.array([[0.0, 0.0, -0.1], [0.0, 0.0, 0.1], [50.0, 9.0, -3.0]])
    assert water.covers(points, 0.0).tolist() == [True, False, True]


def test_a_run_without_water_has_none() -> None:
    """Nothing is drawn where there is no level."""
    assert WaterOverTime(water_run(), Path("nowhere"), np.zeros(3)).at(0.0) is None


def test_waves_move_the_sea() -> None:
    """The mesh is the wave field of the run at its time."""
    settings = water_run("water=fossen", "wave=sea", "wave.height=0.2", "wave.period=2.0")
    over = WaterOverTime(settings, Path("nowhere"), np.zeros(3))
    one, two = over.at(0.0), over.at(1.0)
    assert one is not None
    assert two is not None
    fine = np.abs(one.vertices[:, :2]).max(axis=1) < 3.0
    k = (2.0 * np.pi / 2.0) ** 2 / 9.81
    crest = 0.1 * np.cos(k * one.vertices[fine, 0])
    np.testing.assert_allclose(one.vertices[fine, 2], crest, atol=1e-9)
    # half a period later crests are troughs
    np.testing.assert_allclose(two.vertices[fine, 2], -crest, atol=1e-9)


def test_particles_without_surfaces_are_said(tmp_path: Path) -> None:
    """The sea is drawn as its waves, with a remark that names the option."""
    settings = water_run("water=window", "wave=airy")
    over = WaterOverTime(settings, tmp_path, np.zeros(3))
    assert over.at(0.0) is not None
    assert "surface=0.04" in over.remarks[0]


def test_a_window_passes_into_the_sea(tmp_path: Path) -> None:
    """Inside stand the particles, at the rim the sea; there is one sheet without a gap."""
    settings = water_run("water=window", "wave=airy", "wave.amplitude=0.0", "fluid.spacing=0.05")
    (tmp_path / "surface").mkdir()
    n = 41
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    top = np.stack([x, y, np.full_like(x, 0.1)], -1).reshape(-1, 3)
    i, j = (v.ravel() for v in np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij"))
    a = i * n + j
    sheet = np.concatenate([np.stack([a, a + n, a + n + 1], 1), np.stack([a, a + n + 1, a + 1], 1)])
    floor = Mesh(top - [0.0, 0.0, 0.8], sheet[:, ::-1])
    write_ply(tmp_path / "surface" / "t_000.0400.ply", joined(Mesh(top, sheet), floor))
    water = WaterOverTime(settings, tmp_path, np.zeros(3)).at(0.04)
    assert water is not None
    mesh = Mesh(water.vertices, water.triangles)
    size = 2.0 * np.abs(water.vertices[:, 0]).max()
    np.testing.assert_allclose(areas(mesh)[:, 2].sum(), size * size, rtol=1e-4)
    assert (areas(mesh)[:, 2] > 0.0).all()
    middle = np.abs(water.vertices[:, :2]).max(axis=1) < 0.4
    np.testing.assert_allclose(water.vertices[middle, 2], 0.1, atol=1e-6)
    away = np.abs(water.vertices[:, :2]).max(axis=1) > 0.95
    np.testing.assert_allclose(water.vertices[away, 2], 0.0, atol=1e-6)
    where = np.array([[0.0, 0.0, 0.05], [3.0, 0.0, 0.05]])
    assert water.covers(where, 0.04).tolist() == [True, False]


def test_a_tank_has_flat_sides(tmp_path: Path) -> None:
    """Bulges within a spacing of the walls are laid flat; outside of the tank nothing is wet."""
    settings = water_run("water=particles", "fluid.spacing=0.05", "fluid.size=[2.0,1.0,0.5]")
    (tmp_path / "surface").mkdir()
    mesh = box([-1, -0.5, -0.5], [1, 0.5, 0])
    bulges = np.array([[0.02, 0.01, 0.0], [0.0, 0.0, 0.0]] * 4)
    rough = mesh._replace(vertices=mesh.vertices + bulges)
    write_ply(tmp_path / "surface" / "t_000.0400.ply", rough)
    water = WaterOverTime(settings, tmp_path, np.zeros(3)).at(0.0)
    assert water is not None
    assert water.closed
    assert len(np.unique(water.vertices[:, 0])) == 2
    assert water.covers(np.array([[5.0, 0.0, -0.2], [0.0, 0.0, -0.2]]), 0.0).tolist() == [
        False,
        True,
    ]


def test_surfaces_are_found_by_time(tmp_path: Path) -> None:
    """The nearest in time is taken; a damaged file is said by name."""
    (tmp_path / "surface").mkdir()
    for time, height in ((0.04, 1.0), (0.08, 2.0)):
        write_ply(tmp_path / "surface" / f"t_{time:08.4f}.ply", box([0, 0, 0], [1, 1, height]))
    found = Instants(tmp_path / "surface", ".ply")
    assert len(found.files) == 2
    file = found.nearest(0.07)
    assert file is not None
    assert (file.name, read_mesh(file).vertices[:, 2].max()) == ("t_000.0800.ply", 2.0)
    broken = tmp_path / "surface" / "t_000.0800.ply"
    broken.write_bytes(b"ply\nnothing")
    with pytest.raises(ConfigError, match="cannot be read"):
        read_mesh(broken)
    (tmp_path / "surface" / "t_odd.ply").write_bytes(b"ply")
    with pytest.raises(ConfigError, match="no time in its name"):
        WaterOverTime(water_run("water=fossen"), tmp_path, np.zeros(3))


def test_a_patch_has_both_surfaces() -> None:
    """Height and slope are the inner one's inside and the sea's outside."""
    inner = SurfaceAiry([0.0], [[1.0, 0.0]], [0.0], [0.0], level=0.5)
    both = Patched(inner, ((-1.0, 1.0), (-1.0, 1.0)), SurfaceStill(level=0.2))
    x, y = np.array([0.0, 2.0]), np.zeros(2)
    assert both.height(x, y, 0.0).tolist() == [0.5, 0.2]
    assert both.slope(x, y, 0.0)[0].tolist() == [0.0, 0.0]
    assert both.level == 0.2


def test_ripples_lie_on_the_sea() -> None:
    """Short waves for the eye change the mesh, and its slope by Cox and Munk's law."""
    settings = water_run("water=fossen")
    rough = dataclasses.replace(settings, sight=dataclasses.replace(settings.sight, ripples=4.0))
    water = WaterOverTime(rough, Path("nowhere"), np.zeros(3)).at(0.0)
    assert water is not None
    x, y = np.random.default_rng(0).uniform(-3.0, 3.0, (2, 20000))
    sx, sy = water.surface.slope(x, y, 0.0)
    np.testing.assert_allclose(np.mean(sx**2 + sy**2), 0.003 + 0.00512 * 4.0, rtol=0.1)
