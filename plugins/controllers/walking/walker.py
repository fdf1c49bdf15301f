"""Base of gait controllers: heading, cycle frequency, and inverse kinematics of the legs."""

from __future__ import annotations

import enum
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Array, Floats
from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.limbs import stowed
from seals.control.protocols import NO_LEGS, Compiler, ControllerOptions
from seals.errors import ConfigError, suggestion
from seals.field_roles import roles
from seals.plugins.controllers.walking.anatomy import Anatomy, anatomy_of
from seals.plugins.controllers.walking.stride import Walk, cadence, toes_of
from seals.plugins.controllers.walking.support import Support, leg_stiffness
from seals.schema import setting
from seals.state_records import state_record

STILL = 0.02
"""Liveliness below which the legs stand [1]."""


class Facing(enum.Enum):
    """Heading while walking: ``aim`` as commanded, ``ahead`` along or ``sideways`` to the path."""

    aim = "aim"
    ahead = "ahead"
    sideways = "sideways"


@state_record
class Pace(NamedTuple):
    """State of a gait between calls; immutable.

    Args:
        phase: of every leg, share of the cycle, shape (N,).
        walk: of the body, smooth.
        heading: wanted [rad].
        lively: 1 while walking, 0 standing, between them on the way [1].
        frequency: of the cycle [Hz].
        shift: of the toes, level, to catch the body [m], shape (N, 2); empty for none.
    """

    phase: Floats
    walk: Walk
    heading: float
    lively: float
    frequency: float
    shift: Floats = NO_LEGS


class Manner(NamedTuple):
    """Stepping parameters: those of the reference override those of the gait.

    Args:
        duty: share of the cycle on the ground [1].
        stroke: longest way of a toe on the ground [m].
        lift: height of the toes in the air [m].
        low: lowest frequency [Hz].
        high: highest frequency [Hz].
        spread: of the toes outwards of the stance [m].
        crouch: of the body below the stance [m].
        along: phase by which a leg lags behind the one in front [cycles].
        across: phase by which the right side lags behind the left [cycles].
    """

    duty: float
    stroke: float
    lift: float
    low: float
    high: float
    spread: float
    crouch: float
    along: float = 0.5
    across: float = 0.5


@roles(data="sense")
@dataclass(kw_only=True)
class Walker(ControllerOptions, ABC):
    """Base of walking controllers: track a reference velocity by stepping.

    Args:
        rate: calls a second [Hz].
        sense: sensor of pose and velocity, or ``truth``.
        facing: ``aim``, ``ahead`` or ``sideways``; crabs walk sideways, to either side.
        stroke: longest way of a toe on the ground, in body axes [m].
        lift: height of the toes in the air [m].
        lowest: frequency at which slow walks step [Hz].
        highest: largest frequency [Hz].
        spread: of the toes outwards of the stance [m].
        crouch: of the body below the stance [m].
        turn_gain: of the heading's error [1/s].
        turn_limit: largest rate of turn [rad/s].
        smooth: time in which a change of walk is taken up [s].
        support: share of the weight that is fed forward to the servos of the legs that stand [1].
        level: bandwidth at which the feet hold the body level, 0 for not at all [rad/s].
        catch: time by which the error of the velocity shifts where a toe lands [s].
    """

    rate: float = setting(125.0, "Hz", bounds=(1.0, 1e4), source="chosen: 30 a cycle")
    sense: str = "truth"
    facing: Facing = Facing.aim
    stroke: float = setting(0.03, "m", bounds=(1e-4, 10.0), source="chosen")
    lift: float = setting(0.01, "m", bounds=(0.0, 10.0), source="chosen")
    lowest: float = setting(1.0, "Hz", bounds=(0.01, 100.0), source="chosen")
    highest: float = setting(4.0, "Hz", bounds=(0.01, 100.0), source="chosen")
    spread: float = setting(0.0, "m", bounds=(-10.0, 10.0), source="chosen: the stance")
    crouch: float = setting(0.0, "m", bounds=(-10.0, 10.0), source="chosen: the stance")
    turn_gain: float = setting(3.0, "1/s", bounds=(0.0, 100.0), source="chosen")
    turn_limit: float = setting(2.0, "rad/s", bounds=(0.0, 100.0), source="chosen")
    smooth: float = setting(0.12, "s", bounds=(1e-3, 10.0), source="chosen: a step")

    support: float = setting(0.0, "1", bounds=(0.0, 2.0), source="chosen: stiff servos", later=True)
    level: float = setting(
        0.0, "rad/s", bounds=(0.0, 100.0), source="chosen: many legs", later=True
    )
    catch: float = setting(0.0, "s", bounds=(0.0, 1.0), source="chosen: many legs", later=True)

    needs_mass_properties: ClassVar[bool] = False

    def bind(self, plant: Plant) -> None:
        """Find the legs of the robot.

        Raises:
            ConfigError: it has none, or legs that a gait cannot move.
        """
        if self.lowest > self.highest:
            raise ConfigError(
                f"controller.lowest={self.lowest} is above controller.highest={self.highest}.\n"
                "Allowed: lowest up to highest."
            )
        self._legs: Anatomy = anatomy_of(plant.robot)
        self._rest = stowed(plant.robot)
        self._drives = plant.layout.drives
        self._outward = self._legs.outward()
        self._columns = self._legs.joints.astype(int)
        self._stepping: Callable[..., Sequence[Array]] = self._stepped
        stiff = leg_stiffness(plant, self._columns) if self.support > 0.0 else None
        self._support = (
            None
            if stiff is None
            else Support(self._legs, stiff, plant.gravity, self.support, self.level)
        )

    def start(self) -> Pace:
        """Return the initial legs, all in stance, in the order of the gait."""
        phase = self.order(self.manner({}))
        return Pace(phase, Walk(0.0, 0.0, 0.0), math.nan, 0.0, self.lowest)

    def leg_phase(self, memory: Pace | None) -> Floats:
        """Return the phase of every leg in its cycle, shape (N,)."""
        return NO_LEGS if memory is None else memory.phase

    def command(
        self, situation: RobotState, aim: Reference, memory: Pace
    ) -> tuple[ActuatorCommand, Pace]:
        """Return the joint values for the next control period."""
        manner = self.manner(aim.manner)
        places = self._places(manner)
        pace = self._paced(situation, aim, memory, manner, places)
        if self.catch > 0.0:
            pace = pace._replace(shift=self._caught(situation, pace, manner))
            places[:, :2] += pace.shift
        numbers = (*pace.walk, pace.frequency, manner.duty, manner.lift * pace.lively)
        values, toes = self._stepping(pace.phase, places, numbers)
        if self._support is not None:
            stance = pace.phase / manner.duty if pace.lively > 0.0 else 0.0 * pace.phase + 0.5
            values = values + self._support.offsets(situation, toes, stance)
            values = np.minimum(np.maximum(values, self._legs.lower), self._legs.upper)
        joints = self._rest.copy()
        joints[self._columns] = values
        return ActuatorCommand(np.zeros(self._drives), joints), pace

    def compile(self, compiled: Compiler | None) -> None:
        """Place toes and legs by machine code, or without."""
        legs, self._stepping = len(self._legs.toe), self._stepped
        if compiled is not None:
            self._stepping = compiled(self._stepped, [(legs,), (legs, 3), (6,)])

    def _stepped(self, phase: Array, places: Array, numbers: Any) -> Sequence[Array]:
        """Return hip, lift and bend of every leg [rad] and its toe [m], shape (N, 3) each; pure."""
        ahead, aside, turn, frequency, duty, lift = numbers
        walk = Walk(ahead, aside, turn)
        toes = toes_of(phase, places, walk, frequency=frequency, duty=duty, lift=lift)
        return self._legs.angles(toes), toes

    def manner(self, wishes: Mapping[str, float]) -> Manner:
        """Return the stepping parameters: those of the gait, overridden by the reference."""
        own = Manner(
            stroke=self.stroke,
            lift=self.lift,
            low=self.lowest,
            high=self.highest,
            spread=self.spread,
            crouch=self.crouch,
            **self.rhythm(),
        )
        return wished(own, wishes)

    def share(self, step: float) -> float:
        """Return the share of a change of walk that is taken up in a step [s]."""
        return 1.0 - math.exp(-step / self.smooth)

    @abstractmethod
    def rhythm(self) -> dict[str, float]:
        """Return the stepping parameters that depend on the kind of gait."""

    @abstractmethod
    def order(self, manner: Manner) -> Floats:
        """Return the phase offsets of the legs, shape (N,)."""

    @abstractmethod
    def advanced(self, pace: Pace, manner: Manner, step: float) -> Floats:
        """Return the phases one period later, shape (N,)."""

    def _places(self, manner: Manner) -> Floats:
        """Toes in the middle of their strokes, body axes [m], shape (N, 3)."""
        places: Floats = self._legs.toe.copy()
        places[:, :2] += manner.spread * self._outward
        places[:, 2] += manner.crouch
        return places

    def _paced(
        self, s: RobotState, aim: Reference, memory: Pace, manner: Manner, places: Floats
    ) -> Pace:
        """Update the commanded walk and advance the leg phases."""
        yaw = s.yaw
        heading = self._heading(yaw, aim, memory.heading)
        wanted = self._wanted(yaw, aim, heading)
        duty, low, high = manner.duty, manner.low, manner.high
        _, wanted = cadence(wanted, places, duty=duty, stroke=manner.stroke, low=low, high=high)
        share = self.share(s.step)
        walk = Walk(*(a + share * (b - a) for a, b in zip(memory.walk, wanted, strict=True)))
        going = 1.0 if max(abs(x) for x in wanted) > 1e-3 else 0.0
        lively = memory.lively + share * (going - memory.lively)
        frequency, walk = cadence(walk, places, duty=duty, stroke=manner.stroke, low=low, high=high)
        pace = Pace(memory.phase, walk, heading, lively, frequency, memory.shift)
        if lively < STILL:
            return pace._replace(lively=lively if going else 0.0)
        return pace._replace(phase=self.advanced(pace, manner, s.step))

    def _caught(self, s: RobotState, pace: Pace, manner: Manner) -> Floats:
        """Shift of the toes: those in the air follow the error of the velocity (Raibert 1986)."""
        last = np.zeros((len(pace.phase), 2)) if not len(pace.shift) else pace.shift
        forward = s.rotation[:2, 0] / max(float(np.hypot(*s.rotation[:2, 0])), 1e-9)
        left = np.array([-forward[1], forward[0]])
        now = np.array([forward @ s.velocity[:2], left @ s.velocity[:2]])
        wanted = np.array([pace.walk.ahead, pace.walk.aside])
        limit = 0.5 * manner.stroke
        target = np.clip(self.catch * (now - wanted), -limit, limit)
        # a toe is where it shall land when half of its way through the air is done
        swing = np.clip((pace.phase - manner.duty) / (1.0 - manner.duty), 0.0, 1.0)
        left_over = np.maximum(0.5 - swing, 0.0) / max(s.step * pace.frequency, 1e-9)
        share = np.where(swing > 0.0, 1.0 / (1.0 + left_over * (1.0 - manner.duty)), 0.0)
        out: Floats = last + pace.lively * share[:, None] * (target - last)
        return out

    def _heading(self, yaw: float, aim: Reference, last: float) -> float:
        """Heading that belongs to the way [rad]."""
        east, north = float(aim.velocity[0]), float(aim.velocity[1])
        if self.facing is Facing.aim:
            return aim.yaw
        if math.hypot(east, north) < 1e-3:
            return yaw if math.isnan(last) else last
        way = math.atan2(north, east)
        if self.facing is Facing.ahead:
            return way
        # the nearer of the two sides
        aside = 0.5 * math.pi * (1.0 if math.sin(way - yaw) >= 0.0 else -1.0)
        return way - aside

    def _wanted(self, yaw: float, aim: Reference, heading: float) -> Walk:
        """Return the walk in body axes that tracks the reference velocity and heading."""
        c, n = math.cos(yaw), math.sin(yaw)
        east, north = float(aim.velocity[0]), float(aim.velocity[1])
        error = math.remainder(heading - yaw, 2.0 * math.pi)
        feed = aim.yaw_rate if self.facing is Facing.aim else 0.0
        turn = min(max(self.turn_gain * error + feed, -self.turn_limit), self.turn_limit)
        if abs(error) < 0.03 and math.hypot(east, north) < 1e-3:
            # an animal that stands does not shuffle for a degree
            turn = feed
        return Walk(c * east + n * north, c * north - n * east, turn)


def wished(own: Manner, wishes: Mapping[str, float]) -> Manner:
    """Return stepping parameters overridden by those of a reference.

    Args:
        own: of the gait.
        wishes: values by name; those of ``frequency`` mean the lowest and the highest one.

    Raises:
        ConfigError: a wish names nothing that a manner has.
    """
    if not wishes:
        return own
    values = dict(wishes)
    if "frequency" in values:
        values["low"] = values["high"] = values.pop("frequency")
    for name in values:
        if name not in Manner._fields:
            allowed = ["frequency", *Manner._fields]
            raise ConfigError(f"a gait has no manner '{name}'.\n{suggestion(str(name), allowed)}")
    return own._replace(**{name: float(value) for name, value in values.items()})
