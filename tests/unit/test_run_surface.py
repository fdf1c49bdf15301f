"""Meshes of the water's surface: written when asked for, refused in words otherwise."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import MissingExtra
from seals.run.recorder import Moment
from seals.run.surface import Mesh, Surfaces, surface_of, write_ply


class Water:
    """A cube of particles at rest on a lattice, as far as a surface is concerned."""

    name = "water"

    def __init__(self) -> None:
        axis = 0.1 * (np.arange(10) + 0.5)
        self.places = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)

    def particles(self) -> Any:
        """Places and velocities."""
        return self.places, 0.0 * self.places

    def diagnostics(self) -> dict[str, float]:
        """The spacing alone."""
        return {"spacing [m]": 0.1}


class Clock:
    """A world that only has time and water."""

    step_size = 0.04

    def __init__(self) -> None:
        self.time, self.fluid = 0.0, Water()


def test_the_surface_encloses_the_water() -> None:
    """A cube of particles has a closed surface, its faces a quarter of a spacing off at most.

    Edges and corners are rounded by the smoothing, so the faces are looked at in their middle.
    """
    pytest.importorskip("pysplashsurf")
    mesh = surface_of(Water().places, 0.1)
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        middle = mesh.vertices[(np.abs(mesh.vertices[:, others] - 0.5) < 0.2).all(axis=1), axis]
        assert middle.min() == pytest.approx(0.0, abs=0.025)
        assert middle.max() == pytest.approx(1.0, abs=0.025)
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_one_file_for_every_interval(tmp_path: Path) -> None:
    """Steps of 0.04 s and surfaces every 0.1 s: the first step at or after each multiple."""
    pytest.importorskip("pysplashsurf")
    world: Any = Clock()
    surfaces = Surfaces(0.1, world.fluid)
    surfaces.start(world, tmp_path)
    for k in range(1, 11):
        world.time = k * world.step_size
        surfaces.record(Moment(world, k, 0.0, dict))
    names = sorted(path.name for path in (tmp_path / "surface").iterdir())
    assert names == [f"t_{t:08.4f}.ply" for t in (0.12, 0.2, 0.32, 0.4)]


def test_a_ply_file_reads_back(tmp_path: Path) -> None:
    """A tetrahedron comes back with its corners and its volume."""
    trimesh = pytest.importorskip("trimesh")
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    write_ply(tmp_path / "a.ply", Mesh(corners, faces))
    found = trimesh.load(tmp_path / "a.ply")
    assert found.volume == pytest.approx(1.0 / 6.0)
    assert found.is_watertight


def test_a_missing_package_is_said_before_anything_runs(
    tmp_path: Path, absent: Callable[..., None]
) -> None:
    """Without pysplashsurf the refusal names what to install."""
    absent("pysplashsurf")
    water: Any = Water()
    with pytest.raises(MissingExtra, match=r"pip install 'aam-seals\[render\]'"):
        Surfaces(0.1, water)
    assert not any(tmp_path.iterdir())


def test_a_run_without_particles_has_no_surface(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Asking for the surface of water by coefficients is refused, and a negative interval."""
    monkeypatch.chdir(tmp_path)
    assert main(["run", "robot=ball", "water=fossen", "surface=0.1"]) == 2
    assert "has no particle water" in capsys.readouterr().err
    assert main(["run", "robot=ball", "surface=-1"]) == 2
    assert "surface" in capsys.readouterr().err
