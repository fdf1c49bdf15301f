"""Smoothing kernels of the particle water, their calibration, and boundary volumes."""

from __future__ import annotations

import numpy as np
import pytest

from seals.plugins.fluids.solvers.device_settings import Kernel
from seals.plugins.fluids.solvers.pbf.chebyshev import weights
from seals.plugins.fluids.solvers.pbf.lattice import (
    SHAPES,
    Calibration,
    lattice,
    shape_of,
    sheet_mean,
)
from seals.plugins.fluids.solvers.pbf.points import BULGE, close_pairs, weigh

KERNELS = list(Kernel)


def grid(*counts: int) -> np.ndarray:
    """Return a unit lattice of points."""
    axes = np.meshgrid(*map(np.arange, counts), indexing="ij")
    return np.stack(axes, -1).reshape(-1, len(counts)).astype(float)


@pytest.mark.parametrize("support", [2.0, 2.3])
@pytest.mark.parametrize("kernel", KERNELS)
def test_water_on_the_lattice_has_rest_density(kernel: Kernel, support: float) -> None:
    """The shares of all neighbours and of the particle itself add up to one."""
    found = Calibration.of(kernel, support)
    r = np.linalg.norm(lattice(support), axis=1)
    shape = shape_of(kernel, support)
    assert found.own + found.factor * shape(r)[0].sum() == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("kernel", KERNELS)
def test_kernel_integrates_to_one(kernel: Kernel) -> None:
    """The continuous integral agrees with the lattice sum within five per cent."""
    q = np.linspace(0, 2, 20001)
    whole = np.trapezoid(4 * np.pi * q**2 * SHAPES[kernel](q)[0], q) * Calibration.of(kernel).factor
    assert whole == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("kernel", KERNELS)
def test_slope_is_the_derivative(kernel: Kernel) -> None:
    """The slope over distance equals the finite difference of the value."""
    q = np.linspace(0.05, 1.95, 77)
    ahead, behind = (SHAPES[kernel](q + e)[0] for e in (1e-6, -1e-6))
    assert SHAPES[kernel](q)[1] * q == pytest.approx((ahead - behind) / 2e-6, abs=1e-7)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_sheet_of_samples_stands_for_water_and_presses_twice(kernel: Kernel) -> None:
    """One spacing above a sheet: the density of a layer of water, twice its slope."""
    found = Calibration.of(kernel)
    a, b = found.solid

    def solid(r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u = 1 - r / 2
        return u**7 * (a + b * u), -0.5 * u**6 * (7 * a + 8 * b * u) / r

    layer = found.factor * sheet_mean(SHAPES[kernel], 1.0, 2.0)
    assert sheet_mean(solid, 1.0, 2.0) == pytest.approx(layer * [1, 2], rel=1e-9)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_flat_sheet_has_weight_one(kernel: Kernel) -> None:
    """Samples inside of a square sheet with the water's spacing weigh one, dense ones less."""
    found = Calibration.of(kernel)
    flat = np.pad(grid(9, 9), ((0, 0), (0, 1)))
    given = {"kernel": kernel, "lattice": found, "convex": False}
    middle = 4 * 9 + 4
    assert weigh(0.1 * flat, spacing=0.1, **given)[1][middle] == pytest.approx(1.0)
    dense = weigh(0.05 * flat, spacing=0.1, **given)[1][middle]
    assert dense == pytest.approx(0.25, rel=0.05)


def test_samples_of_a_ball_move_inwards_and_weigh_their_own_area() -> None:
    """By a share of the curvature of their sphere, not of a plane; weights are its area."""
    found = Calibration.of(Kernel.spline)
    given = {"spacing": 1.0, "kernel": Kernel.spline, "lattice": found}
    i = np.arange(572) + 0.5
    polar, turn = np.arccos(1 - 2 * i / 572), np.pi * (1 + 5**0.5) * i
    ball = 4.5 * np.stack(
        [np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], 1
    )
    moved, weights = weigh(ball, convex=True, **given)
    inwards = 4.5 - np.linalg.norm(moved, axis=1)
    assert inwards.mean() == pytest.approx(BULGE / 4.5, rel=0.1)
    assert weights.sum() == pytest.approx(4 * np.pi * 4.5**2, rel=0.03)
    assert weigh(ball, convex=False, **given)[0] == pytest.approx(ball)
    flat = np.pad(grid(9, 9), ((0, 0), (0, 1)))
    assert weigh(flat, convex=True, **given)[0][4 * 9 + 4] == pytest.approx(flat[4 * 9 + 4])


def test_close_pairs_equal_brute_force() -> None:
    """The cell search finds the pairs that comparing all with all finds."""
    rng = np.random.default_rng(0)
    a, b = rng.uniform(0, 3, (200, 3)), rng.uniform(0, 3, (300, 3))
    found = {(i, j) for rows in close_pairs(a, b, 0.5) for i, j in zip(*rows[:2], strict=True)}
    distance = np.linalg.norm(a[:, None] - b[None], axis=2)
    assert found == set(zip(*np.nonzero(distance < 0.5), strict=True))


def test_schedule_beats_plain_relaxation() -> None:
    """Four weighted sweeps leave less of the worst error than four plain ones."""
    found = Calibration.of(Kernel.spline)
    soft = 0.3
    spectrum = (np.linspace(0, found.top, 200) + soft) / (1 + soft)
    error, last = np.ones(200), np.zeros(200)
    for gain, memory in weights(4, softness=soft, lattice=found):
        last = gain * spectrum * error + memory * last
        error = error - last
    plain = np.abs(1 - spectrum / spectrum.max()) ** 4
    assert np.abs(error).max() < 0.5 * plain.max()
