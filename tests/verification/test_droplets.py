"""Surface tension: droplets without gravity swing with the period of Rayleigh."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import curve_fit

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings

TENSION, STRETCH = 0.25, 0.2
STEPS, EACH = 70, 50
"""Steps of a run, and those in a period of Rayleigh's [1]."""


def rayleigh(radius: float) -> float:
    """Angular frequency of the slowest mode of a droplet [rad/s]."""
    return math.sqrt(8.0 * TENSION / (PbfSettings().density * radius**3))


def swing(across: int, spacing: float) -> tuple[np.ndarray, float]:
    """Elongation of a droplet that was stretched, row by row, and its radius at the end [m].

    Args:
        across: spacings of its radius.
        spacing: of the particles [m].
    """
    radius = across * spacing
    axis = spacing * (np.arange(-2 * across, 2 * across) + 0.5)
    places = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    axes = np.array([(1.0 + STRETCH) ** -0.5] * 2 + [1.0 + STRETCH])
    places = places[((places / axes) ** 2).sum(axis=1) < radius**2]
    drop = PbfSettings(
        gravity=0.0, sound_speed=8.0, cohesion=TENSION, artificial_viscosity=20.0
    ).build(
        Domain(
            spacing=spacing,
            lower=np.full(3, -2.0 * radius),
            upper=np.full(3, 2.0 * radius),
            capacity=len(places),
            boundary_capacity=1,
            bodies=0,
        ),
        device="cpu",
        threads=0,
    )
    drop.add_particles(places)
    course, step = [], 2.0 * math.pi / rayleigh(radius) / EACH
    for _ in range(STEPS):
        drop.advance(step, substeps=drop.substeps(step))
        x = drop.positions() - drop.positions().mean(axis=0)
        course.append((x[:, 2] ** 2).sum() / (x**2).sum() - 1.0 / 3.0)
    size = float(np.sqrt(5.0 / 3.0 * (x**2).sum(axis=1).mean()))
    drop.close()
    return np.array(course), size


@pytest.mark.slow
@pytest.mark.parametrize(("across", "spacing"), [(6, 5e-4), (9, 5e-4), (12, 5e-4), (9, 7e-4)])
def test_a_droplet_swings_with_the_period_of_rayleigh(across: int, spacing: float) -> None:
    """omega^2 = 8 sigma / (rho R^3) for its slowest mode, undamped, within 12 %."""
    course, radius = swing(across, spacing)
    exact = rayleigh(radius)
    time = 2.0 * math.pi / rayleigh(across * spacing) / EACH * np.arange(1, STEPS + 1)

    def damped(t: np.ndarray, *p: float) -> np.ndarray:
        return p[0] * np.exp(-p[1] * t) * np.cos(p[2] * t + p[3]) + p[4]

    fit, _ = curve_fit(damped, time, course, p0=(course[0], 0.3 * exact, exact, 0.0, 0.0))
    left = damped(time, *fit) - course
    assert np.sqrt((left**2).mean()) < 0.1 * course[0]
    found = math.hypot(fit[2], fit[1])
    print(f"{across}: {found:.1f} rad/s, Rayleigh {exact:.1f}, damping {fit[1]:.1f} 1/s")
    assert found == pytest.approx(exact, rel=0.12)
