"""Guide through waypoints along minimum-jerk paths."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.control.protocols import Goal
from seals.control.tracking import Place, minimum_jerk, pursued, refuse_strange_places
from seals.field_roles import roles
from seals.schema import setting
from seals.state_records import state_record


@state_record
class WaypointState(NamedTuple):
    """State: start time [s], position [m], heading [rad], and time of the last call [s]."""

    time: float
    place: Floats
    yaw: float
    now: float


class _Leg(NamedTuple):
    """One leg: start and end time [s], and both positions [m]; it rests at the end."""

    start: float
    end: float
    a: Floats
    b: Floats


@roles(data="repeat face_ahead")
@dataclass(kw_only=True)
class Waypoints:
    """Guide through waypoints along straight minimum-jerk paths, with a rest at each.

    Args:
        rate: calls a second [Hz].
        places: to be visited, world [m], rows of three numbers.
        speed: largest speed on a leg [m/s].
        rest: time at every place [s].
        delay: rest before the first leg [s].
        repeat: whether it begins anew after the last place.
        face_ahead: whether the heading follows the way; otherwise that of the start is kept.
        position_gain: of the position's error [1/s].
        tolerance: distance within which a place counts as reached [m].

    Example:
        >>> Waypoints(places=[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]]).speed
        0.5
    """

    rate: float = setting(250.0, "Hz", bounds=(1.0, 1e4), source="chosen: every step")
    places: list[list[float]] = field(default_factory=lambda: [[0.0, 0.0, 1.0]])
    speed: float = setting(0.5, "m/s", bounds=(1e-3, 50.0), source="chosen")
    rest: float = setting(1.0, "s", bounds=(0.0, 1e4), source="chosen")
    delay: float = setting(2.0, "s", bounds=(0.0, 1e4), source="chosen")
    repeat: bool = False
    face_ahead: bool = False
    position_gain: float = setting(
        1.8, "1/s", bounds=(0.0, 50.0), source="chosen: below the speed's"
    )
    tolerance: float = setting(0.05, "m", bounds=(0.0, 1e4), source="chosen: 5 cm")

    def __post_init__(self) -> None:
        """Refuse waypoints that are not finite positions."""
        refuse_strange_places("waypoints.places", self.places)

    def bind(self, plant: Plant) -> None:
        """Accept any robot."""

    def start(self, situation: RobotState) -> WaypointState:
        """Return the initial state: time, position and heading."""
        t = situation.time
        return WaypointState(t, np.array(situation.position), situation.yaw, t)

    def aim(self, situation: RobotState, memory: WaypointState) -> tuple[Reference, WaypointState]:
        """Return the reference on the present leg."""
        place = self._place(situation.time - memory.time, memory)
        aim = pursued(situation, place, gain=self.position_gain, speed=2.0 * self.speed)
        return aim, memory._replace(now=situation.time)

    def finished(self, memory: WaypointState) -> bool | None:
        """Return True after the rest at the last waypoint; never when it repeats."""
        legs = self._legs(memory)
        done = memory.now - memory.time >= legs[-1].end + self.rest
        return True if done and not self.repeat else None

    def goals(self, memory: WaypointState) -> tuple[Goal, ...]:
        """Return the places to be visited."""
        return tuple(
            Goal(f"place {k + 1}", np.array(place, dtype=float), self.tolerance)
            for k, place in enumerate(self.places)
        )

    def stage(self, memory: WaypointState) -> str:
        """Return the number of the next waypoint."""
        k, _ = self._leg(memory.now - memory.time, memory)
        return f"to place {k % len(self.places) + 1}"

    def _place(self, time: float, memory: WaypointState) -> Place:
        _, leg = self._leg(time, memory)
        place = minimum_jerk(leg.a, leg.b, leg.end - leg.start, time - leg.start)
        yaw = memory.yaw
        way = leg.b - leg.a
        if self.face_ahead and math.hypot(way[0], way[1]) > 1e-6:
            yaw = math.atan2(way[1], way[0])
        return place._replace(yaw=yaw)

    def _leg(self, time: float, memory: WaypointState) -> tuple[int, _Leg]:
        legs = self._legs(memory)
        if self.repeat and time > legs[-1].end + self.rest:
            # every further round leads from the last place to the first one
            first = self._chain([np.array(self.places[-1]), *map(np.array, self.places)], 0.0)
            round_time = first[-1].end + self.rest
            begin = legs[-1].end + self.rest
            turn = math.floor((time - begin) / round_time)
            shift = begin + turn * round_time
            legs = [leg._replace(start=leg.start + shift, end=leg.end + shift) for leg in first]
        k = next((k for k, leg in enumerate(legs) if time < leg.end + self.rest), len(legs) - 1)
        return k, legs[k]

    def _legs(self, memory: WaypointState) -> list[_Leg]:
        return self._chain([memory.place, *map(np.array, self.places)], self.delay)

    def _chain(self, places: list[Floats], start: float) -> list[_Leg]:
        """Return the legs between places, one after the other."""
        legs = []
        for a, b in itertools.pairwise(places):
            # the speed of least jerk peaks at 15/8 of its mean
            end = start + 1.875 * float(np.linalg.norm(b - a)) / self.speed
            legs.append(_Leg(start, end, a, b))
            start = end + self.rest
        return legs
