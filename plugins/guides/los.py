"""Line-of-sight guide along straight legs, for vehicles that steer."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.control.line_of_sight import LegPosition, integral_rate, los_angle
from seals.control.protocols import Goal
from seals.control.tracking import refuse_strange_places
from seals.field_roles import roles
from seals.schema import setting
from seals.state_records import state_record

SHORT = 1e-3
"""Legs shorter than this, seen from above, have no course [m]."""


@state_record
class LosState(NamedTuple):
    """State of the guide.

    Args:
        start: place of the start, world [m], shape (3,).
        leg: number of the place that the present leg leads to.
        yaw: last course [rad].
        offset: integral of the cross-track error [m].
        done: whether the last place was passed.
    """

    start: Floats
    leg: int
    yaw: float
    offset: float
    done: bool


@roles(data="repeat")
@dataclass(kw_only=True)
class Los:
    """Guide along straight legs by line of sight: it steers to a point ahead on the leg.

    Equation:
        chi = pi_p - atan((e + y) / Delta), y' = sigma Delta e / ((e + y)^2 + Delta^2); likewise the
        angle of climb, gamma = gamma_p - atan(e_z / Delta_z). The reference is the speed along
        that direction, with the heading chi.

    Args:
        rate: calls a second [Hz].
        places: to be passed, world [m], rows of three numbers; the first leg begins at the start.
        speed: along the way [m/s].
        lookahead: Delta, distance of the point ahead [m]; more than four times the speed by the
            bandwidth of the heading, or the vehicle weaves.
        climb_lookahead: Delta_z, likewise for the depth [m].
        climb_limit: steepest climb or descent [rad].
        integral_gain: sigma, against a current across the leg [m/s].
        acceptance: distance along the leg at which the next one begins [m].
        repeat: whether it begins anew after the last place.

    References:
        Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 12.

    Example:
        >>> Los(places=[[10.0, 0.0, -2.0], [10.0, 10.0, -2.0]]).lookahead
        6.0
    """

    rate: float = setting(50.0, "Hz", bounds=(0.1, 1e4), source="chosen: every step")
    places: list[list[float]] = field(default_factory=lambda: [[20.0, 0.0, 0.0]])
    speed: float = setting(1.0, "m/s", bounds=(1e-3, 50.0), source="chosen")
    lookahead: float = setting(6.0, "m", bounds=(0.01, 1e4), source="chosen: 4 U / (1.4 rad/s)")
    climb_lookahead: float = setting(6.0, "m", bounds=(0.01, 1e4), source="chosen: see lookahead")
    climb_limit: float = setting(0.4, "rad", bounds=(0.0, 1.5), source="chosen: 23 degrees")
    integral_gain: float = setting(0.0, "m/s", bounds=(0.0, 10.0), source="chosen: no current")
    acceptance: float = setting(2.0, "m", bounds=(0.0, 1e4), source="chosen: two lengths")
    repeat: bool = False

    def __post_init__(self) -> None:
        """Refuse an empty list of places, and places that are not three finite numbers."""
        refuse_strange_places("los.places", self.places)

    def bind(self, plant: Plant) -> None:
        """Accept any robot."""

    def start(self, situation: RobotState) -> LosState:
        """Return the initial state: the first leg begins at the present position."""
        return LosState(np.array(situation.position), 0, situation.yaw, 0.0, False)

    def aim(self, situation: RobotState, memory: LosState) -> tuple[Reference, LosState]:
        """Return velocity and heading towards the point ahead."""
        memory = self._passed(situation.position, memory)
        a, b = self._leg(memory)
        if math.hypot(*(b - a)[:2]) < SHORT:
            return Reference(velocity=np.zeros(3), yaw=memory.yaw), memory
        at = LegPosition.of(a, b, situation.position)
        course = at.course + los_angle(at.cross, self.lookahead, memory.offset)
        climb = at.climb + los_angle(at.above, self.climb_lookahead)
        climb = min(max(climb, -self.climb_limit), self.climb_limit)
        level = self.speed * math.cos(climb)
        velocity = np.array(
            [level * math.cos(course), level * math.sin(course), self.speed * math.sin(climb)]
        )
        sum_ = memory.offset
        rate = integral_rate(at.cross, self.lookahead, sum_)
        after = memory._replace(
            yaw=course, offset=sum_ + situation.step * self.integral_gain * rate
        )
        # the course turns as the error shrinks
        vx, vy = situation.velocity[:2].tolist()
        drift = vy * math.cos(at.course) - vx * math.sin(at.course)
        turn = -self.lookahead * drift / ((at.cross + sum_) ** 2 + self.lookahead**2)
        return Reference(velocity=velocity, yaw=course, yaw_rate=turn), after

    def finished(self, memory: LosState) -> bool | None:
        """Return True once the last place has been passed; a repeated course never finishes."""
        return True if memory.done else None

    def goals(self, memory: LosState) -> tuple[Goal, ...]:
        """Return the places to be passed, each within the distance of acceptance."""
        return tuple(
            Goal(f"place {k + 1}", np.array(place, dtype=float), self.acceptance)
            for k, place in enumerate(self.places)
        )

    def stage(self, memory: LosState) -> str:
        """Return the number of the place ahead."""
        return f"to place {memory.leg % len(self.places) + 1}"

    def _leg(self, memory: LosState) -> tuple[Floats, Floats]:
        places = self.places
        k = memory.leg
        before = memory.start if k == 0 else np.array(places[(k - 1) % len(places)], dtype=float)
        return before, np.array(places[k % len(places)], dtype=float)

    def _passed(self, position: Floats, memory: LosState) -> LosState:
        """Switch to the next leg at the end of the present one; the last leg is kept."""
        for _ in self.places:
            a, b = self._leg(memory)
            ahead = math.hypot(*(b - a)[:2])
            left = 0.0 if ahead < SHORT else LegPosition.of(a, b, position).left
            last = not self.repeat and memory.leg == len(self.places) - 1
            if left > (0.0 if last else self.acceptance):
                break
            if last:
                return memory._replace(done=True)
            memory = memory._replace(leg=memory.leg + 1)
        return memory
