"""Command of a robot within a stretch of steps: weights, aim, controller and drives in the loop.

Python is asked when the guide changes its mind, or a sensor tells where the robot is.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.control.protocols import CommandLaw, Steady
from seals.control.tracking import towards
from seals.world.compiled_links import Layout, Look
from seals.world.drivetrain import Drivetrain
from seals.world.scalar_compiler import Kernel, Place, Program, compiled

_WEIGHTS = (
    *("centre", "inertia", "centre_map", "momentum_map", "submersion", "force", "place"),
    *("gain", "limit", "low"),
)
"""Results of `seals.world.pilot.Weighing.numbers`."""


class Given(NamedTuple):
    """Places of a robot's state at the start of a step.

    Args:
        block: of the links, see `seals.world.compiled_links.Layout`.
        drive: states of the drives.
        voltage: of the battery; None for none.
        held: commands of the drives.
    """

    block: Place
    drive: Place
    voltage: Place | None
    held: Place


class LoopedCommand:
    """Command of one robot in a loop of its steps.

    Args:
        law: of the controller.
        weights: law of what the controller is told of the robot.
        layout: of the links.
        train: of the robot.
        look: the links at any instant.
        full: voltage of the full battery [V]; None without one.
        led: whether the aim leads to a place.
        step: h [s].
        every: steps from one command to the next.
    """

    def __init__(  # noqa: PLR0917  parts of one robot
        self,
        law: CommandLaw,
        weights: Kernel,
        layout: Layout,
        train: Drivetrain,
        look: Look,
        full: float | None,
        led: bool,
        step: float,
        every: int,
    ) -> None:
        self.law, self.every, self._step = law, every, step
        self._weights, self._layout, self._look = weights, layout, look
        kernel: Any = law.kernel
        self._kernel, count = kernel, kernel.views[1][law.order].size
        self._out, self._velocity = kernel.memory[1].copy(), np.zeros(3)
        self._aim = compiled(_led, [(1, 3), (1, 3), (1, 1), (1, 1)]) if led else None
        shapes: list[tuple[int, ...]] = [(count,), (1, count)]
        self._train = compiled(
            lambda order, drive, *voltage: train.driven(
                order[None], drive, voltage[0] / full if voltage else None
            ),
            [*shapes, (1, 1)] if full is not None else shapes,
        )

    def begin(self, memory: Any, targets: Floats, steady: Steady) -> None:
        """Set what the first command begins with.

        Args:
            memory: of the controller.
            targets: of the joints, from the last command.
            steady: the guide's aim.
        """
        aim, places = steady.aim, self._kernel.places
        values = {
            **{"memory": self.law.numbers(memory), "targets": targets},
            "velocity_wanted": aim.velocity,
            **{"acceleration": aim.acceleration, "yaw": aim.yaw, "yaw_rate": aim.yaw_rate},
        }
        for name, value in values.items():
            places[self.law.names.index(name)][...] = value
        if self._aim is not None:
            for place, part in zip(self._aim.places[1:], steady[1:], strict=True):
                place[...] = part

    def write(self, program: Program, given: Given) -> None:
        """Write a command."""
        law, kernel, names = self.law, self._kernel, self.law.names
        weights, layout = self._weights, self._layout

        def argument(name: str) -> tuple[Place, int]:
            view = kernel.views[0][names.index(name)]
            return program.given(kernel, view.start), view.size

        def inside(name: str, first: int = 0) -> Place:
            start = layout.span(name)[0] + first
            return given.block._replace(start=given.block.start + start)

        views = weights.views[0]
        program.copy(program.given(weights, views[0].start), given.block, views[0].size)
        program.tell_time(program.given(weights, views[1].start), self._step, 0)
        program.run(weights)
        for name, view in zip(_WEIGHTS, weights.views[1], strict=True):
            program.copy(argument(name)[0], program.out(weights, view.start), argument(name)[1])
        joints = argument("joints")[1]
        sources = {"position": inside("origins"), "rotation": inside("rotations")}
        sources |= {"velocity": inside("velocities"), "angular_velocity": inside("twists", 3)}
        rates = inside("speed", layout.span("speed")[1] - joints)
        sources |= {"joints": inside("joints"), "joint_velocity": rates}
        for name, source in sources.items():
            place, size = argument(name)
            program.copy(place, source, size)
        if self._aim is not None:
            program.copy(program.given(self._aim), inside("origins"), 3)
            program.run(self._aim)
            program.copy(argument("velocity_wanted")[0], program.out(self._aim), 3)
        program.run(kernel)
        order, memory = (kernel.views[1][k] for k in (law.order, law.memory))
        with program.unless(program.out(kernel, kernel.views[1][law.done].start)):
            self._write_search(program)
        program.copy(argument("memory")[0], program.out(kernel, memory.start), memory.size)
        self._write_drives(program, program.out(kernel, order.start), given)

    def _write_search(self, program: Program) -> None:
        """Write the search for the best command within the drives' bounds."""
        law, kernel = self.law, self._kernel
        turn, found, results = law.turn, law.found, kernel.views[1]
        fixed, state, bounds = results[law.memory + 1 : law.memory + 4]
        for view, part in zip(turn.views[0], (fixed, state), strict=True):
            place = program.given(turn, view.start)
            program.copy(place, program.out(kernel, part.start), part.size)
        share, wrong, after = turn.views[1]
        with program.repeated(law.turns, program.out(turn, wrong.start)):
            program.run(turn)
            own = turn.views[0][1]
            place = program.given(turn, own.start)
            program.copy(place, program.out(turn, after.start), own.size)
        *_, shares, more = found.views[0]
        program.copy(program.given(found), program.given(kernel), shares.start)
        place = program.given(found, shares.start)
        program.copy(place, program.out(turn, share.start), shares.size)
        place = program.given(found, more.start)
        program.copy(place, program.out(kernel, bounds.start), more.size)
        program.run(found)
        for view, k in zip(found.views[1], (law.order, law.memory), strict=True):
            place = program.out(kernel, results[k].start)
            program.copy(place, program.out(found, view.start), view.size)

    def _write_drives(self, program: Program, order: Place, given: Given) -> None:
        """Write what the drives are asked."""
        train, places = self._train, [order, given.drive]
        places += [] if given.voltage is None else [given.voltage]
        for view, place in zip(train.views[0], places, strict=True):
            program.copy(program.given(train, view.start), place, view.size)
        program.run(train)
        for view, place in zip(train.views[1], (given.held, given.drive), strict=True):
            program.copy(place, program.out(train, view.start), view.size)

    @property
    def led(self) -> bool:
        """Whether the aim leads to a place."""
        return self._aim is not None

    def record(self, program: Program, tapes: tuple[int, int]) -> None:
        """Copy the last order, and the velocity of a place led to, to the rows of two tapes."""
        order = self._kernel.views[1][self.law.order]
        program.record(tapes[0], (program.out(self._kernel, order.start), order.size))
        if self._aim is not None:
            program.record(tapes[1], (program.out(self._aim), 3))

    def accept(self, program: Program) -> None:
        """Copy what `found` returns, of a step that is not refused."""
        program.copy(program.memory(self._out), program.out(self._kernel), self._out.size)
        if self._aim is not None:
            program.copy(program.memory(self._velocity), program.out(self._aim), 3)

    def found(self) -> tuple[Floats, Floats, Floats | None]:
        """Return order and numbers of the controller's memory, and the velocity of a place led to.

        Those of the last command that was not refused.
        """
        out, views = self._out.copy(), self._kernel.views[1]
        velocity = None if self._aim is None else self._velocity.copy()
        return views[self.law.order].of(out), views[self.law.memory].of(out), velocity


def _led(position: Array, place: Array, gain: Array, speed: Array) -> list[Array]:
    """Velocity towards a place, see `seals.control.tracking.pursued`; pure."""
    x, y, z = towards(position[0], place[0], gain[0, 0], speed[0, 0])
    return [namespace(position).stack([x, y, z])]
