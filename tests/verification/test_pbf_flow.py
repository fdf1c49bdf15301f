"""Particle water flows: a standing wave keeps its period and most of its height."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.optimize import curve_fit

with warnings.catch_warnings():
    warnings.simplefilter("ignore", DeprecationWarning)
    pytest.importorskip("taichi")

from seals.experiments.water_validation.box import filled_box
from seals.plugins.fluids.solvers.device_settings import DeviceSettings
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings

LENGTH, DEPTH, SPACING, STEP = 1.0, 0.4, 1 / 30, 0.005
NUMBER = math.pi / LENGTH
OMEGA = math.sqrt(9.81 * NUMBER * math.tanh(NUMBER * DEPTH))


def swing(physics: DeviceSettings) -> tuple[float, float]:
    """Return period over theory, and the share of the height lost in a period, of half a wave."""
    water = filled_box(
        (LENGTH, 6 * SPACING, 0.7),
        SPACING,
        lambda p: p[:, 2] < DEPTH,
        physics=physics,
    )
    for k in range(100):
        water.advance(STEP, substeps=water.substeps(STEP))
        if k % 5 == 4 and k < 90:
            water.set_particles(velocities=0.5 * water.velocities())
    places = water.positions()
    x, z = NUMBER * places[:, 0], NUMBER * places[:, 2]
    speed = 0.03 * OMEGA / math.sinh(NUMBER * DEPTH)
    flow = np.zeros_like(places)
    flow[:, 0] = speed * np.cosh(z) * np.sin(x)
    flow[:, 2] = -speed * np.sinh(z) * np.cos(x)
    water.set_particles(velocities=flow)
    time, mean = [0.0], [places[:, 0].mean()]
    for _ in range(round(1.6 * 2 * math.pi / OMEGA / STEP)):
        water.advance(STEP, substeps=water.substeps(STEP))
        time.append(time[-1] + STEP)
        mean.append(water.positions()[:, 0].mean())
    water.close()
    return fitted(np.array(time), np.array(mean), OMEGA)


def fitted(time: np.ndarray, mean: np.ndarray, exact: float) -> tuple[float, float]:
    """Return period over theory, and the share lost in a period, of a swing from its middle."""

    def damped(t: np.ndarray, a: float, rate: float, omega: float, level: float) -> np.ndarray:
        return a * np.exp(-rate * t) * np.sin(omega * t) + level

    fit, _ = curve_fit(damped, time, mean, p0=(0.012, 0.1, exact, mean[0]))
    return exact / fit[2], 1 - math.exp(-fit[1] * 2 * math.pi / exact)


@pytest.mark.thorough
def test_a_standing_wave_keeps_its_period_and_its_height() -> None:
    """Sixty spacings long: the period within three per cent, a fifth of the height lost in it."""
    period, lost = swing(PbfSettings())
    assert period == pytest.approx(1.0, abs=0.03)
    assert 0.0 < lost < 0.2
