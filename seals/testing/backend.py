"""Contract tests of rigid-body backends."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals import registry
from seals.arrays import Floats
from seals.backend import Configuration, LinkPoses
from seals.contract import class_of, require
from seals.effects.binding import bind_effects
from seals.effects.effect import Effect
from seals.multibody.kinematics import Kinematics
from seals.robot.model import RobotModel
from seals.testing.bodies import free_body, moving_arm
from seals.testing.scenes import ENVIRONMENT, start_of
from seals.world import Actor, World

STEP = 0.002
"""Step of the checks [s]."""


@dataclass(frozen=True, kw_only=True)
class BackendReport:
    """Result of `check_backend`.

    Args:
        name: of the backend.
        placed: largest difference between the state given to reset and the one read [m, rad/s ...].
        fall: error of 1 s of free fall against its 4.9 m [1].
        linear: change of linear momentum over 1 s of free motion, largest of one body and an arm
            [1].
        angular: change of angular momentum, likewise [1].
    """

    name: str
    placed: float
    fall: float
    linear: float
    angular: float

    def table(self) -> str:
        """Return the figures as text."""
        return (
            f"{self.name}: reset to read {self.placed:.1e}, free fall {self.fall:.1e}, "
            f"momentum linear {self.linear:.1e} angular {self.angular:.1e}, snapshots exact"
        )


def check_backend(backend: str | type, *, values: Mapping[str, Any] | None = None) -> BackendReport:
    """Check the contract of a rigid-body backend.

    It must place a robot where it is told, with mass off the origin and tilted principal axes; fall
    freely; conserve linear and angular momentum of free motion; and continue bit for bit from a
    snapshot.

    Args:
        backend: name of an installed backend, or its class.
        values: fields of the backend.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.
    """
    name, cls = class_of("backend", backend)
    check = _BackendCheck(name, lambda: cls(**(values or {})))
    with tempfile.TemporaryDirectory() as folder:
        robots = [free_body(Path(folder)), moving_arm(Path(folder))]
        placed = max(check.placed(robot) for robot in robots)
        fall = check.fall(robots[0])
        drifts = [check.drift(robot) for robot in robots]
        for robot in robots:
            check.snapshot(robot)
    linear, angular = (max(column) for column in zip(*drifts, strict=True))
    return BackendReport(name=name, placed=placed, fall=fall, linear=linear, angular=angular)


class _BackendCheck:
    """Parts of the check, each in a world of its own."""

    def __init__(self, name: str, make: Any) -> None:
        self.name, self.make = name, make

    def world(self, robot: RobotModel, effects: Mapping[str, Effect]) -> tuple[World, Actor]:
        """Open a world with one robot in the air, tilted and turning."""
        engine = self.make()
        engine.open(ENVIRONMENT, STEP)
        still = registry.get("wave", "still").load()()
        actor = Actor(
            robot,
            bind_effects(effects, robot.links),
            {},
            engine,
            ENVIRONMENT,
            waves=still,
            steps=1000,
        )
        world = World(engine, {"it": actor}, ENVIRONMENT, step=STEP, seed=0)
        world.reset({"it": start_of(robot, "air", 0)})
        return world, actor

    def placed(self, robot: RobotModel) -> float:
        """Compare the state given to reset with the state read back."""
        world, actor = self.world(robot, {})
        given, found = start_of(robot, "air", 0), actor.body.read()
        world.close()
        off = max(float(np.abs(a - b).max(initial=0.0)) for a, b in zip(given, found, strict=True))
        require(
            off < 1e-9,
            self.name,
            f"reads a state {off:.1e} away from the one it was reset to",
            "Check the centre of mass.",
        )
        return off

    def fall(self, robot: RobotModel) -> float:
        """Compare 1 s of free fall with g t^2 / 2."""
        world, actor = self.world(robot, {"gravity": registry.get("effect", "gravity").load()()})
        before, centre = actor.body.read(), robot.centre[0]
        height = _centre_height(before, centre)
        rise = float(
            (before.velocity + np.cross(before.angular_velocity, _turn(before) @ centre))[2]
        )
        for _ in range(round(1.0 / STEP)):
            world.step()
        expected = height + rise - 0.5 * ENVIRONMENT.gravity
        off = abs(_centre_height(actor.body.read(), centre) - expected) / (
            0.5 * ENVIRONMENT.gravity
        )
        world.close()
        # a first-order step errs by dt / t of the distance
        require(
            off < 1.1 * STEP,
            self.name,
            f"deviates by {off:.1e} m from g t^2 / 2 after 1 s of free fall",
            "Look for hidden damping.",
        )
        return off

    def drift(self, robot: RobotModel) -> tuple[float, float]:
        """Return the relative change of linear and angular momentum over 1 s of free motion."""
        world, actor = self.world(robot, {})
        before = momentum_of(robot, actor.body.poses())
        for _ in range(round(1.0 / STEP)):
            world.step()
        after = momentum_of(robot, actor.body.poses())
        world.close()
        out = tuple(
            float(np.linalg.norm(a - b) / np.linalg.norm(b))
            for a, b in zip(after, before, strict=True)
        )
        for what, off in zip(("linear", "angular"), out, strict=True):
            require(
                off < 0.5 * STEP,
                self.name,
                f"changes the {what} momentum of '{robot.name}' by {off:.1e} in 1 s of free motion",
                "Look for hidden damping, or a lost gyroscopic term.",
            )
        return out[0], out[1]

    def snapshot(self, robot: RobotModel) -> None:
        """Continue twice from one snapshot."""
        world, actor = self.world(robot, {"gravity": registry.get("effect", "gravity").load()()})
        self._advance(world, actor)
        kept = world.snapshot()
        first = self._advance(world, actor)
        world.restore(kept)
        second = self._advance(world, actor)
        world.close()
        off = float(np.abs(first - second).max())
        require(
            off == 0.0,
            self.name,
            f"differs by {off:.1e} when continued from a snapshot",
            "Keep all state in snapshot().",
        )

    def _advance(self, world: World, actor: Actor) -> Floats:
        rows = []
        for _ in range(40):
            world.step()
            rows.append(np.concatenate(actor.body.read()))
        return np.array(rows)


def _turn(c: Configuration) -> Floats:
    from seals.frames import matrix_of

    turn: Floats = matrix_of(c.quaternion[None])[0]
    return turn


def _centre_height(c: Configuration, centre: Floats) -> float:
    return float((c.position + _turn(c) @ centre)[2])


def momentum_of(robot: RobotModel, poses: LinkPoses) -> tuple[Floats, Floats]:
    """Return linear and angular momentum about the centre of mass, world axes [kg m/s, kg m^2/s].

    Args:
        robot: the robot.
        poses: of its links.
    """
    kinematics = Kinematics(robot.tree, poses.origins, poses.rotations)
    twists = np.matmul(kinematics.jacobian[0], poses.speed[0])
    own = np.einsum("lij,lj->li", robot.spatial_inertia, twists)
    turn, origin = poses.rotations[0], poses.origins[0]
    linear = np.einsum("lij,lj->li", turn, own[:, :3])
    angular = np.einsum("lij,lj->li", turn, own[:, 3:])
    centres = origin + np.einsum("lij,lj->li", turn, robot.centre)
    middle = (robot.mass[:, None] * centres).sum(axis=0) / robot.mass.sum()
    total: Floats = linear.sum(axis=0)
    return total, (angular + np.cross(origin - middle, linear)).sum(axis=0)
