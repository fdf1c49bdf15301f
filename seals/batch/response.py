"""Linear response of the state derivatives to single effects, evaluated alone."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.batch.fused import FusedBody
from seals.batch.model import BatchDynamics
from seals.batch.rigid import RigidBody
from seals.batch.state import Posture, Rates, TwinState
from seals.batch.tree import TreeBody
from seals.effects.binding import EffectSet
from seals.effects.evaluation import Evaluation, Evaluator
from seals.environment.sample import Sample
from seals.frames import unrotate
from seals.motion import Inputs, Joints
from seals.multibody.kinematics import by_batch, take_motion
from seals.multibody.linear import ChangedLead, Factors
from seals.multibody.spatial import added_terms


class Force(NamedTuple):
    """Loads of some effects at known accelerations, less their inertial reaction.

    Args:
        links: wrenches about the link origins, link axes [N, N m], shape (B, L, 6).
        joints: generalised forces of the joints [N m or N], shape (B, J).
        touched: links beyond which there are no wrenches: first, and one after the last.
    """

    links: Floats
    joints: Floats
    touched: tuple[int, int]

    def less(self, other: Force) -> Force:
        """Return the difference."""
        first = min(self.touched[0], other.touched[0])
        last = max(self.touched[1], other.touched[1])
        return Force(self.links - other.links, self.joints - other.joints, (first, last))

    def over(self, step: float) -> Force:
        """Return the loads divided by a step of a parameter."""
        return Force(self.links / step, self.joints / step, self.touched)


class Response:
    """Linear response of a batch at given states to small changes of the loads.

    Equation:
        M da = J^T (dF - d(inertia) x acceleration) + joint forces, all at the accelerations of the
        twin: exactly the derivative of the rates, without a difference of rates.

    Args:
        twin: on NumPy.
        state: of its batch.
        time: [s].
        inputs: of the batch.
        posture: at the state.

    Attributes:
        rates: of the twin at the state.
    """

    def __init__(
        self, twin: BatchDynamics, state: TwinState, time: Any, inputs: Inputs, posture: Posture
    ) -> None:
        self.twin, self.inputs, self.posture = twin, inputs, posture
        self._state, self._time = state, time
        self._joints = Joints(state.joints, state.joint_velocity)
        body = twin.body
        if isinstance(body, RigidBody):
            self.rates, self._found = body.evaluated(state, time, inputs, twin.memory, posture)
            self._factors: Factors | ChangedLead = Factors(body.inertia_with(self._found))
        else:
            self._tree(body, state)

    @cached_property
    def _lifts(self) -> Floats:
        """Matrices from the generalised velocity to the links' twists, shape (1 or B, L, 6, n)."""
        body = self.twin.body
        if isinstance(body, RigidBody):
            # links that do not move: their twists are constant maps of that of the base
            return np.stack(body.maps if isinstance(body, FusedBody) else [np.eye(6)])[None]
        assert self.posture.kinematics is not None
        jacobian: Floats = self.posture.kinematics.jacobian
        return jacobian

    @cached_property
    def _rise(self) -> Floats:
        """Acceleration twist of every link, rows link by link, shape (L B, 6)."""
        rates = self.rates
        if isinstance(self.twin.body, RigidBody):
            own = np.concatenate((rates.velocity, rates.angular_velocity), axis=1)
            rise = np.einsum("lij,bj->bli", self._lifts[0], own)
        else:
            kinematics, moving = self.posture.kinematics, self.posture.moving
            assert kinematics is not None
            assert moving is not None
            rise = kinematics.move(self._change).twists + kinematics.bias(moving)
        rows: Floats = rise.transpose(1, 0, 2).reshape(-1, 6)
        return rows

    @property
    def sample(self) -> Sample:
        """Sample the surroundings of the links with the flows of all effects, rows link by link."""
        return self._found.sample

    def _tree(self, body: TreeBody, state: TwinState) -> None:
        """Solve the equations of a tree."""
        posture, memory = self.posture, self.twin.memory
        assert posture.kinematics is not None
        assert posture.moving is not None
        found, (matrix, right) = body.system(state, posture, self.inputs, memory, explicit=True)
        self._found, self._right, self._factors = found, right, body.factors(posture, matrix)
        self._change = self._factors.solve(right)
        self.rates = body.state_rates(state, posture.base, self._change)

    def rates_under(self, inputs: Inputs) -> Rates:
        """State derivatives at the same state with other joint commands."""
        body, posture, state = self.twin.body, self.posture, self._state
        if isinstance(body, RigidBody):
            return self.twin.rates(state, self._time, inputs, posture)
        motion = posture.motion._replace(body=body.bodies)
        memory, known = self.twin.memory, self._found
        found = self.twin.evaluator.evaluate(motion, self._joints, inputs, memory, posture.sample)
        # two evaluations at one state differ where the loads on the links do
        kinds = ((found.loads, known.loads), (found.inertias, known.inertias))
        pairs = [
            pair
            for kind in kinds
            for entries in zip(*kind, strict=True)
            for pair in zip(*(entry[2] for entry in entries), strict=True)
        ]
        if any(a is not b and not np.array_equal(a, b) for a, b in pairs):
            return self.twin.rates(state, self._time, inputs, posture)
        still = np.zeros_like(self._joints.velocity)
        change = found.joint_force(still + inputs.joint_torque)
        change = change - known.joint_force(still + self.inputs.joint_torque)
        right = self._right.copy()
        right[:, right.shape[1] - change.shape[1] :] += change
        return body.state_rates(state, posture.base, self._factors.solve(right))

    def force(self, effects: EffectSet) -> Force:
        """Loads of some effects at the states and accelerations of the batch.

        Args:
            effects: without flows, with the values that count.
        """
        twin = self.twin
        batch, links = twin.batch, len(twin.robot.links)
        evaluator = Evaluator(
            effects,
            twin.evaluator.surroundings,
            links=links,
            batch=batch,
            joint_links=twin.robot.tree.child,
            sparing=True,
        )
        evaluator.fed = bool(twin.effects.batteries)
        evaluator.alike = isinstance(twin.body, TreeBody) and len(twin.body.assembly.inertia) == 1
        motion = self.posture.motion
        memory = {**effects.zero_memory(batch), **twin.memory}
        found = evaluator.evaluate(motion, self._joints, self.inputs, memory, self._found.sample)
        touched = [_touched(rows, batch, links) for _, rows, *_ in (*found.loads, *found.inertias)]
        first, last = (
            min((t[0] for t in touched), default=0),
            max((t[1] for t in touched), default=1),
        )
        force: Floats = found.joint_force(np.zeros_like(self._joints.velocity))
        return Force(self._wrenches(found, batch, links), force, (first, last))

    def _wrenches(self, found: Evaluation, batch: int, links: int) -> Floats:
        """Wrenches on the links less the resistance of added inertia, shape (B, L, 6)."""
        motion, total = self.posture.motion, np.zeros((links * batch, 6))
        for _, rows, wrench in found.loads:
            part = total if rows is None else total[rows]
            if wrench.force is not None:
                part[:, :3] += wrench.force
            if wrench.torque is not None:
                part[:, 3:] += wrench.torque
            if rows is not None:
                total[rows] = part
        for _, rows, added, medium in found.inertias:
            force, torque = added_terms(added, medium, take_motion(motion, rows))
            rise = self._rise if rows is None else self._rise[rows]
            if added.matrix.shape[0] == 1:
                pull = rise @ added.matrix[0].T * added.weight
            else:
                pull = np.matmul(added.matrix, rise[:, :, None])[:, :, 0] * added.weight
            pull += np.concatenate((force, torque), axis=1)
            if rows is None:
                total -= pull
            else:
                total[rows] -= pull
        out: Floats = by_batch(total, links)
        return out

    def changes(self, forces: Sequence[Force]) -> list[Floats]:
        """Changes of accelerations and specific force by small forces.

        Returns:
            One array (B, 9 + J) for each force: the changes of the derivative of velocity, of
            spin, of the specific force and of the derivative of the joint rates.
        """
        touched = slice(min(f.touched[0] for f in forces), max(f.touched[1] for f in forces))
        parts = [f.links[:, touched].reshape(f.links.shape[0], -1) for f in forces]
        right = np.stack(parts, axis=2)
        across = (
            self._lifts[:, touched].reshape(len(self._lifts), right.shape[1], -1).transpose(0, 2, 1)
        )
        right = np.matmul(across, right)
        if not isinstance(self.twin.body, RigidBody):
            joints = self._joints.velocity.shape[1]
            if joints:
                right[:, -joints:] += np.stack([f.joints for f in forces], axis=2)
        solved = self._factors.solve(right)
        return [self._packed(solved[:, :, k]) for k in range(len(forces))]

    def pushed(self) -> list[Floats]:
        """Changes by a unit force and torque on the base along its axes, as of `changes`."""
        batch, links = self.twin.batch, len(self.twin.robot.links)
        still = np.zeros_like(self._joints.velocity)
        pushes = np.zeros((6, batch, links, 6))
        for k in range(6):
            pushes[k, :, 0, k] = 1.0
        return self.changes([Force(p, still, (0, 1)) for p in pushes])

    def _packed(self, change: Floats) -> Floats:
        if self.twin.robot.tree.fixed_base:
            still = np.zeros((len(change), 3))
            return np.concatenate((still, still, still, change), axis=1)
        linear, angular, joints = change[:, :3], change[:, 3:6], change[:, 6:]
        if not isinstance(self.twin.body, RigidBody):
            base = self.posture.base
            linear, angular = unrotate(base, linear), unrotate(base, angular)
        return np.concatenate((linear, angular, linear, joints), axis=1)


def _touched(rows: Any, batch: int, links: int) -> tuple[int, int]:
    """First link, and the one after the last, of rows in blocks of a batch, link by link."""
    if rows is None:
        return 0, links
    if isinstance(rows, slice):
        return rows.start // batch, -(-rows.stop // batch)
    return int(rows.min()) // batch, int(rows.max()) // batch + 1
