"""Pilot: guide and controller of one robot, called at their rates."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from seals.arrays import Array, Floats
from seals.control import ActuatorCommand, Controller, Guide, Plant, Reference, RobotState
from seals.control.actuator_limits import ActuatorLimitEstimator, ActuatorLimits
from seals.control.estimate import TRUTH, Estimate, Estimator
from seals.control.mass_properties import MassNow, MassPropertyEstimator, immersion, in_base
from seals.control.protocols import (
    Buoyancy,
    CommandLaw,
    Compiler,
    ControllerOptions,
    Goal,
    GuideOptions,
    Steady,
)
from seals.effects.binding import EffectSet
from seals.environment.sample import Sample
from seals.errors import ConfigError, PhysicsError
from seals.motion import Joints, Motion
from seals.multibody.kinematics import Kinematics, LinkVelocities
from seals.plugin_options import options_of
from seals.state_records import state_record


class Weights(NamedTuple):
    """Mass properties and buoyancy of a robot, and the limits of its drives.

    Args:
        mass: mass properties.
        submersion: submerged share of all hulls' volume [1].
        buoyancy: of the wet part of all hulls.
        limits: of the drives.
    """

    mass: MassNow
    submersion: float
    buoyancy: Buoyancy
    limits: ActuatorLimits


class Weighing:
    """Law of mass properties, buoyancy and limits of one robot; pure, on any array library.

    Args:
        plant: the robot in its surroundings.
        volume: displaced by every link when submerged [m^3], shape (L, 1).
        effects: bound in the library of ``like``; None for the plant's.
        like: array whose library to use; None for NumPy.
    """

    def __init__(
        self,
        plant: Plant,
        volume: Array,
        effects: EffectSet | None = None,
        like: Array | None = None,
    ) -> None:
        self._mass, self._total = MassPropertyEstimator(plant.robot), float(plant.robot.mass.sum())
        self._volume, self._gravity = volume, plant.gravity
        self._limits = ActuatorLimitEstimator(plant, effects, like=like)

    def submersion(self, kinematics: Kinematics, sample: Sample) -> tuple[Array, Buoyancy]:
        """Return the submerged share of all hulls' volume [1], shape (1, 1), and buoyancy."""
        return immersion(sample, self._volume, self._gravity, *in_base(kinematics))

    def numbers(self, kinematics: Kinematics, motion: Motion, sample: Sample) -> list[Array]:
        """Return the arrays of which `weights` makes the result."""
        mass = self._mass.now(kinematics)
        wet, (force, place) = self.submersion(kinematics, sample)
        limits = self._limits.now(motion, sample)
        return [*mass[1:], wet, force, place[0], *(x[0] for x in limits)]

    def weights(self, numbers: Sequence[Floats]) -> Weights:
        """Return what `numbers` found by NumPy or by machine code."""
        centre, inertia, centre_map, momentum_map, wet, force, place, *limits = numbers
        mass = MassNow(self._total, centre, inertia, centre_map, momentum_map)
        return Weights(mass, wet.item(), Buoyancy(force.item(), place), ActuatorLimits(*limits))


class ControlInput(NamedTuple):
    """Inputs of guide and controller at one instant.

    Args:
        time: [s].
        kinematics: of the links.
        moving: velocities of the links.
        joints: positions and rates, shape (1, J).
        weigh: finds mass properties, buoyancy and limits of drives.
        contacts: force on every gripper's tip [N].
    """

    time: float
    kinematics: Kinematics
    moving: LinkVelocities
    joints: Joints
    weigh: Callable[[], Weights]
    contacts: Mapping[str, float]


@state_record
class PilotState(NamedTuple):
    """State of guide and controller; immutable."""

    calls: int
    guide: Any
    controller: Any
    aim: Reference | None
    order: ActuatorCommand | None
    readings: Mapping[str, Mapping[str, Floats]]
    estimate: Estimate | None


NEW = PilotState(0, None, None, None, None, {}, None)


class Pilot:
    """Guide and controller of one robot.

    Args:
        plant: the robot in its surroundings.
        controller: bound here.
        guide: bound here.
        volume: displaced by every link when submerged [m^3], shape (L, 1).
        step: of the world [s].

    Attributes:
        stage: name of the guide's present stage.
        bodies: origins of the other bodies of the scene, by name [m].
    """

    def __init__(
        self, plant: Plant, controller: Controller, guide: Guide, *, volume: Floats, step: float
    ) -> None:
        self.plant, self.controller, self.guide = plant, controller, guide
        guide.bind(plant)
        controller.bind(plant)
        self._weighing = Weighing(plant, volume)
        self._estimator = Estimator(controller.sense)
        self._every = max(1, round(1.0 / (controller.rate * step)))
        self._guide_every = max(self._every, round(1.0 / (guide.rate * step)))
        self._period, self._level = self._every * step, plant.environment.water_level
        self._kept = NEW
        # a gait asks for none of these, and weighing costs more than walking
        self._options = options_of(controller, ControllerOptions)
        self._leading = options_of(guide, GuideOptions)
        self._weighed: Weights | None = None
        self.bodies: Mapping[str, Floats] = {}

    @property
    def sense(self) -> str:
        """Name of the sensor that the estimate comes from, or ``truth``."""
        return self.controller.sense

    @property
    def stage(self) -> str:
        """Name of the guide's present stage, empty before the start."""
        return "" if self._kept.guide is None else self.guide.stage(self._kept.guide)

    @property
    def finished(self) -> bool | None:
        """Return True when the guide is done, False when it gave up, None while it goes on."""
        return None if self._kept.guide is None else self.guide.finished(self._kept.guide)

    @property
    def goals(self) -> tuple[Goal, ...]:
        """Places that the guide is to reach; empty before the start."""
        memory = self._kept.guide
        return () if memory is None else self._leading.goals(memory)

    @property
    def aim(self) -> Reference | None:
        """Present reference of the guide; None before the start."""
        return self._kept.aim

    def reset(self) -> None:
        """Clear the state."""
        self._kept, self._weighed = NEW, None

    @property
    def due(self) -> bool:
        """Return whether the next `command` will call the controller."""
        return self._kept.calls % self._every == 0

    def command(self, seen: ControlInput) -> ActuatorCommand:
        """Return the command for the next step; called once per step, after `hear`."""
        kept = self._kept
        if not self.due and kept.order is not None:
            self.wait()
            return kept.order
        guide, controller, aim = kept.guide, kept.controller, kept.aim
        fresh = controller is None
        controller = self.controller.start() if fresh else controller
        situation = self._situation(seen, kept, self._options.leg_phase(controller))
        guide = self.guide.start(situation) if fresh else guide
        if aim is None or kept.calls % self._guide_every == 0:
            aim, guide = self.guide.aim(situation, guide)
            if not self._options.inner and not (aim.rates is aim.thrusts is None):
                raise ConfigError(
                    f"controller {type(controller).__name__} takes no body rates and no thrusts "
                    "of rotors.\nUse controller=cascade, or give a velocity."
                )
        order, controller = self.controller.command(situation, aim, controller)
        drives, joints = self.plant.layout.drives, self.plant.robot.tree.joints
        fits = order.drive.shape == (drives,) and order.joints.shape == (joints,)
        numbers = order.drive.tolist() + order.joints.tolist()
        if not fits or not math.isfinite(sum(numbers)):
            raise PhysicsError(
                f"the controller commands drives {order.drive} and joints {order.joints}.\n"
                f"Allowed: {drives} and {joints} finite numbers."
            )
        heard = kept.readings, kept.estimate
        self._kept = PilotState(kept.calls + 1, guide, controller, aim, order, *heard)
        return order

    def steady(self) -> tuple[CommandLaw, Steady, float] | None:
        """Return law and aim of commands without Python, and for how many steps they hold.

        The aim stays until the guide is asked, or longer where the guide says so. None where Python
        is asked each time. Where a sensor says where the robot is, it is: readings are taken after
        the steps.
        """
        kept, last = self._kept, math.inf
        if self.sense != TRUTH or kept.aim is None:
            return None
        steady = self._leading.steady(kept.guide)
        if steady is None:
            # the first of the steps has been counted already
            steady, last = Steady(kept.aim), 1 - kept.calls % -self._guide_every
        if steady.aim.position is not None or last <= self._every:
            return None
        # an aim that the guide has not yet given waits for its turn
        if steady.place is None and steady.aim is not kept.aim:
            return None
        if steady.place is not None and self._guide_every != self._every:
            return None
        law = self._options.command_law(self._period, kept.controller, steady.aim)
        return None if law is None else (law, steady, last)

    @property
    def every(self) -> int:
        """Steps from one command to the next."""
        return self._every

    @property
    def calls(self) -> int:
        """Steps since the start."""
        return self._kept.calls

    @property
    def left(self) -> tuple[Any, ActuatorCommand]:
        """Memory of the controller after the last command, and that command."""
        kept = self._kept
        assert kept.order is not None
        return kept.controller, kept.order

    def obeyed(
        self, law: CommandLaw, order: ActuatorCommand, numbers: Floats, velocity: Any
    ) -> None:
        """Note the last command that was given without Python.

        Args:
            law: of the controller.
            order: the command.
            numbers: of the controller's memory.
            velocity: of the aim, None for the present one.
        """
        kept = self._kept
        assert kept.aim is not None
        aim = kept.aim if velocity is None else kept.aim._replace(velocity=velocity)
        remembered = law.remembered(numbers, kept.controller)
        self._kept = kept._replace(controller=remembered, aim=aim, order=order)

    @property
    def free(self) -> int:
        """Return how many steps can go by before the controller is due."""
        return -self._kept.calls % self._every

    def wait(self, steps: int = 1) -> None:
        """Let steps go by in which the controller is not due."""
        self._kept = PilotState(self._kept.calls + steps, *self._kept[1:])

    def hear(self, time: float, readings: Mapping[str, Mapping[str, Floats] | None]) -> None:
        """Receive readings that were sampled at ``time`` [s]."""
        fresh = {name: reading for name, reading in readings.items() if reading is not None}
        if fresh:
            kept = self._kept
            estimate = self._estimator.update(time, fresh, kept.estimate)
            self._kept = PilotState(*kept[:5], {**kept.readings, **fresh}, estimate)

    def _situation(self, seen: ControlInput, kept: PilotState, phase: Floats) -> RobotState:
        if self._options.needs_mass_properties or self._weighed is None:
            self._weighed = seen.weigh()
        mass, submersion, buoyancy, reach = self._weighed
        turn, position = seen.kinematics.rotations[0, 0], seen.kinematics.origins[0, 0]
        moving, pose = seen.moving, kept.estimate
        velocity, spin = moving.linear[0, 0], moving.twists[0, 0, 3:]
        if pose is not None:
            truth = Estimate(seen.time, position, turn, velocity, spin)
            now = self._estimator.now(seen.time, truth, pose)
            _, position, turn, velocity, spin = now
        level = self._level
        # in the order of the fields: keywords take twice as long
        return RobotState(
            seen.time,
            self._period,
            position,
            turn,
            velocity,
            spin,
            seen.joints.position[0],
            seen.joints.velocity[0],
            *mass,
            submersion,
            buoyancy,
            -math.inf if level is None else level - position.item(2),
            *reach,
            kept.readings,
            seen.contacts,
            self.bodies,
            phase,
        )

    def weigh(self, kinematics: Kinematics, motion: Motion, sample: Sample) -> Weights:
        """Compute mass properties, submersion, buoyancy and actuator limits."""
        return self._weighing.weights(self._weighing.numbers(kinematics, motion, sample))

    def submersion(self, kinematics: Kinematics, sample: Sample) -> float:
        """Return the submerged share of all hulls' volume [1]; arguments as of `weigh`."""
        return float(self._weighing.submersion(kinematics, sample)[0][0, 0])

    def compile(self, compiled: Compiler | None) -> None:
        """Pass the compiler of laws to the controller; None for none."""
        self._options.compile(compiled)

    def snapshot(self) -> PilotState:
        """Return the complete state."""
        return self._kept

    def restore(self, kept: PilotState) -> None:
        """Restore a snapshot."""
        self._kept = kept
