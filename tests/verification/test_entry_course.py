"""Course of the added mass of an entering hull against potential flow and closed forms."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ellipe, ellipkm1

from seals.experiments.water_validation.slam import fitted
from seals.hydrostatics import HullBox, HullCapsule, HullCompound, HullCylinder, HullSphere
from seals.hydrostatics.entry import COURSE, course, entry_shares
from seals.plugins.effects.added_mass import AddedMass

if TYPE_CHECKING:
    from tests.verification.conftest import Bench, Trajectory

Floats = NDArray[np.float64]
RHO, RADIUS, MASS = 1000.0, 0.1, 40.0
WHOLE = 2.0 / 3.0 * np.pi * RHO * RADIUS**3
WATER = {"water_level": 0.0, "water_density": RHO, "gravity": 0.0}
GAUSS = np.polynomial.legendre.leggauss(8)


def ring(r: float, z: float, a: Floats, c: Floats) -> tuple[Floats, Floats, Floats]:
    """Potential and its gradient at (r, z) by rings of unit sources of radius a at the height c."""
    far, near = (r + a) ** 2 + (z - c) ** 2, (r - a) ** 2 + (z - c) ** 2
    k, e, q = ellipkm1(near / far), ellipe(1.0 - near / far), np.sqrt(far)
    along = -a * (z - c) * e / (np.pi * q * near)
    out = -a / (2.0 * np.pi * r * q) * (k - (a * a - r * r + (z - c) ** 2) / near * e)
    return a * k / (np.pi * q), out, along


def lens(depth: float, panels: int) -> float:
    """Half the added mass of two mirrored caps of a unit sphere along their axis, rho = 1."""
    edge = np.arccos(1.0 - depth) * (1.0 - 0.5 * (1.0 - np.cos(np.linspace(0, np.pi, panels + 1))))
    below = np.stack((np.sin(edge), 1.0 - depth - np.cos(edge)), 1)
    line = np.concatenate((below[::-1][:-1] * (1.0, -1.0), below))
    middle, side = 0.5 * (line[1:] + line[:-1]), np.diff(line, axis=0)
    length = np.hypot(*side.T)
    normal = np.stack((-side[:, 1], side[:, 0]), 1) / length[:, None]
    x, w = GAUSS
    ends = np.concatenate(([0.0], 0.5 * 2.0 ** -np.arange(12.0, -1.0, -1.0)))
    pairs = list(itertools.pairwise(ends))
    fine = np.concatenate([0.5 * (p + q) + 0.5 * (q - p) * x for p, q in pairs])
    weights = np.concatenate([0.5 * (q - p) * w for p, q in pairs])
    flow, push = np.empty((2, len(middle), len(middle)))
    for i, (m, n) in enumerate(zip(middle, normal, strict=True)):
        places = middle[:, None] + 0.5 * side[:, None] * x[:, None]
        share = 0.5 * w * length[:, None]
        own = m + np.concatenate((fine, -fine))[:, None] * side[i]
        places, at = places.reshape(-1, 2), np.repeat(np.arange(len(middle)), len(x)) == i
        phi, out, along = ring(*m, *places[~at].T)
        others = np.arange(len(middle)) != i
        flow[i, others] = ((out * n[0] + along * n[1]).reshape(-1, len(x)) * share[others]).sum(1)
        push[i, others] = (phi.reshape(-1, len(x)) * share[others]).sum(1)
        phi, out, along = ring(*m, *own.T)
        both = np.concatenate((weights, weights)) * length[i]
        # the jump of a layer's normal flow is one half on either side
        flow[i, i], push[i, i] = (out * n[0] + along * n[1]) @ both - 0.5, phi @ both
    potential = push @ np.linalg.solve(flow, normal[:, 1])
    return -0.5 * float(potential @ (normal[:, 1] * 2.0 * np.pi * middle[:, 0] * length))


def test_rings_know_the_half_sphere() -> None:
    """The panels' added mass of a half sphere tends to pi / 3, with half the error at twice."""
    errors = [lens(1.0, n) / (np.pi / 3.0) - 1.0 for n in (40, 80)]
    assert abs(errors[1]) < 0.6 * abs(errors[0]) < 0.01


@pytest.mark.parametrize("b", [0.05, 0.1, 0.3, 0.5, 0.8])
def test_course_is_that_of_the_risen_lens(b: float) -> None:
    """The series is the added mass of the lens at b (3 - b) / 2, from Wagner's limit on."""
    coarse, fine = (lens(b * (3.0 - b) / 2.0, n) for n in (60, 120))
    expected = (2.0 * fine - coarse) / (np.pi / 3.0)
    root = (b * b * (3.0 - b) / 2.0) ** 0.25
    found = sum(c * root ** (3 + k) for k, c in enumerate(COURSE))
    assert found == pytest.approx(expected, rel=2e-3)
    assert COURSE[0] == pytest.approx(4.0 / np.pi * 3.0**1.5 * (2.0 / 3.0) ** 0.75, abs=1e-4)
    assert sum(COURSE) == pytest.approx(1.0, abs=1e-12)
    # the softened onset takes away most of the beginning, and little from 0.3 radii on
    softened = float(course(np.array(root**4))[0]) / expected
    assert (0.98 if b >= 0.3 else 0.7) < softened < 1.005


def test_slope_of_the_course_is_its_derivative() -> None:
    """The slope is the central difference, and nothing from the widest waterline on."""
    x, d = np.array([1e-5, 1e-3, 0.02, 0.3, 0.98]), 1e-7
    np.testing.assert_allclose(
        course(x)[1], (course(x + d)[0] - course(x - d)[0]) / (2.0 * d), rtol=1e-6
    )
    assert course(np.array([1.0, 2.0]))[1].tolist() == [0.0, 0.0]


def entering(bench: Bench, step: float) -> Trajectory:
    """Return the entry of a sphere of 40 kg at 4 m/s under its added mass alone."""
    effects = {"added": AddedMass(mass_x=WHOLE, mass_y=WHOLE, mass_z=WHOLE)}
    settings = bench.settings(
        bench.body(MASS, (0.1,) * 3, size=[RADIUS]),
        effects,
        step=step,
        duration=0.06,
        environment=WATER,
        position=[0, 0, 1.001 * RADIUS],
        velocity=[0, 0, -4.0],
    )
    return bench.run("world", settings)


def test_sphere_takes_up_the_momentum_of_theory(bench: Bench) -> None:
    """Slam coefficients at 0.05, 0.1 and 0.3 radii, and the impulse at one, are within 15 %."""
    run = entering(bench, 1e-4)
    depth, speed = 1.0 - run.position[:, 2] / RADIUS, -run.velocity[:, 2]
    # (m + M) v = m v0
    taken = MASS * (4.0 / speed - 1.0) / (RHO * RADIUS**3)
    # C_s = 2 (dM/db) / (pi rho R^3), by differences over 0.02 radii
    for b, expected in ((0.05, 0.973), (0.1, 1.186), (0.3, 1.055)):
        series = 2.0 / np.pi * float(fitted(b + 0.01) - fitted(b - 0.01)) / 0.02
        assert series == pytest.approx(expected, rel=0.01)  # Miloh 1991
        ends = np.interp([b - 0.01, b + 0.01], depth, taken)
        found = 2.0 / np.pi * float(ends[1] - ends[0]) / 0.02
        print(f"C_s at {b:g} R: {found:.3f}, Miloh {series:.3f}")
        assert found == pytest.approx(series, rel=0.15)
    for b in (0.1, 0.3, 0.5):
        found = float(np.interp(b, depth, taken))
        print(f"impulse at {b:g} R: {found:.3f} rho R^3 V, Miloh {float(fitted(b)):.3f}")
        assert found == pytest.approx(float(fitted(b)), rel=0.05)
    found = float(np.interp(1.0, depth, taken))
    print(f"impulse at R: {found:.4f} rho R^3 V, half of a sphere's added mass {np.pi / 3:.4f}")
    assert found == pytest.approx(np.pi / 3.0, rel=0.01)


@pytest.mark.parametrize("engine", ["world", "twin"])
def test_water_does_not_turn_a_sphere(bench: Bench, engine: str) -> None:
    """A ball that enters aslant keeps its way and gets no spin: all pressure is through its middle.

    What it turns already it goes on turning, and loses nothing by the water that follows.
    """
    effects = {"added": AddedMass(mass_x=WHOLE, mass_y=WHOLE, mass_z=WHOLE)}
    for spin in ([0.0, 0.0, 0.0], [3.0, -2.0, 5.0]):
        settings = bench.settings(
            bench.body(MASS, (0.1,) * 3, size=[RADIUS]),
            effects,
            step=5e-4,
            duration=0.1,
            environment=WATER,
            position=[0, 0, 1.001 * RADIUS],
            velocity=[2.0, -1.0, -3.0],
            angular_velocity=spin,
        )
        run = bench.run(engine, settings)
        np.testing.assert_allclose(run.angular_velocity[-1], spin, atol=1e-9)
        assert run.velocity[-1, 2] > -2.99


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ["world", "twin"])
@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_flat_face_takes_up_the_same_momentum(bench: Bench, engine: str, turn: float) -> None:
    """A box slows to m v0 / (m + A), flat or on its edge, and no faster than that."""
    mass, added, speed, step = 6.0, 4.0, 2.0, 0.001
    effects = {"added": AddedMass(mass_x=added, mass_y=added, mass_z=added)}
    settings = bench.settings(
        bench.body(mass, (0.05,) * 3, hull="box", size=[0.3, 0.2, 0.1]),
        effects,
        step=step,
        duration=0.35,
        environment=WATER,
        position=[0, 0, 0.2],
        velocity=[0, 0, -speed],
        rpy=[0.0, turn, 0.0],
    )
    run = bench.run(engine, settings)
    kept = run.velocity[-1, 2] / (-mass * speed / (mass + added))
    print(f"{engine}, pitched {turn:g} rad: {kept:.5f} of the speed that momentum leaves")
    # the force begins at once: half a step of the largest, (A / 2) v over 15 mm, the depth 0.293 r
    assert kept == pytest.approx(1.0, abs=added / 2.0 / mass * speed * step / 0.015)
    assert run.velocity[-1, 2] < 0.0


@pytest.mark.parametrize("position", [(0.0, 0.0, 0.0), (0.2, -0.1, 0.7)])
def test_spheres_enter_as_spheres(position: tuple[float, float, float]) -> None:
    """A sphere anywhere in its link is at its widest when half of it is submerged."""
    shares = entry_shares(HullSphere(radius=0.07, position=position))
    np.testing.assert_allclose(shares, 0.5, rtol=2e-3)
    pair = [HullSphere(radius=0.07, position=(x, 0.0, 0.0)) for x in (-0.2, 0.2)]
    np.testing.assert_allclose(entry_shares(HullCompound(parts=pair))[[2, 5]], 0.5, rtol=2e-3)


def test_shares_of_other_hulls() -> None:
    """A round nose is widest early, a lying cylinder as in closed form, a flat face is softened."""
    capsule = HullCapsule(radius=0.05, length=0.4)
    nose = 2.0 / 3.0 * np.pi * 0.05**3
    assert entry_shares(capsule)[2] == pytest.approx(nose / capsule.volume, rel=2e-3)
    # half of the width of a circle is reached at the depth 1 - 3^(1/2) / 2 = 0.134, less than that
    # of a sphere, 0.293: the segment there
    low = 1.0 - np.sqrt(0.5)
    angle = np.arccos(1.0 - low)
    segment = (angle - np.sin(angle) * np.cos(angle)) / np.pi
    sphere = low * low * (3.0 - low) / 4.0
    lying = entry_shares(HullCylinder(radius=0.05, length=0.4))[0]
    assert lying == pytest.approx(0.5 * segment / sphere, rel=5e-3)
    flat = entry_shares(HullBox(size=(0.3, 0.2, 0.1)))[2]
    assert flat == pytest.approx(0.5 * (low * 0.05 / 0.1) / sphere, rel=2e-3)
