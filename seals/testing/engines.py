"""Trajectories of one case by simulator and batch dynamics, at common times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from seals import registry
from seals.arrays import Floats
from seals.backend import Configuration
from seals.batch import BatchDynamics
from seals.effects.binding import EffectSet
from seals.environment.waves import Waves
from seals.frames import conjugate, matrix_of, multiply, rotation_vector, unrotate
from seals.robot.model import RobotModel
from seals.testing.scenes import ENVIRONMENT, held_inputs
from seals.world import Actor, World

SAMPLE = 0.004
"""Time between the compared instants [s]; every step divides it."""


class Track(NamedTuple):
    """Poses over time: position (T, B, 3), quaternion (T, B, 4), joints (T, B, J)."""

    position: Floats
    quaternion: Floats
    joints: Floats

    def errors(self, reference: Track) -> Floats:
        """Largest error of position, attitude and joints relative to the reference, shape (B, 3).

        The path has floors of 0.1 m and 0.1 rad, so that a body that hardly moves is not judged by
        its rest.
        """
        turn = _angle(
            multiply(*(_flat(q) for q in (conjugate(_flat(self.quaternion)), reference.quaternion)))
        )
        steps = multiply(
            _flat(conjugate(_flat(reference.quaternion[:-1]))), _flat(reference.quaternion[1:])
        )
        batch = reference.position.shape[1]
        off = [
            np.linalg.norm(self.position - reference.position, axis=2).max(axis=0),
            turn.reshape(-1, batch).max(axis=0),
            np.abs(self.joints - reference.joints).max(axis=(0, 2), initial=0.0),
        ]
        path = [
            np.linalg.norm(np.diff(reference.position, axis=0), axis=2).sum(axis=0),
            _angle(steps).reshape(-1, batch).sum(axis=0),
            np.abs(np.diff(reference.joints, axis=0)).sum(axis=(0, 2)),
        ]
        return np.stack([o / np.maximum(p, 0.1) for o, p in zip(off, path, strict=True)], axis=1)

    def extrapolated(self, fine: Track) -> Track:
        """Richardson extrapolation of first-order trajectories with steps in the ratio 2 to 1."""
        position, turn, joints = (2.0 * b - a for a, b in zip(self, fine, strict=True))
        return Track(position, turn / np.linalg.norm(turn, axis=2, keepdims=True), joints)


def simulate(
    robot: RobotModel,
    effects: EffectSet,
    starts: Sequence[Configuration],
    *,
    step: float,
    duration: float,
    backend: str = "",
) -> Track:
    """Return the trajectory of the rigid-body simulator; all scenes share one world."""
    engine = registry.get("backend", backend or registry.default_backend()).load()()
    engine.open(ENVIRONMENT, step)
    count, every = round(duration / step), round(SAMPLE / step)
    actors = {
        str(k): Actor(robot, effects, {}, engine, ENVIRONMENT, waves=_still(), steps=count + 1)
        for k in range(len(starts))
    }
    world = World(engine, actors, ENVIRONMENT, step=step, seed=0)
    try:
        world.reset({str(k): start for k, start in enumerate(starts)})
        held = held_inputs(robot, effects)
        for actor in actors.values():
            actor.joint_torque, actor.joint_command = held.joint_torque, held.joint_command
            actor.drive, actor.voltage = held.drive, held.voltage
        rows = [_read(actors)]
        for k in range(count):
            world.step()
            if (k + 1) % every == 0:
                rows.append(_read(actors))
    finally:
        world.close()
    return _stack(rows)


def follow(
    robot: RobotModel,
    effects: EffectSet,
    starts: Sequence[Configuration],
    *,
    step: float,
    duration: float,
) -> Track:
    """Return the trajectory of the batch dynamics, one row per scene."""
    twin = BatchDynamics(robot, effects, ENVIRONMENT, _still(), batch=len(starts))
    fields = {
        name: np.array([getattr(start, name) for start in starts]) for name in Configuration._fields
    }
    turn = matrix_of(fields["quaternion"])
    for name in ("velocity", "angular_velocity"):
        fields[name] = unrotate(turn, fields[name])
    state = twin.start(**fields)
    rows = [Track(state.position, state.quaternion, state.joints)]
    held = held_inputs(robot, effects)._replace(step=step)
    for k in range(round(duration / step)):
        state, _ = twin.advance(state, k * step, step, (held, held, held))
        if (k + 1) % round(SAMPLE / step) == 0:
            rows.append(Track(state.position, state.quaternion, state.joints))
    return _stack(rows)


def _still() -> Waves:
    waves: Waves = registry.get("wave", "still").load()()
    return waves


def _read(actors: dict[str, Actor]) -> Track:
    states = [actor.body.read() for actor in actors.values()]
    return Track(
        *(
            np.array([getattr(s, name) for s in states])
            for name in ("position", "quaternion", "joints")
        )
    )


def _stack(rows: list[Track]) -> Track:
    return Track(*(np.stack(column) for column in zip(*rows, strict=True)))


def _flat(quaternions: Floats) -> Floats:
    return quaternions.reshape(-1, 4)


def _angle(quaternions: Floats) -> Floats:
    angle: Floats = np.linalg.norm(rotation_vector(quaternions), axis=1)
    return angle
