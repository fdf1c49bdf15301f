"""Batch dynamics with a controller, for learning and studies of many flights."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from seals.arrays import Array, Floats, as_like, iterate, namespace
from seals.batch.fused import FusedBody
from seals.batch.holding import hold
from seals.batch.model import BatchDynamics
from seals.batch.state import Posture, TwinState
from seals.control import Reference, RobotState
from seals.control.actuator_limits import ActuatorLimitEstimator
from seals.control.mass_properties import MassNow, MassPropertyEstimator, immersion, in_base
from seals.control.plant import Plant, build_plant
from seals.control.protocols import Buoyancy, ControllerOptions
from seals.effects.binding import EffectSet
from seals.environment.sample import Sample
from seals.environment.settings import EnvironmentSettings
from seals.environment.wetting import Wetting
from seals.motion import Inputs
from seals.plugin_options import options_of
from seals.robot.model import RobotModel
from seals.world.drivetrain import response_of


class PilotedSettings(Protocol):
    """Settings of a run that a controlled batch needs."""

    environment: EnvironmentSettings
    wave: Any
    controller: Any


class Flight(NamedTuple):
    """State of a batch of controlled flights; arrays of B rows.

    Args:
        state: of the bodies.
        time: since the start of each [s], shape (B, 1).
        drive: states of the drives, shape (B, n).
        memory: of the effects, rows link by link.
        control: memory of the controller.
    """

    state: TwinState
    time: Array
    drive: Array
    memory: Mapping[str, Array]
    control: Any


class BatchPilot:
    """Controller of the robots of a batch, and what it knows of their state.

    Args:
        controller: of the robots.
        plant: their stated model.
        twin: dynamics of the batch.
        effects: bound to its links, of which limits of drives are known; None for those of the
            twin.
        joints: held joint values [rad or m], J of them; None where the joints move, on NumPy.
    """

    def __init__(
        self,
        controller: Any,
        plant: Plant,
        twin: BatchDynamics,
        effects: EffectSet | None = None,
        *,
        joints: Floats | None = None,
    ) -> None:
        like, batch = twin.like, twin.batch
        self.law = options_of(controller, ControllerOptions).batched(plant, joints, like)
        self._plant, self._twin = plant, twin
        known = twin.effects if effects is None else effects
        links = len(twin.robot.links)
        self._thrust = ActuatorLimitEstimator(plant, known, links=links, like=like, batch=batch)
        self._estimator = MassPropertyEstimator(plant.robot)
        count, self._mass = plant.robot.tree.joints, None
        if joints is not None or not count:
            self._mass = self._massed((np.zeros(0) if joints is None else joints)[None])
        xp = namespace(like)
        self._links = as_like(np.zeros((1, 1, 3)), like), as_like(np.eye(3)[None, None], like)
        if isinstance(twin.body, FusedBody):
            places, turns = xp.concat(list(twin.body.places), axis=0), xp.stack(twin.body.turns)
            self._links = places[None], turns[None]

    def _massed(self, joints: Floats) -> MassNow:
        """Mass properties at joint values, rows of a batch."""
        mass, *parts = zip(*(self._estimator.at(row) for row in joints), strict=True)
        return MassNow(mass[0], *(as_like(np.stack(x), self._twin.like) for x in parts))

    def immersed(self, posture: Posture) -> tuple[Array, Buoyancy]:
        """Submerged share of all hulls' volume [1], shape (B, 1), and buoyancy."""
        links = self._links if posture.kinematics is None else in_base(posture.kinematics)
        volume = self._twin.evaluator.surroundings.volume
        return immersion(_sampled(posture), volume, self._plant.gravity, *links)

    def situation(self, state: TwinState, time: Array, posture: Posture, step: float) -> RobotState:
        """Return the state of all robots for the controller; ``step``: until its next call [s]."""
        nothing: Any = None
        wet, buoyancy = self.immersed(posture)
        velocity = namespace(state.velocity).matmul(posture.base, state.velocity[:, :, None])
        mass = self._massed(state.joints) if self._mass is None else self._mass
        return RobotState(
            time=time,
            step=step,
            position=state.position,
            rotation=posture.base,
            velocity=velocity[:, :, 0],
            angular_velocity=state.angular_velocity,
            joints=state.joints,
            joint_velocity=state.joint_velocity,
            submersion=wet,
            buoyancy=buoyancy,
            depth=nothing,
            **mass._asdict(),
            **self._thrust.now(posture.motion, _sampled(posture))._asdict(),
        )


class PilotedTwin:
    """Batch of controlled robots with held joints.

    Args:
        settings: of a run with a controller.
        robot: of the run.
        effects: bound to its links.
        joints: held joint values [rad or m], J of them.
        batch: number of robots B.
        like: array whose library, type and device to use.
        step: of the integrator [s].
        values: ``"effect.parameter"`` to a number or an array (B,), in place of the settings.
        wetting: makes what finds the wetted parts of the hulls; None for `tables_of`.

    Attributes:
        every: steps between two calls of the controller.

    Raises:
        ConfigError: the controller has no form over a batch, or a value does not fit.
    """

    def __init__(
        self,
        settings: PilotedSettings,
        robot: RobotModel,
        effects: EffectSet,
        *,
        joints: Sequence[float],
        batch: int,
        like: Array,
        step: float,
        values: Mapping[str, Any] | None = None,
        wetting: Callable[[RobotModel], Wetting] | None = None,
    ) -> None:
        self.plant = plant = build_plant(robot, effects, settings.environment)
        self.whole, held = hold(robot, effects, joints)
        self.twin = BatchDynamics(
            self.whole,
            held,
            settings.environment,
            settings.wave,
            batch=batch,
            like=like,
            values=values,
            wetting=None if wetting is None else wetting(self.whole),
        )
        self.batch, self.like, self.step = batch, like, step
        values_held = np.asarray(joints, dtype=float)
        self.pilot = BatchPilot(settings.controller, plant, self.twin, joints=values_held)
        self.controller = self.pilot.law
        self.every = max(1, round(1.0 / (settings.controller.rate * step)))
        self._drives = response_of(held).over_batch(like, self.twin.effects)
        batteries = self.twin.effects.batteries
        self._full = batteries[0].hooks.full_voltage if batteries else None
        self._torque = self.twin.no_torque()

    def start(self, state: TwinState, drive: Array) -> Flight:
        """Return flights at their start.

        Args:
            state: of the bodies.
            drive: states of the drives [rad/s or N], shape (1 or B, n).
        """
        time = state.position[:, 0:1] * 0.0
        whole = drive + time
        memory = self.twin.zero_memory()
        return Flight(state, time, whole, memory, self.controller.start(self.batch))

    def fly(self, flight: Flight, wanted: Mapping[str, Array], steps: int) -> Flight:
        """Return flights after some steps under one reference.

        Args:
            flight: before.
            wanted: fields of a `Reference` by name, of B rows each.
            steps: of the integrator.
        """
        periods, rest = divmod(steps, self.every)
        flight = iterate(lambda held: self._period(held, wanted, self.every), flight, periods)
        return self._period(flight, wanted, rest) if rest else flight

    def _period(self, flight: Flight, wanted: Mapping[str, Array], steps: int) -> Flight:
        """Steps under one command of the controller."""
        posture = self.twin.posture(flight.state, flight.time)
        goal, control = self._order(flight, wanted, steps, posture)

        def moved(held: Flight, now: Posture | None = None) -> Flight:
            now = self.twin.posture(held.state, held.time) if now is None else now
            if self._full is None:
                share = None
            else:
                voltage: Any = self.twin.evaluator.supplied(held.memory)
                share = voltage / self._full
            return self._advance(held, self._drives.goal(goal, share), now, share)

        first = moved(flight._replace(control=control), posture)
        later: Flight = iterate(moved, first, steps - 1)
        return later

    def _order(
        self, flight: Flight, wanted: Mapping[str, Array], steps: int, posture: Posture | None
    ) -> tuple[Array, Any]:
        """Commands of the drives for some steps, and the new memory of the controller."""
        if posture is None:
            posture = self.twin.posture(flight.state, flight.time)
        situation = self.pilot.situation(flight.state, flight.time, posture, steps * self.step)
        still = flight.state.position * 0.0
        plain = {"velocity": still, "acceleration": still, "yaw": still[:, :1]}
        aim: Any = Reference(**{**plain, **wanted})
        return self.controller.command(situation, aim, flight.control)

    def commands(
        self, state: TwinState, time: Array, control: Any, wanted: Mapping[str, Array]
    ) -> tuple[Array, Any]:
        """Return the commands of the drives for the next period, for bodies that others move.

        Args:
            state: of the bodies.
            time: since the start of each [s], shape (B, 1).
            control: memory of the controller.
            wanted: fields of a `Reference` by name, of B rows each.

        Returns:
            Commands [rad/s or N], shape (B, n), and the new memory of the controller.
        """
        flight = Flight(state, time, None, {}, control)
        return self._order(flight, wanted, self.every, None)

    def submersion(self, flight: Flight) -> Array:
        """Return the submerged fraction of the volume of all hulls [1], shape (B, 1)."""
        posture = self.twin.posture(flight.state, flight.time)
        return self.pilot.immersed(posture)[0]

    def merged(self, fresh: Flight, flight: Flight, ended: Array) -> Flight:
        """Return ``fresh`` flights where ``ended`` (B,) is set, else the present ones."""
        return Flight(*(_chosen(a, b, ended) for a, b in zip(fresh, flight, strict=True)))

    def _advance(
        self, flight: Flight, goal: Array, posture: Posture | None, share: Array | None
    ) -> Flight:
        """One step of the integrator under held commands."""
        h = self.step
        later = (self._drives.followed(flight.drive, goal, s) for s in (0.5 * h, h))
        drives = [flight.drive, *later]
        voltage = None if share is None else share * self._full
        first, middle, last = (Inputs(h, self._torque, d, voltage) for d in drives)
        self.twin.memory = flight.memory
        state, _ = self.twin.advance(flight.state, flight.time, h, (first, middle, last), posture)
        return flight._replace(
            state=state, time=flight.time + h, drive=drives[2], memory=self.twin.memory
        )


def _sampled(posture: Posture) -> Sample:
    """Surroundings of a posture that was made with them."""
    assert posture.sample is not None
    return posture.sample


def _chosen(fresh: Any, other: Any, ended: Array) -> Any:
    """Select fresh values where a flight ended, in arrays and nested tuples."""
    if other is None:
        return None
    if isinstance(other, Mapping):
        return {name: _chosen(fresh[name], value, ended) for name, value in other.items()}
    if isinstance(other, tuple):
        pairs = zip(fresh, other, strict=True)
        return type(other)(*(_chosen(a, b, ended) for a, b in pairs))
    xp = namespace(other)
    if other.shape[1] == 0:
        return other
    repeat = other.shape[0] // ended.shape[0]
    mask = xp.concat([ended] * repeat, axis=0) if repeat > 1 else ended
    return xp.where(mask[:, None], fresh, other)
