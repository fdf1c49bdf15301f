"""Radiation with memory: fit, passivity, and the decay of heave against Cummins' equation."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from seals.experiments.water_validation.heave import HEAVE, LIMIT
from seals.hydrostatics import HullCylinder
from seals.plugins.backends.free import BackendFree
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.radiation_memory import RadiationMemory
from seals.robot.build import build_robot
from seals.scaffold.hydrodynamics import (
    Radiation,
    Resonators,
    fit_resonators,
    panels_of,
    radiation_of,
    wave_frequencies,
)
from seals.scaffold.hydrodynamics.link import Method, hydrodynamics_of

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

Floats = NDArray[np.float64]
G, RHO, RADIUS = 9.81, 1000.0, 0.2
MASS = RHO * 2.0 / 3.0 * np.pi * RADIUS**3
OMEGA = np.sqrt(G * HEAVE[:, 0] / RADIUS)
RATE = np.sqrt(G / RADIUS)
"""Unit of frequency of the hemisphere [rad/s]; its heave has about 0.9 of it."""


def hemisphere() -> Radiation:
    """Return Hulme's coefficients of heave as the radiation of a hull."""
    added, damping = np.zeros((2, len(OMEGA), 6, 6))
    added[:, 2, 2], damping[:, 2, 2] = HEAVE[:, 1] * MASS, HEAVE[:, 2] * MASS * OMEGA
    return Radiation(OMEGA, added, damping, np.diag([0, 0, LIMIT * MASS, 0, 0, 0]), RADIUS)


@cache
def model() -> Resonators:
    """Return the resonators of the hemisphere."""
    return fit_resonators(hemisphere())


@cache
def of_hemisphere(step: float, count: int) -> Floats:
    """Return heave by its start of the hemisphere let go at rest."""
    return cummins(
        OMEGA,
        HEAVE[:, 2] * MASS * OMEGA,
        MASS * (1.0 + LIMIT),
        RHO * G * np.pi * RADIUS**2,
        step,
        count,
    )


def cummins(
    omega: Floats, damping: Floats, inertia: float, stiffness: float, step: float, count: int
) -> Floats:
    """Return heave by its start of a hull let go at rest, by convolution with K(t).

    K(t) = 2/pi int B cos(w t) dw; B, zero at rest, ends with the last frequency.
    """
    w = np.linspace(0.0, omega[-1], 1000)
    known = CubicSpline(np.append(0.0, omega), np.append(0.0, damping))(w)
    kernel = (
        2.0
        / np.pi
        * np.array([np.trapezoid(known * np.cos(w * k * step), w) for k in range(count)])
    )
    heave, velocity = np.ones(count), np.zeros(count)

    def rate(k: int, z: float, v: float) -> float:
        past = step * kernel[1 : k + 1] @ velocity[:k][::-1] if k else 0.0
        return float(-(stiffness * z + past + 0.5 * step * kernel[0] * v) / inertia)

    for k in range(count - 1):
        # Heun's rule; the convolution by trapezia
        first = rate(k, heave[k], velocity[k])
        v, z = velocity[k] + step * first, heave[k] + step * velocity[k]
        second = rate(k + 1, z, v)
        velocity[k + 1] = velocity[k] + 0.5 * step * (first + second)
        heave[k + 1] = heave[k] + 0.5 * step * (velocity[k] + velocity[k + 1])
    return heave


def effects_of(model: Resonators) -> dict[str, Any]:
    """Return buoyancy, added mass at infinite frequency and memory of the hemisphere."""
    floating = np.diag([0.0, 0.0, LIMIT * MASS, 0.0, 0.0, 0.0]).tolist()
    return {
        "buoyancy": Buoyancy(),
        "added": AddedMass(mass_z=MASS, floating=floating, floating_fraction=0.5),
        "memory": RadiationMemory(
            frequency=model.frequency.tolist(),
            damping=model.damping.tolist(),
            coupling=model.coupling.tolist(),
        ),
    }


def transfer_of(resonators: Resonators, w: np.ndarray) -> np.ndarray:
    """K(iw) of the equation that `Resonators` states, shape (W, 6, 6)."""
    own = np.diag(resonators.frequency**2)
    s = 1j * w[:, None, None]
    middle = s**2 * np.eye(len(own)) + s * resonators.damping + own
    return s * (resonators.coupling.T @ np.linalg.solve(middle, resonators.coupling + 0.0 * s))


def test_fit_of_the_hemisphere() -> None:
    """Resonators give Hulme's K(iw) within 4 % of its largest value, and are passive."""
    found = transfer_of(model(), OMEGA)[:, 2, 2]
    expected = MASS * OMEGA * (HEAVE[:, 2] + 1j * (HEAVE[:, 1] - LIMIT))
    apart = np.abs(found - expected).max() / np.abs(expected).max()
    print(f"{len(model().frequency)} resonators, misfit {model().misfit:.2%}, at most {apart:.2%}")
    assert model().misfit < 0.025
    assert apart < 0.04
    everywhere = transfer_of(model(), np.geomspace(1e-3, 1e3, 200) * RATE)
    assert np.linalg.eigvalsh(everywhere.real).min() > -1e-9 * np.abs(everywhere).max()


def test_fit_of_coupled_motions() -> None:
    """Two motions that share resonators are fitted to the misfit asked for."""
    true = Resonators(
        np.array([3.0, 6.0]),
        np.array([[4.0, 1.0], [1.0, 5.0]]),
        np.array([[4.0, 0, 0, 0, 0.8, 0], [2.0, 0, 0, 0, -0.5, 0]]),
        0.0,
    )
    w = np.linspace(0.5, 15.0, 24)
    transfer = transfer_of(true, w)
    limit = np.diag([5.0, 0.0, 0.0, 0.0, 0.2, 0.0])
    data = Radiation(w, limit + transfer.imag / w[:, None, None], transfer.real, limit, 0.5)
    found = fit_resonators(data)
    assert found.misfit < 0.025
    apart = np.abs(transfer_of(found, w) - transfer)[:, [0, 0, 4], [0, 4, 4]].max(axis=0)
    size = np.abs(transfer)[:, [0, 0, 4], [0, 4, 4]].max(axis=0)
    assert np.all(apart < 0.05 * size)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "engine",
    ["pybullet", "twin", *(pytest.param(e, marks=pytest.mark.slow) for e in ("mujoco", "free"))],
)
def test_heave_decay(bench: Bench, engine: str) -> None:
    """A hemisphere let go decays within 2 % of Cummins' equation with Hulme's coefficients."""
    start, step = 0.01 * RADIUS, 0.004
    settings = bench.settings(
        bench.body(MASS, (0.1, 0.1, 0.1), hull="sphere", size=[RADIUS]),
        effects_of(model()),
        step=step,
        duration=4.0,
        environment={"water_level": 0.0, "water_density": RHO},
        position=[0, 0, start],
    )
    if engine == "free":
        settings.backend = BackendFree()
    if engine == "mujoco":
        mujoco = pytest.importorskip("seals.plugins.backends.mujoco")
        settings.backend = mujoco.BackendMujoco()
    run = bench.run("twin" if engine == "twin" else "world", settings)
    expected = of_hemisphere(step, len(run.time))
    apart = float(np.abs(run.position[:, 2] / start - expected).max())
    print(f"{engine}: largest difference {apart:.2%} of the start")
    # second order: (rate h)^2 / 24 a radian; first order in the batch: rate h of the radiation,
    # a fifth of the motion; amplitude: 1 % of the radius, of which the entry force takes a share
    assert apart < 0.02


@pytest.mark.slow
def test_heave_decay_of_a_cylinder(bench: Bench) -> None:
    """A cylinder computed as a user does decays within 5 % of Cummins' equation with its B(w)."""
    pytest.importorskip("capytaine", reason="boundary elements need the extra hydro")
    radius, height, step = 0.15, 0.2, 0.004
    mass = 0.5 * RHO * np.pi * radius**2 * height
    body = bench.body(mass, (0.05, 0.05, 0.05), hull="cylinder", size=[radius, height])
    found = hydrodynamics_of(build_robot(body), "base", Method.bem, density=RHO, panels=400)
    mass_entry, memory = found.entries["added_mass"], found.entries["radiation_memory"]
    plain = [{k: v for k, v in e.items() if k not in ("effect",)} for e in (mass_entry, memory)]
    settings = bench.settings(
        body,
        {
            "buoyancy": Buoyancy(),
            "added": AddedMass(**plain[0]),
            "memory": RadiationMemory(**plain[1]),
        },
        step=step,
        duration=6.0,
        environment={"water_level": 0.0, "water_density": RHO},
        position=[0, 0, 0.01 * radius],
    )
    settings.backend = BackendFree()
    run = bench.run("world", settings)
    panels = panels_of(HullCylinder(radius=radius, length=height), 700)
    w = wave_frequencies(panels, 0.0, 40)
    data = radiation_of(panels, 0.0, w, RHO, gravity=G)
    expected = cummins(
        w,
        data.damping[:, 2, 2],
        mass + float(data.limit[2, 2]),
        RHO * G * np.pi * radius**2,
        step,
        len(run.time),
    )
    apart = float(np.abs(run.position[:, 2] / (0.01 * radius) - expected).max())
    print(f"cylinder: largest difference {apart:.2%} of the start; {found.words}")
    assert apart < 0.05


def test_memory_gives_back_no_more_than_it_took() -> None:
    """Under any motion the work of the force on the hull is never positive in sum."""
    from types import SimpleNamespace

    effect = RadiationMemory(**RadiationMemory.material, floating_fraction=0.4)
    params = effect.constants() | {
        "strength": np.ones((1, 1)),
        "floating_fraction": np.full((1, 1), 0.4),
    }
    rng = np.random.default_rng(3)
    memory, work, most, step = np.zeros((4, effect.memory_size)), np.zeros(4), 0.0, 0.05
    law: Any = effect.loads
    for _ in range(400):
        twist = rng.normal(size=(4, 6))
        motion = SimpleNamespace(velocity=twist[:, :3], angular_velocity=twist[:, 3:])
        wet = rng.uniform(0.0, 1.0, (4, 1))
        medium = SimpleNamespace(velocity=np.zeros((4, 3)), submersion=wet)
        wrench, memory = law(motion, medium, SimpleNamespace(step=step), memory, params)
        both = np.concatenate((wrench.force, wrench.torque), axis=1)
        work += step * np.sum(both * twist, axis=1)
        most = max(most, float(work.max()))
    assert most < 1e-12
    assert np.all(work < -0.1)
