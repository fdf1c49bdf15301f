"""Stages of a mission: each gives a reference and a transition at every instant."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Floats
from seals.control.tracking import Place, minimum_jerk
from seals.plugins.guides.mission.scene import Move, Outcome, Scene
from seals.schema import setting, vector

PEAK = 1.875
"""Largest speed of a minimum-jerk way over its mean."""


def _speed(default: float) -> float:
    return setting(default, "m/s", bounds=(1e-3, 50.0), source="chosen")


def _seconds(default: float) -> float:
    return setting(default, "s", bounds=(0.0, 1e4), source="chosen")


def _metres(default: float, low: float = -1e4) -> float:
    return setting(default, "m", bounds=(low, 1e4), source="chosen")


@dataclass(frozen=True, kw_only=True)
class Stage(ABC):
    """Base of the stages of a mission.

    Args:
        name: shown and logged; the kind of stage when left out.
        settle: how long the condition to go on must hold [s].
        patience: time beyond the planned one after which it goes on, or tries again [s].
        holding: whether the object is in the hand: when no pad feels it, it is reached for again.
    """

    name: str = ""
    settle: float = _seconds(0.3)
    patience: float = _seconds(6.0)
    holding: bool = False

    @abstractmethod
    def act(self, scene: Scene) -> Move:
        """Return the reference and transition at one instant."""

    def still(self, scene: Scene, *, fine: bool, grip: float | None = None) -> Move:
        """Hold the position at which the stage began."""
        k = scene.kept
        wanted = k.grip if grip is None else grip
        return Move(Place(k.origin, yaw=k.yaw), k.arm, wanted, fine)


@dataclass(frozen=True, kw_only=True)
class Rise(Stage):
    """Stage that changes the height.

    Args:
        height: upwards [m].
        speed: largest [m/s].
        within: distance from the end at which it has arrived [m].
    """

    height: float = _metres(1.0)
    speed: float = _speed(0.4)
    within: float = _metres(0.05, 1e-3)

    def act(self, scene: Scene) -> Move:
        """Return the next position on the way up."""
        end = scene.kept.origin + np.array([0.0, 0.0, self.height])
        return _travelled(self, scene, end, self.speed, self.within)


@dataclass(frozen=True, kw_only=True)
class Go(Stage):
    """Stage that moves to a position on a straight line.

    Args:
        to: world [m], three numbers.
        hand: whether the hand shall be there, not the body.
        yaw: heading at the end [rad]; empty keeps it.
        speed: largest [m/s].
        within: distance from the end at which it has arrived [m].
    """

    to: list[float] = vector((0.0, 0.0, 1.0), "m", bounds=(-1e4, 1e4), source="chosen")
    hand: bool = False
    yaw: list[float] = field(default_factory=list)
    speed: float = _speed(0.6)
    within: float = _metres(0.06, 1e-3)

    def act(self, scene: Scene) -> Move:
        """Return the next position on the line."""
        end = np.asarray(self.to, dtype=float)
        if self.hand:
            end = scene.hand.body_for(end, scene.kept.yaw, scene.now.joints)
        yaw = self.yaw[0] if self.yaw else None
        return _travelled(self, scene, end, self.speed, self.within, yaw)


@dataclass(frozen=True, kw_only=True)
class ReachStage(Stage):
    """Stage that moves the hand above the object at its last seen position.

    Args:
        height: of the hand above the object's origin [m].
        speed: largest [m/s].
        within: horizontal distance at which it has arrived [m].
        within_height: vertical distance at which it has arrived [m].
    """

    height: float = _metres(0.25)
    speed: float = _speed(0.3)
    within: float = _metres(0.02, 1e-3)
    within_height: float = _metres(0.03, 1e-3)

    def act(self, scene: Scene) -> Move:
        """Return the next position towards the object; wait until it has been seen."""
        k, s = scene.kept, scene.now
        if k.target is None:
            late = scene.elapsed > self.patience
            return self.still(scene, fine=False, grip=0.0)._replace(
                verdict=Outcome.again if late else Outcome.stay
            )
        above = k.target + np.array([0.0, 0.0, self.height])
        end = scene.hand.body_for(above, k.yaw, s.joints)
        held = s.position + s.rotation @ scene.hand.offset(s.joints) - above
        there = math.hypot(held[0], held[1]) < self.within and abs(held[2]) < self.within_height
        move = _travelled(self, scene, end, self.speed, math.inf)
        verdict = Outcome.again if move.verdict is Outcome.onward else move.verdict
        return move._replace(fine=move.fine and there, verdict=verdict, grip=0.0)


@dataclass(frozen=True, kw_only=True)
class Pose(Stage):
    """Stage that moves the arm while the body holds its position.

    Args:
        angles: one a joint of the arm [rad or m]; empty for stowed.
        time: of the motion [s].
    """

    angles: list[float] = field(default_factory=list)
    time: float = _seconds(2.0)

    def act(self, scene: Scene) -> Move:
        """Return the next joint angles."""
        k = scene.kept
        end = np.asarray(self.angles, dtype=float) if self.angles else scene.hand.stowed
        done = scene.elapsed >= self.time
        way = minimum_jerk(k.arm_origin, end, self.time, scene.elapsed).position
        return self.still(scene, fine=done)._replace(arm=way)


@dataclass(frozen=True, kw_only=True)
class Close(Stage):
    """Stage that closes the gripper until enough pads are in contact.

    Args:
        time: of the whole motion [s].
        force: on each pad [N].
        pads: how many must feel it.
    """

    time: float = _seconds(1.0)
    force: float = setting(0.3, "N", bounds=(1e-6, 1e3), source="chosen: above splashes")
    pads: int = 2
    settle: float = _seconds(0.6)
    patience: float = _seconds(2.0)

    def act(self, scene: Scene) -> Move:
        """Return the grip; retry without contact in time."""
        grip = min(scene.elapsed / max(self.time, 1e-9), 1.0)
        felt = scene.elapsed >= self.time and scene.pressed(self.force) >= self.pads
        late = scene.elapsed > self.time + self.settle + self.patience
        move = self.still(scene, fine=felt, grip=grip)
        return move._replace(verdict=Outcome.again) if late else move


@dataclass(frozen=True, kw_only=True)
class Open(Stage):
    """Stage that opens the gripper.

    Args:
        time: of the motion [s].
    """

    time: float = _seconds(1.0)

    def act(self, scene: Scene) -> Move:
        """Return the grip."""
        share = min(scene.elapsed / max(self.time, 1e-9), 1.0)
        grip = scene.kept.grip_origin * (1.0 - share)
        return self.still(scene, fine=share >= 1.0, grip=grip)


@dataclass(frozen=True, kw_only=True)
class Wait(Stage):
    """Stage that holds the position for a time.

    Args:
        time: [s].
    """

    time: float = _seconds(1.0)

    def act(self, scene: Scene) -> Move:
        """Return the held position."""
        return self.still(scene, fine=scene.elapsed >= self.time)


@dataclass(frozen=True, kw_only=True)
class Land(Stage):
    """Stage that descends until the body is supported.

    Args:
        speed: downwards [m/s].
        slow: speed at which it counts as held up [m/s].
        lag: how far the wanted place must be below the body before that counts [m].
    """

    speed: float = _speed(0.25)
    slow: float = _speed(0.03)
    lag: float = _metres(0.12, 1e-3)
    settle: float = _seconds(0.5)

    def act(self, scene: Scene) -> Move:
        """Return a descending position; landed when the body no longer follows."""
        k, s = scene.kept, scene.now
        down = self.speed * min(scene.elapsed, 1.0) * max(scene.elapsed - 0.5, 0.5 * scene.elapsed)
        low = k.origin - np.array([0.0, 0.0, down])
        # the wanted place stays near, or the pull on the ground would grow without end
        low[2] = max(low[2], s.position[2] - 2.0 * self.lag)
        held = abs(s.velocity[2]) < self.slow and s.position[2] - low[2] > self.lag
        place = Place(low, np.array([0.0, 0.0, -self.speed]), yaw=k.yaw)
        return Move(place, k.arm, k.grip, held)


def _travelled(  # noqa: PLR0917  one way of one stage
    stage: Stage,
    scene: Scene,
    end: Floats,
    speed: float,
    within: float,
    yaw: float | None = None,
) -> Move:
    """Return the position on a minimum-jerk path to an end point that may move.

    Args:
        stage: with its patience.
        scene: now.
        end: world [m], shape (3,).
        speed: largest [m/s].
        within: distance from the end that counts as arrived [m].
        yaw: heading at the end [rad]; None keeps it.
    """
    k, s = scene.kept, scene.now
    way = end - k.origin
    time = max(PEAK * math.sqrt(way @ way) / speed, 0.5)
    place = minimum_jerk(k.origin, end, time, scene.elapsed)
    heading = k.yaw
    if yaw is not None:
        turn = math.remainder(yaw - k.yaw_origin, 2.0 * math.pi)
        heading = k.yaw_origin + turn * min(scene.elapsed / time, 1.0)
    back = end - s.position
    fine = scene.elapsed >= time and math.sqrt(back @ back) < within
    late = scene.elapsed > time + stage.patience
    verdict = Outcome.onward if late else Outcome.stay
    return Move(place._replace(yaw=heading), k.arm, k.grip, fine, verdict)
