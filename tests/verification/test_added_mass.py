"""A light body in heavy water, against an integrator that shares nothing with the simulator."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from seals.effects import MediumKind
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.angular_drag import DragAngular
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.linear_drag import DragLinear

if TYPE_CHECKING:
    from tests.verification.conftest import Bench, Trajectory

G, RHO = 9.81, 1000.0
WATER = {"water_level": 0.0, "water_density": RHO}
SIZE = (0.3, 0.2, 0.15)
DISPLACED = RHO * SIZE[0] * SIZE[1] * SIZE[2]
MASS = 0.1 * DISPLACED
CENTRE = np.array([0.01, -0.02, -0.03])
LIFT_AT = np.array([0.0, 0.01, 0.02])
INERTIA = np.array([[0.004, 0.0005, -0.0003], [0.0005, 0.006, 0.0002], [-0.0003, 0.0002, 0.005]])
LINEAR, ANGULAR = np.array([12.0, 20.0, 30.0]), np.array([0.15, 0.2, 0.25])
SPEED, SPIN, TURN = (
    np.array([0.6, -0.3, 0.2]),
    np.array([1.0, -1.5, 2.0]),
    np.array([0.3, -0.2, 0.5]),
)
DURATION = 2.0
FASTEST = 20.0
"""Fastest rate of the motion [1/s].

Drag over inertia 7, spin 7, Munk moment v sqrt(dA / I) = 2.6 sqrt(2.7 / 0.05) = 19. An error of
order p is a share below (rate x step)^p of the way: with p = 2, 6e-3 at 4 ms and 4e-4 at 1 ms.
"""


def added_matrix() -> NDArray[np.float64]:
    """Return a positive definite matrix with couplings, several times the body's own inertia."""
    table = np.diag([0.4 * DISPLACED, 0.7 * DISPLACED, 1.0 * DISPLACED, 0.04, 0.06, 0.05])
    for i, j, value in (
        (0, 1, 0.6),
        (0, 4, 0.15),
        (1, 3, -0.2),
        (1, 5, 0.18),
        (2, 4, -0.1),
        (3, 5, 0.006),
    ):
        table[i, j] = table[j, i] = value
    return table


def skew(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix of the cross product with v."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def rotation_of(rpy: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Rz(yaw) Ry(pitch) Rx(roll)."""
    (a, b, c), (x, y, z) = np.cos(rpy), np.sin(rpy)
    about_x = np.array([[1, 0, 0], [0, a, -x], [0, x, a]])
    about_y = np.array([[b, 0, y], [0, 1, 0], [-y, 0, b]])
    about_z = np.array([[c, -z, 0], [z, c, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


@cache
def reference() -> NDArray[np.float64]:
    """Integrate the momenta of body and water over ground, which no Coriolis term enters.

    P' = F, H' = T about the fixed world origin; moved to the body origin and turned into body axes,
    (P, H) is (M + A) (v, w). Rows are 1 ms apart: position and rotation, shape (N, 12).
    """
    s = skew(CENTRE)
    own = np.block([[MASS * np.eye(3), -MASS * s], [MASS * s, INERTIA - MASS * s @ s]])
    inverse = np.linalg.inv(own + added_matrix())

    def twist(x: Any, r: Any, p: Any, h: Any) -> Any:
        return inverse @ np.concatenate([r.T @ p, r.T @ (h - np.cross(x, p))])

    def slope(_: float, y: Any) -> Any:
        x, r, p, h = y[:3], y[3:12].reshape(3, 3), y[12:15], y[15:18]
        nu = twist(x, r, p, h)
        weight, lift = np.array([0, 0, -MASS * G]), np.array([0, 0, DISPLACED * G])
        drag, turn = r @ (-LINEAR * nu[:3]), r @ (-ANGULAR * nu[3:])
        torque = (
            np.cross(x + r @ CENTRE, weight)
            + np.cross(x + r @ LIFT_AT, lift)
            + np.cross(x, drag)
            + turn
        )
        return np.concatenate(
            [r @ nu[:3], (r @ skew(nu[3:])).ravel(), weight + lift + drag, torque]
        )

    x, r = np.array([0.0, 0.0, -50.0]), rotation_of(TURN)
    both = np.linalg.inv(inverse) @ np.concatenate([r.T @ SPEED, SPIN])
    p = r @ both[:3]
    start = np.concatenate([x, r.ravel(), p, r @ both[3:] + np.cross(x, p)])
    times = np.linspace(0.0, DURATION, round(DURATION * 1000) + 1)
    found = solve_ivp(slope, (0.0, DURATION), start, t_eval=times, rtol=1e-9, atol=1e-11)
    return np.asarray(found.y.T[:, :12])


def run(bench: Bench, engine: str, step: float) -> Trajectory:
    """Run the same body in an engine."""
    matrix = added_matrix()
    names = ("mass_x", "mass_y", "mass_z", "inertia_x", "inertia_y", "inertia_z")
    diagonal = dict(zip(names, np.diag(matrix).tolist(), strict=True))
    added = AddedMass(**diagonal, coupling=(matrix - np.diag(np.diag(matrix))).tolist())
    axes = ("coefficient_x", "coefficient_y", "coefficient_z")
    drag = DragLinear(**dict(zip(axes, LINEAR.tolist(), strict=True)), medium=MediumKind.water)
    turn = DragAngular(**dict(zip(axes, ANGULAR.tolist(), strict=True)))
    robot = bench.body(MASS, INERTIA, centre=CENTRE, hull="box", size=SIZE, at=LIFT_AT)
    settings = bench.settings(
        robot,
        {"buoyancy": Buoyancy(), "added": added, "drag": drag, "turn": turn},
        step=step,
        duration=DURATION,
        environment=WATER,
        position=[0, 0, -50],
        rpy=TURN,
        velocity=SPEED,
        angular_velocity=SPIN,
    )
    return bench.run(engine, settings)


def error(found: Trajectory) -> tuple[float, float]:
    """Return the largest errors of position and attitude, as shares of path and rotation."""
    truth = reference()[:: round(found.time[1] * 1000)]
    way = np.linalg.norm(np.diff(truth[:, :3], axis=0), axis=1).sum()
    turns = truth[:, 3:].reshape(-1, 3, 3)
    step = np.einsum("nij,nik->njk", turns[:-1], turns[1:])
    turned = np.arccos(np.clip(0.5 * (np.trace(step, axis1=1, axis2=2) - 1.0), -1.0, 1.0)).sum()
    off = np.linalg.norm(found.rotation - turns, axis=(1, 2)).max() / np.sqrt(2.0)
    return float(np.linalg.norm(found.position - truth[:, :3], axis=1).max() / way), float(
        off / turned
    )


def test_the_case_is_hard() -> None:
    """The matrix is positive definite, coupled, and several times the body's own mass."""
    matrix = added_matrix()
    assert np.linalg.eigvalsh(matrix)[0] > 0.0
    assert np.linalg.eigvalsh(matrix[:3, :3])[0] > 3.0 * MASS


def test_twin_against_the_reference(bench: Bench) -> None:
    """The twin converges to the independent integrator at fourth order."""
    coarse, fine = (np.array(error(run(bench, "twin", h))) for h in (0.008, 0.004))
    print(f"twin 4 ms: position {fine[0]:.1e}, attitude {fine[1]:.1e}")
    assert fine.max() < (FASTEST * 0.004) ** 4
    assert (coarse / fine > 12.0).all()


def test_world_against_the_reference(bench: Bench) -> None:
    """PyBullet is stable at 1 and 4 ms and converges to the reference at second order."""
    coarse, fine = (np.array(error(run(bench, "world", h))) for h in (0.004, 0.001))
    print(f"world 4 ms: position {coarse[0]:.1e}, attitude {coarse[1]:.1e}")
    print(f"world 1 ms: position {fine[0]:.1e}, attitude {fine[1]:.1e}")
    assert coarse.max() < (FASTEST * 0.004) ** 2
    assert fine.max() < (FASTEST * 0.001) ** 2
    assert (coarse / fine > 12.0).all()
