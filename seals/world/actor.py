"""Actor: one robot or object in the world, with body, effects and sensors."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple, TypeAlias, cast

import numpy as np

from seals.arrays import Array, Floats
from seals.backend import (
    Backend,
    BackendOptions,
    BodyOptions,
    CompiledBody,
    Configuration,
    Dynamics,
    compiles,
)
from seals.control.estimate import TRUTH
from seals.effects.binding import EffectSet
from seals.effects.evaluation import Evaluator
from seals.effects.scene import Rotors
from seals.environment.sample import Sample
from seals.environment.sampler import build_surroundings, exact_of
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Waves
from seals.errors import ConfigError
from seals.fluid import BodyStates, Fluid, SeaOfFluid
from seals.motion import Inputs, Joints, Motion, Wrench
from seals.multibody.equations import Assembly
from seals.multibody.kinematics import Kinematics, LinkVelocities, link_motion
from seals.plugin_options import options_of
from seals.robot.model import RobotModel
from seals.scalar_compiler import REFUSED, CannotCompile
from seals.sensors.protocol import OnboardState, Sensor, spins
from seals.sensors.rays import Shape, shapes_of_hull
from seals.sensors.surroundings import Surroundings
from seals.world.compiled import CompiledStep
from seals.world.compiled_links import Look
from seals.world.compiled_weights import CompiledWeights
from seals.world.drivetrain import Drivetrain
from seals.world.felt import Tracker
from seals.world.history import Given, History
from seals.world.immersion import Immersion
from seals.world.ledger import Ledger
from seals.world.looped_command import LoopedCommand
from seals.world.pilot import ControlInput, Pilot
from seals.world.sensor_suite import MANY, Instant, SensorSuite
from seals.world.servos import Servoing
from seals.world.stretch import Made, Ready, Share, Supply
from seals.world.subgrid import SubgridDrag

_COMMANDS = ("joint_torque", "joint_command", "command", "drive", "voltage")
"""What the caller sets."""
Links: TypeAlias = tuple[Kinematics, LinkVelocities, Motion, Joints, Sample]
"""Poses, velocities, motion, joints and surroundings of a robot at one instant."""
_NO_JOINTS = Joints(np.zeros((1, 0)), np.zeros((1, 0)))


class _Begun(NamedTuple):
    """A compiled step of which the commands are known.

    Args:
        look: the links at its start.
        inputs: of the effects.
        ready: the step; None where this one is not compiled.
        given: commands in force in the first of several steps; None before `Actor.share`.
        command: that is given in the loop; None for none.
    """

    look: Look
    inputs: Inputs
    ready: Ready | None
    given: Given | None = None
    command: LoopedCommand | None = None


class Actor:
    """Robot or object with its effects and sensors.

    Args:
        robot: the robot.
        effects: bound effects.
        sensors: by instance name.
        backend: open scene.
        environment: air, water, ground.
        waves: motion of the water surface.
        steps: rows to reserve in the ledger.
        fluid: that the robot is in, or None; its surface stands for the waves then.
        repeats: times that they are made, from a reset each.
        stated: drag, added mass and buoyancy that the fluid computes, see `SubgridDrag`; None to
            add nothing to what it resolves.

    Attributes:
        ledger: every effect's wrench at every step.
        memory: of the effects, by name.
        joint_torque: commanded generalised forces [N m or N], shape (1, J).
        joint_command: commanded joint positions [rad or m], shape (1, J); None for none.
        command: of all drives, rotor speed [rad/s] or thruster force [N], shape (1, n); None while
            the caller sets ``drive`` itself.
        drive: states of all drives, in the unit of the command, shape (1, n); None for none.
        drive_at_start: what ``drive`` is after a reset, None for standstill.
        voltage: of the battery [V], shape (1, 1); None when not known.
        sensor_suite: its sensors, their memory and readings.
        compiled: its laws as machine code, or None.
        history: of the steps made at once, those before the last one; None for one step.
        pilot: guide and controller that set ``command`` and ``joint_command``, or None.
    """

    def __init__(
        self,
        robot: RobotModel,
        effects: EffectSet,
        sensors: Mapping[str, Sensor],
        backend: Backend,
        environment: EnvironmentSettings,
        *,
        waves: Waves,
        steps: int,
        fluid: Fluid | None = None,
        repeats: int = 1,
        stated: EffectSet | None = None,
    ) -> None:
        self.robot, self.effects, self.sensors = robot, effects, dict(sensors)
        self.gravity, self.body = environment.gravity, backend.add(robot)
        waves = waves if fluid is None else SeaOfFluid(fluid)
        exact = exact_of(robot, environment)
        surroundings = build_surroundings(robot, environment, waves, exact, like=np.zeros(1))
        self._options = options_of(self.body, BodyOptions)
        self.servos = Servoing(effects, robot, implicit=self._options.implicit)
        self.evaluator = Evaluator(
            *(effects, surroundings),
            links=len(robot.links),
            batch=1,
            joint_links=robot.tree.child,
            implicit=self.servos.implicit,
        )
        self._bodies = robot.bodies(np.zeros(1))
        self.immersion = Immersion(robot) if fluid is not None else None
        self.subgrid: SubgridDrag | None = None
        names = effects.wrenching
        if self.immersion is not None and stated is not None:
            roots = [group.root for group in self.immersion.groups]
            self.subgrid = SubgridDrag(robot, stated, surroundings, roots)
            names = (*names, self.subgrid.name)
        names = names if fluid is None else (*names, fluid.name)
        self.ledger = Ledger(names, robot.links, steps=steps)
        self.memory: Mapping[str, Array] = effects.zero_memory()
        self.joint_torque = np.zeros((1, robot.tree.joints))
        self.joint_command: Floats | None = None
        self.command: Floats | None = None
        self.drive: Floats | None = None
        self.drive_at_start: Floats | None = None
        self.voltage: Floats | None = None
        self.drivetrain = Drivetrain(effects, robot.tree.joints)
        self.battery: Any = effects.batteries[0].effect if effects.batteries else None
        self.pilot: Pilot | None = None
        self._speeds: Mapping[str, Any] = {}
        self._solid: list[tuple[int, Shape]] | None = None
        board = OnboardState(self.body.joint_positions, self._rotor_speeds, self.battery_state)
        self.sensor_suite = SensorSuite(
            *(robot, effects, sensors),
            body=self.body,
            around=Surroundings(environment, waves),
            board=board,
            gravity=self.gravity,
        )
        self._start_over()
        self._tips = [(t, robot.links[t]) for g in robot.grippers.values() for t in g.tips]
        self._assembly = Assembly(robot.spatial_inertia[None], self.servos.armature)
        choice = options_of(backend, BackendOptions).compiled
        if fluid is not None or robot.degrees == 0:
            # of what cannot move there are no laws
            choice = "false"
        self._must, self._backend = choice == "true", backend
        self._weights: CompiledWeights | None = None
        self._looped: dict[Any, LoopedCommand] = {}
        self.compiled: CompiledStep | None = None
        if compiles(choice, steps * repeats):
            self._compile(environment, waves)

    def _compile(self, environment: EnvironmentSettings, waves: Waves) -> None:
        """Prepare machine code of the laws, which is made form by form when it is needed."""
        parts = self.servos, self.drivetrain, self.body
        try:
            self.compiled = CompiledStep(self.robot, environment, waves, *parts)
        except REFUSED as problem:
            if self._must:
                raise
            self._say(problem)

    @property
    def readings(self) -> Mapping[str, Any]:
        """Return the last reading of every sensor by channel, or None."""
        return self.sensor_suite.readings

    def reset(self, configuration: Configuration, rng: np.random.Generator) -> None:
        """Set the state of the robot and clear all memory."""
        self.body.reset(configuration)
        self.memory = self.effects.zero_memory()
        self.joint_torque = np.zeros_like(self.joint_torque)
        self.joint_command = self.command = self.voltage = None
        self.drive = self.drive_at_start
        self.drivetrain.reset()
        if self.pilot is not None:
            self.pilot.reset()
        self._speeds = {}
        self.ledger.rewind(0)
        self.sensor_suite.reset(rng)
        self._start_over()

    def _start_over(self) -> None:
        """Forget the last step."""
        self._time = self._step = 0.0
        wanted = self.sensor_suite.inertial
        self._tracker = Tracker(self.robot.tree, self._options, self.gravity, wanted=wanted)
        self._now: tuple[Kinematics, LinkVelocities] | None = None
        self._look: Look | None = None
        self._supply, self._driven = Supply(), self.drive
        self._due: tuple[Dynamics, Floats] | None = None
        self._noted: Floats | None = None
        self._begun: _Begun | None = None
        self.history: History | None = None

    def begin(self, time: float, step: float) -> None:
        """Command a robot whose laws are compiled, before `share` or `load`.

        Args:
            time: [s].
            step: h [s].
        """
        self._time, self._step, self.history, self._begun = time, step, None, None
        if self.compiled is not None:
            try:
                self._begun = self._commanded_step(self.compiled)
            except CannotCompile as problem:
                self._interpret(problem)

    def _commanded_step(self, laws: CompiledStep) -> _Begun:
        """Ask guide and controller, and prepare the step."""
        look, ready = self._look or self._looked(self._step), None
        if self._tracker.last is None:
            self._tracker.note(look)
        if self.pilot is not None:
            if self.pilot.due:
                self._fly(self.pilot, self._told(laws, self.pilot, look))
            else:
                self.pilot.wait()
        inputs = self._inputs(self._time, self._step, look.joints)
        try:
            ready = laws.ready(look, self._time, inputs, self.memory, self.drivetrain.held)
        except CannotCompile as problem:
            self._interpret(problem)
        return _Begun(look, inputs, ready)

    def load(self) -> None:
        """Evaluate the effects into the ledger, and pass the sum to the backend; after `begin`."""
        time, step, begun = self._time, self._step, self._begun
        if begun is not None:
            self._load_compiled(begun)
            return
        kinematics, moving = self._now or self.look()
        joints, pilot = self._joints(moving), self.pilot
        motion, sample = self._sampled(time, kinematics, moving)
        if pilot is not None:
            weigh = partial(pilot.weigh, kinematics, motion, sample)
            self._fly(pilot, ControlInput(time, kinematics, moving, joints, weigh, {}))
        inputs = self._inputs(time, step, joints.position)
        self._evaluate((kinematics, moving, motion, joints, sample), inputs)

    def _joints(self, moving: LinkVelocities) -> Joints:
        """Positions and rates of the joints."""
        if not self.robot.tree.joints:
            return _NO_JOINTS
        lead = 0 if self.robot.tree.fixed_base else 6
        return Joints(self.body.joint_positions()[None], moving.speed[:, lead:])

    def _fly(self, pilot: Pilot, seen: ControlInput) -> None:
        """Ask guide and controller for the commands of the next step."""
        if pilot.due:
            normals = self.body.contact_normals().tolist() if self._tips else []
            contacts = {name: normals[k] for k, name in self._tips}
            seen = seen._replace(contacts=contacts)
        order = pilot.command(seen)
        if order.drive.size:
            self.command = order.drive[None]
        if order.joints.size:
            self.joint_command = order.joints[None]

    def _evaluate(self, seen: Links, inputs: Inputs) -> None:
        """Evaluate the effects into the ledger, and pass the sum to the backend."""
        (kinematics, moving, motion, joints, sample), step = seen, inputs.step
        found = self.evaluator.evaluate(motion, joints, inputs, self.memory, sample)
        row = self.ledger.open_row(self._time)
        more = self.subgrid
        if more is not None:
            given = joints, inputs, self.memory.get(more.name), found.sample
            wrench, found.memory[more.name] = more.loads(motion, *given)
            found.loads.append((more.bound, None, wrench))
        for b, rows, wrench in found.loads:
            self.ledger.write(row, b.name, rows, wrench)
        pushed = self.servos.push(found, inputs)
        total = np.add.reduce(row, axis=0)[None]
        due = Dynamics(kinematics, moving, motion, found, total, *pushed)
        if self.immersion is None:
            self.body.apply(due, step)
        else:
            self._due = due, row
        self.memory = found.memory
        self._speeds = {b.name: drives.speed for b, drives in found.drives}
        self._supply = Supply()
        self._tracker.begin(self._time, kinematics, moving)
        self._now = None

    def _sampled(
        self, time: float, kinematics: Kinematics, moving: LinkVelocities
    ) -> tuple[Motion, Sample]:
        """Motion of the links and their surroundings."""
        motion = link_motion(kinematics, moving, np.array([[time]]), self._bodies)
        return motion, self.evaluator.surroundings.sample(motion)

    def _load_compiled(self, begun: _Begun) -> None:
        """Do the same by machine code."""
        look, inputs, ready, *_ = begun
        found = None
        if ready is not None and self.compiled is not None:
            try:
                found = self.compiled.loads(ready)
            except CannotCompile as problem:
                self._interpret(problem)
        self._look = None
        if found is None:
            kinematics, moving = look.kinematics, look.moving
            motion, sample = self._sampled(self._time, kinematics, moving)
            seen = kinematics, moving, motion, self._joints(moving), sample
            self._evaluate(seen, inputs)
        else:
            self.ledger.open_row(self._time)[...] = found.row
            _, self.memory, self._speeds, self._supply = found
            self._driven = self.drive

    def quiet(self, most: int) -> int:
        """Return how many steps can go by before Python is asked; 0 where it is asked in this one.

        Args:
            most: of these.
        """
        laws, begun, step = self.compiled, self._begun, self._step
        if laws is None or begun is None or begun.ready is None or not laws.alone():
            return 0
        most = min(most, self.sensor_suite.quiet(self._time, step))
        if most > 1:
            most = max(1, min(most, int(min(self.drivetrain.quiet(self._time) / step, MANY))))
        return most

    def share(self, most: int) -> Share | None:
        """Return this robot's part in steps that are made at once; None where it has none.

        Args:
            most: steps, of `quiet`.
        """
        laws, begun, pilot = self.compiled, self._begun, self.pilot
        assert laws is not None
        assert begun is not None
        assert begun.ready is not None
        command, calls = None, None
        try:
            if pilot is not None and most > 1 + pilot.free:
                command, last = self._commanded(laws, begun.ready, pilot, self._step)
                most = int(min(most, last)) if command is not None else 1 + pilot.free
            stretch = laws.stretch(begun.ready, command)
        except CannotCompile as problem:
            self._interpret(problem)
            return None
        if stretch is None:
            return None
        until = MANY
        if command is not None and pilot is not None:
            calls = pilot.calls - 1
            # the first step is never commanded in the loop
            until = pilot.every - calls % pilot.every
        aim = None if pilot is None else pilot.aim
        given = Given(self.command, self.joint_command, aim, until)
        self._begun = begun._replace(given=given, command=command)
        return Share(stretch, self.ledger, most, calls)

    def note(self, made: Made, first: int) -> int:
        """Note steps that were made at once; return how many.

        Args:
            made: of the stretch of `share`.
            first: number of the first one, from the start.
        """
        begun, step, train, pilot = self._begun, self._step, self.drivetrain, self.pilot
        assert begun is not None
        assert begun.given is not None
        given, command = begun.given, begun.command
        steps, self.memory, self._speeds, self._supply, *commands, passed = made
        self.history = None if passed is None else History(passed, given)
        self.drive, voltage, held, asked = commands
        self._driven = self.drive
        if self.battery is not None:
            self.voltage = voltage
        self._time, self._look = (first + steps - 1) * step, None
        train.passed(self._time, held)
        if pilot is not None and steps > 1:
            pilot.wait(steps - 1)
            if command is not None and steps > given.until:
                order, numbers, velocity = command.found(pilot.left[1])
                pilot.obeyed(command.law, order, numbers, velocity)
                if asked is not None:
                    self.command = order.drive[None]
                    train.obeyed(self.command, asked)
                self.joint_command = order.joints[None]
                train.aimed(self.joint_command)
        return steps

    def _commanded(
        self, laws: CompiledStep, ready: Ready, pilot: Pilot, step: float
    ) -> tuple[LoopedCommand | None, float]:
        """Return what commands the robot in the loop, and for how many steps; None for Python."""
        look, train, none = ready.look, self.drivetrain, (None, 0)
        drive, _, position, held = ready.commands[1:]
        found = None if train.late else pilot.steady()
        weights = self._weights
        if found is None or look.state == "given" or weights is None:
            return none
        law, steady, last = found
        if (law.order is not None and (drive is None or held is None)) or (
            law.targets is not None and position is None
        ):
            return none
        key = look.state, steady.place is None, law.kernel
        command = self._looped.get(key)
        if command is None:
            command = self._looped[key] = LoopedCommand(
                *(law, partial(weights.kernel, look), laws.links.layout, train, look),
                *(laws.full_voltage, steady.place is not None, step, pilot.every),
            )
        memory, order = pilot.left
        command.begin(memory, order.joints, steady)
        return command, last

    def _say(self, problem: Exception) -> None:
        """Say that there is no machine code; the run notes it."""
        warnings.warn(f"robot '{self.robot.name}' goes on uncompiled: {problem}", stacklevel=4)
        cast("BackendOptions", self._backend).compiled = "false"

    def _interpret(self, problem: CannotCompile) -> None:
        """Go on without machine code, in words, where that is allowed."""
        if self._must:
            raise problem
        self._say(problem)
        self.compiled = self._look = self._weights = None
        self._looped = {}
        cast("CompiledBody", self.body).interpret()
        if self.pilot is not None:
            self.pilot.compile(None)

    def submersion(self) -> float:
        """Return the submerged share of all hulls' volume now [1]; for a robot with a pilot."""
        assert self.pilot is not None
        if self.compiled is not None:
            return (
                self._told(self.compiled, self.pilot, self._looked(self._step)).weigh().submersion
            )
        kinematics, moving = self.look()
        _, sample = self._sampled(self._time, kinematics, moving)
        return self.pilot.submersion(kinematics, sample)

    def _told(self, laws: CompiledStep, pilot: Pilot, look: Look) -> ControlInput:
        """What guide and controller are given; their laws are compiled at the first call."""
        if self._weights is None or self._weights.pilot is not pilot:
            self._weights, self._looped = CompiledWeights(laws, pilot), {}
        weigh = partial(self._weights.now, look, self._time)
        joints = self._joints(look.moving)
        return ControlInput(self._time, look.kinematics, look.moving, joints, weigh, {})

    def immersed(self, step: float) -> BodyStates:
        """Return the states of the robot's bodies for the fluid, after `load` and before `push`."""
        assert self.immersion is not None
        if self._due is None:
            return self.immersion.placed(self.body.poses())
        middle = self._options.middle_speed()
        contact = self.body.contact_wrenches()
        return self.immersion.states(self._due[0], middle, contact, self._assembly, step)

    def push(self, impulses: Floats, step: float) -> None:
        """Pass the fluid's impulses (K, 6), with all other loads, to the backend."""
        assert self.immersion is not None
        assert self._due is not None
        due, row = self._due
        wrench = self.immersion.wrenches(impulses, due, step)
        if self.subgrid is not None:
            name = self.subgrid.name
            noted = self.subgrid.note(self.memory[name], wrench)
            self.memory = {**self.memory, name: noted}
        self.ledger.write(row, self.ledger.effects[-1], None, Wrench(wrench[:, :3], wrench[:, 3:]))
        whole = due._replace(wrench=due.wrench + wrench[None], discontinuous=True)
        self.body.apply(whole, step)

    def battery_state(self) -> tuple[float, float, float]:
        """Return voltage [V], current [A] and state of charge [1] of the battery.

        Raises:
            ConfigError: the robot has none.
        """
        for b in self.effects.batteries:
            voltage, current, charge = b.hooks.state(self.memory[b.name], b.params)
            return float(voltage[0, 0]), float(current[0, 0]), float(charge[0, 0])
        raise ConfigError(
            f"robot '{self.robot.name}' has no battery.\nAdd one: +effect@effects.battery=battery"
        )

    def battery_states(self, past: History) -> list[tuple[float, float, float]]:
        """Return what `battery_state` returned after each of some steps made at once."""
        battery = self.effects.batteries[0]
        rows = past.memory(battery.name)
        if rows is None:
            return [self.battery_state()] * len(past.times)
        found = []
        for row in rows:
            parts = battery.hooks.state(row, battery.params)
            found.append(tuple(float(x[0, 0]) for x in parts))
        return found  # type: ignore[return-value]

    def _inputs(self, time: float, step: float, joints: Floats) -> Inputs:
        """Return the inputs of the effects after delays and lags."""
        train, share = self.drivetrain, 1.0
        if self.battery is not None:
            voltage: Any = self._supply.voltage
            if voltage is None:
                voltage = self.evaluator.supplied(self.memory)
            share = float(voltage[0, 0]) / self.battery.full_voltage
            self.voltage, self.evaluator.fed = voltage, True
        # a state that somebody set meanwhile counts
        ahead = self._supply.drive if self.drive is self._driven else None
        self.drive = train.drive(time, self.command, self.drive, share, ahead)
        torque = train.torque(time, self.joint_torque)
        position = train.position(time, self.joint_command, joints, step)
        return Inputs(step, torque, self.drive, self.voltage, position)

    def look(self) -> tuple[Kinematics, LinkVelocities]:
        """Return poses and velocities at the current time; cached until the next step."""
        if self.compiled is None:
            poses = self.body.poses()
            kinematics = Kinematics(self.robot.tree, poses.origins, poses.rotations)
            self._now = (kinematics, kinematics.move(poses.speed))
            return self._now
        look = self._looked(self._step)
        return look.kinematics, look.moving

    def _looked(self, step: float) -> Look:
        """Return the links at the current time; ``step`` since the last look [s]."""
        assert self.compiled is not None
        if self._look is None:
            self._look = self.compiled.links.look(self._time, self._tracker.last, step)
        return self._look

    def sense(
        self, time: float, step: float, rng: np.random.Generator, *, keep: bool = False
    ) -> None:
        """Sample the sensors that are due, and pass arriving readings to the controller.

        Args:
            time: [s].
            step: h [s].
            rng: random state.
            keep: whether the readings of steps made at once are kept in ``history``.
        """
        if not self.sensors:
            self._time = time
            return
        if self.history is not None:
            self._caught_up(self.history, step, rng, keep=keep)
        self._time = time
        if self.compiled is None:
            kinematics, moving = self.look()
            seen = kinematics.origins[0], kinematics.rotations[0], moving.twists[0]
            felt = self._tracker.follow(time, kinematics, moving, step)
            now = Instant(time, step, seen, felt)
        else:
            look = self._looked(step)
            now = Instant(time, step, look.seen, look.felt)
            self._tracker.note(look)
        self._sensed(now, rng)

    def _caught_up(
        self, history: History, step: float, rng: np.random.Generator, *, keep: bool
    ) -> None:
        """Sample the sensors at the ends of steps that were made at once."""
        pilot, suite, times = self.pilot, self.sensor_suite, history.times
        # only the last of the readings is told the pilot, unless they tell where the robot is
        felt = history.passed.contacts
        if felt is None and (pilot is None or pilot.sense == TRUTH):
            links = history.passed.links if keep else None
            found = suite.catch_up(times, rng, step, links)
            if found is not None:
                history.readings = [(slice(0, len(times)), found)]
                return
        body, began = cast("CompiledBody", self.body), history.passed.began
        for k, look in enumerate(history.passed.looks()):
            if felt is not None:
                body.note_contacts(felt[k], began)
            self._sensed(Instant(look.time, step, look.seen, look.felt), rng)
            began = look
            if keep:
                history.readings.append((k, self.readings))
        if felt is not None:
            body.note_contacts(felt[-1], began)

    def _sensed(self, now: Instant, rng: np.random.Generator) -> None:
        """Sample the sensors that are due at an instant, and pass arriving readings on."""
        self.sensor_suite.take(now, rng)
        if self.pilot is not None:
            for taken, readings in self.sensor_suite.heard().items():
                self.pilot.hear(taken, readings)

    def shapes(self) -> list[Shape]:
        """Return the hulls of the links at their present poses, for the sensors of other bodies."""
        if self._solid is None:
            pairs = enumerate(self.robot.hulls)
            self._solid = [(k, shape) for k, hull in pairs for shape in shapes_of_hull(hull)]
        poses = self.body.poses()
        return [s.moved(poses.origins[0, k], poses.rotations[0, k]) for k, s in self._solid]

    def note_drive(self) -> None:
        """Note the drive states at the start of a step, which `rotors` is about."""
        self._noted = _copy(self.drive)

    def rotors(self) -> list[Rotors]:
        """Return the rotors at the start of the step, for the effects of other robots."""
        found: list[Rotors] = []
        if self._noted is None:
            return found
        inputs = Inputs(0.0, self.joint_torque, self._noted, self.voltage)
        poses = self.body.poses()
        for b in self.effects.actuators:
            drives = b.hooks.drives(inputs, b.params)
            if not drives.radius.any():
                continue
            link = b.links[0]
            turn, origin = poses.rotations[0, link], poses.origins[0, link]
            hubs = origin + drives.position @ turn.T
            found.append(Rotors(hubs, drives.axis @ turn.T, drives.radius, drives.thrust[0]))
        return found

    def _rotor_speeds(self) -> Floats:
        """Speeds of all rotors in the last step [rad/s], zeros before the first."""
        bound = [b for b in self.effects.actuators if spins(b.effect)]
        bound.sort(key=lambda b: b.hooks.first)
        still = {b.name: np.zeros(b.hooks.count) for b in bound}
        found = [np.reshape({**still, **self._speeds}[b.name], -1) for b in bound]
        return np.concatenate([np.zeros(0), *found])

    def snapshot(self) -> Any:
        """Return memory of effects and sensors, commands, and the length of the ledger."""
        commands = [_copy(getattr(self, name)) for name in _COMMANDS]
        effects, speeds = dict(self.memory), dict(self._speeds)
        memory = (effects, self.sensor_suite.snapshot(), speeds, self._supply)
        pilot = None if self.pilot is None else self.pilot.snapshot()
        train = (self.drivetrain.snapshot(), pilot)
        return memory, commands, train, self.ledger.rows, self._tracker.last

    def restore(self, kept: Any) -> None:
        """Restore a snapshot; later rows of the ledger are discarded."""
        memory, commands, train, rows, self._tracker.last = kept
        self.memory, sensing, self._speeds, self._supply = memory
        self.sensor_suite.restore(sensing)
        for name, value in zip(_COMMANDS, commands, strict=True):
            setattr(self, name, _copy(value))
        self.drivetrain.restore(train[0])
        self._driven = self.drive
        if self.pilot is not None:
            self.pilot.restore(train[1])
        self._now = self._look = None
        self.ledger.rewind(rows)


def _copy(values: Floats | None) -> Floats | None:
    return None if values is None else values.copy()
