"""Guide that runs the stages of a mission in order; `grasp` is one that fetches an object.

Each stage gives a reference and a transition at every instant.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.control.tracking import Place, minimum_jerk, pursued
from seals.errors import ConfigError, refuse_unlisted, suggestion
from seals.field_roles import roles
from seals.plugins.guides.mission.scene import Hand, MissionState, Move, Outcome, Scene
from seals.schema import read, setting, vector

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


@roles(data="stages arm gripper locator pads")
@dataclass(kw_only=True)
class Mission:
    """Mission of stages in order: rise, go, pose, reach, close, open, wait, land.

    Args:
        rate: calls a second [Hz].
        stages: mappings with ``do`` and the values of that stage.
        arm: that is used; the robot's first when empty.
        gripper: that is used; the robot's first when empty.
        locator: sensor on the base that says where the object is.
        pads: contact sensors of the finger-tips; empty for the truth.
        tries: how often the object is reached for before the mission is given up.
        smoothing: time constant of the object's place [s].
        position_gain: of the position's error [1/s].
        speed: largest speed back to the wanted place [m/s].

    Limitations:
        Level hand: the reach corrects for heading and arm, not for the lean of the body.

    Example:
        >>> Mission(stages=[{"do": "wait", "time": 2.0}]).tries
        3
    """

    rate: float = setting(125.0, "Hz", bounds=(1.0, 1e4), source="chosen")
    stages: list[Any] = field(default_factory=list)
    arm: str = ""
    gripper: str = ""
    locator: str = "locator"
    pads: list[str] = field(default_factory=list)
    tries: int = 3
    smoothing: float = setting(0.25, "s", bounds=(0.0, 100.0), source="chosen: a dozen readings")
    position_gain: float = setting(
        1.5, "1/s", bounds=(0.0, 50.0), source="chosen: below the speed's"
    )
    speed: float = setting(0.5, "m/s", bounds=(0.0, 50.0), source="chosen")

    def __post_init__(self) -> None:
        """Read the stages."""
        self._stages = stages_of(self.listed(), where="guide.stages")
        if not self._stages:
            raise ConfigError(
                "guide.stages is empty.\nGive stages, for instance [{do: rise, height: 1.0}]"
            )

    def listed(self) -> list[Any]:
        """Return the stages as mappings."""
        return self.stages

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensors that the mission requires."""
        reaches = any(isinstance(stage, ReachStage) for stage in self._stages)
        return (*((self.locator,) if reaches else ()), *self.pads)

    def bind(self, plant: Plant) -> None:
        """Find arm and gripper.

        Raises:
            ConfigError: the robot has no arm or gripper of that name.
        """
        robot = plant.robot
        arm = _chosen(robot.arms, self.arm, "arm", robot.name)
        gripper = _chosen(robot.grippers, self.gripper, "gripper", robot.name)
        self._hand = Hand(robot, arm, gripper)

    def start(self, situation: RobotState) -> MissionState:
        """Return the initial state: first stage, arm stowed, hand open."""
        p, yaw, rest = situation.position, situation.yaw, self._hand.stowed
        return MissionState(
            number=0,
            since=situation.time,
            origin=p,
            place=p,
            yaw=yaw,
            yaw_origin=yaw,
            arm=rest,
            arm_origin=rest,
            grip=0.0,
            grip_origin=0.0,
            target=None,
            good=math.inf,
            tries=1,
            outcome=None,
        )

    def aim(self, situation: RobotState, memory: MissionState) -> tuple[Reference, MissionState]:
        """Return the reference of the present stage, and the new state."""
        kept = memory._replace(target=self._seen(situation, memory))
        stage = self._stages[min(kept.number, len(self._stages) - 1)]
        if not self.pads:
            pads = situation.contacts
        else:
            readings = situation.readings
            pads = {
                n: float(readings[n]["pressing"][0]) if n in readings else 0.0 for n in self.pads
            }
        move = stage.act(Scene(situation, kept, self._hand, pads))
        lost = stage.holding and not any(pads.values()) and kept.outcome is None
        if lost:
            move = move._replace(verdict=Outcome.again)
        return self._aimed(situation, move), self._after(situation.time, stage, move, kept)

    def finished(self, memory: MissionState) -> bool | None:
        """Return whether all stages are done, or the object was missed too often."""
        return memory.outcome

    def stage(self, memory: MissionState) -> str:
        """Return the name of the present stage."""
        if memory.outcome is not None:
            return "done" if memory.outcome else "given up"
        return self._stages[memory.number].name

    def _aimed(self, situation: RobotState, move: Move) -> Reference:
        joints: Mapping[str, Floats] = {}
        grip: Mapping[str, float] = {}
        if self._hand.arm is not None:
            joints = {self._hand.arm.name: move.arm}
        if self._hand.gripper is not None:
            grip = {self._hand.gripper.name: move.grip}
        gain, speed = self.position_gain, self.speed
        return pursued(situation, move.place, gain=gain, speed=speed, joints=joints, grip=grip)

    def _after(self, time: float, stage: Stage, move: Move, kept: MissionState) -> MissionState:
        """Return the state after an instant: the stage goes on, or the next one begins."""
        good = min(kept.good, time) if move.fine else math.inf
        kept = kept._replace(
            place=move.place.position, yaw=move.place.yaw, arm=move.arm, grip=move.grip, good=good
        )
        settled = move.fine and time - good >= stage.settle - 1e-9
        if kept.outcome is not None or (move.verdict is Outcome.stay and not settled):
            return kept
        index, tries = kept.number + 1, kept.tries
        if move.verdict is Outcome.again:
            # index of the first of the consecutive reach stages before a stage
            reaches = [k for k in range(kept.number + 1) if isinstance(self._stages[k], ReachStage)]
            while len(reaches) > 1 and reaches[-2] == reaches[-1] - 1:
                reaches.pop()
            index, tries = reaches[-1] if reaches else kept.number, tries + 1
        if tries > self.tries:
            return kept._replace(outcome=False)
        if index >= len(self._stages):
            return kept._replace(outcome=True)
        return kept._replace(
            number=index,
            tries=tries,
            since=time,
            origin=kept.place,
            yaw_origin=kept.yaw,
            arm_origin=kept.arm,
            grip_origin=kept.grip,
            good=math.inf,
            # what has been dropped lies elsewhere now
            target=None if move.verdict is Outcome.again else kept.target,
        )

    def _seen(self, situation: RobotState, kept: MissionState) -> Floats | None:
        """Position of the object by smoothed readings, held while the hand is closed about it."""
        reading = situation.readings.get(self.locator)
        if reading is None or kept.grip > 0.0 or reading["seen"][0] == 0.0:
            return kept.target
        here = situation.position + situation.rotation @ reading["offset"]
        if kept.target is None:
            return here
        share = 1.0 if self.smoothing == 0.0 else -math.expm1(-1.0 / (self.rate * self.smoothing))
        return kept.target + share * (here - kept.target)


def _chosen(parts: Mapping[str, Any], name: str, word: str, robot: str) -> Any:
    """The named part, the first one without a name, or None if there is none."""
    if not name:
        return next(iter(parts.values()), None)
    refuse_unlisted(name, parts, f"guide.{word}={name}: robot '{robot}' has no such {word}")
    return parts[name]


KINDS: Mapping[str, type[Stage]] = {
    "rise": Rise,
    "go": Go,
    "reach": ReachStage,
    "pose": Pose,
    "close": Close,
    "open": Open,
    "wait": Wait,
    "land": Land,
}
"""Stages by the word after ``do:``."""


def stages_of(rows: Sequence[Any], *, where: str = "stages") -> tuple[Stage, ...]:
    """Return the stages that a list describes.

    Args:
        rows: mappings with ``do`` and the values of that stage.
        where: key of the list, named in the messages.

    Raises:
        ConfigError: a stage is unknown, or a value of it.

    Example:
        >>> stages_of([{"do": "rise", "height": 2.0}])[0].height
        2.0
    """
    return tuple(_stage(row, f"{where}[{k}]") for k, row in enumerate(rows))


def _stage(row: Any, where: str) -> Stage:
    values = read(dict[str, Any], row, where=where)
    word = str(values.pop("do", ""))
    if not word:
        raise ConfigError(
            f"{where}={row} names no action.\n"
            f"Write for instance {{do: rise, height: 1.0}}.  {suggestion('', KINDS)}"
        )
    refuse_unlisted(word, KINDS, f"{where}.do={word} is not a stage")
    return read(KINDS[word], {"name": word, **values}, where=where)


@dataclass(kw_only=True)
class Grasp(Mission):
    """Mission that approaches an object, grasps it, lifts it and carries it to a goal.

    Args:
        goal: where the hand shall bring the object, world [m].
        clearance: of the hand above the object before it descends [m].
        unfolded: angles of the arm while it grasps [rad or m].
        stages: not used; they follow from the other values.

    Example:
        >>> [stage.name for stage in Grasp()._stages]
        ['unfold', 'above', 'descend', 'close', 'lift', 'carry', 'hold']
    """

    goal: list[float] = vector((0.0, 0.0, 1.0), "m", bounds=(-1e5, 1e5), source="chosen")
    clearance: float = setting(0.25, "m", bounds=(0.0, 100.0), source="chosen")
    unfolded: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def listed(self) -> list[Any]:
        """Return the stages of the mission."""
        return [
            {"do": "pose", "name": "unfold", "angles": list(self.unfolded), "time": 2.0},
            {"do": "reach", "name": "above", "height": self.clearance, "speed": 0.4},
            {
                "do": "reach",
                "name": "descend",
                "height": 0.0,
                "speed": 0.12,
                "within_height": 0.015,
            },
            {"do": "close", "name": "close"},
            {"do": "rise", "name": "lift", "height": 0.2, "speed": 0.15, "holding": True},
            {"do": "go", "name": "carry", "to": list(self.goal), "hand": True, "holding": True},
            {"do": "wait", "name": "hold", "time": 1.0, "holding": True},
        ]
