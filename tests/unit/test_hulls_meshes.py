"""The door for meshes: what is accepted, repaired, sampled or refused."""

from __future__ import annotations

import struct
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.errors import RobotError
from seals.hydrostatics import HullMesh, HullSamples, NoteKind, hull_from_mesh

CORNERS = np.array([[x, y, z] for x in (0, 0.4) for y in (0, 0.2) for z in (0, 0.1)])
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
FACES = np.array([f for a, b, c, d in QUADS for f in ((a, b, c), (a, c, d))])
VOLUME = 0.4 * 0.2 * 0.1


def write_stl(path: Path, faces: NDArray[np.int64], *, declared: int | None = None) -> Path:
    """Write the box as binary STL, whose corners are not shared."""
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *CORNERS[face].ravel().tolist(), 0) for face in faces
    )
    count = len(faces) if declared is None else declared
    path.write_bytes(b"\0" * 80 + struct.pack("<I", count) + body)
    return path


def test_stl_with_unshared_corners_is_exact(tmp_path: Path) -> None:
    """An STL file repeats every corner; it is still recognised as closed and cut exactly."""
    hull, notes = hull_from_mesh(write_stl(tmp_path / "box.stl", FACES), position=(0, 0, 1))
    assert isinstance(hull, HullMesh)
    assert notes == ()
    assert hull.volume == pytest.approx(VOLUME, rel=1e-6)
    assert hull.centroid == pytest.approx([0.2, 0.1, 1.05], rel=1e-6)
    assert hull.wetted((0, 0, 1), 1.025).volume == pytest.approx(VOLUME / 4, rel=1e-6)
    assert hull.plan_area == pytest.approx(0.08, rel=1e-6)


def test_mesh_object_pair_and_scale() -> None:
    """Objects with vertices and faces, and pairs, are accepted; scale is metres per unit."""
    source = SimpleNamespace(vertices=CORNERS * 1000, faces=FACES)
    assert hull_from_mesh(source, scale=0.001).hull.volume == pytest.approx(VOLUME)
    assert hull_from_mesh((CORNERS, FACES)).hull.volume == pytest.approx(VOLUME)


def test_inward_winding_is_turned_and_noted() -> None:
    """A mesh of negative volume is turned round, with a note."""
    hull, notes = hull_from_mesh((CORNERS, FACES[:, ::-1]))
    assert hull.volume == pytest.approx(VOLUME)
    assert [note.kind for note in notes] == [NoteKind.FLIPPED]


def test_holes_become_samples() -> None:
    """A box without half of its lid is sampled; the volume stays within a few per cent."""
    hull, notes = hull_from_mesh((CORNERS, FACES[:-1]))
    assert isinstance(hull, HullSamples)
    assert len(hull.points) >= 4096
    assert hull.volume == pytest.approx(VOLUME, rel=0.2)
    assert notes[0].kind is NoteKind.BROKEN
    assert "3 open edges" in notes[0].text


def test_mixed_winding_becomes_samples_of_the_right_volume() -> None:
    """One face turned the wrong way is noticed, and the samples fill the true box."""
    faces = FACES.copy()
    faces[3] = faces[3, ::-1]
    hull, notes = hull_from_mesh((CORNERS, faces))
    assert isinstance(hull, HullSamples)
    assert "not consistently oriented" in notes[0].text
    assert hull.volume == pytest.approx(VOLUME, rel=0.01)


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (np.where(CORNERS > 0.3, np.nan, CORNERS), FACES, "NaN"),
        (CORNERS, np.zeros((0, 3), dtype=np.int64), "no triangles"),
        (CORNERS, FACES + 3, "name vertices"),
        (CORNERS[:, :2], FACES, "shape"),
        (CORNERS * 1000, FACES, "scale=0.001"),
        (CORNERS / 1000, FACES, "scale=1000"),
        (CORNERS * [1.0, 1.0, 0.0], FACES, "flat"),
        (CORNERS, np.tile(FACES, (20_000, 1)), "Simplify"),
    ],
)
def test_unusable_meshes_are_refused(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], words: str
) -> None:
    """Broken numbers, wrong units and monsters are refused in words."""
    with pytest.raises(RobotError, match=words):
        hull_from_mesh((vertices, faces))


def test_wrong_unit_can_be_insisted_upon() -> None:
    """A very large hull is accepted when its size is confirmed."""
    assert hull_from_mesh((CORNERS * 1000, FACES), any_size=True).hull.volume > 1e6


def test_missing_file_lists_the_folder(tmp_path: Path) -> None:
    """A missing file is refused with the names that are there."""
    (tmp_path / "hull.obj").write_text("")
    with pytest.raises(RobotError, match=r"hull\.obj"):
        hull_from_mesh(tmp_path / "hull.stl")


def test_header_is_not_believed(tmp_path: Path) -> None:
    """A header that declares 200 MB is refused before anything is read."""
    path = write_stl(tmp_path / "bomb.stl", FACES, declared=4_000_000)
    with pytest.raises(RobotError, match="truncated"):
        hull_from_mesh(path)


def test_too_many_triangles_are_refused_unread(tmp_path: Path) -> None:
    """A file that truly holds too many triangles is refused by its header."""
    path = tmp_path / "fine.stl"
    with path.open("wb") as file:
        file.write(b"\0" * 80 + struct.pack("<I", 300_000))
        file.truncate(84 + 50 * 300_000)
    with pytest.raises(RobotError, match="300000 triangles"):
        hull_from_mesh(path)


def test_rubbish_is_refused(tmp_path: Path) -> None:
    """A file that no reader understands is refused with its name."""
    path = tmp_path / "rubbish.obj"
    path.write_bytes(b"\x00\x01nonsense\n" * 20)
    with pytest.raises(RobotError, match=r"rubbish\.obj"):
        hull_from_mesh(path)


def test_inward_mesh_hull_is_refused() -> None:
    """The unchecked class refuses a mesh that encloses no volume."""
    with pytest.raises(RobotError, match="encloses"):
        HullMesh(vertices=CORNERS, faces=FACES[:, ::-1])
