"""A body as heavy as its water goes where the water goes: in waves, and in waves on a current.

Without drag the pressure and the added mass alone carry it: m dv/dt = rho V Du/Dt + A (Du/Dt -
dv/dt), whose solution is v = u (Maxey and Riley 1983; Auton, Hunt and Prud'homme 1988).
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.current import Current
from seals.plugins.waves.airy import WaveAiry
from seals.plugins.waves.sea import WaveSea

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

Floats = NDArray[np.float64]
RHO, RADIUS = 1000.0, 0.05
MASS = RHO * 4.0 / 3.0 * math.pi * RADIUS**3
SPAN = 6.0
AMPLITUDE, PERIOD, DEPTH = 0.1, 2.0, 0.6
WAVES = [
    (WaveAiry(amplitude=AMPLITUDE, period=PERIOD, direction=0.6), math.inf),
    (WaveSea(height=2 * AMPLITUDE, period=PERIOD, direction=0.6, depth=1.5), 1.5),
]


def orbit(place: Floats, time: float, bottom: float) -> Floats:
    """Velocity of the water under one linear wave, from its textbook form."""
    omega = 2.0 * math.pi / PERIOD
    k = omega**2 / 9.81
    for _ in range(50):
        k = omega**2 / (9.81 * math.tanh(k * bottom))
    east, north = math.cos(0.6), math.sin(0.6)
    theta = k * (east * place[0] + north * place[1]) - omega * time
    if math.isinf(bottom):
        ahead = up = math.exp(k * place[2])
    else:
        ahead = math.cosh(k * (place[2] + bottom)) / math.sinh(k * bottom)
        up = math.sinh(k * (place[2] + bottom)) / math.sinh(k * bottom)
    speed = AMPLITUDE * omega
    along = speed * ahead * math.cos(theta)
    return np.array([east * along, north * along, speed * up * math.sin(theta)])


def drifted(flow: Floats, bottom: float, step: float = 0.01) -> Floats:
    """Where a drop of water is after a while, by fourth-order steps of its own."""
    place = np.array([0.0, 0.0, -DEPTH])
    for k in range(round(SPAN / step)):
        t = k * step
        a = orbit(place, t, bottom) + flow
        b = orbit(place + 0.5 * step * a, t + 0.5 * step, bottom) + flow
        c = orbit(place + 0.5 * step * b, t + 0.5 * step, bottom) + flow
        d = orbit(place + step * c, t + step, bottom) + flow
        place = place + step * (a + 2 * b + 2 * c + d) / 6.0
    return place


@pytest.mark.parametrize("speed", [0.0, 0.5, -0.5])
@pytest.mark.parametrize(("wave", "bottom"), WAVES)
@pytest.mark.parametrize(("engine", "step", "near"), [("twin", 0.02, 1e-5), ("world", 0.004, 2e-3)])
def test_a_neutral_sphere_stays_with_its_water(
    bench: Bench,
    wave: WaveAiry | WaveSea,
    bottom: float,
    speed: float,
    engine: str,
    step: float,
    near: float,
) -> None:
    """Three periods, in orbits of up to 0.1 m, on deep and on shallow water, with currents.

    Taken by the rate of the velocity at fixed points alone it would sink by tens of centimetres.
    """
    flow = np.array([0.0, speed, 0.0])
    begun = orbit(np.array([0.0, 0.0, -DEPTH]), 0.0, bottom) + flow
    effects = {
        "buoyancy": Buoyancy(),
        "added": AddedMass(mass_x=MASS / 2, mass_y=MASS / 2, mass_z=MASS / 2),
        "current": Current(velocity_y=speed),
    }
    settings = bench.settings(
        bench.body(MASS, [1e-4] * 3, size=[RADIUS]),
        effects,
        step=step,
        duration=SPAN,
        environment={"water_level": 0.0, "water_density": RHO},
        position=[0.0, 0.0, -DEPTH],
        velocity=begun.tolist(),
    )
    found = bench.run(engine, dataclasses.replace(settings, wave=wave))
    expected = drifted(flow, bottom)
    assert np.linalg.norm(found.position[-1] - expected) < near
