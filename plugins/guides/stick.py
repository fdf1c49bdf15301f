"""Stick guide: references from keyboard, gamepad or script."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.control.key_events import NEXT_ARM, held_after, read_track, stick_of
from seals.control.tracking import Place, pursued
from seals.field_roles import roles
from seals.schema import setting
from seals.state_records import state_record
from seals.teleop.device import Device, Script


@state_record
class StickState(NamedTuple):
    """State of the stick guide between calls; immutable.

    Args:
        time: of the last call [s].
        events: number of events that were heeded.
        held: value of every control that is held.
        arm: number of the chosen arm.
        place: where the robot shall be, world [m], shape (3,).
        velocity: of that place [m/s], shape (3,).
        yaw: heading [rad].
        joints: by arm [rad or m].
        grip: by gripper [1].
        ended: whether the session is over.
    """

    time: float
    events: int
    held: Mapping[str, float]
    arm: int
    place: Floats
    velocity: Floats
    yaw: float
    joints: Mapping[str, Floats]
    grip: Mapping[str, float]
    ended: bool


@roles(read="script")
@dataclass(kw_only=True)
class Stick:
    """Guide that integrates stick input to target position, heading, arm angles and grip.

    Args:
        rate: calls a second [Hz].
        script: file of events (CSV or YAML); empty for none, or for a device set by `use`.
        speed: of full forward and sideways stick [m/s].
        climb: of full vertical stick [m/s].
        turn: of full turning stick [rad/s].
        agility: rate at which the speed follows the stick [m/s^2].
        joint_speed: of the chosen arm's joints [rad/s or m/s].
        grip_speed: of opening and closing [1/s].
        leash: farthest that the wished-for place may run ahead of the robot [m].
        position_gain: of the position's error [1/s].

    Example:
        >>> Stick(speed=0.5).speed
        0.5
    """

    rate: float = setting(50.0, "Hz", bounds=(1.0, 1e4), source="chosen: a hand")
    script: str = ""
    speed: float = setting(0.8, "m/s", bounds=(0.0, 50.0), source="chosen")
    climb: float = setting(0.5, "m/s", bounds=(0.0, 50.0), source="chosen")
    turn: float = setting(0.8, "rad/s", bounds=(0.0, 20.0), source="chosen")
    agility: float = setting(1.5, "m/s^2", bounds=(0.01, 100.0), source="chosen")
    joint_speed: float = setting(0.8, "rad/s", bounds=(0.0, 20.0), source="chosen")
    grip_speed: float = setting(1.5, "1/s", bounds=(0.0, 100.0), source="chosen")
    leash: float = setting(0.5, "m", bounds=(0.01, 100.0), source="chosen")
    position_gain: float = setting(1.8, "1/s", bounds=(0.0, 50.0), source="chosen: as hover")

    def __post_init__(self) -> None:
        """Start without a device: the script leads."""
        self._given: Device | None = None

    def use(self, device: Device) -> None:
        """Use events of a device instead of the script."""
        self._given = device

    def bind(self, plant: Plant) -> None:
        """Store the arms of the robot; read the script.

        Raises:
            ConfigError: the script cannot be used.
        """
        self._robot = plant.robot
        self._device: Device = (
            Script(read_track(Path(self.script)) if self.script else [])
            if self._given is None
            else self._given
        )

    def start(self, situation: RobotState) -> StickState:
        """Start with the target at the present position, arms at rest, grippers open."""
        return StickState(
            time=situation.time,
            events=0,
            held={},
            arm=0,
            place=situation.position.copy(),
            velocity=np.zeros(3),
            yaw=situation.yaw,
            joints={name: arm.stowed for name, arm in self._robot.arms.items()},
            grip=dict.fromkeys(self._robot.grippers, 0.0),
            ended=False,
        )

    def aim(self, situation: RobotState, memory: StickState) -> tuple[Reference, StickState]:
        """Integrate the held controls into the target, and return the reference to it."""
        span = situation.time - memory.time
        # what was held until now has moved it; what is heard now acts from now on
        moved = self._heard(situation, self._moved(situation, memory, span))
        acceleration = (moved.velocity - memory.velocity) / span if span > 0.0 else np.zeros(3)
        place = Place(
            moved.place,
            velocity=moved.velocity,
            acceleration=acceleration,
            yaw=moved.yaw,
            yaw_rate=(moved.yaw - memory.yaw) / span if span > 0.0 else 0.0,
        )
        aim = pursued(
            situation,
            place,
            gain=self.position_gain,
            speed=max(self.speed, self.climb),
            joints=moved.joints,
            grip=moved.grip,
        )
        return aim, moved

    def finished(self, memory: StickState) -> bool | None:
        """Return True once the user has ended the session."""
        return True if memory.ended else None

    def stage(self, memory: StickState) -> str:
        """Return the names of the held controls."""
        return " ".join(memory.held) or "hold"

    def _heard(self, situation: RobotState, memory: StickState) -> StickState:
        """Return the state after all events up to the current time."""
        every = self._device.events(situation)
        stop = memory.events
        # half a nanosecond forgives times that were rounded in a file
        while stop < len(every) and every[stop].time <= situation.time + 5e-10:
            stop += 1
        news = every[memory.events : stop]
        presses = sum(1 for event in news if event.control == NEXT_ARM and event.value)
        # a key that was pressed and released between two calls has been pressed
        ended = memory.ended or any(stick_of({e.control: e.value}).end for e in news)
        return memory._replace(
            time=situation.time,
            events=stop,
            held=held_after(memory.held, news) if news else memory.held,
            arm=(memory.arm + presses) % max(len(memory.joints), 1),
            ended=ended,
        )

    def _moved(self, situation: RobotState, memory: StickState, span: float) -> StickState:
        """Return the state after the held controls acted for ``span`` [s]."""
        stick = stick_of(memory.held)
        yaw = memory.yaw + self.turn * stick.turn * span
        cos, sin = math.cos(yaw), math.sin(yaw)
        wanted = np.array(
            [
                self.speed * (cos * stick.forward - sin * stick.left),
                self.speed * (sin * stick.forward + cos * stick.left),
                self.climb * stick.up,
            ]
        )
        velocity = memory.velocity + _shortened(wanted - memory.velocity, self.agility * span)
        ahead = memory.place + 0.5 * (memory.velocity + velocity) * span - situation.position
        return memory._replace(
            place=situation.position + _shortened(ahead, self.leash),
            velocity=velocity,
            yaw=yaw,
            joints=self._arms(memory, stick.joints, stow=stick.stow, span=span),
            grip={
                name: min(max(value + self.grip_speed * stick.grip * span, 0.0), 1.0)
                for name, value in memory.grip.items()
            },
        )

    def _arms(
        self, memory: StickState, shares: tuple[float, ...], *, stow: bool, span: float
    ) -> dict[str, Floats]:
        """Angles of all arms: the selected one moved by its keys, or all on their way to rest."""
        out = dict(memory.joints)
        step = self.joint_speed * span
        for number, (name, arm) in enumerate(self._robot.arms.items()):
            index = list(arm.joints)
            change = np.zeros(len(index))
            if stow:
                change = np.clip(arm.stowed - out[name], -step, step)
            elif number == memory.arm:
                count = min(len(index), len(shares))
                change[:count] = step * np.array(shares[:count])
            low, high = self._robot.lower[index], self._robot.upper[index]
            out[name] = np.clip(out[name] + change, low, high)
        return out


def _shortened(vector: Floats, longest: float) -> Floats:
    """Return a vector with its length limited to ``longest``.

    Example:
        >>> _shortened(np.array([3.0, 4.0]), 1.0)
        array([0.6, 0.8])
    """
    length = math.sqrt(vector @ vector)
    return vector * (longest / length) if length > longest else vector
