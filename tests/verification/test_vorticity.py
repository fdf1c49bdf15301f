"""Vorticity confinement feeds a vortex of particle water and leaves a current alone."""

from __future__ import annotations

import numpy as np
import pytest

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings

SPACING, ACROSS, STEPS = 0.02, 12, 10


def flown(strength: float, speed: np.ndarray) -> np.ndarray:
    """Velocities of a block of water after some steps without gravity [m/s], shape (n, 3)."""
    places = lattice()
    half = SPACING * ACROSS
    water = PbfSettings(gravity=0.0, vorticity=strength, deterministic=True).build(
        Domain(
            spacing=SPACING,
            lower=np.full(3, -half),
            upper=np.full(3, half),
            capacity=len(places),
            boundary_capacity=1,
            bodies=0,
        ),
        device="cpu",
        threads=0,
    )
    water.add_particles(places, speed)
    for _ in range(STEPS):
        water.advance(0.002, substeps=1)
    found = np.array(water.velocities())
    water.close()
    return found


def lattice() -> np.ndarray:
    """Return the places of a cube of water [m], shape (n, 3)."""
    axis = SPACING * (np.arange(ACROSS) - 0.5 * (ACROSS - 1))
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)


def test_a_vortex_is_fed_and_a_current_is_not() -> None:
    """The force is strength * spacing * N x w: none without vorticity, and along the swirl with it.

    N points to the core and w along the axis, so that N x w is the direction of the flow round it:
    the angular momentum about the axis grows, in proportion to the strength over so short a time.
    """
    x, y, _ = lattice().T
    swirl = 4.0 * np.exp(-(x**2 + y**2) / (2.0 * (3.0 * SPACING) ** 2))
    turning = np.stack([-swirl * y, swirl * x, 0.0 * x], axis=1)
    spin = {
        strength: float((x * v[:, 1] - y * v[:, 0]).sum())
        for strength in (0.0, 5.0, 10.0)
        for v in [flown(strength, turning)]
    }
    gain = {strength: found - spin[0.0] for strength, found in spin.items()}
    assert gain[10.0] > 0.01 * spin[0.0] > 0.0
    assert gain[10.0] == pytest.approx(2.0 * gain[5.0], rel=0.1)
    current = np.tile([0.3, 0.0, 0.0], (len(x), 1))
    calm = [flown(strength, current) for strength in (0.0, 10.0)]
    assert calm[1].mean(axis=0) == pytest.approx(calm[0].mean(axis=0), abs=1e-5)
