"""Command of a robot within a stretch of steps: weights, aim, controller and drives in the loop.

Python is asked when the guide changes its mind, or a sensor tells where the robot is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.control.protocols import ActuatorCommand, CommandLaw, SearchLaw, Steady
from seals.control.tracking import towards
from seals.scalar_compiler import Kernel, Place, Program, compiled
from seals.world.compiled_links import Layout, Look
from seals.world.drivetrain import Drivetrain

_WEIGHTS = (
    *("centre", "inertia", "centre_map", "momentum_map", "submersion", "force", "place"),
    *("gain", "limit", "low"),
)
"""Results of `seals.world.pilot.Weighing.numbers`."""


class Given(NamedTuple):
    """Places of a robot's state at the start of a step.

    Args:
        block: of the links, see `seals.world.compiled_links.Layout`.
        drive: states of the drives; None for none, as all others.
        voltage: of the battery.
        held: commands of the drives.
        goal: of the joints.
    """

    block: Place
    drive: Place | None
    voltage: Place | None
    held: Place | None
    goal: Place | None


class LoopedCommand:
    """Command of one robot in a loop of its steps.

    Args:
        law: of the controller.
        weights: gives the law of what the controller is told of the robot.
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
        weights: Callable[[], Kernel],
        layout: Layout,
        train: Drivetrain,
        look: Look,
        full: float | None,
        led: bool,
        step: float,
        every: int,
    ) -> None:
        self.law, self.every, self._step = law, every, step
        self._layout, self._look = layout, look
        self._weights = weights() if set(_WEIGHTS) & set(law.names) else None
        kernel: Any = law.kernel
        self._kernel = kernel
        self._out, self._velocity = kernel.memory[1].copy(), np.zeros(3)
        self._aim = compiled(_led, [(1, 3), (1, 3), (1, 1), (1, 1)]) if led else None
        self._train: Kernel | None = None
        if law.order is not None:
            count = kernel.views[1][law.order].size
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
        aim, places, law = steady.aim, self._kernel.places, self.law
        values = {
            **{"memory": law.numbers(memory), "targets": targets},
            "velocity_wanted": aim.velocity,
            **{"acceleration": aim.acceleration, "yaw": aim.yaw, "yaw_rate": aim.yaw_rate},
            **law.aimed(aim),
        }
        for name, place in zip(law.names, places, strict=True):
            if name in values:
                place[...] = values[name]
        if self._aim is not None:
            for place, part in zip(self._aim.places[1:], steady[1:], strict=True):
                place[...] = part

    def write(self, program: Program, given: Given) -> None:
        """Write a command."""
        law, kernel, views = self.law, self._kernel, self._kernel.views
        for name, source in self._sources(program, given).items():
            place, size = self._argument(program, name)
            program.copy(place, source, size)
        if self._aim is not None:
            program.copy(program.given(self._aim), self._inside(given.block, "origins"), 3)
            program.run(self._aim)
            place, size = self._argument(program, "velocity_wanted")
            program.copy(place, program.out(self._aim), size)
        program.run(kernel)
        if law.search is not None:
            with program.unless(program.out(kernel, views[1][law.search.done].start)):
                self._write_search(program, law.search)
        place, size = self._argument(program, "memory")
        program.copy(place, program.out(kernel, views[1][law.memory].start), size)
        if law.order is not None:
            self._write_drives(program, program.out(kernel, views[1][law.order].start), given)
        if law.targets is not None:
            assert given.goal is not None
            targets = views[1][law.targets]
            program.copy(given.goal, program.out(kernel, targets.start), targets.size)

    def _argument(self, program: Program, name: str) -> tuple[Place, int]:
        """Place of an argument of the law, and its length."""
        view = self._kernel.views[0][self.law.names.index(name)]
        return program.given(self._kernel, view.start), view.size

    def _inside(self, block: Place, name: str, first: int = 0) -> Place:
        """Place of an array in the block of the links."""
        return block._replace(start=block.start + self._layout.span(name)[0] + first)

    def _sources(self, program: Program, given: Given) -> dict[str, Place]:
        """Places of arguments of the law, by name; written: what the controller is told."""
        names, layout, sources = self.law.names, self._layout, {}
        if self._weights is not None:
            weights = self._weights
            views = weights.views[0]
            program.copy(program.given(weights, views[0].start), given.block, views[0].size)
            program.tell_time(program.given(weights, views[1].start), self._step, 0)
            program.run(weights)
            pairs = zip(_WEIGHTS, weights.views[1], strict=True)
            sources = {name: program.out(weights, view.start) for name, view in pairs}
        joints = layout.span("joints")[1]
        inside = {"position": ("origins", 0), "rotation": ("rotations", 0)}
        inside |= {"velocity": ("velocities", 0), "angular_velocity": ("twists", 3)}
        inside |= {"joints": ("joints", 0)}
        inside |= {"joint_velocity": ("speed", layout.span("speed")[1] - joints)}
        sources |= {name: self._inside(given.block, *at) for name, at in inside.items()}
        return {name: place for name, place in sources.items() if name in names}

    def _write_search(self, program: Program, search: SearchLaw) -> None:
        """Write the search for the best command within the drives' bounds."""
        law, kernel = self.law, self._kernel
        turn, found, results = search.turn, search.found, kernel.views[1]
        assert law.order is not None
        fixed, state, bounds = results[law.memory + 1 : law.memory + 4]
        for view, part in zip(turn.views[0], (fixed, state), strict=True):
            place = program.given(turn, view.start)
            program.copy(place, program.out(kernel, part.start), part.size)
        share, wrong, after = turn.views[1]
        with program.repeated(search.turns, program.out(turn, wrong.start)):
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
        train, drive, held = self._train, given.drive, given.held
        assert train is not None
        assert drive is not None
        assert held is not None
        places = [order, drive, *([] if given.voltage is None else [given.voltage])]
        for view, place in zip(train.views[0], places, strict=True):
            program.copy(program.given(train, view.start), place, view.size)
        program.run(train)
        for view, place in zip(train.views[1], (held, drive), strict=True):
            program.copy(place, program.out(train, view.start), view.size)

    @property
    def tells(self) -> tuple[bool, bool, bool]:
        """Whether `record` tells an order, the velocity of a place led to, and targets."""
        return self.law.order is not None, self._aim is not None, self.law.targets is not None

    @property
    def widths(self) -> tuple[int, int, int]:
        """Numbers in a row of the tapes of `record`."""
        views = self._kernel.views[1]
        order, targets = (
            0 if k is None else views[k].size for k in (self.law.order, self.law.targets)
        )
        return order, 3, targets

    def record(self, program: Program, tapes: Sequence[int]) -> None:
        """Copy the last order, the velocity of a place led to, and targets, to rows of tapes."""
        out, views = self._kernel, self._kernel.views[1]
        for tape, k in ((tapes[0], self.law.order), (tapes[2], self.law.targets)):
            if k is not None:
                program.record(tape, (program.out(out, views[k].start), views[k].size))
        if self._aim is not None:
            program.record(tapes[1], (program.out(self._aim), 3))

    def accept(self, program: Program) -> None:
        """Copy what `found` returns, of a step that is not refused."""
        program.copy(program.memory(self._out), program.out(self._kernel), self._out.size)
        if self._aim is not None:
            program.copy(program.memory(self._velocity), program.out(self._aim), 3)

    def found(self, last: ActuatorCommand) -> tuple[ActuatorCommand, Floats, Floats | None]:
        """Return the command, numbers of the controller's memory, and velocity of a place led to.

        Those of the last command that was not refused.

        Args:
            last: the command before.
        """
        out, views, law = self._out.copy(), self._kernel.views[1], self.law
        velocity = None if self._aim is None else self._velocity.copy()
        order = ActuatorCommand(
            last.drive if law.order is None else views[law.order].of(out),
            last.joints if law.targets is None else views[law.targets].of(out),
        )
        return order, views[law.memory].of(out), velocity


def _led(position: Array, place: Array, gain: Array, speed: Array) -> list[Array]:
    """Velocity towards a place, see `seals.control.tracking.pursued`; pure."""
    x, y, z = towards(position[0], place[0], gain[0, 0], speed[0, 0])
    return [namespace(position).stack([x, y, z])]
