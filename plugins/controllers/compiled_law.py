"""Machine code of the law of a controller that allocates a wrench to drives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from seals.arrays import Array, Floats
from seals.control import ActuatorCommand, Reference, RobotState
from seals.control.allocation import Allocation
from seals.control.bounded import ROUNDS, Search, changed, tried
from seals.control.protocols import (
    AIM_ARRAYS,
    AIM_OPTIONS,
    STATE_ARRAYS,
    Buoyancy,
    CommandLaw,
    Compiler,
    SearchLaw,
    of_one,
)
from seals.pytree import leaves, mapped
from seals.state_records import state_record

State = TypeVar("State", bound=tuple[Any, ...])


class Demand(Protocol):
    """Demand on the drives."""

    @property
    def wrench(self) -> Array:
        """Wrench to allocate, the chosen rows, torque about the centre of gravity, (B, rows)."""

    @property
    def speeds(self) -> Array | None:
        """Commands that the reference asks for in place of it, (B, n); None for none."""


class AllocatingLaw(Protocol):
    """Law that finds a wrench, and gives commands for what was allocated; pure, batch first."""

    @property
    def allocation(self) -> Allocation:
        """Allocation of the wrench, with ``priority`` and for independent rows."""

    def asked(self, s: RobotState, aim: Reference, joints: Array, memory: Any) -> Any:
        """Return the `Demand`; the last field of the memory is the targets of the joints."""

    def ordered(self, s: RobotState, wanted: Array, asked: Any, memory: Any) -> tuple[Array, Any]:
        """Return commands for what was allocated, and the new memory."""


@state_record
class PackedState(NamedTuple):
    """State of a controller between calls of machine code.

    Args:
        block: all numbers of its state but the targets, in its order, shape (m,).
        joints: targets of the joints [rad or m], shape (J,).
    """

    block: Floats
    joints: Floats | None

    def unpacked(self, form: State) -> State:
        """Return the state in full; ``form``: one of the same shapes."""
        return _filled(form, self.block, self.joints)


def packed(memory: tuple[Any, ...]) -> PackedState:
    """Return a state as a block of numbers."""
    parts = [np.reshape(x, -1) for x in leaves(memory[:-1])]
    return PackedState(np.concatenate(parts), memory[-1])


def _filled(form: State, block: Array, joints: Any) -> State:
    """Return a state of the shapes of another from a block on any array library."""
    place = 0

    def taken(leaf: Floats) -> Array:
        nonlocal place
        first, place = place, place + leaf.size
        return block[first:place].reshape(leaf.shape)

    made: Any = type(form)
    found: State = made._make((*mapped(form[:-1], taken), joints))
    return found


class _Kernels(NamedTuple):
    """Machine code of one form of the law.

    Args:
        plain: without regard to the rotors' bounds; also begins the search for the best within.
        round: of that search; None, as the next, where the rotors' thrusts are given.
        bounded: of the law, with what it found.
    """

    plain: Any
    round: Any
    bounded: Any


class CompiledController:
    """The law of a controller as machine code.

    Args:
        law: of the controller.
        form: its state after a call, of any numbers.
        compiled: makes machine code of a law.
    """

    def __init__(self, law: AllocatingLaw, form: Any, compiled: Compiler) -> None:
        self._law, self._form, self._compiled = law, form, compiled
        self._kernels: dict[Any, _Kernels] = {}

    def command(
        self, s: RobotState, aim: Reference, joints: Floats, memory: PackedState
    ) -> tuple[ActuatorCommand, PackedState]:
        """Return commands and memory as the controller's own ``command``."""
        force, place = s.buoyancy
        given = [
            *(s.position, s.rotation, s.velocity, s.angular_velocity, s.joints, s.joint_velocity),
            *(s.centre, s.inertia, s.centre_map, s.momentum_map, s.gain, s.limit, s.low),
            *(s.submersion, force, place, joints, memory.block),
            *(aim.velocity, aim.acceleration, aim.yaw, aim.yaw_rate),
        ]
        given += [x for x in (getattr(aim, name) for name in AIM_OPTIONS) if x is not None]
        key = s.step, aim.given
        kernels = self._kernels.get(key)
        if kernels is None:
            kernels = self._kernels[key] = self._traced(s, aim, given)
        within, order, block, *search = kernels.plain(*given)
        if search and not within.item():
            fixed, state, bounds = search
            for _ in range(ROUNDS * len(order)):
                share, wrong, state = kernels.round(fixed, state)
                if not wrong.item():
                    break
            order, block = kernels.bounded(*given, share, bounds)
        return ActuatorCommand(order, joints), PackedState(block, joints)

    def law(self, period: float, aim: Reference) -> CommandLaw | None:
        """Return the law for aims of the form of one; None before the first call with such."""
        kernels = self._kernels.get((period, aim.given))
        if kernels is None:
            return None
        more = aim.given
        names = (*STATE_ARRAYS, "force", "place", "targets", "memory")
        aims = ("velocity_wanted", *AIM_ARRAYS[1:])
        within, order, block = range(3)
        turns = ROUNDS * kernels.plain.views[1][order].size
        search = SearchLaw(within, kernels.round, kernels.bounded, turns)
        return CommandLaw(
            *(kernels.plain, (*names, *aims, *more), block),
            numbers=lambda memory: memory.block,
            remembered=lambda numbers, last: PackedState(numbers, last.joints),
            order=order,
            search=None if aim.thrusts is not None else search,
            aimed=lambda other: {name: getattr(other, name) for name in more},
        )

    def _traced(self, s: RobotState, aim: Reference, given: Sequence[Any]) -> _Kernels:
        """Compile the law for arguments of these shapes."""
        shapes = [np.shape(x) for x in given]
        allocation, drives = self._law.allocation, len(s.limit)

        def asked(arrays: Sequence[Array]) -> tuple[RobotState, Demand, Any]:
            more: Iterator[Array] = (
                x.reshape(shape or (1,)) for x, shape in zip(arrays, shapes, strict=True)
            )
            state = s._replace(**{name: next(more) for name in STATE_ARRAYS})
            state = state._replace(buoyancy=Buoyancy(next(more), next(more)))
            joints = next(more)
            memory = _filled(self._form, next(more), joints)
            names = (*AIM_ARRAYS, *aim.given)
            wanted = aim._replace(**{name: next(more) for name in names})
            state, wanted = of_one(state, wanted)
            return state, self._law.asked(state, wanted, joints, memory), memory

        def ended(parts: tuple[RobotState, Demand, Any], wanted: Array) -> list[Array]:
            state, found, memory = parts
            order, new = self._law.ordered(state, wanted, found, memory)
            flat = [x.reshape(-1) for x in leaves(new[:-1])]
            return [order[0], np.concatenate(flat)]

        def plain(*arrays: Array) -> list[Array]:
            state, found, _ = parts = asked(arrays)
            if found.speeds is not None:
                return [1.0 + 0.0 * state.submersion, *ended(parts, found.speeds)]
            bounds = {"gain": state.gain, "limit": state.limit, "low": state.low}
            wanted, within, (h, soft, g, *rest), low, span = allocation.unbounded(
                found.wrench, state.centre, **bounds
            )
            search = ((h, soft, g), rest, (low, span))
            flat = [np.concatenate([x.reshape(-1) for x in part]) for part in search]
            return [within, *ended(parts, wanted), *flat]

        def bounded(*arrays: Array) -> list[Array]:
            *own, share, bounds = arrays
            within = np.minimum(np.maximum(share, 0.0), 1.0)
            squares = bounds[:drives] + within * bounds[drives:]
            return ended(asked(own), allocation.of_squares(squares[None]))

        def turn(fixed: Array, state: Array) -> list[Array]:
            n = drives
            h, soft = (fixed[k : k + n * n].reshape((1, n, n)) for k in (0, n * n))
            g = fixed[2 * n * n :][None]
            rest = state[:n][None], state[n : 2 * n][None], state[2 * n :][:1], state[2 * n + 1 :]
            now = Search(h, soft, g, *rest)
            x, wrong = tried(now)
            after = [y.reshape(-1) for y in changed(now, x, wrong)[3:]]
            return [x[0], np.any(wrong), np.concatenate(after)]

        own = [shape or (1, 1) for shape in shapes]
        if aim.thrusts is not None:
            return _Kernels(self._compiled(plain, own), None, None)
        size = 2 * drives * drives + drives
        return _Kernels(
            self._compiled(plain, own),
            self._compiled(turn, [(size,), (2 * drives + 2,)]),
            self._compiled(bounded, [*own, (drives,), (2 * drives,)]),
        )
