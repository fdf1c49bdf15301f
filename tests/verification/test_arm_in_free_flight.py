"""A free body with a moving arm: momentum stays, and both engines agree."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.backend import LinkPoses
from seals.frames import conjugate, matrix_of, multiply, rotate, rotation_vector
from seals.motion import Inputs
from seals.multibody.tree import forward
from seals.robot.model import RobotModel
from seals.run import build_twin, build_world
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.testing.backend import momentum_of

Floats = NDArray[np.float64]
SWING = 0.8
"""Half-width of the arm's motion [rad]."""
ROBOTS = {
    "free_arm": ([0.0, 0.0], [SWING, SWING]),
    "aam": ([0.6, -0.8, 0.1, -0.2, -0.2, -0.2], [SWING, SWING, SWING, 0.3, 0.3, 0.3]),
}
"""Middle and half-width of every joint's motion, clear of all stops [rad]."""


class Flight(NamedTuple):
    """Poses and momenta over a flight: (T, 3), (T, 4), (T, J), (T, 3), (T, 3)."""

    position: Floats
    quaternion: Floats
    joints: Floats
    linear: Floats
    angular: Floats


def settings(robot: str, step: float, duration: float = 2.0) -> RunSettings:
    """Return a robot that turns slowly in empty space, its servos alone at work."""
    run = run_settings(
        [
            f"robot={robot}",
            "water=none",
            f"time.step={step}",
            f"time.duration={duration}",
            "initial.velocity=[0.3,-0.2,0.1]",
            "initial.angular_velocity=[0.4,0.2,-0.3]",
            f"initial.joint_position={ROBOTS[robot][0]}",
        ]
    )
    servos = run.actuators.get("servos") or _servos()
    run.effects, run.sensors, run.actuators = {}, {}, {"servos": servos}
    return run


def _servos() -> Any:
    from seals.plugins.actuators.servos import Servos

    return Servos(kp=2.0, kd=0.1)


def command(run: RunSettings, time: float) -> Floats:
    """Joints that swing smoothly, each at its own pace [rad], shape (1, J)."""
    middle, sizes = (np.array(x) for x in ROBOTS[run.robot.name])
    paces = 1.0 + 0.3 * np.arange(len(sizes))
    return (middle + sizes * np.sin(np.pi * paces * time) * min(2.0 * time, 1.0) ** 2)[None]


def in_world(run: RunSettings) -> Flight:
    """Fly in the rigid-body simulator."""
    world = build_world(run)
    try:
        actor, rows = world.actors["robot"], []
        for k in range(round(run.time.duration / run.time.step) + 1):
            at = actor.body.read()
            rows.append((at.position, at.quaternion, at.joints, *_momentum(actor)))
            actor.joint_command = command(run, k * run.time.step)
            world.step()
        return Flight(*(np.array(column) for column in zip(*rows, strict=True)))
    finally:
        world.close()


def _momentum(actor: Any) -> tuple[Floats, Floats]:
    return momentum_of(actor.robot, actor.body.poses())


def in_twin(run: RunSettings) -> Flight:
    """Fly in the twin."""
    twin, state = build_twin(run)
    step, rows = run.time.step, []
    for k in range(round(run.time.duration / step) + 1):
        turn = matrix_of(state.quaternion)
        poses = forward(twin.robot.tree, state.position, turn, state.joints)
        lead = [rotate(turn, state.velocity), rotate(turn, state.angular_velocity)]
        speed = np.concatenate([*lead, state.joint_velocity], axis=1)
        pair = momentum_of(twin.robot, LinkPoses(*poses, speed))
        rows.append((state.position[0], state.quaternion[0], state.joints[0], *pair))
        inputs = Inputs(step, twin.no_torque(), joint_command=command(run, k * step))
        state, _ = twin.advance(state, k * step, step, (inputs,) * 3)
    return Flight(*(np.array(column) for column in zip(*rows, strict=True)))


def lost(flight: Flight) -> tuple[float, float]:
    """Largest changes of linear and angular momentum, by the momenta at the start."""
    found = []
    for momentum in (flight.linear, flight.angular):
        change = np.linalg.norm(momentum - momentum[0], axis=1).max()
        found.append(float(change / np.linalg.norm(momentum[0])))
    return found[0], found[1]


@pytest.mark.thorough
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_moving_arm_changes_no_momentum(robot: str) -> None:
    """Linear and angular momentum stay within 1e-3 at 0.25 ms; the figure at 4 ms is printed."""
    fine, coarse = (lost(in_world(settings(robot, h, 1.0))) for h in (2.5e-4, 4e-3))
    print(
        f"{robot}: momentum lost at 0.25 ms {fine[0]:.1e} linear, {fine[1]:.1e} angular; "
        f"at 4 ms {coarse[0]:.1e}, {coarse[1]:.1e}"
    )
    assert max(fine) < 1e-3
    # the scheme is of second order: a sixteenth of the step, less than a thirtieth of the loss
    assert fine[1] < max(coarse[1] / 30.0, 1e-9)


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_momentum_is_that_of_the_moving_parts(robot: str) -> None:
    """The arm moves enough to matter: its joints travel, and the body turns against it."""
    flight = in_twin(settings(robot, 4e-3))
    assert np.ptp(flight.joints[:, 0]) > SWING
    model: RobotModel = build_twin(settings(robot, 4e-3))[0].robot
    assert np.allclose(flight.linear[0], model.mass.sum() * _centre_speed(model), rtol=1e-9)
    # stiff servos make the twin's steps those of second order, too: (kp / kd h)^2 = 1e-2 at most
    assert max(lost(flight)) < 1e-2


def _centre_speed(model: RobotModel) -> Floats:
    """Velocity of the centre of mass at the start of a flight [m/s]."""
    start = np.array([ROBOTS[model.name][0]])
    origins, turns = forward(model.tree, np.zeros((1, 3)), np.eye(3)[None], start)
    places = origins[0] + np.einsum("lij,lj->li", turns[0], model.centre)
    centre = model.mass @ places / model.mass.sum()
    return np.array([0.3, -0.2, 0.1]) + np.cross([0.4, 0.2, -0.3], centre)


@pytest.mark.thorough
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(
    ("step", "bound"), [(4e-3, 2e-2), pytest.param(1e-3, 5e-3, marks=pytest.mark.slow)]
)
def test_world_and_twin_fly_alike(robot: str, step: float, bound: float) -> None:
    """Position, attitude and joints agree within 2e-2 at 4 ms and 5e-3 at 1 ms over 2 s."""
    a, b = in_world(settings(robot, step)), in_twin(settings(robot, step))
    path = np.linalg.norm(np.diff(b.position, axis=0), axis=1).sum()
    turned = multiply(conjugate(b.quaternion), a.quaternion)
    steps = multiply(conjugate(b.quaternion[:-1]), b.quaternion[1:])
    turn = np.linalg.norm(rotation_vector(steps), axis=1).sum()
    travel = np.abs(np.diff(b.joints, axis=0)).sum(axis=0).max()
    apart = (
        np.linalg.norm(a.position - b.position, axis=1).max() / max(path, 0.1),
        np.linalg.norm(rotation_vector(turned), axis=1).max() / max(turn, 0.1),
        np.abs(a.joints - b.joints).max() / max(travel, 0.1),
    )
    print(f"{robot}, {step * 1e3:g} ms: {apart[0]:.1e}, {apart[1]:.1e}, {apart[2]:.1e}")
    assert max(apart) < bound
