"""Scripted gaits over a batch of robots."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from seals.arrays import Array, as_like, namespace
from seals.plugins.controllers.walking.anatomy import Anatomy
from seals.plugins.controllers.walking.stride import Walk, toes_of
from seals.plugins.controllers.walking.walker import Facing

SLOWEST = 1e-3
"""Speed below which there is no way to face [m/s]."""
SHUFFLE = 0.03
"""Error of the heading that is left to a standing robot [rad]."""
STILL = 0.02
"""Liveliness below which the legs stand [1]."""


class BatchPace(NamedTuple):
    """State of B gaits between calls.

    Args:
        phase: of every leg, share of the cycle, shape (B, N).
        walk: ahead and aside [m/s], turn [rad/s], smooth, shape (B, 3).
        lively: 1 while walking, 0 standing, shape (B, 1).
        heading: that belongs to the way [rad], shape (B, 1); not a number before it first walks.
    """

    phase: Array
    walk: Array
    lively: Array
    heading: Array


class BatchGait:
    """Gait of B robots, as `Gait` steps one: leg by leg the same laws.

    Args:
        gait: bound to the robot.
        legs: geometry of its legs.
        batch: number of robots B.
        like: array whose library, type and device to use.

    Attributes:
        joints: columns of the legs' joints, shape (3 N,).
    """

    def __init__(self, gait: Any, legs: Anatomy, *, batch: int, like: Array) -> None:
        self._gait, self.batch, self.count = gait, batch, len(legs.toe)
        self._order = as_like(gait.order(gait.manner({})), like)[None]
        self._toe, self._outward = as_like(legs.toe, like), as_like(legs.outward(), like)
        xp = namespace(like)
        self._legs = Anatomy(*(xp.concat([as_like(x, like)] * batch, axis=0) for x in legs))
        self.joints = [int(j) for j in legs.joints.ravel()]

    def start(self) -> BatchPace:
        """Return standing gaits."""
        xp = namespace(self._toe)
        one = as_like([[0.0]] * self.batch, self._toe)
        walk = xp.concat([one] * 3, axis=1)
        return BatchPace(one + self._order, walk, one, one + math.nan)

    def command(
        self,
        rotation: Array,
        velocity: Array,
        turn: Array | None,
        wishes: Mapping[str, Array],
        memory: BatchPace,
        *,
        step: float,
    ) -> tuple[Array, BatchPace]:
        """Return the joint values for the next period, shape (B, 3 N), and the new state.

        Args:
            rotation: of the bodies, shape (B, 3, 3).
            velocity: wanted, world axes [m/s], shape (B, 3).
            turn: wanted rate of turn [rad/s], shape (B, 1); None where the gait turns the robot.
            wishes: stepping parameters over those of the gait, shape (B, 1) each.
            memory: of the last call.
            step: until the next call [s].
        """
        xp = namespace(velocity)
        manner = self._gait.manner({})._asdict() | dict(wishes)
        if "frequency" in manner:
            manner["low"] = manner["high"] = manner.pop("frequency")
        places = self._places(manner, memory.lively)
        heading = memory.heading
        if turn is None:
            turn, heading = self._turn(rotation, velocity, heading)
        wanted = self._cadence(self._wanted(rotation, velocity, turn), places, manner)[1]
        share = self._gait.share(step)
        walk = memory.walk + share * (wanted - memory.walk)
        one = memory.lively * 0.0 + 1.0
        going = xp.astype(xp.max(xp.abs(wanted), axis=1) > 1e-3, one.dtype)[:, None]
        lively = memory.lively + share * (going - memory.lively)
        frequency, walk = self._cadence(walk, places, manner)
        stands = lively < STILL
        phase = memory.phase + xp.where(stands, one * 0.0, frequency * step)
        phase = phase - xp.floor(phase)
        lively = xp.where(stands, lively * going, lively)
        toes = toes_of(
            xp.reshape(phase, (-1,)),
            xp.reshape(places, (-1, 3)),
            Walk(*(self._by_leg(walk[:, k : k + 1]) for k in range(3))),
            frequency=self._by_leg(frequency),
            duty=self._by_leg(manner["duty"] * one),
            lift=self._by_leg(manner["lift"] * lively),
        )
        values = xp.reshape(self._legs.angles(toes), (self.batch, 3 * self.count))
        return values, BatchPace(phase, walk, lively, heading)

    def _turn(self, rotation: Array, velocity: Array, last: Array) -> tuple[Array, Array]:
        """Rate of turn to the heading that belongs to the way [rad/s], and that heading [rad]."""
        xp, gait = namespace(velocity), self._gait
        yaw = xp.atan2(rotation[:, 1, 0:1], rotation[:, 0, 0:1])
        goes = xp.sqrt(xp.sum(velocity[:, :2] ** 2, axis=1, keepdims=True)) >= SLOWEST
        heading = xp.where(xp.isnan(last), yaw, last)
        if gait.facing is not Facing.aim:
            way = xp.atan2(velocity[:, 1:2], velocity[:, 0:1])
            half = way * 0.0 + 0.5 * math.pi
            # the nearer of the two sides
            side = way - xp.where(xp.sin(way - yaw) >= 0.0, half, -half)
            heading = xp.where(goes, side if gait.facing is Facing.sideways else way, heading)
        error = xp.atan2(xp.sin(heading - yaw), xp.cos(heading - yaw))
        turn = xp.clip(gait.turn_gain * error, -gait.turn_limit, gait.turn_limit)
        # an animal that stands does not shuffle for a degree
        return xp.where(~goes & (xp.abs(error) < SHUFFLE), turn * 0.0, turn), heading

    def _by_leg(self, column: Array) -> Array:
        """Return numbers of the robots (B, 1) as numbers of their legs, shape (B N,)."""
        xp = namespace(column)
        return xp.reshape(xp.concat([column] * self.count, axis=1), (-1,))

    def _places(self, manner: Mapping[str, Any], like: Array) -> Array:
        """Toes in the middle of their strokes, body axes [m], shape (B, N, 3)."""
        xp = namespace(like)
        one = like * 0.0 + 1.0
        level = self._toe[None, :, :2] + (manner["spread"] * one)[:, :, None] * self._outward[None]
        height = self._toe[None, :, 2] + manner["crouch"] * one
        return xp.concat((level, height[:, :, None]), axis=2)

    def _wanted(self, rotation: Array, velocity: Array, turn: Array) -> Array:
        """Walk in body axes that tracks the velocity, shape (B, 3)."""
        xp = namespace(velocity)
        yaw = xp.atan2(rotation[:, 1, 0:1], rotation[:, 0, 0:1])
        c, n = xp.cos(yaw), xp.sin(yaw)
        east, north = velocity[:, 0:1], velocity[:, 1:2]
        limit = self._gait.turn_limit
        return xp.concat(
            (c * east + n * north, c * north - n * east, xp.clip(turn, -limit, limit)), axis=1
        )

    def _cadence(
        self, walk: Array, places: Array, manner: Mapping[str, Any]
    ) -> tuple[Array, Array]:
        """Cycle frequency (B, 1) [Hz], and the walk limited to what it allows (B, 3)."""
        xp = namespace(walk)
        x = walk[:, 0:1] - walk[:, 2:3] * places[:, :, 1]
        y = walk[:, 1:2] + walk[:, 2:3] * places[:, :, 0]
        fastest = xp.sqrt(xp.max(x * x + y * y, axis=1))[:, None]
        needed = fastest * manner["duty"] / manner["stroke"]
        high, low = needed * 0.0 + manner["high"], needed * 0.0 + manner["low"]
        short = xp.where(needed > high, high / xp.maximum(needed, high), high * 0.0 + 1.0)
        return xp.where(needed > high, high, xp.maximum(needed, low)), walk * short
