"""Primitives and compounds: sizes, totals, exits and refusals."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from seals.errors import RobotError
from seals.hydrostatics import (
    Hull,
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullSamples,
    HullSphere,
    HullTable,
    Wetted,
)

Z = (0.0, 0.0, 1.0)
LYING = (0.0, math.pi / 2, 0.0)


@pytest.mark.parametrize(
    ("hull", "volume", "plan_area"),
    [
        (HullSphere(radius=0.2), 4 / 3 * math.pi * 0.008, math.pi * 0.04),
        (HullBox(size=(0.3, 0.2, 0.1)), 0.006, 0.06),
        (HullBox(size=(0.3, 0.2, 0.1), rpy=LYING), 0.006, 0.02),
        (HullCylinder(radius=0.1, length=0.5), math.pi * 0.005, math.pi * 0.01),
        (HullCylinder(radius=0.1, length=0.5, rpy=LYING), math.pi * 0.005, 0.1),
        (
            HullCapsule(radius=0.1, length=0.5, rpy=LYING),
            math.pi * (0.005 + 0.004 / 3),
            0.1 + math.pi * 0.01,
        ),
    ],
)
def test_volume_and_plan_area(hull: Hull, volume: float, plan_area: float) -> None:
    """Whole volume and plan area are those of the solid."""
    assert hull.volume == pytest.approx(volume, rel=1e-12)
    assert hull.plan_area == pytest.approx(plan_area, rel=1e-6)


@pytest.mark.parametrize(
    "hull",
    [
        HullSphere(radius=0.1, position=(0.1, 0.2, 0.3)),
        HullBox(size=(0.3, 0.2, 0.1), position=(0.1, 0.2, 0.3), rpy=(1, 2, 3)),
        HullCylinder(radius=0.1, length=0.5, position=(0.1, 0.2, 0.3), rpy=LYING),
        HullCapsule(radius=0.1, length=0.5, position=(0.1, 0.2, 0.3), rpy=LYING),
        HullCompound(parts=[HullSphere(radius=0.1), HullBox(size=(0.1, 0.1, 0.9))]),
    ],
)
@pytest.mark.parametrize("share", [-1.0, -0.999, 0.999, 1.0])
def test_ends_of_the_range(hull: Hull, share: float) -> None:
    """At and just within reach nothing or everything is wet, without a jump."""
    wet = hull.wetted(Z, share * hull.reach)
    if share > 0:
        assert wet.volume == pytest.approx(hull.volume, rel=1e-6)
        assert wet.centroid == pytest.approx(hull.centroid, abs=1e-6)
    else:
        assert wet.volume == pytest.approx(0.0, abs=1e-6 * hull.volume)
    if abs(share) == 1.0:
        assert wet.waterplane_area == 0.0
        assert not wet.waterplane_centroid.any()


def test_centroid_of_a_dry_hull_is_zero() -> None:
    """A dry hull above the water, but within reach, has zero centroids and no waterplane."""
    hull = HullBox(size=(0.1, 0.1, 0.1), position=(0.0, 0.0, 1.0))
    dry = hull.wetted(Z, 0.5)
    assert dry == Wetted(0.0, dry.centroid, 0.0, dry.waterplane_centroid)
    assert not dry.centroid.any()
    assert not dry.waterplane_centroid.any()


def test_answers_cannot_be_spoilt() -> None:
    """Vectors that are handed out again and again are read-only."""
    hull = HullSphere(radius=0.1, position=(1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="read-only"):
        hull.wetted(Z, 5.0).centroid[0] = 3.0


@pytest.mark.parametrize(
    "build",
    [
        lambda: HullSphere(radius=0.0),
        lambda: HullSphere(radius=math.nan),
        lambda: HullBox(size=(0.1, -0.1, 0.1)),
        lambda: HullCylinder(radius=0.1, length=math.inf),
        lambda: HullCapsule(radius=0.1, length=-1.0),
        lambda: HullSphere(radius=0.1, position=(0.0, 0.0)),
        lambda: HullSphere(radius=0.1, position=(0.0, 0.0, math.nan)),
        lambda: HullBox(size=(0.1, 0.1)),
        lambda: HullCompound(parts=[]),
        lambda: HullCompound(parts=[HullSphere(radius=0.1)], displaced_volume=-1.0),
        lambda: HullCompound(parts=[HullSphere(radius=0.1)], centre_of_buoyancy=(0, 0)),
        lambda: HullSamples(points=np.zeros((0, 3)), volume=1.0),
        lambda: HullSamples(points=np.zeros((5, 3)), volume=0.0),
        lambda: HullSamples.inside(
            lambda p: np.zeros(len(p), dtype=bool), low=(0, 0, 0), high=(1, 1, 1)
        ),
    ],
)
def test_nonsense_is_refused(build: Callable[[], Hull]) -> None:
    """Sizes and stated values that no body can have are refused in words."""
    with pytest.raises(RobotError):
        build()


def stated_compound(*, shift_geometry: bool) -> HullCompound:
    """Return two boxes whose stated totals differ from their sum."""
    return HullCompound(
        parts=[
            HullBox(size=(0.4, 0.2, 0.1)),
            HullBox(size=(0.4, 0.2, 0.1), position=(0.0, 0.0, 0.1)),
        ],
        displaced_volume=0.02,
        centre_of_buoyancy=(0.01, 0.0, 0.07),
        plan_area=0.09,
        shift_geometry=shift_geometry,
    )


@pytest.mark.parametrize("shift_geometry", [False, True])
def test_stated_totals_rule(shift_geometry: bool) -> None:
    """Stated volume, centre of buoyancy and plan area win over the parts."""
    hull = stated_compound(shift_geometry=shift_geometry)
    whole = hull.wetted(Z, 5.0)
    assert whole.volume == 0.02
    assert whole.centroid == pytest.approx([0.01, 0.0, 0.07], abs=1e-15)
    assert hull.plan_area == 0.09
    nearly = hull.wetted(Z, 0.3)
    assert nearly.volume == pytest.approx(0.02, rel=1e-9)
    assert nearly.centroid == pytest.approx([0.01, 0.0, 0.07], abs=1e-9)


def test_scale_and_shift_of_a_floating_compound() -> None:
    """Half wet, volume and waterplane are scaled and the centroid is shifted, not the waterline."""
    wet = stated_compound(shift_geometry=False).wetted(Z, 0.05)
    assert wet.volume == pytest.approx(0.01, rel=1e-9)
    assert wet.waterplane_area == pytest.approx(0.08 * 0.02 / 0.016, rel=1e-6)
    assert wet.centroid == pytest.approx([0.01, 0.0, 0.02], abs=1e-7)
    moved = stated_compound(shift_geometry=True).wetted(Z, 0.07)
    assert moved.volume == pytest.approx(0.01, rel=1e-9)
    assert moved.centroid == pytest.approx([0.01, 0.0, 0.02], abs=1e-7)


def test_plan_area_of_a_compound_is_its_widest_level() -> None:
    """Without a stated plan area the widest horizontal section of the sum is taken."""
    parts = [HullSphere(radius=0.1), HullBox(size=(0.3, 0.2, 0.1), position=(0, 0, 0.5))]
    assert HullCompound(parts=parts).plan_area == pytest.approx(0.06, rel=1e-9)


def test_table_refuses_a_hull_without_a_batched_form() -> None:
    """A stranger's hull without cut and extents is refused with the next step."""

    class Bare:
        volume = 1.0

    with pytest.raises(RobotError, match="cut\\(ups, levels\\)"):
        HullTable.build(Bare())  # type: ignore[arg-type]
