"""Solids as samples with volumes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from seals.errors import PhysicsError
from seals.plugins.fluids.sampling import (
    ALL,
    Thin,
    box_walls,
    refuse_coarse,
    sample_pieces,
    thickness,
)
from seals.plugins.fluids.sampling.pieces import is_closed, sample_closed, sample_sheet
from seals.plugins.fluids.sampling.shapes import PITCH, fine_face
from seals.robot.pieces import Piece

D = 0.02
STILL = (np.zeros(3), np.eye(3))
trimesh = pytest.importorskip("trimesh")
SHAPES = {
    "box": Piece("box", (0.2, 0.13, 0.1), *STILL),
    "sphere": Piece("sphere", (0.1,), *STILL),
    "cylinder": Piece("cylinder", (0.08, 0.21), *STILL),
    "capsule": Piece("capsule", (0.06, 0.2), *STILL),
}
VOLUMES = {
    "box": 0.2 * 0.13 * 0.1,
    "sphere": 4 / 3 * math.pi * 0.1**3,
    "cylinder": math.pi * 0.08**2 * 0.21,
    "capsule": math.pi * 0.06**2 * 0.2 + 4 / 3 * math.pi * 0.06**3,
}


def mesh_piece(shape: Any) -> Piece:
    """Return a mesh as a piece."""
    return Piece("mesh", (), *STILL, np.asarray(shape.vertices), np.asarray(shape.faces))


@pytest.mark.parametrize("name", SHAPES)
def test_fine_shapes_fill_their_shells(name: str) -> None:
    """Two layers of a shape hold the volume between its surface and two spacings under it."""
    piece = SHAPES[name]
    found = sample_pieces([piece], D, layers=2)
    smaller = {
        "box": lambda: np.prod([x - 4 * D for x in (0.2, 0.12, 0.1)]) * 0.13 / 0.12,
        "sphere": lambda: 4 / 3 * math.pi * 0.06**3,
        "cylinder": lambda: math.pi * 0.04**2 * (0.21 - 4 * 0.21 / 10),
        "capsule": lambda: math.pi * 0.02**2 * 0.2 + 4 / 3 * math.pi * 0.02**3,
    }[name]()
    if name == "box":
        counts = [10, 6, 5]
        smaller = VOLUMES["box"] * (6 * 2 * 1) / math.prod(counts)
    assert found.volumes.sum() == pytest.approx(VOLUMES[name] - smaller, rel=1e-9)
    # even spacing: no two samples closer than half, none alone
    apart = cKDTree(found.points).query(found.points, k=2)[0][:, 1]
    assert apart.min() > 0.5 * D
    assert apart.max() < 1.35 * D


@pytest.mark.parametrize("name", SHAPES)
def test_coarse_shapes_keep_all_their_volume(name: str) -> None:
    """A shape of a few spacings, thin ones included, loses and gains no volume."""
    for spacing in (0.05, 0.08, 0.3):
        found = sample_pieces([SHAPES[name]], spacing, layers=ALL)
        assert found.volumes.sum() == pytest.approx(VOLUMES[name], rel=1e-9)
        assert np.abs(found.volumes @ found.points).max() < 0.03 * VOLUMES[name] * spacing


def test_first_layer_lies_half_a_spacing_deep() -> None:
    """The outermost samples of a ball lie half a spacing under its surface."""
    found = sample_pieces([SHAPES["sphere"]], D)
    assert np.linalg.norm(found.points, axis=1).max() == pytest.approx(0.1 - 0.5 * D, rel=1e-9)


@pytest.mark.parametrize("spacing", [0.03, 0.06, 0.25])
def test_closed_meshes_keep_volume_and_centre(spacing: float) -> None:
    """A closed mesh, thick or thinner than a cell, keeps its volume and its centroid."""
    shape = trimesh.creation.icosphere(subdivisions=3, radius=0.11)
    shape.apply_scale([1.0, 0.8, 0.35])
    shape.apply_translation([0.013, -0.02, 0.05])
    found = sample_closed(np.asarray(shape.vertices), np.asarray(shape.faces), spacing, ALL)
    near = cKDTree(found.points).query(found.points, k=2)[0]
    assert found.volumes.sum() == pytest.approx(shape.volume, rel=1e-9)
    centre = found.volumes @ found.points / found.volumes.sum()
    assert np.abs(centre - shape.center_mass).max() < 0.02 * spacing
    assert near.shape[1] == 2
    assert found.volumes.max() <= spacing**3 * 1.02


@pytest.mark.thorough
@pytest.mark.parametrize("spacing", [0.02, 0.03])
def test_a_convex_mesh_has_its_face_half_a_spacing_in(spacing: float) -> None:
    """A cone's samples stand as those of a sphere do, not where its faces cut a lattice."""
    outline = [(0.0, -0.15), (0.12, -0.11), (0.12, 0.15), (0.0, 0.15)]
    shape = trimesh.creation.revolve(np.array(outline))
    found = sample_pieces([mesh_piece(shape)], spacing)
    normals = shape.face_normals
    under = (shape.triangles[:, 0] * normals).sum(1) - found.points @ normals.T
    np.testing.assert_allclose(under.min(axis=1), 0.5 * spacing, rtol=1e-6)
    # the layer one spacing thick, of a cone whose face lies deeper at the same distance from it
    slope = math.atan2(0.04, 0.12)
    rim, tip = 0.12 - spacing, -0.15 + spacing / math.cos(slope)
    edge = tip + rim * math.tan(slope)
    inner = math.pi * rim**2 * (0.15 - spacing - edge + (edge - tip) / 3.0)
    whole = math.pi * 0.12**2 * (0.26 + 0.04 / 3.0)
    assert found.volumes.sum() == pytest.approx(whole - inner, rel=0.02)
    near = cKDTree(found.points).query(found.points, k=2)[0][:, 1] / (PITCH * spacing)
    assert near.min() > 0.5
    assert near.max() < 1.3


def test_hollow_meshes_stay_hollow() -> None:
    """The room inside a thick-walled tube is no solid."""
    shape = trimesh.creation.annulus(r_min=0.1, r_max=0.2, height=0.3, sections=64)
    found = sample_closed(np.asarray(shape.vertices), np.asarray(shape.faces), 0.05, ALL)
    assert found.volumes.sum() == pytest.approx(shape.volume, rel=1e-6)
    assert np.linalg.norm(found.points[:, :2], axis=1).min() > 0.095


def test_open_meshes_are_one_layer() -> None:
    """A sheet becomes one layer, a spacing thick, with no hole wider than a spacing and a half."""
    shape = trimesh.creation.box((0.4, 0.3, 0.0001))
    top = shape.faces[shape.face_normals[:, 2] > 0.5]
    assert not is_closed(top)
    found = sample_sheet(np.asarray(shape.vertices), top, 0.03)
    assert found.volumes.sum() == pytest.approx(0.4 * 0.3 * 0.03, rel=1e-9)
    probe = np.random.default_rng(0).uniform(-1, 1, (2000, 3)) * [0.2, 0.15, 0.0]
    assert cKDTree(found.points).query(probe)[0].max() <= 0.78 * 0.03


def test_thin_pieces_may_block() -> None:
    """A plate thinner than a spacing keeps its volume, or is a layer that nothing passes."""
    plate = Piece("box", (0.2, 0.2, 0.002), *STILL)
    assert sample_pieces([plate], D).volumes.sum() == pytest.approx(0.2 * 0.2 * 0.002)
    assert sample_pieces([plate], D, thin=Thin.block).volumes.sum() == pytest.approx(0.04 * D)


def test_stated_volumes_rule() -> None:
    """A hull whose volume is stated displaces that volume."""
    piece = SHAPES["sphere"]._replace(volume=0.002)
    assert sample_pieces([piece], 0.05, layers=ALL).volumes.sum() == pytest.approx(0.002)


def test_too_coarse_is_refused_with_the_bound() -> None:
    """A body thinner than two spacings is refused, and the message says which spacing would do."""
    refuse_coarse("ball", [SHAPES["sphere"]], 0.1)
    with pytest.raises(PhysicsError, match=r"'ball'.*0.2 m thick(.|\n)*up to 0.1 m"):
        refuse_coarse("ball", [SHAPES["sphere"]], 0.11)
    # a boom may be thin when the can is not
    refuse_coarse("robot", [SHAPES["box"], Piece("cylinder", (0.01, 0.16), *STILL)], 0.05)


def test_thickness_of_meshes() -> None:
    """Of a convex mesh that of the largest ball in it, of others of a plate of equal volume."""
    plate = trimesh.creation.box((0.4, 0.3, 0.01))
    assert thickness(mesh_piece(plate)) == pytest.approx(0.01, rel=1e-6)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.11)
    assert thickness(mesh_piece(ball)) == pytest.approx(0.22, rel=0.02)
    ring = trimesh.creation.annulus(r_min=0.195, r_max=0.2, height=0.3, sections=64)
    assert thickness(mesh_piece(ring)) == pytest.approx(0.005, rel=0.06)


def test_walls_continue_the_lattice() -> None:
    """Walls and floor are a fine layer half a spacing behind their faces, the lid left out."""
    lower, upper = np.zeros(3), np.array([0.2, 0.1, 0.3])
    walls = box_walls(lower, upper, 0.05)
    assert walls.points.min(axis=0) == pytest.approx(np.full(3, -0.025))
    assert walls.points[:, :2].max(axis=0) == pytest.approx([0.225, 0.125])
    behind = (walls.points < lower) | (walls.points > upper)
    assert behind[:, :2].any(axis=1)[walls.points[:, 2] > 0].all()
    # no sample alone, and none doubled: two thirds of a spacing to the next
    apart = cKDTree(walls.points).query(walls.points, k=2)[0][:, 1]
    assert apart.min() > 0.6 * 0.05
    assert apart.max() < 0.75 * 0.05
    assert 0.27 < walls.points[:, 2].max() < 0.3


@pytest.mark.parametrize("name", SHAPES)
def test_faces_are_smoother_than_the_fluid_is_coarse(name: str) -> None:
    """A face is finer than the fluid, keeps the layer's volume and lies as deep as the layer."""
    piece = SHAPES[name]
    fine = fine_face(piece.kind, piece.size, D)
    layer = fine_face(piece.kind, piece.size, D, pitch=1.0)
    assert fine.volumes.sum() == pytest.approx(layer.volumes.sum(), rel=1e-9)
    assert 1.9 < len(fine.points) / len(layer.points) < 2.6
    r, *long = piece.size
    half = {
        "sphere": [r, r, r],
        "box": [0.5 * edge for edge in piece.size],
        "cylinder": [r, r, 0.5 * long[-1] if long else 0.0],
        "capsule": [r, r, r + 0.5 * long[-1] if long else 0.0],
    }[name]
    # the golden angle puts no sample of a ball at its pole
    assert np.abs(fine.points).max(axis=0) == pytest.approx(np.array(half) - 0.5 * D, abs=0.06 * D)
    apart = cKDTree(fine.points).query(fine.points, k=2)[0][:, 1]
    assert 0.45 * PITCH * D < apart.min() < apart.max() < 1.35 * PITCH * D
