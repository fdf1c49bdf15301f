"""Drag-free motion with added mass: conserved energy, and the Munk moment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.special import ellipk

from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.current import Current
from seals.run import build_twin

if TYPE_CHECKING:
    from seals.run.settings import RunSettings
    from tests.verification.conftest import Bench

G, RHO = 9.81, 1000.0
WATER = {"water_level": 0.0, "water_density": RHO}
SIZE = (0.2, 0.1, 0.1)
VOLUME = 0.002
ADDED = np.diag([0.5, 1.6, 1.8, 0.004, 0.009, 0.008])
for _i, _j, _value in ((0, 4, 0.03), (1, 3, -0.02), (1, 5, 0.04), (0, 2, 0.1)):
    ADDED[_i, _j] = ADDED[_j, _i] = _value
CENTRE = np.array([0.0, 0.01, -0.02])
MASS = 1.7
INERTIA = np.array([[0.006, 4e-4, 0.0], [4e-4, 0.009, -3e-4], [0.0, -3e-4, 0.01]])


def energy_drift(bench: Bench, engine: str, step: float) -> float:
    """Return the change of total energy, as a share of the largest kinetic energy."""
    names = ("mass_x", "mass_y", "mass_z", "inertia_x", "inertia_y", "inertia_z")
    diagonal = dict(zip(names, np.diag(ADDED).tolist(), strict=True))
    added = AddedMass(**diagonal, coupling=(ADDED - np.diag(np.diag(ADDED))).tolist())
    robot = bench.body(MASS, INERTIA, centre=CENTRE, hull="box", size=SIZE)
    settings = bench.settings(
        robot,
        {"buoyancy": Buoyancy(), "added": added},
        step=step,
        duration=2.0,
        environment=WATER,
        position=[0, 0, -30],
        velocity=[0.5, -0.3, 0.2],
        angular_velocity=[2.0, 1.0, -1.5],
        rpy=[0.3, 0.1, 0.2],
    )
    run = bench.run(engine, settings)
    velocity, spin = (
        np.einsum("nji,nj->ni", run.rotation, x) for x in (run.velocity, run.angular_velocity)
    )
    twist = np.concatenate([velocity, spin], axis=1)
    # T = m |v + w x c|^2 / 2 + w I w / 2 + nu M_A nu / 2, V = m g z_c - rho V g z_b
    mass_speed = velocity + np.cross(spin, CENTRE)
    kinetic = 0.5 * MASS * (mass_speed**2).sum(axis=1) + 0.5 * np.einsum(
        "ni,ij,nj->n", spin, INERTIA, spin
    )
    kinetic = kinetic + 0.5 * np.einsum("ni,ij,nj->n", twist, ADDED, twist)
    height = run.position[:, 2]
    potential = MASS * G * (height + run.rotation[:, 2] @ CENTRE) - RHO * VOLUME * G * height
    total = kinetic + potential
    return float(np.abs(total - total[0]).max() / kinetic.max())


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("engine", "order", "steps"), [("twin", 4, (0.008, 0.004)), ("world", 2, (0.004, 0.002))]
)
def test_energy_is_conserved(
    bench: Bench, engine: str, order: int, steps: tuple[float, float]
) -> None:
    """Energy of body and water stays; what is lost falls with the order of the scheme."""
    coarse, fine = (energy_drift(bench, engine, h) for h in steps)
    print(
        f"{engine}: energy drift {coarse:.1e} at {steps[0] * 1e3:g} ms, "
        f"{fine:.1e} at {steps[1] * 1e3:g} ms"
    )
    # rates up to 20 1/s (spin and Munk moment): a share of (20 h)^p; half the step, 2^p less, 0.8
    # of it asked for
    assert coarse < (20.0 * steps[0]) ** order
    assert coarse / fine > 0.8 * 2**order


HEAVY, LIGHT, TURNING = 2.0, 0.2, 0.01
"""Added mass across and along, added moment about the upright axis of an elongated body."""


def elongated(
    bench: Bench, heading: float, duration: float, *, stream: bool, step: float = 0.004
) -> RunSettings:
    """Return a neutral slender body at ``heading`` to a stream, or a speed, of 1 m/s along x."""
    effects = {
        "buoyancy": Buoyancy(),
        "added": AddedMass(
            mass_x=LIGHT, mass_y=HEAVY, mass_z=HEAVY, inertia_y=TURNING, inertia_z=TURNING
        ),
    }
    if stream:
        effects["current"] = Current(velocity_x=1.0)
    robot = bench.body(RHO * VOLUME, (0.004, 0.01, 0.01), hull="box", size=SIZE)
    return bench.settings(
        robot,
        effects,
        step=step,
        duration=duration,
        environment=WATER,
        position=[0, 0, -30],
        rpy=[0, 0, heading],
        velocity=[0.0 if stream else 1.0, 0, 0],
    )


@pytest.mark.parametrize("heading", [0.4, -0.4, 2.0])
@pytest.mark.parametrize("stream", [True, False])
def test_munk_moment(bench: Bench, heading: float, stream: bool) -> None:
    """The first angular acceleration is that of the Munk moment (A_x - A_y) u v."""
    twin, state = build_twin(elongated(bench, heading, 1.0, stream=stream))
    rates = twin.rates(state, 0.0)
    # relative velocity in body axes: (u, v) = U (cos, -sin) of the heading when moving along x, the
    # opposite in a stream along x; the product u v is the same. T = -nu x (A nu)
    along, across = np.cos(heading), -np.sin(heading)
    expected = (LIGHT - HEAVY) * along * across / (0.01 + TURNING)
    assert rates.angular_velocity[0, 2] == pytest.approx(expected, rel=1e-12)
    run = bench.run("world", elongated(bench, heading, 0.02, stream=stream, step=0.001))
    # after 20 ms: w = w' t, with a relative error below (rate t)^2 / 2 for rates up to 10 1/s
    assert run.angular_velocity[-1, 2] == pytest.approx(
        expected * 0.02, rel=0.5 * (10.0 * 0.02) ** 2
    )


@pytest.mark.parametrize(("engine", "step"), [("world", 0.004), ("twin", 0.016)])
def test_an_elongated_body_swings_about_broadside(bench: Bench, engine: str, step: float) -> None:
    """A slender body turns broadside to its way and swings about it as a pendulum does."""
    heading, mass = 0.35, RHO * VOLUME
    settings = elongated(bench, heading, 6.0, stream=False, step=step)
    run = bench.run(engine, settings)
    # total momentum P of body and water is fixed in the world; u = P_x / (m + A_x), v = P_y / (m +
    # A_y), so that I theta'' = P^2 / 2 (1 / m_x - 1 / m_y) sin 2 theta, theta from P to the body.
    # phi = 2 (theta - pi/2) obeys the pendulum phi'' = -w^2 sin phi: T = 4 K(sin^2(phi_0 / 2)) / w
    along, across = mass + LIGHT, mass + HEAVY
    c, s = np.cos(heading), np.sin(heading)
    momentum = np.array([along * c * c + across * s * s, (along - across) * c * s])
    theta = heading - np.arctan2(momentum[1], momentum[0])
    swing = np.sqrt(momentum @ momentum * (1.0 / along - 1.0 / across) / (0.01 + TURNING))
    expected = 4.0 * ellipk(np.sin(np.pi / 2 - theta) ** 2) / swing
    yaw = np.unwrap(np.arctan2(run.rotation[:, 1, 0], run.rotation[:, 0, 0]))
    phi = yaw - np.arctan2(momentum[1], momentum[0]) - np.pi / 2
    k = np.flatnonzero((phi[:-1] < 0.0) & (phi[1:] >= 0.0))
    crossing = run.time[k] - phi[k] * step / (phi[k + 1] - phi[k])
    period = float(np.diff(crossing).mean())
    print(
        f"broadside {engine}: T = {period:.5f} s, closed form {expected:.5f} s, {len(k)} crossings"
    )
    # a second-order scheme shifts a period by less than (w h)^2; the separatrix is near, the period
    # feels the energy's error by the factor 1 / (1 - k^2) = 1 / sin^2(theta)
    order = 2 if engine == "world" else 4
    assert len(k) >= 2
    assert period == pytest.approx(expected, rel=(swing * step) ** order / np.sin(theta) ** 2)
    # it starts at one end of the swing and reaches the other
    assert phi.max() == pytest.approx(np.pi / 2 - theta, rel=0.01)
