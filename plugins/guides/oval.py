"""Guide along a vertical ellipse through the surface, half in air, half under water."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.control.tracking import Place, pursued
from seals.schema import check_tree, count, setting, vector
from seals.state_records import state_record


@state_record
class OvalState(NamedTuple):
    """State: start time [s], heading [rad] and time of the last call [s]."""

    time: float
    yaw: float
    now: float


@dataclass(kw_only=True)
class Oval:
    """Guide along an ellipse in a vertical plane, lap by lap, from the topmost point.

    Equation:
        p = centre + length / 2 sin(a) e + height / 2 cos(a) z with e along ``direction``; the angle
        a runs at a constant rate after a soft start.

    Args:
        rate: calls a second [Hz].
        centre: of the oval, world [m]; on the surface, half of it is under water.
        length: horizontal axis [m].
        height: vertical axis [m].
        direction: of the horizontal axis, anticlockwise from world x [rad].
        period: time of a lap [s].
        laps: number of laps; it then rests at the top.
        start_time: rest before the first lap, and time of the soft start [s].
        position_gain: of the position's error [1/s].
        speed: largest speed towards the course [m/s].

    Example:
        >>> Oval(period=20.0).laps
        20
    """

    rate: float = setting(250.0, "Hz", bounds=(1.0, 1e4), source="chosen: every step")
    centre: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e5, 1e5), source="the surface")
    length: float = setting(2.0, "m", bounds=(0.0, 1e4), source="chosen: four robots long")
    height: float = setting(
        1.6, "m", bounds=(0.0, 1e4), source="chosen: dry above, submerged below"
    )
    direction: float = setting(0.0, "rad", bounds=(-6.3, 6.3), source="world x")
    period: float = setting(20.0, "s", bounds=(0.1, 1e5), source="chosen")
    laps: int = count(20, bounds=(1, 1_000_000))
    start_time: float = setting(4.0, "s", bounds=(0.0, 1e4), source="chosen: rotors spin up")
    position_gain: float = setting(
        1.5, "1/s", bounds=(0.0, 50.0), source="chosen: below the speed's"
    )
    speed: float = setting(1.0, "m/s", bounds=(0.0, 50.0), source="chosen")

    def __post_init__(self) -> None:
        """Refuse what the fields do not allow, as the reading of a configuration does."""
        check_tree(self, where="oval")

    def bind(self, plant: Plant) -> None:
        """Accept any robot."""

    def start(self, situation: RobotState) -> OvalState:
        """Return the initial state: time and heading."""
        return OvalState(situation.time, situation.yaw, situation.time)

    def aim(self, situation: RobotState, memory: OvalState) -> tuple[Reference, OvalState]:
        """Return the reference on the ellipse."""
        place = self.place(situation.time - memory.time)._replace(yaw=memory.yaw)
        aim = pursued(situation, place, gain=self.position_gain, speed=self.speed)
        return aim, memory._replace(now=situation.time)

    def place(self, time: float) -> Place:
        """Return the reference position ``time`` [s] after the start."""
        angle, rate, gain = self._angle(time)
        c, s = math.cos(angle), math.sin(angle)
        along = (math.cos(self.direction), math.sin(self.direction))
        out = self._oval(along, s, c)
        first, second = self._oval(along, c, -s), self._oval(along, -s, -c)
        velocity: Floats = rate * first
        return Place(np.asarray(self.centre) + out, velocity, gain * first + rate**2 * second)

    def _oval(self, along: tuple[float, float], aside: float, up: float) -> Floats:
        reach = 0.5 * self.length * aside
        return np.array([reach * along[0], reach * along[1], 0.5 * self.height * up])

    def _angle(self, time: float) -> tuple[float, float, float]:
        """Return angle, rate and acceleration: at rest, a smooth start, laps, a smooth end."""
        full, soft = 2.0 * math.pi / self.period, self.start_time
        whole = 2.0 * math.pi * self.laps
        moving = time - soft
        # while starting and while stopping it covers half a soft start at full speed
        cruise = (whole - full * soft) / full if soft > 0.0 else whole / full
        if moving <= 0.0:
            return 0.0, 0.0, 0.0
        if moving < soft:
            return _eased(moving, soft, full)
        if moving < soft + cruise:
            return full * (moving - 0.5 * soft), full, 0.0
        left = 2.0 * soft + cruise - moving
        if left <= 0.0:
            return whole, 0.0, 0.0
        angle, rate, gain = _eased(left, soft, full)
        return whole - angle, rate, -gain

    def finished(self, memory: OvalState) -> bool | None:
        """Return True after the last lap."""
        end = self.laps * self.period + 2.0 * self.start_time
        return True if memory.now - memory.time >= end else None

    def stage(self, memory: OvalState) -> str:
        """Return the number of the lap."""
        angle = self._angle(memory.now - memory.time)[0]
        return f"lap {min(int(angle / (2.0 * math.pi)) + 1, self.laps)}"


def _eased(time: float, soft: float, full: float) -> tuple[float, float, float]:
    """Angle, rate and acceleration while the rate rises smoothly to ``full`` within ``soft``."""
    u = time / soft
    angle = full * soft * (u**3 - 0.5 * u**4)
    return angle, full * (3.0 * u**2 - 2.0 * u**3), full * 6.0 * u * (1.0 - u) / soft
