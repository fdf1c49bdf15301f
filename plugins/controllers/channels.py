"""Controller that passes the outputs of an external autopilot to drives and servos."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.limbs import stowed
from seals.control.protocols import ControllerOptions
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.motion import MediumKind
from seals.schema import param, vector
from seals.state_records import state_record
from seals.teleop.autopilot.link import Link, Track, flight_state, read_track

PULSES = (1000.0, 2000.0)
"""Range of a channel where no autopilot says another [us]."""
MOST = 32
"""Channels of an autopilot."""


@state_record
class ChannelsState(NamedTuple):
    """State between calls; immutable.

    Args:
        place: at the last call, world [m], shape (3,); None before the first.
        velocity: at the last call, world axes [m/s], shape (3,).
        way: change of place between the last two calls over their time, world axes [m/s], shape
            (3,); None before the second.
        joints: targets of the servos [rad or m], shape (J,).
    """

    place: Floats | None
    velocity: Floats | None
    way: Floats | None
    joints: Floats


@roles(data="reverse", read="script")
@dataclass(kw_only=True)
class Channels(ControllerOptions):
    """Passes servo channels of an external autopilot to drives and joints, for `seals autopilot`.

    Outputs are counted over the drives in their order, then the joints. Lists hold one entry an
    output, or one for all. A channel without a pulse stops a drive and leaves a servo where it is.

    Equation:
        command = at_low + (x - low) / (high - low) (at_high - at_low), x the channel's value
        within low and high; at_low and at_high change places where ``reverse`` is true.

    Args:
        rate: calls a second [Hz]; `seals autopilot` calls it at each step.
        channel: of each output, counted from 1, 0 for none; empty for 1, 2, 3 ...
        low: value of the channel for ``at_low``; empty for that of the protocol.
        high: likewise for ``at_high``.
        reverse: whether the channel acts the other way.
        at_low: command at ``low`` [rad/s, N, rad or m]; empty for 0 of rotors, the largest force
            backwards of thrusters, the lower limit of joints.
        at_high: command at ``high``, likewise; empty for the largest.
        script: file of outputs to take in place of an autopilot; empty for none: nothing moves.

    Assumptions:
        A rotor's speed, a thruster's force, a servo's angle are proportional to the pulse.

    Valid range:
        Any robot with drives or servos.

    Limitations:
        Thrust of a rotor is then quadratic in the pulse: MOT_THST_EXPO 1 of ArduPilot, THR_MDL_FAC
        1 of PX4.

    Example:
        >>> Channels(channel=[3, 1], reverse=[True]).reverse
        [True]
    """

    rate: float = param(
        400.0,
        "Hz",
        bounds=(1.0, 1e5),
        tolerance=0.0,
        source="ArduPilot: SCHED_LOOP_RATE",
        fit=False,
    )
    channel: list[int] = field(default_factory=list)
    low: list[float] = vector((), "us or 1", bounds=(-1e4, 1e4), source="the protocol")
    high: list[float] = vector((), "us or 1", bounds=(-1e4, 1e4), source="the protocol")
    reverse: list[bool] = field(default_factory=lambda: [False])
    at_low: list[float] = vector((), "rad/s, N, rad, m", bounds=(-1e5, 1e5), source="the robot")
    at_high: list[float] = vector((), "rad/s, N, rad, m", bounds=(-1e5, 1e5), source="the robot")
    script: str = ""
    sense: ClassVar[str] = "truth"
    needs_mass_properties: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Take no autopilot's outputs as yet."""
        self._link: Link | None = None

    def use(self, link: Link, step: float) -> None:
        """Take outputs of an autopilot at each step [s] instead of the script, and keep them."""
        self._link, self.rate = link, 1.0 / step
        self.track: list[tuple[float, Floats]] = []

    def bind(self, plant: Plant) -> None:
        """Find channel, range and commands of each output.

        Raises:
            ConfigError: a list does not fit the robot, or a range is empty.
        """
        link = self._link
        self._script = None if link or not self.script else read_track(Path(self.script))
        layout, robot = plant.layout, plant.robot
        rotors = np.array([kind == "rotor" for kind in layout.kind], dtype=bool)
        drives, joints = layout.drives, robot.tree.joints
        # velocity of the air by the effects of the robot's model, world axes [m/s]
        blowing = [b.params for b in plant.effects.flows if b.kind is MediumKind.air]
        blows = [params["velocity"] for params in blowing if "velocity" in params]
        wind: Floats = np.zeros(3)
        for velocity in blows:
            wind = wind + np.reshape(np.asarray(velocity), -1)[:3]
        self._gravity, self._rest, self._wind = plant.gravity, stowed(robot), wind
        one = np.concatenate((rotors, np.zeros(joints, dtype=bool)))[:, None]
        ranges = np.where(one, *((link.one_way, link.two_way) if link else (PULSES, PULSES)))
        bottom = np.where(np.isfinite(robot.lower), robot.lower, -math.pi)
        top = np.where(np.isfinite(robot.upper), robot.upper, math.pi)
        lowest = np.concatenate((np.where(rotors, 0.0, layout.low), bottom))
        self._floor = np.concatenate((layout.low, bottom))
        self._ceiling = np.concatenate((layout.limit, top))
        count = drives + joints
        self._drives = drives
        default = [k + 1 if k < MOST else 0 for k in range(count)]
        self._channel = _spread("channel", self.channel or default, count).astype(int)
        if self._channel.min(initial=0) < 0 or self._channel.max(initial=0) > MOST:
            raise ConfigError(
                f"controller.channel={self.channel} is not allowed.\nAllowed: 0 to {MOST}"
            )
        self._low = _spread("low", self.low or ranges[:, 0], count)
        self._high = _spread("high", self.high or ranges[:, 1], count)
        if np.any(self._low >= self._high):
            raise ConfigError(
                f"controller.low={self.low} and high={self.high}: a range is empty.\n"
                "Allowed: low below high; reverse a channel by controller.reverse"
            )
        start = _spread("at_low", self.at_low or lowest, count)
        end = _spread("at_high", self.at_high or self._ceiling, count)
        turned = _spread("reverse", self.reverse, count).astype(bool)
        self._start, self._end = np.where(turned, end, start), np.where(turned, start, end)

    def settled(self) -> dict[str, Any]:
        """Return rate and ranges in use, for a run that repeats this one."""
        return {"rate": self.rate, "low": self._low.tolist(), "high": self._high.tolist()}

    def start(self) -> ChannelsState:
        """Return the initial state."""
        return ChannelsState(None, None, None, self._rest)

    def command(
        self, situation: RobotState, aim: Reference, memory: ChannelsState
    ) -> tuple[ActuatorCommand, ChannelsState]:
        """Return the commands of the outputs in force."""
        wanted = self._commands(self._outputs(situation, memory))
        drive = np.nan_to_num(wanted[: self._drives], nan=0.0)
        targets = wanted[self._drives :]
        joints = np.where(np.isnan(targets), memory.joints, targets)
        now, way = situation, None
        if memory.place is not None:
            way = (now.position - memory.place) / now.step
        later = ChannelsState(now.position.copy(), now.velocity.copy(), way, joints)
        return ActuatorCommand(drive, joints), later

    def _outputs(self, now: RobotState, memory: ChannelsState) -> Floats | None:
        """Outputs of the autopilot that answer the present state, or those of the script."""
        link = self._link
        if link is None:
            return None if self._script is None else self._script.at(now.time)
        if link.ended:
            return None
        found = link.exchange(flight_state(now, _change(now, memory), self._gravity, self._wind))
        # at the end nothing has a pulse
        self.track.append((now.time, np.zeros(0) if found is None else found))
        return found

    def _commands(self, outputs: Floats | None) -> Floats:
        """Commands of all outputs, NaN for those without a pulse."""
        values = np.full(MOST + 1, np.nan)
        if outputs is not None:
            values[1 : len(outputs) + 1] = outputs[:MOST]
        x = np.minimum(np.maximum(values[self._channel], self._low), self._high)
        share = (x - self._low) / (self._high - self._low)
        wanted: Floats = self._start + share * (self._end - self._start)
        return np.clip(wanted, self._floor, self._ceiling)

    def recorded(self) -> Track:
        """Return the outputs of the autopilot so far, without those that repeat the last ones."""
        width = max((len(values) for _, values in self.track), default=0)
        times = np.array([time for time, _ in self.track])
        rows = np.full((len(times), width), np.nan)
        for k, (_, values) in enumerate(self.track):
            rows[k, : len(values)] = values
        plain = np.nan_to_num(rows, nan=-1e9)
        fresh = np.ones(len(times), dtype=bool)
        fresh[1:] = np.any(plain[1:] != plain[:-1], axis=1)
        return Track(times[fresh], rows[fresh])


def _change(now: RobotState, memory: ChannelsState) -> Floats | None:
    """Acceleration of the step that led here, as an accelerometer has it, see `seals.world.felt`.

    The velocity at the end of the first step, less that at the start, is h times the first
    acceleration; a later velocity holds half of the last kick more than the way.
    """
    if memory.place is None or memory.velocity is None:
        return None
    if memory.way is None:
        return (now.velocity - memory.velocity) / now.step
    return ((now.position - memory.place) / now.step - memory.way) / now.step


def _spread(key: str, values: Sequence[Any] | Floats, count: int) -> Floats:
    """One value an output, from such a list or one value for all."""
    given = np.asarray(values, dtype=float)
    if given.shape not in ((count,), (1,)):
        raise ConfigError(
            f"controller.{key} has {given.size} entries, the robot has {count} outputs.\n"
            "Allowed: one for each output (the drives, then the joints), or one for all"
        )
    return np.array(np.broadcast_to(given, (count,)))
