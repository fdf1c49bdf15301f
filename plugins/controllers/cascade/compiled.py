"""Machine code of the cascade's law, for calls in which no rotor is at a bound."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats
from seals.control import ActuatorCommand, Reference, RobotState
from seals.control.protocols import Buoyancy, Compiler
from seals.pytree import leaves, mapped
from seals.state_records import state_record

if TYPE_CHECKING:
    from seals.plugins.controllers.cascade.controller import Cascade, CascadeState

_AIM = ("velocity", "acceleration", "yaw", "yaw_rate")


@state_record
class PackedState(NamedTuple):
    """State of the cascade between calls of machine code.

    Args:
        block: all numbers of `CascadeState` but the targets, in its order, shape (m,).
        joints: targets of the joints [rad or m], shape (J,).
    """

    block: Floats
    joints: Floats


class CompiledCascade:
    """The law of a cascade as machine code.

    Args:
        law: the cascade.
        form: its state after two calls, of any numbers.
        compiled: makes machine code of a law.
    """

    def __init__(self, law: Cascade, form: CascadeState, compiled: Compiler) -> None:
        """Compile nothing yet."""
        self._law, self._form, self._compiled = law, form, compiled
        self._shapes = [np.shape(x) for x in leaves(form._replace(joints=None))]
        self._ends = np.cumsum([int(np.prod(s, dtype=int)) for s in self._shapes]).tolist()
        self._kernels: dict[Any, Any] = {}

    def command(
        self, s: RobotState, aim: Reference, joints: Floats, memory: PackedState
    ) -> tuple[ActuatorCommand, PackedState] | None:
        """Return commands and memory as `Cascade.command`; None where a rotor is at a bound."""
        force, place = s.buoyancy
        given = [
            *(s.position, s.rotation, s.velocity, s.angular_velocity, s.joints, s.joint_velocity),
            *(s.centre, s.inertia, s.centre_map, s.momentum_map, s.gain, s.limit, s.low),
            *(s.submersion, force, place, joints, memory.block),
            *(aim.velocity, aim.acceleration, aim.yaw, aim.yaw_rate),
        ]
        if aim.position is not None:
            given.append(aim.position)
        key = s.step, aim.position is None
        kernel = self._kernels.get(key)
        if kernel is None:
            kernel = self._kernels[key] = self._traced(s, aim, given)
        within, order, block = kernel(*given)
        if not within.item():
            return None
        return ActuatorCommand(order, joints), PackedState(block, joints)

    def packed(self, memory: CascadeState) -> CascadeState | PackedState:
        """Return a state as a block of numbers; one of the first two calls stays."""
        if memory.drive is None or memory.known.second.value is None:
            return memory
        parts = [np.reshape(x, -1) for x in leaves(memory._replace(joints=None))]
        return PackedState(np.concatenate(parts), memory.joints)

    def unpacked(self, memory: PackedState) -> CascadeState:
        """Return a state in full."""
        return self._state(memory.block, memory.joints)

    def _state(self, block: Array, joints: Array) -> CascadeState:
        """Return a state from a block on any array library."""
        places = zip([0, *self._ends], self._ends, self._shapes, strict=False)
        parts = iter([block[a:b].reshape(shape) for a, b, shape in places])
        found: CascadeState = mapped(self._form._replace(joints=None), lambda _: next(parts))
        return found._replace(joints=joints)

    def _traced(self, s: RobotState, aim: Reference, given: Sequence[Any]) -> Any:
        """Compile the law for arguments of these shapes."""
        shapes = [np.shape(x) for x in given]

        def law(*arrays: Array) -> list[Array]:
            more: Iterator[Array] = (
                x.reshape(shape) for x, shape in zip(arrays, shapes, strict=True)
            )
            names = ("position", "rotation", "velocity", "angular_velocity", "joints")
            names += ("joint_velocity", "centre", "inertia", "centre_map", "momentum_map")
            names += ("gain", "limit", "low", "submersion")
            state = s._replace(**{name: next(more) for name in names})
            state = state._replace(buoyancy=Buoyancy(next(more), next(more)))
            joints = next(more)
            memory = self._state(next(more), joints)
            wanted = aim._replace(**{name: next(more) for name in _AIM})
            if aim.position is not None:
                wanted = wanted._replace(position=next(more))
            asked = self._law.asked(state, wanted, joints, memory)
            bounds = {"gain": state.gain, "limit": state.limit, "low": state.low}
            found = self._law.allocation.unbounded(asked.wrench, state.centre, **bounds)
            order, new = self._law.ordered(state, found[0], asked, memory)
            parts = [x.reshape(-1) for x in leaves(new._replace(joints=None))]
            return [found[1], order, np.concatenate(parts)]

        return self._compiled(law, [shape or (1, 1) for shape in shapes])
