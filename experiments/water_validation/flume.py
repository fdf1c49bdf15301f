"""Wave flume: regular waves from a piston wave maker, absorbed by a sponge layer."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import lsq_linear

from seals.environment.linear_waves import wavenumber
from seals.environment.settings import EnvironmentSettings
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome, relative
from seals.fluid import BodyStates, Surrounding
from seals.plugins.fluids.tank import FluidParticles
from seals.plugins.fluids.tank.settings import BeachSettings, Maker, MakerSettings
from seals.plugins.waves.still import WaveStill
from seals.report.figures import Chart, Series

HEIGHT, PERIOD, DEPTH, STEP = 0.08, 1.0, 0.4, 0.004


def run(grade: Grade) -> Outcome:
    """Make waves for eight periods and split the last ones into incident and reflected."""
    spacing = 0.02 if grade.quick else 0.01
    k = wavenumber(2.0 * math.pi / PERIOD, DEPTH, 9.81)
    length = 2.0 * math.pi / k
    beach, clear = 1.3 * length, 1.7 * length
    fluid = FluidParticles(
        spacing=spacing,
        size=[clear + beach, 8 * spacing, DEPTH],
        centre=[0.5 * (clear + beach), 0.0],
        freeboard=0.2,
        maker=MakerSettings(kind=Maker.piston, height=HEIGHT, period=PERIOD),
        beach=BeachSettings(length=beach),
        look=0.0,
        device=grade.device,
        threads=grade.threads,
    )
    environment = EnvironmentSettings(water_level=0.0, tank_bottom=-DEPTH, water_density=1000.0)
    fluid.open(Surrounding(environment, WaveStill(), (), STEP), ())
    none = np.zeros((0, 3))
    states = BodyStates(
        none, np.zeros((0, 3, 3)), none, none, np.zeros(0), np.zeros((0, 3, 3)), none
    )
    fluid.initialise(states)
    places = np.stack([np.linspace(0.7, 1.6, 12) * length, np.zeros(12)], axis=1)
    time, rows = [], []
    for n in range(round(8.0 * PERIOD / STEP)):
        fluid.exchange(states, n * STEP, STEP)
        time.append((n + 1) * STEP)
        rows.append(fluid.simulation.heights.at(places))
    t, eta = np.array(time), np.array(rows)
    count, d = fluid.simulation.water.count, fluid.simulation.basin.spacing
    fluid.close()
    late = t > 5.0 * PERIOD
    # amplitudes of the waves toward and from the beach, by least squares over all gauges
    x = places[:, 0]
    omega = 2.0 * math.pi / PERIOD
    time, place = np.meshgrid(t[late], x, indexing="ij")
    columns = [
        function(k * place + sign * omega * time).ravel()
        for sign in (-1.0, 1.0)
        for function in (np.cos, np.sin)
    ]
    columns += [(place == at).ravel().astype(float) for at in x]
    fit = lsq_linear(np.stack(columns, axis=1), eta[late].ravel()).x
    coming, going = float(np.hypot(*fit[:2])), float(np.hypot(*fit[2:4]))
    lines = [
        relative("height of the incoming wave [m]", 2.0 * coming, HEIGHT, 0.10),
        Line("reflection", going / coming, 0.0, going / coming, 0.10),
    ]
    wave = eta[:, 4] - eta[late, 4].mean()
    chart = Chart(
        title="Waves of a piston, one length away", y_label="surface [m]", x_label="t [s]",
        series=(Series(name="simulated", x=t, y=wave),),
        note=f"wanted: {HEIGHT:g} m from trough to crest",
    )  # fmt: skip
    source = "linear wave-maker theory, H/S = 2 (cosh 2kh - 1) / (sinh 2kh + 2kh)"
    return Outcome(lines, [chart], count, d, length / d, source)


CASE = Case("flume", "Piston, waves and beach", run, quick=False)
