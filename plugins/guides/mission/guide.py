"""Guide that runs the stages of a mission in order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.control.tracking import pursued
from seals.errors import ConfigError, refuse_unlisted, suggestion
from seals.field_roles import roles
from seals.plugins.guides.mission.scene import Hand, MissionState, Move, Outcome, Scene
from seals.plugins.guides.mission.stages import (
    Close,
    Go,
    Land,
    Open,
    Pose,
    ReachStage,
    Rise,
    Stage,
    Wait,
)
from seals.schema import read, setting


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
    """The named part, the first one without a name, or None where there is none."""
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
            f"{where}={row} does not say what to do.\n"
            f"Write for instance {{do: rise, height: 1.0}}.  {suggestion('', KINDS)}"
        )
    refuse_unlisted(word, KINDS, f"{where}.do={word} is not a stage")
    return read(KINDS[word], {"name": word, **values}, where=where)
