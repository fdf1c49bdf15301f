"""Batch dynamics: the robot's equations of motion with its effects, over a batch."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seals.arrays import Array, as_like, namespace, on_accelerator
from seals.batch.fused import FusedBody
from seals.batch.rigid import RigidBody
from seals.batch.state import GAMMA, Posture, Rates, TwinState, advance, rosenbrock, runge_kutta
from seals.batch.tree import TreeBody
from seals.effects.binding import BoundEffect, EffectSet, rows_of
from seals.effects.evaluation import Evaluator
from seals.effects.joint_inertia import fastest_drive
from seals.effects.rigid import changed
from seals.environment.sampler import build_surroundings, tables_of
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Waves
from seals.environment.wetting import Wetting
from seals.motion import Inputs
from seals.multibody.equations import scatter
from seals.multibody.kinematics import take
from seals.pytree import mapped
from seals.robot.model import RobotModel
from seals.scalar_compiler import CannotCompile, constant
from seals.scalar_compiler.device_rows import DeviceLaw

Ahead = tuple[Rates, Any] | None
"""Rates to go along before others are found, and for how long [s]; None stays where it is."""


STEEPEST = 1.2
"""Largest product of step and fastest rate of a joint drive that explicit steps take well [1].

They are stable up to 2.8; accuracy ends before.
"""


class BatchDynamics:
    """A batch of robots under the same effects as the simulator.

    Integrated by the classic Runge-Kutta method of fourth order; where joint drives are too steep
    for it, by a Rosenbrock method of second order that is stable at any gain.

    Args:
        robot: the robot.
        effects: bound effects.
        environment: air, water, gravity.
        waves: motion of the water surface.
        batch: number of robots B.
        like: array whose library, type and device to use; NumPy float64 by default.
        values: ``"effect.parameter"`` to a number or an array (B,), in place of the configured
            values.
        wetting: finds the wetted parts of the hulls; None for `tables_of`.

    Assumptions:
        No contacts. Effects' memory and inputs are held over a step. On an accelerator an explicit
        step is one kernel (`seals.scalar_compiler.device_rows`), compiled for its first call;
        what has no kernel is computed operation by operation.

    Example:
        >>> BatchDynamics  # doctest: +ELLIPSIS
        <class 'seals.batch.model.BatchDynamics'>
    """

    robot: RobotModel
    batch: int
    like: Any
    effects: EffectSet
    evaluator: Evaluator

    def __init__(
        self,
        robot: RobotModel,
        effects: EffectSet,
        environment: EnvironmentSettings,
        waves: Waves,
        *,
        batch: int,
        like: Array | None = None,
        values: Mapping[str, Any] | None = None,
        wetting: Wetting | None = None,
    ) -> None:
        like = np.zeros(1) if like is None else like
        self._parts = robot, effects, environment, waves
        self._values = values or {}
        self._kernels: dict[tuple[float, float], DeviceLaw] = {}
        self._plain = False
        self.robot, self.batch, self.like = robot, batch, like
        self.effects = effects.with_values(values or {}, like, batch)
        bodies = robot.bodies(like, batch)
        wetting = wetting or tables_of(robot, environment)
        surroundings = build_surroundings(
            robot, environment, waves, wetting, like=like, batch=batch
        )
        links = len(robot.links)
        self.evaluator = Evaluator(
            self.effects,
            surroundings,
            links=links,
            batch=batch,
            joint_links=robot.tree.child,
            folded=True,
            sparing=True,
        )
        change = _nominal_change(self.effects, robot, like, batch)
        if change is not None:
            # found once for each link where it is one of each
            count, rows = len(robot.links), bodies.mass.shape[0]
            if change.shape[0] != count or rows == count:
                bodies = changed(bodies, change)
            else:
                each, repeat = changed(robot.bodies(like), change), namespace(bodies.mass).repeat
                mass, centre = (
                    repeat(x, rows // count, axis=0) for x in (each.mass, each.centre_of_mass)
                )
                bodies = bodies._replace(mass=mass, centre_of_mass=centre)
        form = _form(robot)
        self.body: RigidBody | TreeBody = form(robot, self.evaluator, bodies, environment, change)
        self.memory: Mapping[str, Array] = self.zero_memory()
        self._torque = self.no_torque()
        self._rate = fastest_drive(self.effects, robot)

    def zero_memory(self) -> dict[str, Array]:
        """Return the memory of all effects at reset."""
        return {k: as_like(v, self.like) for k, v in self.effects.zero_memory(self.batch).items()}

    def no_torque(self) -> Array:
        """Return zero joint torques, shape (1, J)."""
        return as_like(np.zeros((1, self.robot.tree.joints)), self.like)

    def start(self, **values: Any) -> TwinState:
        """Return a state of the batch from the given fields, see `TwinState.at_rest`."""
        return TwinState.at_rest(self.batch, self.robot.tree.joints, self.like, **values)

    def posture(self, state: TwinState, time: Any) -> Posture:
        """Return the quantities that depend on the state alone, for use with other parameters.

        Args:
            state: of the batch.
            time: [s], a number or an array (B, 1).
        """
        posture = self.body.posture(state, time)
        return posture._replace(sample=self.evaluator.surroundings.sample(posture.motion))

    def rates(
        self,
        state: TwinState,
        time: Any,
        inputs: Inputs | None = None,
        posture: Posture | None = None,
    ) -> Rates:
        """Return the time derivative of the state.

        Args:
            state: of the batch.
            time: [s], a number or an array (B, 1).
            inputs: joint torques and the time since the memory was updated.
            posture: at the state, where it is known.
        """
        inputs = Inputs(0.0, self._torque) if inputs is None else inputs
        return self.body.rates(state, time, inputs, self.memory, posture)[0]

    def step(
        self, state: TwinState, time: float, step: float, joint_torque: Array | None = None
    ) -> tuple[TwinState, Rates]:
        """Advance the batch by one step under held inputs.

        Args:
            state: at ``time``.
            time: [s].
            step: [s].
            joint_torque: held over the step [N m or N], shape (1 or B, J).

        Returns:
            The state at ``time + step`` and the rates at ``time``.
        """
        inputs = Inputs(step, self._torque if joint_torque is None else joint_torque)
        return self.advance(state, time, step, (inputs, inputs, inputs))

    def advance(
        self,
        state: TwinState,
        time: Any,
        step: Any,
        inputs: tuple[Inputs, Inputs, Inputs],
        posture: Posture | None = None,
    ) -> tuple[TwinState, Rates]:
        """Advance the batch by one step under inputs known at its start, middle and end.

        Args:
            state: at ``time``.
            time: [s], a number or an array (B, 1).
            step: [s], a number or an array (B, 1).
            inputs: at the start, in the middle and at the end of the step.
            posture: at the start, where it is known.

        Returns:
            The state at ``time + step`` and the rates at ``time``.
        """
        if self._stiff(step):
            return self._implicit(state, time, step, inputs, posture)
        given = state, time, step, inputs, self.memory, posture
        if on_accelerator(state.position) and not self._plain:
            try:
                now, k1, self.memory = self._launched(*given)
                return now, k1
            except CannotCompile:
                # operation by operation, as any law on tensors
                self._plain = True
        now, k1, self.memory = self._explicit(*given)
        return now, k1

    def _launched(  # noqa: PLR0917  as `_explicit`
        self,
        state: TwinState,
        time: Any,
        step: float,
        inputs: tuple[Inputs, Inputs, Inputs],
        memory: Mapping[str, Array],
        posture: Posture | None,
    ) -> tuple[TwinState, Rates, Mapping[str, Array]]:
        """One step as one kernel; what is known at the start is worked out again in it."""
        del posture
        batch, span = state.position.shape[0], inputs[0].step
        if (step, span) not in self._kernels:
            law = functools.partial(self._step_of_one, step, span)
            self._kernels[step, span] = DeviceLaw(law, self.like)

        def whole(x: Any) -> Array:
            """A row for every robot; one that holds for all of them is repeated."""
            rows = as_like(x, self.like) if isinstance(x, int | float) else x
            rows = rows.reshape(-1, 1) if rows.ndim < 2 else rows
            return rows.expand(batch, *rows.shape[1:]) if rows.shape[0] == 1 else rows

        nothing: Any = None
        given = [x._replace(step=nothing) for x in inputs]
        values = mapped({k: as_like(v, self.like) for k, v in self._values.items()}, whole)
        found: tuple[TwinState, Rates, Mapping[str, Array]] = self._kernels[step, span](
            *(values, mapped(tuple(given), whole), memory, whole(time), state)
        )
        return found

    def _step_of_one(  # noqa: PLR0917  a law of numbers and arrays
        self,
        step: float,
        span: float,
        values: Mapping[str, Array],
        inputs: tuple[Inputs, ...],
        memory: Mapping[str, Array],
        time: Array,
        state: TwinState,
    ) -> tuple[TwinState, Rates, Mapping[str, Array]]:
        """The same step of one robot on traced arrays."""
        single = {name: value.reshape((1,)) for name, value in values.items()}
        one = BatchDynamics(*self._parts, batch=1, like=constant(np.zeros(1)), values=single)
        first, middle, last = (x._replace(step=span) for x in inputs)
        return one._explicit(state, time, step, (first, middle, last), memory, None)

    def _explicit(  # noqa: PLR0917  a law, whole
        self,
        state: TwinState,
        time: Any,
        step: Any,
        inputs: tuple[Inputs, Inputs, Inputs],
        memory: Mapping[str, Array],
        posture: Posture | None,
    ) -> tuple[TwinState, Rates, Mapping[str, Array]]:
        """One step of the Runge-Kutta method: state and memory after it, rates before it."""
        slopes = self.slopes
        k1, after = slopes(state, None, time, inputs[0], memory, posture=posture)
        middle, end = (x._replace(step=0.0) for x in inputs[1:])
        half = 0.5 * step
        k2, _ = slopes(state, (k1, half), time, middle, memory)
        k3, _ = slopes(state, (k2, half), time, middle, memory)
        k4, _ = slopes(state, (k3, step), time, end, memory)
        return runge_kutta(state, (k1, k2, k3, k4), step), k1, after

    def slopes(
        self,
        state: TwinState,
        ahead: Ahead,
        time: Any,
        inputs: Inputs,
        memory: Mapping[str, Array],
        *,
        posture: Posture | None = None,
    ) -> tuple[Rates, Mapping[str, Array]]:
        """Return the rates at the state advanced along other rates, and the new memory.

        Args:
            state: of the batch.
            ahead: rates to go along, and for how long [s]; None stays at the state.
            time: of the state [s].
            inputs: there and then.
            memory: of the effects.
            posture: at the state, where it is known and nothing goes ahead.
        """
        if ahead is not None:
            rates, span = ahead
            state, time = advance(state, rates, span).normal(), time + span
        return self.body.rates(state, time, inputs, memory, posture)

    def _stiff(self, step: Any) -> bool:
        """Return whether the joint drives are too steep for explicit steps of this length [s]."""
        return self._rate > 0.0 and float(np.max(step)) * self._rate > STEEPEST

    def _implicit(
        self,
        state: TwinState,
        time: Any,
        step: Any,
        inputs: tuple[Inputs, Inputs, Inputs],
        posture: Posture | None,
    ) -> tuple[TwinState, Rates]:
        """Advance by one step that takes the joint drives implicitly, of second order."""
        body: Any = self.body
        ahead, end = GAMMA * step, inputs[2]._replace(step=0.0)
        k1, memory = body.stage(state, time, inputs[0], self.memory, ahead=ahead, posture=posture)
        moved = advance(state, k1, step).normal()
        k2, _ = body.stage(moved, time + step, end, self.memory, ahead=ahead, before=k1)
        self.memory = memory
        return rosenbrock(state, (k1, k2), step), k1


def _form(robot: RobotModel) -> type[RigidBody | TreeBody]:
    """Equations of motion for a robot: one body, a tree, or rigidly connected links."""
    if len(robot.links) == 1 and not robot.tree.fixed_base:
        return RigidBody
    return FusedBody if robot.held and not robot.tree.fixed_base else TreeBody


def _nominal_change(effects: EffectSet, robot: RobotModel, like: Array, batch: int) -> Array | None:
    """Sum of all changes of rigid inertia, about the origins of the links.

    Returns:
        Rows link by link, shape (L B, 6, 6); one row per link, shape (L, 6, 6), when no change is
        batched; None for none.
    """
    constant: list[BoundEffect] = []
    varied: list[BoundEffect] = []
    for b in effects.inertia_changes:
        (constant if all(len(x) == 1 for x in b.params.values()) else varied).append(b)
    total = _summed(constant, robot, like, 1)
    if not varied:
        return total
    total = None if total is None else namespace(total).repeat(total, batch, axis=0)
    return _summed(varied, robot, like, batch, total)


def _summed(
    chosen: Sequence[BoundEffect],
    robot: RobotModel,
    like: Array,
    batch: int,
    total: Array | None = None,
) -> Array | None:
    """Sum of some changes of rigid inertia beside ``total``, which NumPy changes in place."""
    links = len(robot.links)
    bodies = robot.bodies(like, batch)
    for b in chosen:
        rows = rows_of(b.links, links, batch)
        matrix = b.hooks.inertia_change(take(bodies, rows), b.params)
        if rows is not None and type(total) is np.ndarray:
            total[rows] += matrix
            continue
        if rows is not None:
            matrix = scatter(matrix, rows, links * batch)
        # the first one may be an array that its effect keeps
        total = matrix + 0.0 if total is None else total + matrix
    return total
