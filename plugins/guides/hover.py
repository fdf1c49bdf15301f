"""Guide that hovers in place while the arms move."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.control.protocols import Goal, Steady
from seals.control.tracking import Place, pursued
from seals.errors import ConfigError
from seals.robot.limbs import Arm
from seals.robot.model import RobotModel
from seals.schema import count, setting, vector
from seals.state_records import state_record

WAVES = 4
"""Sines in a random motion of one joint."""


class ArmMotion(enum.Enum):
    """Motion of the arms: at rest, swinging through their range, or smooth random motion."""

    stowed = "stowed"
    sweep = "sweep"
    random = "random"


@state_record
class HoverState(NamedTuple):
    """State: start time [s], position [m] and heading [rad]."""

    time: float
    place: Floats
    yaw: float


@dataclass(kw_only=True)
class Hover:
    """Guide that hovers at the start or a given position while the arms rest, swing or wander.

    Args:
        rate: calls a second [Hz].
        position: place to hold, world [m]; empty for that of the start.
        yaw: heading [rad]; empty for that of the start, one number otherwise.
        arm: what the arms do.
        frequency: of the swing [Hz]; a random motion holds frequencies up to it.
        share: of the range of each joint that is used [1].
        delay: rest before the arms move [s].
        seed: of the random motion.
        position_gain: of the position's error [1/s].
        speed: largest speed back to the place [m/s].
        tolerance: distance at the end within which the place counts as held [m].

    Example:
        >>> Hover(arm=ArmMotion.sweep).frequency
        0.5
    """

    rate: float = setting(250.0, "Hz", bounds=(1.0, 1e4), source="chosen: every step")
    position: list[float] = vector((), "m", bounds=(-1e5, 1e5), source="chosen: the start")
    yaw: list[float] = vector((), "rad", bounds=(-6.3, 6.3), source="chosen: the start")
    arm: ArmMotion = ArmMotion.stowed
    frequency: float = setting(0.5, "Hz", bounds=(0.01, 10.0), source="task 1 of the paper")
    share: float = setting(1.0, "1", bounds=(0.0, 1.0), source="chosen: the whole range")
    delay: float = setting(3.0, "s", bounds=(0.0, 1e4), source="chosen: rotors spin up")
    seed: int = count(1, bounds=(0, 2**63 - 1))
    position_gain: float = setting(
        1.8, "1/s", bounds=(0.0, 50.0), source="chosen: below the speed's"
    )
    speed: float = setting(1.0, "m/s", bounds=(0.0, 50.0), source="chosen")
    tolerance: float = setting(0.05, "m", bounds=(0.0, 1e4), source="chosen: 5 cm")

    def __post_init__(self) -> None:
        """Refuse lists of wrong length."""
        if len(self.position) not in (0, 3) or len(self.yaw) not in (0, 1):
            raise ConfigError(
                f"guide.position={self.position}, guide.yaw={self.yaw}: wrong numbers of values.\n"
                "Allowed: three and one, or none for where it starts."
            )

    def bind(self, plant: Plant) -> None:
        """Plan the motion of every arm."""
        rng = np.random.default_rng(self.seed)
        self._swings = {
            name: _Swing.of(arm, plant.robot, self, rng) for name, arm in plant.robot.arms.items()
        }

    def start(self, situation: RobotState) -> HoverState:
        """Return the initial state: time, position and heading."""
        place = np.array(self.position or situation.position, dtype=float)
        yaw = self.yaw[0] if self.yaw else situation.yaw
        return HoverState(situation.time, place, yaw)

    def aim(self, situation: RobotState, memory: HoverState) -> tuple[Reference, HoverState]:
        """Return the velocity back to the position, and the arms' next angles."""
        time = situation.time - memory.time - self.delay
        joints = {}
        if self.arm is not ArmMotion.stowed and time > 0.0:
            joints = {name: swing.at(time) for name, swing in self._swings.items()}
        place = Place(memory.place, yaw=memory.yaw)
        aim = pursued(situation, place, gain=self.position_gain, speed=self.speed, joints=joints)
        return aim, memory

    def steady(self, memory: HoverState) -> Steady | None:
        """Return the place to hold; None while arms move."""
        if self.arm is not ArmMotion.stowed:
            return None
        aim = Reference(yaw=memory.yaw)
        return Steady(aim, memory.place, self.position_gain, self.speed)

    def finished(self, memory: HoverState) -> bool | None:
        """Return None: a hover never ends."""
        return None

    def goals(self, memory: HoverState) -> tuple[Goal, ...]:
        """Return the place to hold."""
        return (Goal("hover", memory.place, self.tolerance, held=True),)

    def stage(self, memory: HoverState) -> str:
        """Return the kind of arm motion."""
        return f"hover, arm {self.arm.value}"


class _Swing(NamedTuple):
    """Motion of one arm: sums of sines about the middle of the joint range.

    Args:
        rest: angles before [rad], shape (k,).
        middle: of the range [rad], shape (k,).
        size: of the sines [rad], shape (k, m).
        frequency: [Hz], shape (k, m).
        phase: [rad], shape (k, m).
        ramp: time of the way from rest into the motion [s].
    """

    rest: Floats
    middle: Floats
    size: Floats
    frequency: Floats
    phase: Floats
    ramp: float

    @staticmethod
    def of(arm: Arm, robot: RobotModel, guide: Hover, rng: np.random.Generator) -> _Swing:
        """Plan the motion of one arm within its joint limits; continuous joints turn by pi."""
        index = list(arm.joints)
        low = np.where(np.isfinite(robot.lower[index]), robot.lower[index], -math.pi)
        high = np.where(np.isfinite(robot.upper[index]), robot.upper[index], math.pi)
        half = 0.5 * guide.share * (high - low)[:, None]
        waves = 1 if guide.arm is ArmMotion.sweep else WAVES
        shape = (len(index), waves)
        phase, frequency = np.zeros(shape), np.full(shape, guide.frequency)
        if waves > 1:
            phase = rng.uniform(0.0, 2.0 * math.pi, shape)
            frequency = guide.frequency * rng.uniform(0.2, 1.0, shape)
        size = half * np.ones(shape) / waves
        return _Swing(arm.stowed, 0.5 * (low + high), size, frequency, phase, 1.0 / guide.frequency)

    def at(self, time: float) -> Floats:
        """Return the angles ``time`` [s] after the start, shape (k,)."""
        wave = np.sin(2.0 * math.pi * self.frequency * time + self.phase)
        angles: Floats = self.middle + (self.size * wave).sum(axis=1)
        u = min(time / self.ramp, 1.0)
        blend = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        return self.rest + blend * (angles - self.rest)
