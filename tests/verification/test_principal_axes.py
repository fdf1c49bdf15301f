"""A body whose principal axes and centre of mass lie off its link frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from seals.effects import MediumKind
from seals.plugins.effects.angular_drag import DragAngular
from seals.plugins.effects.linear_drag import DragLinear

if TYPE_CHECKING:
    from seals.run.settings import RunSettings
    from tests.verification.conftest import Bench

CENTRE = np.array([0.05, -0.08, 0.03])
INERTIA = np.array([[0.02, 0.006, -0.003], [0.006, 0.035, 0.004], [-0.003, 0.004, 0.03]])
START: dict[str, Any] = {
    "position": [1.0, 2.0, 3.0],
    "rpy": [0.4, -0.3, 1.2],
    "velocity": [1.0, -0.5, 2.0],
    "angular_velocity": [3.0, -2.0, 4.0],
}
SPIN = float(np.linalg.norm(START["angular_velocity"]))


def settings_of(bench: Bench, step: float, *, drag: bool) -> RunSettings:
    """Return the settings of the thrown, turning body."""
    effects = {
        "drag": DragLinear(
            coefficient_x=0.2, coefficient_y=0.4, coefficient_z=0.6, medium=MediumKind.air
        ),
        "turn": DragAngular(
            coefficient_x=0.002, coefficient_y=0.004, coefficient_z=0.003, medium=MediumKind.air
        ),
    }
    robot = bench.body(0.8, INERTIA, centre=CENTRE)
    return bench.settings(robot, effects if drag else {}, step=step, duration=2.0, **START)


def test_the_centre_of_mass_flies_a_parabola(bench: Bench) -> None:
    """The centre of mass, not the link origin, falls freely; angular momentum is kept."""
    for engine, step, order in (("world", 0.004, 2), ("twin", 0.004, 4)):
        run = bench.run(engine, settings_of(bench, step, drag=False))
        centre = run.position + run.rotation @ CENTRE
        speed = run.velocity[0] + np.cross(run.angular_velocity[0], run.rotation[0] @ CENTRE)
        t = run.time[:, None]
        expected = centre[0] + speed * t - 0.5 * 9.81 * t * t * np.array([0.0, 0.0, 1.0])
        # the engine integrates the centre of mass itself: rounding; the twin integrates the link
        # origin, whose way about the centre it follows to (spin x step)^4 of the arm each radian
        arm = float(np.linalg.norm(CENTRE))
        bound = 1e-10 if engine == "world" else (SPIN * step) ** 4 * arm * SPIN * 2.0
        assert np.abs(centre - expected).max() < bound
        inertia = run.rotation @ INERTIA @ np.swapaxes(run.rotation, 1, 2)
        momentum = np.einsum("nij,nj->ni", inertia, run.angular_velocity)
        drift = np.linalg.norm(momentum - momentum[0], axis=1).max() / np.linalg.norm(momentum[0])
        assert drift < (SPIN * step) ** order * SPIN * 2.0


def test_both_engines_write_the_same_log(bench: Bench) -> None:
    """Pose and twist of the link frame agree between PyBullet and the twin to second order."""
    truth = bench.run("twin", settings_of(bench, 0.002, drag=True))
    gaps = []
    for step in (0.004, 0.002):
        run = bench.run("world", settings_of(bench, step, drag=True))
        every = round(step / 0.002)
        pairs = zip(run[1:5], truth[1:5], strict=True)
        gaps.append([float(np.abs(a - b[::every]).max()) for a, b in pairs])
    print("position, rotation, velocity, spin off by", gaps[0], "at 4 ms and", gaps[1], "at 2 ms")
    # an error of attitude of (spin x step)^2 each radian, over 2 s; positions by the arm,
    # velocities by spin times arm
    turned = (SPIN * 0.004) ** 2 * SPIN * 2.0
    arm = float(np.linalg.norm(CENTRE))
    bounds = np.array([turned * arm + turned, turned, turned * (1.0 + SPIN * arm), turned * SPIN])
    assert (np.array(gaps[0]) < bounds).all()
    # half the step: four times less; 3 leaves room for the next order
    assert (np.array(gaps[0]) / np.array(gaps[1]) > 3.0).all()
