"""How much of many hulls is under water: what is not cut is not looked up, and stays the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.environment.wetting import WettingTable
from seals.hydrostatics import (
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullSphere,
    HullTable,
)
from seals.hydrostatics.alike import HullsAlike

HULLS = (HullBox(size=(0.4, 0.2, 0.1)), HullSphere(radius=0.15))
BATCH = 200


def _surfaces() -> tuple[Any, Any]:
    rng = np.random.default_rng(4)
    up = rng.normal(size=(2 * BATCH, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    return up, rng.uniform(-0.6, 0.6, (2 * BATCH, 1))


def _looked_up(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    rows: list[int] = []
    plain = HullTable.lookup

    def lookup(self: Any, up: Any, level: Any) -> Any:
        rows.append(len(level))
        return plain(self, up, level)

    monkeypatch.setattr(HullTable, "lookup", lookup)
    return rows


def test_only_cut_hulls_are_looked_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """All rows get what their table gives, those out of reach of the surface without asking it."""
    tables = [HullTable.build(hull) for hull in HULLS]
    up, level = _surfaces()
    cuts = slice(0, BATCH), slice(BATCH, None)
    wanted = [t.lookup(up[c], level[c]) for t, c in zip(tables, cuts, strict=True)]
    wetting = WettingTable(tables, reach=[hull.reach for hull in HULLS])
    wetting.wet(up, level)
    rows = _looked_up(monkeypatch)
    found = wetting.wet(up, level)
    reach = np.repeat([[hull.reach] for hull in HULLS], BATCH, axis=0)
    assert rows == [int((np.abs(level) < reach)[c].sum()) for c in cuts]
    assert sum(rows) < BATCH
    for column, parts in zip(found, zip(*wanted, strict=True), strict=True):
        np.testing.assert_allclose(column, np.concatenate(parts), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_away_from_the_surface_there_is_no_waterplane(
    side: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A batch far above or far below asks no table and has no area."""
    wetting = WettingTable(
        [HullTable.build(hull) for hull in HULLS], reach=[hull.reach for hull in HULLS]
    )
    up, level = _surfaces()
    far = side * (1.0 + np.abs(level))
    wetting.wet(up, far)
    rows = _looked_up(monkeypatch)
    found = wetting.wet(up, far)
    assert rows == []
    assert found.area is None
    volumes = np.repeat([[hull.volume] for hull in HULLS], BATCH, axis=0)
    np.testing.assert_allclose(found.volume, volumes * (side > 0.0), rtol=1e-12)


def test_another_library_gets_the_same() -> None:
    """An array library that cannot leave rows out looks all of them up."""
    torch = pytest.importorskip("torch", reason="torch is not installed")
    tables = [HullTable.build(hull) for hull in HULLS]
    wetting = WettingTable(tables, reach=[hull.reach for hull in HULLS])
    up, level = _surfaces()
    here = wetting.wet(up, level)
    there = wetting.wet(torch.as_tensor(up), torch.as_tensor(level))
    for one, other in zip(here, there, strict=True):
        np.testing.assert_allclose(one, other.numpy(), rtol=0.0, atol=1e-12)


def test_hulls_of_like_forms_are_evaluated_together_as_one_by_one() -> None:
    """Primitives of every form, turned, moved, and in compounds, agree with their own tables."""
    torch = pytest.importorskip("torch", reason="torch is not installed")
    place = {"position": (0.03, -0.02, 0.05), "rpy": (0.3, -0.5, 0.8)}
    parts = [
        HullCylinder(radius=0.05, length=0.3, **place),
        HullCylinder(radius=0.02, length=0.1),
        HullCapsule(radius=0.04, length=0.2, **place),
        HullSphere(radius=0.1, position=(0.0, 0.1, 0.0)),
        HullBox(size=(0.2, 0.3, 0.1), **place),
    ]
    whole = HullCompound(parts=parts, displaced_volume=0.02, centre_of_buoyancy=(0.01, 0.02, 0.0))
    hulls = [*parts, whole, HullCompound(parts=parts[:2])]
    tables = [HullTable.build(hull) for hull in hulls]
    rng = np.random.default_rng(2)
    up = rng.normal(size=(len(hulls) * BATCH, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    level = rng.uniform(-0.3, 0.3, (len(up), 1))
    found = WettingTable(tables).wet(torch.as_tensor(up), torch.as_tensor(level))
    rows = [slice(k * BATCH, (k + 1) * BATCH) for k in range(len(hulls))]
    wanted = [t.lookup(up[r], level[r]) for t, r in zip(tables, rows, strict=True)]
    for one, own in zip(found, zip(*wanted, strict=True), strict=True):
        np.testing.assert_allclose(one.numpy(), np.concatenate(own), rtol=0.0, atol=1e-13)


def test_a_compound_that_is_moved_keeps_its_own_table() -> None:
    """A stated centre of buoyancy that moves the parts has its own law; a mesh has one as well."""
    parts = [HullSphere(radius=0.1)]
    stated = {"parts": parts, "centre_of_buoyancy": (0.0, 0.0, 0.1)}
    assert HullsAlike.fits(HullCompound(**stated))
    assert not HullsAlike.fits(HullCompound(**stated, shift_geometry=True))
