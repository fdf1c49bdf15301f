"""Equations of motion of several rigidly connected links."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, as_like, column_of, namespace
from seals.batch.rigid import RigidBody, pattern
from seals.batch.state import Posture, TwinState
from seals.effects.evaluation import Evaluation, Evaluator
from seals.environment.settings import EnvironmentSettings
from seals.frames import cross, matrix_of
from seals.motion import Body, Motion, Wrench
from seals.multibody.kinematics import take_motion
from seals.multibody.spatial import added_terms, kirchhoff, twist_map
from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel


class FusedBody(RigidBody):
    """Newton-Euler equations of a free body whose effects act at several frames fixed to it.

    Equation:
        (sum X_k^T (M_k + s_k A_k) X_k) (v', w') = sum X_k^T (wrench_k - velocity terms), with X_k
        the constant map from the twist of the base to that of frame k.

    Args:
        robot: with a free base and without joints.
        evaluator: of its effects, rows link by link.
        bodies: constant properties of its links.
        environment: gravity.
        change: of the rigid inertias about the origins, rows link by link; None for none.

    Attributes:
        maps: X_k of every link, each (6, 6).
    """

    def __init__(
        self,
        robot: RobotModel,
        evaluator: Evaluator,
        bodies: Body,
        environment: EnvironmentSettings,
        change: Array | None = None,
    ) -> None:
        places, turns = poses_in_base(robot.tree)
        self.maps = [twist_map(p, r) for p, r in zip(places, turns, strict=True)]
        self._lifts = [as_like(x, bodies.mass) for x in self.maps]
        self.places = [as_like(p, bodies.mass) for p in places[:, None]]
        self.turns = [as_like(r, bodies.mass) for r in turns]
        self._moved: dict[str, tuple[Array, Array]] = {}
        self._patterns: dict[int, list[tuple[int, int]]] = {}
        whole = sum(x.T @ m @ x for x, m in zip(self.maps, robot.spatial_inertia, strict=True))
        self.links = len(robot.links)
        super().__init__(robot, evaluator, bodies, environment, None)
        self._inertia = as_like(np.asarray(whole)[None], bodies.mass)
        if change is not None:
            each = change.shape[0] // self.links
            for k in range(self.links):
                part = change[k * each : (k + 1) * each]
                x = as_like(self.maps[k], bodies.mass)
                self._inertia = self._inertia + namespace(part).matmul(x.T, part) @ x
        self._used = set(pattern(self._inertia))

    def posture(self, state: TwinState, time: Any) -> Posture:
        """Return poses and velocities of all links at a state."""
        xp = namespace(state.position)
        base = matrix_of(state.quaternion)
        up, columns = base[:, 2, :], [xp.permute_dims(base[:, :, k], (1, 0)) for k in range(3)]
        rows: list[list[Array]] = [[] for _ in range(5)]
        for place, turn in zip(self.places, self.turns, strict=True):
            x, y, z = (place[0, k] for k in range(3))
            at = state.position + (columns[0] * x + columns[1] * y + columns[2] * z).T
            own = xp.matmul(base, turn)
            through = state.velocity + cross(
                state.angular_velocity, place + state.angular_velocity * 0.0
            )
            parts = (at, own, up @ turn, through @ turn, state.angular_velocity @ turn)
            for row, part in zip(rows, parts, strict=True):
                row.append(part)
        joined = [xp.concat(row, axis=0) for row in rows]
        moment = column_of(time, self.bodies.mass)
        if moment.shape[0] > 1:
            moment = xp.concat([moment] * self.links, axis=0)
        return Posture(base, Motion._make((moment, *joined, self.bodies)))

    def _right_side(self, motion: Motion, found: Evaluation) -> tuple[Array, Array]:
        """Wrenches less velocity terms, about the base, base axes."""
        batch = motion.velocity.shape[0] // self.links
        speed, spin = motion.velocity[:batch], motion.angular_velocity[:batch]
        force, torque = kirchhoff(self._inertia, speed, spin)
        total = -force, -torque
        for b, _, wrench in found.loads:
            total = self._gathered(total, b.links, wrench, batch)
        for b, rows, added, medium in found.inertias:
            terms = added_terms(added, medium, take_motion(motion, rows))
            total = self._gathered(total, b.links, Wrench(-terms[0], -terms[1]), batch)
        return total

    def _gathered(
        self, total: tuple[Array, Array], links: tuple[int, ...], wrench: Wrench, batch: int
    ) -> tuple[Array, Array]:
        """Add the wrenches on some links to those on the base."""
        force, torque = total
        for j, k in enumerate(links):
            rows = slice(j * batch, (j + 1) * batch)
            if wrench.force is not None:
                push = _rows(wrench.force, rows) @ self.turns[k].T
                force = force + push
                if k:
                    torque = torque + cross(self.places[k] + push * 0.0, push)
            if wrench.torque is not None:
                torque = torque + _rows(wrench.torque, rows) @ self.turns[k].T
        return force, torque

    def _added(self, found: Evaluation) -> list[tuple[Array, Array]]:
        """Weights (B, 1) and matrices about the base of all added inertias."""
        out = []
        for b, _, added, _ in found.inertias:
            batch = max(added.weight.shape[0], added.matrix.shape[0]) // len(b.links)
            for j, k in enumerate(b.links):
                rows = slice(j * batch, (j + 1) * batch)
                if added.matrix.shape[0] > 1:
                    moved = self._at_base(k, added.matrix[rows])
                else:
                    moved = self._moved_once(f"{b.name} {k}", k, added.matrix)
                # one weight applies to all: that of a robot in the air, without added mass
                out.append((_rows(added.weight, rows), moved))
        return out

    def _moved_once(self, name: str, link: int, matrix: Array) -> Array:
        """Return a matrix about the base; that of a constant one, the same array, is kept."""
        kept, moved = self._moved.get(name, (None, matrix))
        # of one robot a matrix that changes has one row, too
        if kept is not matrix:
            moved = self._at_base(link, matrix)
            if name not in self._moved:
                self._moved[name] = matrix, moved
                self._patterns[id(moved)] = pattern(moved)
        return moved

    def _filled(self, matrix: Array) -> list[tuple[int, int]]:
        # those of constant matrices were found when they were moved, and live as long as they do
        return self._patterns.get(id(matrix)) or super()._filled(matrix)

    def _at_base(self, link: int, matrix: Array) -> Array:
        x = self._lifts[link]
        return namespace(matrix).matmul(x.T, matrix) @ x


def _rows(x: Array, rows: slice) -> Array:
    """Rows of one link; one row applies to all."""
    return x if x.shape[0] == 1 else x[rows]
