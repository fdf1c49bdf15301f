"""Look-up tables of hulls: one for all hulls of the same shape, kept between runs."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.caches import HOME, cache_folder
from seals.hydrostatics import HullBox, HullCylinder, HullMesh, HullTable, table
from seals.hydrostatics.fused import HullFused, Part
from seals.hydrostatics.octahedron import OctahedralTable
from seals.hydrostatics.samples import HullSamples

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
COARSE = {"cells": 4, "depths": 5}


def wedge(height: float = 1.0) -> HullMesh:
    """Return a tetrahedron as a mesh."""
    return HullMesh(vertices=np.array(CORNERS) * [1.0, 1.0, height], faces=FACES)


def boom(length: float = 0.4) -> HullFused:
    """Return a box with a cylinder beside it, as one hull."""
    parts = (HullBox(size=(0.3, 0.2, 0.1)), HullCylinder(radius=0.05, length=length), wedge())
    return HullFused(
        [Part(hull, np.array([0.3 * k, 0, 0]), np.eye(3)) for k, hull in enumerate(parts)]
    )


def cloud(count: int = 64) -> HullSamples:
    """Return samples of a cube."""
    return HullSamples(points=np.random.default_rng(0).random((count, 3)), volume=1.0)


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[OctahedralTable]:
    """Count the tables that are built; no older ones are known."""
    found: list[OctahedralTable] = []
    own = OctahedralTable.__init__

    def noted(self: OctahedralTable, *given: object, **more: int) -> None:
        found.append(self)
        own(self, *given, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(OctahedralTable, "__init__", noted)
    table._SHARED.clear()
    table._RECENT.clear()
    return found


@pytest.mark.parametrize("made", [wedge, boom, cloud])
def test_equal_hulls_share_a_table(
    built: list[OctahedralTable], made: Callable[..., HullMesh | HullFused | HullSamples]
) -> None:
    """Hulls of the same numbers have one table, also after one was asked for its volume."""
    one = made()
    one.wetted((0.0, 0.0, 1.0), 0.1)
    first = HullTable.build(one, **COARSE)
    count = len(built)
    second = HullTable.build(made(), **COARSE)
    assert len(built) == count
    assert first.law.__self__ is second.law.__self__  # type: ignore[attr-defined]


def test_other_hulls_and_resolutions_have_their_own(built: list[OctahedralTable]) -> None:
    """Another size, or another number of cells, is another table."""
    tables = [HullTable.build(hull, **COARSE) for hull in (wedge(), wedge(1.5), boom(), boom(0.5))]
    tables.append(HullTable.build(wedge(), cells=5, depths=5))
    assert len({id(table.law.__self__) for table in tables}) == 5  # type: ignore[attr-defined]
    deep = np.array([[0.0, 0.0, 1.0]]), np.array([[9.0]])
    assert tables[1].lookup(*deep)[0] == pytest.approx(0.25)
    assert tables[0].lookup(*deep)[0] == pytest.approx(1.0 / 6.0)


def test_tables_that_no_hull_uses_are_few(built: list[OctahedralTable]) -> None:
    """Beyond the latest ones, a table goes with the last hull that used it."""
    for k in range(table.RECENT + 3):
        HullTable.build(wedge(1.0 + k), **COARSE)
    gc.collect()
    assert len(built) == table.RECENT + 3
    built.clear()
    gc.collect()
    assert len(table._SHARED) == table.RECENT


def test_a_hull_of_functions_keeps_its_table_to_itself(built: list[OctahedralTable]) -> None:
    """What cannot be compared is not shared: two such hulls may differ unseen."""

    class Drawn(HullMesh):
        """A mesh with a function beside its numbers."""

        def __init__(self, shape: Callable[[float], float]) -> None:
            super().__init__(vertices=np.array(CORNERS), faces=FACES)
            self.shape = shape

    for k in range(2):
        HullTable.build(Drawn(lambda x, k=k: x * k), **COARSE)
    assert len(built) == 2
    with pytest.raises(TypeError, match="function has no digest"):
        table.shape_digest(Drawn(lambda x: x))


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Caches of one's own."""
    monkeypatch.setenv(HOME, str(tmp_path))
    cache_folder.cache_clear()
    yield tmp_path / "seals" / "tables"
    cache_folder.cache_clear()


def test_cuts_are_kept_between_runs_and_made_anew_where_damaged(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A table from the kept cuts has the same bits; a damaged file and another hull are cut."""
    counted: list[int] = []
    own = HullFused.cut

    def cut(self: HullFused, ups: Any, levels: Any) -> Any:
        counted.append(len(ups))
        return own(self, ups, levels)

    monkeypatch.setattr(HullFused, "cut", cut)

    def rows(length: float = 0.4) -> tuple[bytes, bool]:
        counted.clear()
        shape = table.shape_digest(boom(length))
        made = OctahedralTable(boom(length), **COARSE, shape=shape)
        return made._rows.tobytes() + made._bounds.tobytes(), bool(counted)

    first, was_cut = rows()
    assert was_cut
    assert rows() == (first, False)
    files = list(home.iterdir())
    for file in files:
        file.write_bytes(file.read_bytes()[:-1] + b"x")
    assert rows() == (first, True)
    assert rows(0.5)[1]
    assert len(list(home.iterdir())) == len(files) + 1
