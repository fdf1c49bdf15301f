"""Steps that follow each other without Python: laws, engine and motion of all robots as one loop.

A stretch lasts until a controller is due, a command arrives, a sensor wants to read, or a step
takes another form: hulls are wetted in another way, something touches or nothing does any more,
a joint comes to its stop, a drive to its limit. The step that does is refused and made one by one,
see `World.advance`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats
from seals.backend import CompiledBody, Configuration
from seals.scalar_compiler import Kernel, Place, Program, View, compiled
from seals.state_records import state_record
from seals.world.compiled_links import CompiledLinks, Look
from seals.world.drivetrain import Drivetrain
from seals.world.ledger import Ledger
from seals.world.looped_command import Given, LoopedCommand

MOST = 64
"""Steps of a stretch."""
_PATIENCE, _KEPT, _MET = 8, 64, 4096
"""Steps of one combination of forms of several robots before their loop is compiled, which takes as
long as a hundred single steps; loops, and combinations counted, at most: forms of robots at the
surface combine freely."""
_TAPES = 7
"""Arrays of a robot that get a row of every step: the ledger, five tables, contacts or poses."""


@state_record
class Supply(NamedTuple):
    """Battery and drives after a step.

    Args:
        voltage: of the battery [V], shape (1, 1); None where it is not known.
        drive: states of the drives if no command arrives meanwhile, shape (1, n); None likewise.
    """

    voltage: Floats | None = None
    drive: Floats | None = None


class Loads(NamedTuple):
    """Results of the laws.

    Args:
        row: of the ledger [N, N m], shape (effects, L, 6).
        memory: of the effects, by name.
        speeds: of the rotors, by actuator [rad/s].
        supply: what the drives will have.
    """

    row: Floats
    memory: dict[str, Floats]
    speeds: dict[str, Floats]
    supply: Supply


def supply_of(voltage: Floats, drive: Floats) -> Supply:
    """Return battery and drives of results of the laws, which are empty where nothing is known."""
    return Supply(voltage if voltage.size else None, drive if drive.size else None)


class Ready(NamedTuple):
    """A step that is to be made.

    Args:
        key: the body's form, which commands there are, how hulls are wetted, and h [s].
        look: the links at its start.
        time: of its start [s].
        commands: torque, drive, voltage, position, and what the drives are asked; None for none.
        memory: of the effects, by name.
    """

    key: tuple[Any, ...]
    look: Look
    time: float
    commands: tuple[Floats | None, ...]
    memory: Mapping[str, Floats]


@dataclass
class Form:
    """One form of a step: its kernel, what the results are of, and its loops by their commands."""

    kernel: Kernel
    remembered: list[str]
    turning: list[str]
    stretches: dict[tuple[LoopedCommand | None, bool], Stretch] = field(default_factory=dict)

    def told(
        self, row: Floats, results: list[Floats], memory: Mapping[str, Floats]
    ) -> tuple[Loads, list[Floats]]:
        """Return the results by name, and those for the body.

        Args:
            row: of the ledger.
            results: all others.
            memory: before the step.
        """
        first, last = len(self.remembered), len(self.remembered) + len(self.turning)
        voltage, ahead, *body = results[last:]
        # in the order of the memory before: the kernel is given its values
        new = {**memory, **dict(zip(self.remembered, results, strict=False))}
        speeds = dict(zip(self.turning, results[first:last], strict=True))
        return Loads(row, new, speeds, supply_of(voltage, ahead)), body


class Parts(NamedTuple):
    """Parts of a robot that its steps are made of."""

    links: CompiledLinks
    body: CompiledBody
    drivetrain: Drivetrain


class Made(NamedTuple):
    """What a stretch has made.

    Args:
        steps: how many.
        memory: of the effects, by name.
        speeds: of the rotors, by actuator [rad/s].
        supply: what the drives will have.
        drive: states of the drives in the last step, shape (1, n); None for none.
        voltage: of the battery in it [V]; None for none.
        held: joint positions that the servos held in it; None for none.
        asked: what the drives were asked in it, shape (1, n); None for none.
        passed: the steps before the last one; None where there was one alone.
    """

    steps: int
    memory: Mapping[str, Floats]
    speeds: Mapping[str, Floats]
    supply: Supply
    drive: Floats | None
    voltage: Floats | None
    held: Floats | None
    asked: Floats | None
    passed: Passed | None


class Passed(NamedTuple):
    """Steps that were made at once, a row each.

    Args:
        stretch: that made them.
        times: at their ends [s].
        leaps: results of the law of the motion, shape (N, numbers).
        laws: memory, speeds and supply, of the results of the laws, shape (N, numbers).
        orders: what the loop commanded the drives, shape (N, n); None where it did not.
        velocities: of the place that it led to, shape (N, 3); None likewise.
        targets: what it commanded the joints, shape (N, J); None likewise.
        contacts: records of them, and of those in the step after; None where nothing touched.
        poses: of the base as the engine tells them; None where that is what it was given.
        began: the links where the first step began.
    """

    stretch: Stretch
    times: list[float]
    leaps: Floats
    laws: Floats
    orders: Floats | None
    velocities: Floats | None
    targets: Floats | None
    contacts: Floats | None
    poses: Floats | None
    began: Look

    def looks(self) -> list[Look]:
        """Return the links at the ends of the steps."""
        return [self.look(k) for k in range(len(self.times))]

    def look(self, k: int) -> Look:
        """Return the links at the end of a step."""
        tree, layout = self.stretch.tree, self.stretch.layout
        # of its own memory: the next stretch writes to the same place
        return Look(tree, self.times[k], self._leapt(0)[k].copy(), layout, "none", True)

    def links(self, name: str) -> Floats:
        """Return an array of `seals.world.compiled_links.Layout`, a row for each step."""
        return self.stretch.layout.rows(self._leapt(0), name)

    def states(self) -> Configuration:
        """Return what the body read after each step."""
        body: Any = self.stretch.body
        _, *written, joints, now, _, _ = (self._leapt(k) for k in range(len(self.stretch.leapt)))
        places = written if self.poses is None else [self.poses]
        return body.read_rows(places, joints, now)  # type: ignore[no-any-return]

    def pressing(self) -> Floats | None:
        """Return `RigidBody.contact_normals` after each step, shape (N, L); None for no contact."""
        if self.contacts is None:
            return None
        body: Any = self.stretch.body
        return body.pressing(self.contacts[:-1])  # type: ignore[no-any-return]

    def memory(self, name: str) -> Floats | None:
        """Return the memory of an effect after each step; None where it stays as it was."""
        view = self.stretch.remembered.get(name)
        return None if view is None else _rows(self.laws, view, self.stretch.first)

    def _leapt(self, result: int) -> Floats:
        return _rows(self.leaps, self.stretch.leapt[result], 0)


def _rows(table: Floats, view: View, first: int) -> Floats:
    """Return an array of results, a row for each step; ``first``: numbers before the table's."""
    start = view.start - first
    found: Floats = table[:, start : start + view.size].reshape(len(table), *view.shape)
    return found


class Views(Mapping[str, Floats]):
    """Arrays in one block of memory, made when they are asked for.

    Args:
        memory: the block.
        views: by name, see `Kernel.views`.
    """

    __slots__ = ("_memory", "_views")

    def __init__(self, memory: Floats, views: Mapping[str, View]) -> None:
        self._memory, self._views = memory, views

    def __getitem__(self, name: str) -> Floats:
        return self._views[name].of(self._memory)

    def __iter__(self) -> Iterator[str]:
        return iter(self._views)

    def __len__(self) -> int:
        return len(self._views)


class _Law(NamedTuple):
    """Law in the loop."""

    kernel: Kernel

    def argument(self, program: Program, k: int) -> tuple[Place, int]:
        """Place of an argument, and its length."""
        view = self.kernel.views[0][k]
        return program.given(self.kernel, view.start), view.size

    def result(self, program: Program, k: int) -> tuple[Place, int]:
        """Place of a result, and its length."""
        view = self.kernel.views[1][k]
        return program.out(self.kernel, view.start), view.size


class Stretch:
    """Steps of one robot of one form, its part of a `Loop`.

    Args:
        parts: of the robot.
        ready: a step of the form.
        form: the laws of its loads.
        leap: the law of the motion.
        command: that is given in the loop, or None.

    Attributes:
        touching: whether something touches in all of them.
    """

    def __init__(
        self, parts: Parts, ready: Ready, form: Form, leap: Kernel, command: LoopedCommand | None
    ) -> None:
        self.command, self.touching = command, parts.body.touching
        self._parts, self._form, self._key = parts, form, ready.key
        self._loads, self._leap = _Law(form.kernel), _Law(leap)
        self._commands = [x is not None for x in ready.commands]
        self._names = list(ready.memory)
        self._after = _Law(self._between(ready))
        self._mover: Kernel | None = None
        if self._commands[3] and parts.drivetrain.goal is not None:
            step, both = ready.key[-1], [(1, parts.body.robot.tree.joints)] * 2
            self._mover = compiled(lambda x, y: [parts.drivetrain.moved(x, y, step)], both)
        self.tree, self.layout = parts.body.robot.tree, parts.links.layout
        self.body, self.leapt = parts.body, leap.views[1]
        results = form.kernel.views[1]
        # the results of the laws: the row, memory, speeds, battery, drives, those for the body
        last = 1 + len(form.remembered)
        self.remembered = dict(zip(form.remembered, results[1:last], strict=True))
        self.first, self._beyond = results[1].start, results[last + len(form.turning) + 2].start
        commanded = (0, 0, 0) if command is None else command.widths
        self._widths = [leap.memory[1].size, self._beyond - self.first, *commanded]
        self._poses = False
        views = form.kernel.views[0][2 : 2 + sum(self._commands)]
        # the commands in the last pass that was not refused
        self._given = np.zeros(sum(view.size for view in views))
        own = iter([View(view.shape, view.start - views[0].start) for view in views])
        self._kept = [next(own) if there else None for there in self._commands]
        self._tapes: list[Floats] = []
        self._addresses: list[int] = []
        later = [View(view.shape, view.start - self.first) for view in results[1:]]
        kept = dict(zip(form.remembered, later, strict=False))
        self._memories = {name: kept[name] for name in self._names if name in kept}
        self._speeds = dict(zip(form.turning, later[last - 1 :], strict=False))
        self._supply = later[last - 1 + len(form.turning) :][:2]
        self._end: Floats | None = None
        self._memory: Mapping[str, Floats] = ready.memory
        self._began, self._before = ready.look, parts.body.velocity

    def continues(self, look: Look, memory: Mapping[str, Floats]) -> bool:
        """Return whether the next step follows the last one here, and has its form.

        Args:
            look: the links at its start.
            memory: of the effects.
        """
        changed = self._after.kernel.memory[1][0] != 0.0
        return look.block is self._end and memory is self._memory and not changed

    def begin(self, ready: Ready, given: list[Any] | None) -> None:
        """Set what the first step begins with.

        Args:
            ready: the step.
            given: arguments of the law of the motion; None where the last step was made here.
        """
        commands = [x for x in ready.commands if x is not None]
        if given is None:
            for place, value in zip(self._loads.kernel.places[2:], commands, strict=False):
                place[...] = value
        else:
            own = *ready.memory.values(), *self._parts.body.compiled_arguments()
            self._loads.kernel.put([ready.look.block, ready.time, *commands, *own])
            self._leap.kernel.put(given)
            self._before = self._parts.body.velocity
        self._memory, self._began = ready.memory, ready.look
        if self._mover is not None:
            self._mover.places[1][...] = self._parts.drivetrain.goal

    def prepare(self, most: int, ledger: Ledger) -> list[int]:
        """Prepare for steps; return the addresses of the arrays that get a row of each.

        Args:
            most: steps.
            ledger: of the robot.
        """
        self._parts.body.begin_alone(self._key[-1])
        return [ledger.reserve(most), *self._addresses]

    def note(self, first: int, steps: int, ledger: Ledger) -> Made | None:
        """Note steps, their rows in the ledger; None where the first one was refused.

        Args:
            first: number of the first one, from the start.
            steps: that were made.
            ledger: of the robot.
        """
        body = self._parts.body
        body.leave()
        if not steps:
            self._end = None
            return None
        step, passed = self._key[-1], None
        times = [(first + k) * step for k in range(steps + 1)]
        ledger.append(times[:-1])
        if steps > 1:
            leaps, laws, *told = (tape[: steps - 1] for tape in self._tapes[:5])
            there = (False,) * 3 if self.command is None else self.command.tells
            orders, velocities, targets = (
                tape if some else None for tape, some in zip(told, there, strict=True)
            )
            passed = Passed(
                *(self, times[1:-1], leaps, laws, orders, velocities, targets),
                contacts=self._tapes[-1][:steps] if self.touching else None,
                poses=self._tapes[-1][: steps - 1] if self._poses else None,
                began=self._began,
            )
        found, views = self._tapes[0][steps - 1].copy(), self.leapt
        before = self._before if steps == 1 else views[-3].of(self._tapes[0][steps - 2])
        end, joints, now, middle = (views[k].of(found) for k in (0, -4, -3, -2))
        self._end, self._before = end, now
        body.end_alone(end, joints, now, None if self.touching else middle, now - before)
        if self.touching:
            began = self._began if passed is None else passed.look(steps - 2)
            body.note_contacts(self._tapes[-1][steps - 1], began)
        return self._made(steps, passed)

    def _made(self, steps: int, passed: Passed | None) -> Made:
        """Return what was made, of copies of what was recorded of the last step."""
        out, kept = self._tapes[1][steps - 1].copy(), len(self._memories) == len(self._names)
        memory: Mapping[str, Floats] = Views(out, self._memories)
        self._memory = memory if kept else {**self._memory, **memory}
        supply = supply_of(*(view.of(out) for view in self._supply))
        given = self._given.copy()
        _, drive, voltage, held, asked = (x if x is None else x.of(given) for x in self._kept)
        speeds = Views(out, self._speeds)
        return Made(steps, self._memory, speeds, supply, drive, voltage, held, asked, passed)

    def _between(self, ready: Ready) -> Kernel:
        """Compile what is asked between two steps: whether the form changes."""
        links, body, _ = self._parts
        *_, state, step = ready.key
        joints, degrees = ready.look.joints.shape[1], body.robot.degrees

        def law(extent: Array, place: Array, speed: Array) -> list[Array]:
            changes = links.changes(state, extent[0], extent[1])
            stops = body.reaches_stop(place, speed, step)
            return [changes if stops is None else changes | stops]

        return compiled(law, [(2,), (joints,), (degrees,)])

    def _argument(self, program: Program, name: str) -> tuple[Place, int]:
        """Place of a command among the arguments of the laws."""
        at = ("torque", "drive", "voltage", "position", "held").index(name)
        return self._loads.argument(program, 2 + sum(self._commands[:at]))

    @property
    def _first(self) -> int:
        """Result of the laws that is the battery's voltage; the drives' and the body's follow."""
        return 1 + len(self._form.remembered) + len(self._form.turning)

    def write_loads(self, program: Program) -> None:
        """Write the command and the laws of a step."""
        self._write_command(program)
        program.tell_time(self._loads.argument(program, 1)[0], self._key[-1], 0)
        program.run(self._loads.kernel)

    def given(self, program: Program) -> list[tuple[Place, int]]:
        """Return the places of what the laws give the body."""
        count = len(self._loads.kernel.views[1])
        return [self._loads.result(program, k) for k in range(self._first + 2, count)]

    def write_step(self, program: Program, beside: Sequence[Stretch]) -> tuple[Place, int] | None:
        """Write a step of the engine; return the record of the contacts.

        Args:
            program: to write to.
            beside: the stretches of the other robots of the scene.
        """
        block, _ = self._loads.argument(program, 0)
        origin = block._replace(start=block.start + self.layout.span("origins")[0])
        others = [(other.body, other.given(program)) for other in beside]
        given, touching = self.given(program), self.touching
        return self.body.write_step(program, given, origin, others, touching=touching)

    def write_leap(self, program: Program) -> None:
        """Write the motion of the robot, and what refuses the step."""
        body, leap = self._parts.body, self._leap
        places = [program.address(x) for x in body.native_places()]
        places = body.write_world(program) if self.touching else places
        for k, at in enumerate(places):
            place, size = leap.argument(program, k)
            program.copy(place, at, size)
        program.tell_time(leap.argument(program, self._past(len(places)))[0], self._key[-1], 1)
        program.run(leap.kernel)
        program.refuse_if(leap.result(program, len(self.leapt) - 1)[0])

    def write_end(self, program: Program, tape: int, told: tuple[Place, int] | None) -> None:
        """Write what is kept of a step that is not refused, and what the next one begins with.

        Args:
            program: to write to.
            tape: the first of the robot's, see `_TAPES`.
            told: record of the contacts; None for none.
        """
        body, loads, leap = self._parts.body, self._loads, self._leap
        if not self.touching:
            written = [leap.result(program, k) for k in range(1, len(self.leapt) - 4)]
            told = body.write_put(program, written, self.given(program)[1])
            self._poses = told is not None
        widths = [*self._widths, 0 if told is None else told[1]]
        if not self._tapes:
            self._tapes = [np.zeros((MOST, width)) for width in widths]
            self._addresses = [tape.ctypes.data for tape in self._tapes]
        if told is not None:
            program.record(tape + len(self._widths) + 1, told)
        commands, _ = loads.argument(program, 2)
        program.copy(program.memory(self._given), commands, self._given.size)
        if self.command is not None:
            self.command.accept(program)
        program.record(tape, loads.result(program, 0))
        program.record(tape + 1, (program.out(leap.kernel), self._widths[0]))
        beyond = self._beyond - self.first
        program.record(tape + 2, (program.out(loads.kernel, self.first), beyond))
        if self.command is not None:
            self.command.record(program, range(tape + 3, tape + 6))
        self._write_next(program, len(body.native_places()), self._first)
        self._write_between(program)

    def write_end_if(self, program: Program) -> None:
        """Write that the loop ends where the form of the step changes."""
        program.end_if(self._after.result(program, 0)[0])

    def _write_command(self, program: Program) -> None:
        """Write a command, where one is due, and what the servos hold from then on."""
        names = ("drive", "voltage", "position", "held")
        there = (self._commands[k] for k in (1, 2, 3, 4))
        places = {
            name: self._argument(program, name)[0] if some else None
            for name, some in zip(names, there, strict=True)
        }
        goal = held = places["position"]
        if self._mover is not None:
            goal = program.given(self._mover, self._mover.views[0][1].start)
        if self.command is not None:
            block, _ = self._loads.argument(program, 0)
            with program.every(self.command.every):
                given = *(places[x] for x in ("drive", "voltage", "held")), goal
                self.command.write(program, Given(block, *given))
        if self._mover is not None and held is not None:
            size = self._mover.views[0][0].size
            with program.every(1):
                program.copy(program.given(self._mover), held, size)
                program.run(self._mover)
                program.copy(held, program.out(self._mover), size)

    def _past(self, native: int) -> int:
        """Number of the argument of the law of the motion that is the time; the past follows."""
        return native + (0 if self.touching else 3)

    def _write_next(self, program: Program, native: int, first: int) -> None:
        """Write what the next step begins with.

        Args:
            program: to write to.
            native: number of parts of the engine's state.
            first: result of the laws that is the battery's voltage; that of the drives follows.
        """
        loads, leap, layout = self._loads, self._leap, self._parts.links.layout
        block, _ = leap.result(program, 0)
        program.copy(loads.argument(program, 0)[0], *leap.result(program, 0))
        # velocity, joints and the velocity half a step earlier, in the order of `leapt`
        last = len(self.leapt)
        for k, result in enumerate(() if self.touching else (last - 3, last - 4, last - 2)):
            program.copy(leap.argument(program, native + k)[0], *leap.result(program, result))
        # the mean speed over the step, then the links with their motion
        for k, name in enumerate(("rotations", "arms", "axes", "means")):
            start, size = layout.span(name)
            place = leap.argument(program, self._past(native) + 1 + k)[0]
            program.copy(place, block._replace(start=block.start + start), size)
        for name, result in (("voltage", first), ("drive", first + 1)):
            place, size = loads.result(program, result)
            if size:
                program.copy(self._argument(program, name)[0], place, size)
        for k, name in enumerate(self._form.remembered):
            place, size = loads.result(program, 1 + k)
            at = 2 + sum(self._commands) + self._names.index(name)
            program.copy(loads.argument(program, at)[0], place, size)

    def _write_between(self, program: Program) -> None:
        """Write what is asked between two steps."""
        after, leap = self._after, self._leap
        block, size = leap.result(program, 0)
        extent = block._replace(start=block.start + size - 2)
        program.copy(after.argument(program, 0)[0], extent, 2)
        last = len(self.leapt)
        for k, result in enumerate((last - 4, last - 3)):
            program.copy(after.argument(program, 1 + k)[0], *leap.result(program, result))
        program.run(after.kernel)


class Share(NamedTuple):
    """Part of one robot in steps that are made at once.

    Args:
        stretch: its laws, set to begin.
        ledger: of the robot.
        most: steps that it may make.
        calls: of the pilot, the first step's not among them; None where none commands in the loop.
    """

    stretch: Stretch
    ledger: Ledger
    most: int
    calls: int | None


class Loops:
    """Loops of the steps of all robots of a scene, one for each combination of their forms.

    Example:
        >>> Loops().run([], 0) is None
        True
    """

    def __init__(self) -> None:
        self._loops: dict[tuple[Stretch, ...], Any] = {}
        self._met: Counter[tuple[Stretch, ...]] = Counter()

    def run(self, shares: Sequence[Share], first: int) -> list[Made] | None:
        """Make steps of all robots; None where the first one is refused, or none can be made.

        Args:
            shares: of the robots, in the order in which they were added.
            first: number of the first step, from the start.
        """
        stretches = tuple(share.stretch for share in shares)
        calls = {share.calls for share in shares if share.calls is not None}
        # contacts are solved for one robot; commands are in step with each other
        if not shares or len(calls) > 1 or (len(shares) > 1 and any(s.touching for s in stretches)):
            return None
        loop = self._loops.get(stretches)
        if loop is None:
            if len(shares) > 1 and not self._pays(stretches):
                return None
            loop = self._loops[stretches] = self._written(stretches)
        most = min(MOST, *(share.most for share in shares))
        tapes = [tape for s in shares for tape in s.stretch.prepare(most, s.ledger)]
        steps = loop(first, most, next(iter(calls), 0), *tapes)
        made = [share.stretch.note(first, steps, share.ledger) for share in shares]
        return [x for x in made if x is not None] or None

    def _pays(self, stretches: tuple[Stretch, ...]) -> bool:
        """Count a step of a combination of forms; return whether to compile its loop."""
        if len(self._met) >= _MET:
            self._met.clear()
        self._met[stretches] += 1
        return self._met[stretches] >= _PATIENCE and len(self._loops) < _KEPT

    @staticmethod
    def _written(stretches: Sequence[Stretch]) -> Any:
        """Write and compile a loop."""
        program, (one, *beside) = Program(_TAPES * len(stretches)), stretches
        for stretch in stretches:
            stretch.write_loads(program)
        told = one.write_step(program, beside)
        for stretch in stretches:
            stretch.write_leap(program)
        program.accept()
        for k, stretch in enumerate(stretches):
            stretch.write_end(program, _TAPES * k, told)
        for stretch in stretches:
            stretch.write_end_if(program)
        return program.compiled()
