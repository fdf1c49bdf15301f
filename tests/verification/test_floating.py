"""Bodies afloat: Archimedes at rest, heave and roll about the rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from seals.check.floating import FloatingBody
from seals.effects import MediumKind
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.angular_drag import DragAngular
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.linear_drag import DragLinear
from seals.robot.build import build_robot

if TYPE_CHECKING:
    from tests.verification.conftest import Bench, Trajectory

Floats = NDArray[np.float64]
G, RHO = 9.81, 1000.0
STEPS = {"world": 0.004, "twin": 0.016}
ORDER = {"world": 2, "twin": 4}
WATER = {"water_level": 0.0, "water_density": RHO}
HULLS = {
    "sphere": ([0.1], 4.0 / 3.0 * np.pi * 0.1**3, np.pi * 0.1**2, 0.1),
    "box": ([0.3, 0.2, 0.1], 0.3 * 0.2 * 0.1, 0.3 * 0.2, 0.05),
    "cylinder": ([0.15, 0.1], np.pi * 0.15**2 * 0.1, np.pi * 0.15**2, 0.05),
}
"""Size [m], volume [m^3], waterplane at the middle [m^2], half height [m]; stable when upright."""


def draught_of(shape: str, ratio: float) -> float:
    """Return the draught at which the displaced mass equals that of the body [m]."""
    size, volume, _, half = HULLS[shape]
    if shape != "sphere":
        return 2.0 * half * ratio
    r = size[0]
    # spherical cap: pi d^2 (3 r - d) / 3 = ratio V
    return float(
        brentq(lambda d: np.pi * d * d * (3 * r - d) / 3 - ratio * volume, 0, 2 * r, xtol=1e-15)
    )


def settle(bench: Bench, engine: str, shape: str, ratio: float) -> Trajectory:
    """Let a body come to rest under strong drag, from above its draught and slightly tilted."""
    size, volume, plane, half = HULLS[shape]
    mass = ratio * RHO * volume
    damping = 1.4 * np.sqrt(RHO * G * plane * mass)
    drag = DragLinear(
        coefficient_x=damping, coefficient_y=damping, coefficient_z=damping, medium=MediumKind.water
    )
    spin = 1.4 * mass * np.sqrt(G * half) * half
    turn = DragAngular(coefficient_x=spin, coefficient_y=spin, coefficient_z=spin)
    moments = mass * half * half * np.array([1.0, 1.2, 1.4])
    settings = bench.settings(
        bench.body(mass, moments, hull=shape, size=size),
        {"buoyancy": Buoyancy(), "drag": drag, "turn": turn},
        step=0.004,
        duration=6.0,
        environment=WATER,
        position=[0, 0, half * 0.9],
        rpy=[0.05, -0.03, 0.4],
    )
    return bench.run(engine, settings)


@pytest.mark.parametrize("ratio", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("shape", list(HULLS))
def test_archimedes_at_rest(bench: Bench, shape: str, ratio: float) -> None:
    """A body settles at the draught whose displaced mass is its own."""
    run = settle(bench, "world", shape, ratio)
    half = HULLS[shape][3]
    # at rest only the decaying remainder of the motion is left: strongly damped, it is at most
    # speed x (c / k)
    left = abs(run.velocity[-1, 2]) * 1.4 * np.sqrt(ratio * 2 * half / G)
    expected = draught_of(shape, ratio)
    draught = half - run.position[-1, 2]
    print(
        f"{shape} {ratio}: draught {draught:.6f} m, closed form {expected:.6f} m, left {left:.1e} m"
    )
    assert left < 1e-5 * expected
    assert draught == pytest.approx(expected, rel=1e-5)
    if shape != "sphere":
        assert run.rotation[-1, 2, 2] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.thorough
@pytest.mark.parametrize("shape", list(HULLS))
def test_archimedes_at_rest_in_the_twin(bench: Bench, shape: str) -> None:
    """The twin's hulls, good to 0.1 % of the volume, give the draught to 0.1 % of the height."""
    run = settle(bench, "twin", shape, 0.5)
    half = HULLS[shape][3]
    # dz = dV / S with dV < 0.001 V, and V / S is at most the height at half draught
    assert half - run.position[-1, 2] == pytest.approx(
        draught_of(shape, 0.5), abs=0.001 * 2.0 * half
    )


def period_of(time: Floats, signal: Floats) -> float:
    """Return the mean period from the upward zero crossings, found by straight lines [s].

    A sine has no curvature at its zeros, so the lines are in error by the third order of the step.
    """
    k = np.flatnonzero((signal[:-1] < 0.0) & (signal[1:] >= 0.0))
    crossing = time[k] - signal[k] * (time[k + 1] - time[k]) / (signal[k + 1] - signal[k])
    return float(np.diff(crossing).mean())


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ["world", "twin"])
@pytest.mark.parametrize("added", [0.0, 5.0])
def test_heave_period(bench: Bench, engine: str, added: float) -> None:
    """A cylinder bobs with T = 2 pi sqrt((m + A) / (rho g S)), A that of the wetted part."""
    radius, height, ratio, amplitude, step = 0.1, 0.3, 0.5, 0.0005, STEPS[engine]
    plane = np.pi * radius**2
    mass = ratio * RHO * plane * height
    effects = {"buoyancy": Buoyancy(), "added": AddedMass(mass_x=added, mass_y=added, mass_z=added)}
    rest = height * (0.5 - ratio)
    settings = bench.settings(
        bench.body(mass, (0.05, 0.05, 0.02), hull="cylinder", size=[radius, height]),
        effects,
        step=step,
        duration=5.0,
        environment=WATER,
        position=[0, 0, rest + amplitude],
    )
    run = bench.run(engine, settings)
    omega = np.sqrt(RHO * G * plane / (mass + ratio * added))
    period = period_of(run.time, run.position[:, 2] - rest)
    # a scheme of order p shifts the period by less than (omega h)^p, by (omega h)^2 / 24 in the
    # world; added mass grows with the wetted part, which changes by amplitude / height and acts at
    # second order; together far below the 1 % asked for
    bound = (omega * step) ** ORDER[engine] + (amplitude / height if added else 0.0)
    print(
        f"heave {engine}, A = {added} kg: T = {period:.6f} s, closed form {2 * np.pi / omega:.6f} s"
    )
    assert period == pytest.approx(2.0 * np.pi / omega, rel=bound)


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ["world", "twin"])
@pytest.mark.parametrize("added", [0.0, 0.02])
def test_roll_period(bench: Bench, engine: str, added: float) -> None:
    """A box rolls with T = 2 pi sqrt((I + A) / (m g GM)), GM = KB + BM - KG."""
    length, breadth, height, ratio, angle, step = 0.3, 0.2, 0.1, 0.5, 0.01, STEPS[engine]
    mass = ratio * RHO * length * breadth * height
    moment = 0.012
    effects = {
        "buoyancy": Buoyancy(),
        "added": AddedMass(inertia_x=added, inertia_y=added, inertia_z=added),
    }
    settings = bench.settings(
        bench.body(mass, (moment, 0.03, 0.035), hull="box", size=[length, breadth, height]),
        effects,
        step=step,
        duration=5.0,
        environment=WATER,
        position=[0, 0, height * (0.5 - ratio)],
        rpy=[angle, 0, 0],
    )
    run = bench.run(engine, settings)
    roll = np.arctan2(run.rotation[:, 2, 1], run.rotation[:, 2, 2])
    # KB = d / 2, BM = I_waterplane / V = b^2 / (12 d), KG = h / 2, d the draught
    draught = ratio * height
    metacentric = draught / 2 + breadth**2 / (12 * draught) - height / 2
    omega = np.sqrt(mass * G * metacentric / (moment + ratio * added))
    period = period_of(run.time, roll)
    # wall-sided formula: GZ = sin(phi) (GM + BM tan^2(phi) / 2), a shift of the order of angle^2;
    # the twin's table is good to 0.1 % of the volume's moments
    bound = (omega * step) ** ORDER[engine] + angle**2 + (1e-3 if engine == "twin" else 0.0)
    print(
        f"roll {engine}, A = {added} kg m2: T = {period:.6f} s, closed form {2 * np.pi / omega:.6f}"
    )
    assert period == pytest.approx(2.0 * np.pi / omega, rel=bound)


@pytest.mark.parametrize(("breadth", "draught"), [(0.6, 0.12), (0.4, 0.05), (0.3, 0.2)])
def test_metacentric_height_of_a_box_barge(bench: Bench, breadth: float, draught: float) -> None:
    """Inclined by 0.2 degrees, moment / (weight angle) = GM = BM - BG within 1 % of the barge's BM.

    BM = I / V = b^2 / (12 d), BG = h / 2 - d / 2: the second moment of the waterplane by the
    displaced volume, and the height of the centre of gravity over that of buoyancy.
    """
    length, height, angle = 1.2, 0.25, np.radians(0.2)
    mass = RHO * length * breadth * draught
    body = bench.body(mass, (1.0, 4.0, 5.0), hull="box", size=[length, breadth, height])
    settings = bench.settings(
        body,
        {"buoyancy": Buoyancy()},
        step=0.001,
        duration=0.002,
        environment=WATER,
        position=[0, 0, 0.5 * height - draught],
        rpy=[angle, 0, 0],
    )
    run = bench.run("world", settings)
    # I p' = -m g GM angle from rest; in the first steps the angle is that of the start
    moment = -1.0 * run.angular_velocity[2, 0] / 0.002
    found = moment / (mass * G * angle)
    radius, above = breadth**2 / (12.0 * draught), 0.5 * (height - draught)
    print(f"GM {found:.5f} m, BM - BG {radius - above:.5f} m")
    assert found == pytest.approx(radius - above, abs=0.01 * abs(radius - above))
    checked = FloatingBody(build_robot(body)).metacentric_height((1.0, 0.0, 0.0), mass / RHO)
    assert checked == pytest.approx(radius - above, rel=1e-3)
