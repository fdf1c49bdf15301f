"""Compiled step of one robot: machine code from the link poses to the engine's loads.

What is compiled is what runs otherwise: kinematics, `EnvironmentSampler`, `Evaluator`, sensors'
accelerations and the pure part of the body's coupling, on traced arrays
(`seals.scalar_compiler`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.backend import CompiledBody, Dynamics
from seals.effects.evaluation import Evaluator
from seals.effects.scene import refuse_asking
from seals.environment.sample import Sample
from seals.environment.sampler import build_surroundings, hulls_of
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Waves
from seals.motion import Inputs, Joints, Motion
from seals.multibody.kinematics import Kinematics, LinkVelocities, link_motion
from seals.robot.model import RobotModel
from seals.scalar_compiler import compiled, constant
from seals.world.compiled_links import CompiledLinks, Look
from seals.world.drivetrain import Drivetrain
from seals.world.looped_command import LoopedCommand
from seals.world.servos import Servoing
from seals.world.stretch import Form, Loads, Parts, Ready, Stretch

LIKE = constant(np.zeros(1))
"""A traced array."""


class CompiledStep:
    """Compiled laws of one robot; each form of a step is compiled when it first occurs.

    Args:
        robot: the robot.
        environment: air, water, ground.
        waves: motion of the water surface.
        servos: joint drives and effects of the robot.
        drivetrain: of the robot.
        body: of the robot, `seals.backend.CompiledBody`.
    """

    def __init__(  # noqa: PLR0917  parts of one robot
        self,
        robot: RobotModel,
        environment: EnvironmentSettings,
        waves: Waves,
        servos: Servoing,
        drivetrain: Drivetrain,
        body: Any,
    ) -> None:
        effects = servos.effects
        refuse_asking(effects)
        self._robot, self._servos, self._response = robot, servos, drivetrain.response
        batteries: list[Any] = [b.effect for b in effects.batteries]
        self._full = batteries[0].full_voltage if batteries else 1.0
        self._body: CompiledBody = body
        self._effects = effects.with_values({}, LIKE, 1)
        self._places = {name: k for k, name in enumerate(effects.wrenching)}
        self.links = CompiledLinks(robot, environment, body, hulls_of(robot))
        self._surroundings = build_surroundings(
            robot, environment, waves, self.links.wetting, like=LIKE
        )
        self._evaluator = Evaluator(
            self._effects,
            self._surroundings,
            links=len(robot.links),
            batch=1,
            joint_links=robot.tree.child,
            implicit=servos.implicit,
        )
        self._evaluator.fed = True
        self._bodies = robot.bodies(LIKE)
        self.links.bind(self._surroundings, self._bodies)
        self._forms: dict[Any, Form] = {}
        inertial = bool(effects.inertias or effects.inertia_changes)
        body.compile(inertial=inertial, follow=self.links.follow)
        self._parts = Parts(self.links, body, drivetrain)
        self._stretch: Stretch | None = None
        self._present: tuple[Any, ...] = ()
        self._key: tuple[Any, ...] = ()

    def sampled(
        self, state: str, block: Array, time: Array, parts: Sequence[Array]
    ) -> tuple[Kinematics, Motion, Sample]:
        """Return poses, motion and surroundings of the links of a block, on traced arrays.

        Args:
            state: how the hulls are wetted, in a word.
            block: of the links.
            time: [s], shape (1, 1).
            parts: wetted parts of the hulls, where they are given.
        """
        self.links.give(state, iter(parts))
        kinematics, _, motion = self._seen(block, time)
        return kinematics, motion, self._surroundings.sample(motion)

    @property
    def volume(self) -> Array:
        """Volume displaced by every link when submerged [m^3], shape (L, 1)."""
        return self._surroundings.volume

    def _seen(self, block: Array, time: Array) -> tuple[Kinematics, LinkVelocities, Motion]:
        """Poses, velocities and motion of the links of a block."""
        of = self.links.layout.traced
        kinematics = Kinematics(self._robot.tree, of(block, "origins"), of(block, "rotations"))
        moving = self.links.layout.moving(block)
        return kinematics, moving, link_motion(kinematics, moving, time, self._bodies)

    def ready(
        self,
        look: Look,
        time: float,
        inputs: Inputs,
        memory: Mapping[str, Floats],
        held: Floats | None,
    ) -> Ready | None:
        """Prepare a step.

        None where this step is not compiled.

        Args:
            look: the links.
            time: [s].
            inputs: of the effects.
            memory: of the effects.
            held: commands of the drives over the step, shape (1, n); None for none.
        """
        step, torque, drive, voltage, position = inputs[:5]
        # the very number that the world will have
        self.links.expect(look, (round(time / step) + 1) * step)
        held = None if drive is None else held
        commands = (torque, drive, voltage, position, held)
        driven = self._servos.drives(inputs)
        present = (driven, drive is None, voltage is None, position is None, held is None, step)
        last = self._stretch
        if last is not None and present == self._present and last.continues(look, memory):
            return Ready(self._key, look, time, commands, memory)
        self._stretch, form = None, self._body.compiled_form(step, driven=driven)
        if form is None:
            return None
        self._present = present
        self._key = (form, tuple(x is not None for x in commands[1:]), look.state, step)
        return Ready(self._key, look, time, commands, memory)

    def loads(self, ready: Ready) -> Loads:
        """Evaluate the laws, and pass their sum to the body."""
        while True:
            form = self._form(ready)
            row, *results = form.kernel(*self._values(ready))
            loads, body = form.told(row, results, ready.memory)
            if self._body.give(ready.key[0], body, ready.look):
                return loads

    def alone(self) -> bool:
        """Return whether the body can make its next steps by a program."""
        return self._body.steps_alone()

    def stretch(self, ready: Ready, command: LoopedCommand | None) -> Stretch | None:
        """Return what makes steps one after the other, set to begin; None where nothing does.

        Args:
            ready: the first step.
            command: that is given in the loop; None for none.
        """
        look, found = ready.look, self._stretch
        if found is not None and found.command is command:
            found.begin(ready, None)
            return found
        touching = self._body.touching
        # the time between two mean velocities is a whole step after a contact
        begun = look.begun or touching
        if not (begun and look.state != "given" and self._body.steps_alone()):
            return None
        form = self._form(ready)
        leap, given = self.links.leap(*self._body.native_state(), ready.key[-1])
        made = form.stretches.get((command, touching))
        if made is None:
            made = Stretch(self._parts, ready, form, leap, command)
            form.stretches[command, touching] = made
        made.begin(ready, given)
        self._stretch = made
        return made

    @property
    def full_voltage(self) -> float | None:
        """Voltage of the full battery [V]; None without one."""
        return self._full if self._servos.effects.batteries else None

    def _form(self, ready: Ready) -> Form:
        """Return the form of a step, which is compiled when it first occurs."""
        kept = self._forms.get(ready.key)
        if kept is None:
            kept = self._compiled(ready.key, ready.memory, self._values(ready))
            self._forms[ready.key] = kept
        return kept

    def _values(self, ready: Ready) -> list[Any]:
        """Arguments of the laws."""
        commands = [x for x in ready.commands if x is not None]
        own, look = self._body.compiled_arguments(), ready.look
        return [look.block, ready.time, *commands, *look.parts, *ready.memory.values(), *own]

    def _compiled(self, key: Any, memory: Mapping[str, Floats], values: Sequence[Any]) -> Form:
        """Compile one form."""
        form, present, state, step = key
        names: list[list[str]] = [[], []]
        of = self.links.layout.traced

        def law(block: Array, time: Array, torque: Array, *rest: Array) -> list[Array]:
            more = iter(rest)
            *commands, held = (next(more) if there else None for there in present)
            self.links.give(state, more)
            remembered = {name: next(more) for name in memory}
            kinematics, moving, motion = self._seen(block, time)
            position = of(block, "joints")
            rates = moving.speed[:, moving.speed.shape[1] - position.shape[1] :]
            inputs = Inputs(step, torque, *commands)
            found = self._evaluator.evaluate(motion, Joints(position, rates), inputs, remembered)
            row = self._row(found)
            total = namespace(row).sum(row, axis=0)[None]
            due = Dynamics(
                kinematics, moving, motion, found, total, *self._servos.push(found, inputs)
            )
            speeds = {b.name: d.speed for b, d in found.drives if d.speed is not None}
            names[:] = list(found.memory), list(speeds)
            own = self._body.compiled_law(form, due, step, of(block, "change"), *more)
            voltage = self._evaluator.supplied({**remembered, **found.memory})
            nothing = np.zeros((1, 0))
            battery, ahead = nothing if voltage is None else voltage, nothing
            if held is not None:
                share = None if voltage is None else voltage / self._full
                if share is not None or self._response.laws:
                    held = self._response.goal(held, share)
                ahead = self._response.followed(inputs.drive, held, step)
            return [row, *found.memory.values(), *speeds.values(), battery, ahead, *own]

        kernel = compiled(law, [np.shape(x) or (1, 1) for x in values])
        remembered, turning = names
        return Form(kernel, remembered, turning)

    def _row(self, found: Any) -> Array:
        """Return the wrenches of all effects on all links, shape (effects, L, 6)."""
        row = constant(np.zeros((len(self._places), len(self._robot.links), 6)))
        for b, rows, wrench in found.loads:
            where = slice(None) if rows is None else rows
            own = row.entries[self._places[b.name]]
            for values, part in ((wrench.force, slice(0, 3)), (wrench.torque, slice(3, 6))):
                if values is not None:
                    own[where, part] = (constant(own[where, part]) + values).entries
        return row
