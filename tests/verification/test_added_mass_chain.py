"""A light base with two moving links and coupled added mass, against Lagrange's equations.

The reference writes kinetic energy, potential and drag in eight coordinates and differentiates them
by complex steps; it shares no code and no formulation with the simulator, which projects Newton and
Euler on the links.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from seals.effects import MediumKind
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.linear_drag import DragLinear

if TYPE_CHECKING:
    from tests.verification.conftest import Bench, Trajectory

G, RHO, DURATION = 9.81, 1000.0, 1.0
WATER = {"water_level": 0.0, "water_density": RHO}
LINKS = ("base", "upper", "fore")
SIZES = ((0.25, 0.2, 0.1), (0.04, 0.04, 0.2), (0.03, 0.03, 0.2))
LIFTS = ((0.0, 0.0, 0.02), (0.0, 0.0, -0.1), (0.0, 0.0, -0.1))
CENTRES = ((0.01, -0.01, -0.02), (0.0, 0.005, -0.1), (0.004, 0.0, -0.09))
ARMS = ((0.02, 0.01, -0.05), (0.0, 0.0, -0.21))
AXES = ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
DISPLACED = tuple(RHO * float(np.prod(size)) for size in SIZES)
MASSES = tuple(0.1 * d for d in DISPLACED)
INERTIAS = ((0.003, 0.004, 0.005), (1.5e-4, 1.5e-4, 2e-5), (1.0e-4, 1.0e-4, 1.5e-5))
SHARES = ((0.4, 0.6, 1.0), (0.9, 0.8, 0.2), (0.8, 0.9, 0.15))
DRAG = 4.0
START = np.array([0.0, 0.0, -50.0, 0.2, -0.1, 0.4, 0.3, -0.4])
RATES = np.array([0.4, 0.1, -0.2, 0.0, 0.0, 0.0, 1.0, -2.0])
FASTEST = 25.0
"""Fastest rate of the motion [1/s]: drag over inertia across the fore link, 4 / (0.02 + 0.15) = 24.

An error of order p is a share below (rate x step)^p of the way: with p = 2, 1e-2 at 4 ms and 6e-4
at 1 ms.
"""


def added_matrix(k: int) -> NDArray[np.float64]:
    """Return the added inertia of link k about its origin: an offset shape, and a coupling."""
    about = (
        0.06
        * DISPLACED[k]
        * np.array([SIZES[k][1] ** 2 + SIZES[k][2] ** 2] * 2 + [SIZES[k][0] ** 2])
    )
    x, y, z = LIFTS[k]
    shift = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    linear = np.diag(SHARES[k]) * DISPLACED[k]
    linear[0, 1] = linear[1, 0] = 0.1 * DISPLACED[k]
    return np.block(
        [[linear, -linear @ shift], [shift @ linear, np.diag(about) - shift @ linear @ shift]]
    )


def about(axis: int, angle: Any) -> Any:
    """Return rotations about a coordinate axis for angles (B,), complex angles allowed."""
    c, s, i, j = np.cos(angle), np.sin(angle), (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((*angle.shape, 3, 3), dtype=complex)
    turn[:, axis, axis], turn[:, i, i], turn[:, j, j] = 1.0, c, c
    turn[:, i, j], turn[:, j, i] = -s, s
    return turn


def links_at(q: Any) -> list[tuple[Any, Any, Any]]:
    """Return origin (B, 3), rotation (B, 3, 3) and twist Jacobian (B, 6, 8) of each link."""
    roll, pitch, yaw = q[:, 3], q[:, 4], q[:, 5]
    by_roll, by_pitch = about(0, roll), about(1, pitch)
    turn = about(2, yaw) @ by_pitch @ by_roll
    flip = np.swapaxes(turn, 1, 2)
    linear, spin = np.zeros((len(q), 3, 8), dtype=complex), np.zeros((len(q), 3, 8), dtype=complex)
    linear[:, :, :3] = flip
    spin[:, 0, 3] = 1.0
    spin[:, :, 4] = np.swapaxes(by_roll, 1, 2)[:, :, 1]
    spin[:, :, 5] = flip[:, :, 2]
    origin, out = q[:, :3], [(q[:, :3], turn, np.concatenate([linear, spin], axis=1))]
    for k, (arm, axis) in enumerate(zip(ARMS, AXES, strict=True)):
        lever, which = np.array(arm), int(np.argmax(axis))
        linear = linear + np.cross(np.swapaxes(spin, 1, 2), lever).swapaxes(1, 2)
        origin = origin + turn @ lever
        step = about(which, q[:, 6 + k])
        turn, back = turn @ step, np.swapaxes(step, 1, 2)
        linear, spin = back @ linear, back @ spin
        spin[:, which, 6 + k] += 1.0
        out.append((origin, turn, np.concatenate([linear, spin], axis=1)))
    return out


def energies(q: Any) -> tuple[Any, Any, Any]:
    """Return mass matrix (B, 8, 8), potential (B,) and damping matrix (B, 8, 8)."""
    mass, damping = 0.0, 0.0
    potential: Any = 0.0
    for k, (origin, turn, jacobian) in enumerate(links_at(q)):
        flip = np.swapaxes(jacobian, 1, 2)
        x, y, z = CENTRES[k]
        s = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        m = MASSES[k]
        mass = (
            mass
            + flip
            @ (
                np.block([[m * np.eye(3), -m * s], [m * s, np.diag(INERTIAS[k]) - m * s @ s]])
                + added_matrix(k)
            )
            @ jacobian
        )
        damping = damping + DRAG * flip[:, :, :3] @ jacobian[:, :3]
        weight = (origin + turn @ np.array(CENTRES[k]))[:, 2] * MASSES[k]
        lift = (origin + turn @ np.array(LIFTS[k]))[:, 2] * DISPLACED[k]
        potential = potential + G * (weight - lift)
    return mass, potential, damping


def acceleration(q: NDArray[np.float64], rate: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve Lagrange's equations M q'' = -M' q' + d(T - V)/dq - D q'."""
    tiny = 1e-30
    mass, potential, damping = energies(
        q[None] + 1j * tiny * np.vstack([np.zeros((1, 8)), np.eye(8)])
    )
    slopes, pull = mass[1:].imag / tiny, potential[1:].imag / tiny
    changing = np.einsum("kij,k,j->i", slopes, rate, rate)
    gain = 0.5 * np.einsum("kij,i,j->k", slopes, rate, rate)
    return np.asarray(
        np.linalg.solve(mass[0].real, gain - changing - pull - damping[0].real @ rate)
    )


@cache
def reference() -> NDArray[np.float64]:
    """Return the coordinates, rows 1 ms apart, shape (N, 8)."""

    def slope(_: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([y[8:], acceleration(y[:8], y[8:])])

    start = np.concatenate([START, RATES])
    times = np.linspace(0.0, DURATION, round(DURATION * 1000) + 1)
    found = solve_ivp(slope, (0.0, DURATION), start, t_eval=times, rtol=1e-9, atol=1e-11)
    return np.asarray(found.y.T[:, :8])


def run(bench: Bench, engine: str, step: float) -> Trajectory:
    """Run the same robot in an engine."""
    names = ("mass_x", "mass_y", "mass_z", "inertia_x", "inertia_y", "inertia_z")
    effects: dict[str, Any] = {"buoyancy": Buoyancy()}
    for k, link in enumerate(LINKS):
        matrix = added_matrix(k)
        diagonal = dict(zip(names, np.diag(matrix).tolist(), strict=True))
        coupling = (matrix - np.diag(np.diag(matrix))).tolist()
        effects[f"added_{link}"] = AddedMass(**diagonal, coupling=coupling, links=[link])
    effects["drag"] = DragLinear(
        coefficient_x=DRAG,
        coefficient_y=DRAG,
        coefficient_z=DRAG,
        medium=MediumKind.water,
        links=["*"],
    )
    parts = [
        bench.link(n, m, i, centre=c)
        for n, m, i, c in zip(LINKS, MASSES, INERTIAS, CENTRES, strict=True)
    ]
    for k in range(2):
        arm, axis = (" ".join(map(str, v[k])) for v in (ARMS, AXES))
        parts.append(
            f'<joint name="j{k}" type="continuous"><parent link="{LINKS[k]}"/>'
            f'<child link="{LINKS[k + 1]}"/><origin xyz="{arm}"/><axis xyz="{axis}"/></joint>'
        )
    hulls = {link: [("box", SIZES[k], LIFTS[k])] for k, link in enumerate(LINKS)}
    settings = bench.settings(
        bench.robot(*parts, hulls=hulls),
        effects,
        step=step,
        duration=DURATION,
        environment=WATER,
        position=START[:3],
        rpy=START[3:6],
        velocity=RATES[:3],
        joint_position=START[6:],
        joint_velocity=RATES[6:],
    )
    return bench.run(engine, settings)


def error(found: Trajectory) -> NDArray[np.float64]:
    """Return the largest errors of position, attitude, joints, as shares of what each moved."""
    truth = reference()[:: round(found.time[1] * 1000)]
    turns = links_at(truth)[0][1].real
    steps = np.einsum("nij,nik->njk", turns[:-1], turns[1:])
    turned = np.arccos(np.clip(0.5 * (np.trace(steps, axis1=1, axis2=2) - 1.0), -1.0, 1.0)).sum()
    way = np.linalg.norm(np.diff(truth[:, :3], axis=0), axis=1).sum()
    travel = np.abs(np.diff(truth[:, 6:], axis=0)).sum()
    off = np.linalg.norm(found.rotation - turns, axis=(1, 2)).max() / np.sqrt(2.0)
    position = np.linalg.norm(found.position - truth[:, :3], axis=1).max()
    return np.array(
        [position / way, off / turned, np.abs(found.joints - truth[:, 6:]).max() / travel]
    )


def test_the_case_is_hard() -> None:
    """Every link is a tenth as heavy as its water, with a positive definite added inertia."""
    for k in range(3):
        assert MASSES[k] == 0.1 * DISPLACED[k]
        assert np.linalg.eigvalsh(added_matrix(k))[0] > 0.0


def test_twin_against_lagrange(bench: Bench) -> None:
    """The twin converges to Lagrange's equations at fourth order."""
    coarse, fine = (error(run(bench, "twin", h)) for h in (0.008, 0.004))
    print(f"twin 4 ms: position {fine[0]:.1e}, attitude {fine[1]:.1e}, joints {fine[2]:.1e}")
    assert fine.max() < (FASTEST * 0.004) ** 4
    assert (coarse / fine > 12.0).all()


def test_world_against_lagrange(bench: Bench) -> None:
    """PyBullet is stable with light links at 1 and 4 ms and converges to Lagrange's equations."""
    coarse, fine = (error(run(bench, "world", h)) for h in (0.004, 0.001))
    print(f"world 4 ms: position {coarse[0]:.1e}, attitude {coarse[1]:.1e}, joints {coarse[2]:.1e}")
    print(f"world 1 ms: position {fine[0]:.1e}, attitude {fine[1]:.1e}, joints {fine[2]:.1e}")
    assert coarse.max() < (FASTEST * 0.004) ** 2
    assert fine.max() < (FASTEST * 0.001) ** 2
    assert (coarse / fine > 12.0).all()
