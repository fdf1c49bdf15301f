"""Arms, grippers and legs of a robot: joints, tool frames, finger-tips, feet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError, refuse_unlisted, suggestion
from seals.robot.settings import ArmSettings, GripperSettings, LegSettings


@dataclass(frozen=True, kw_only=True, eq=False)
class Arm:
    """One arm.

    Args:
        name: of the arm.
        joints: indices among the robot's joints, from the base on, k of them.
        tool: index of the link that the arm moves, for instance the palm.
        stowed: joint values at rest [rad or m], shape (k,).
    """

    name: str
    joints: tuple[int, ...]
    tool: int
    stowed: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Gripper:
    """One gripper.

    Args:
        name: of the gripper.
        joints: indices among the robot's joints, k of them.
        open: joint values when open [rad or m], shape (k,).
        closed: joint values when closed on nothing [rad or m], shape (k,).
        tips: indices of the links that touch.
    """

    name: str
    joints: tuple[int, ...]
    open: Floats
    closed: Floats
    tips: tuple[int, ...]

    def at(self, grip: float) -> Floats:
        """Return the joint values of a grip, 0 for open and 1 for closed, shape (k,).

        Example:
            >>> import numpy as np
            >>> g = Gripper(name="hand", joints=(0,), open=np.zeros(1), closed=np.ones(1), tips=())
            >>> g.at(0.25)
            array([0.25])
        """
        share = min(max(grip, 0.0), 1.0)
        return self.open + share * (self.closed - self.open)


@dataclass(frozen=True, kw_only=True, eq=False)
class Leg:
    """One leg.

    Args:
        name: of the leg.
        joints: indices among the robot's joints, from the body on, k of them.
        foot: index of the last link.
        toe: what stands on the ground, in axes of that link [m], shape (3,).
        stance: joint values when it stands [rad or m], shape (k,).
    """

    name: str
    joints: tuple[int, ...]
    foot: int
    toe: Floats
    stance: Floats


def build_arms(
    settings: Mapping[str, ArmSettings], links: Sequence[str], joints: Sequence[str]
) -> dict[str, Arm]:
    """Return the arms of a robot by name.

    Raises:
        RobotError: a joint or link does not exist, or the numbers of values and joints differ.
    """
    out = {}
    for name, arm in settings.items():
        where = f"robot.arms.{name}"
        found = _joints(where, arm.joints, joints)
        tool = _link(f"{where}.tool", arm.tool, links)
        stowed = _values(f"{where}.stowed", arm.stowed or [0.0] * len(found), found)
        out[name] = Arm(name=name, joints=found, tool=tool, stowed=stowed)
    return out


def build_grippers(
    settings: Mapping[str, GripperSettings], links: Sequence[str], joints: Sequence[str]
) -> dict[str, Gripper]:
    """Return the grippers of a robot by name.

    Raises:
        RobotError: a joint or link does not exist, or the numbers of values and joints differ.
    """
    out = {}
    for name, hand in settings.items():
        where = f"robot.grippers.{name}"
        found = _joints(where, hand.joints, joints)
        out[name] = Gripper(
            name=name,
            joints=found,
            open=_values(f"{where}.open", hand.open, found),
            closed=_values(f"{where}.closed", hand.closed, found),
            tips=tuple(_link(f"{where}.tips", tip, links) for tip in hand.tips),
        )
    return out


def build_legs(
    settings: Mapping[str, LegSettings], links: Sequence[str], joints: Sequence[str]
) -> dict[str, Leg]:
    """Return the legs of a robot by name.

    Raises:
        RobotError: a joint or link does not exist, the toe is not a position, or the numbers of
            stance values and joints differ.
    """
    out = {}
    for name, leg in settings.items():
        where = f"robot.legs.{name}"
        found = _joints(where, leg.joints, joints)
        foot = _link(f"{where}.foot", leg.foot, links)
        if len(leg.toe) != 3:
            raise RobotError(
                f"{where}.toe={list(leg.toe)} is not a position.\nAllowed: three numbers."
            )
        stance = _values(f"{where}.stance", leg.stance or [0.0] * len(found), found)
        toe = np.asarray(leg.toe, dtype=float)
        out[name] = Leg(name=name, joints=found, foot=foot, toe=toe, stance=stance)
    return out


def standing(legs: Mapping[str, Leg], joints: int) -> Floats:
    """Return the joint values of a robot on its legs: their stance, zero elsewhere, shape (J,).

    Args:
        legs: of the robot.
        joints: number of all its joints, J.
    """
    out = np.zeros(joints)
    for leg in legs.values():
        out[list(leg.joints)] = leg.stance
    return out


def _joints(where: str, wanted: Sequence[str], joints: Sequence[str]) -> tuple[int, ...]:
    if not wanted:
        raise RobotError(
            f"{where}.joints is empty.\n{suggestion('', joints, label='Movable joints')}"
        )
    for name in wanted:
        refuse_unlisted(
            name,
            joints,
            f"{where}.joints: there is no movable joint '{name}'",
            label="Movable joints",
            error=RobotError,
        )
    if len(set(wanted)) < len(wanted):
        raise RobotError(f"{where}.joints={list(wanted)} names a joint twice.\nName each once.")
    return tuple(list(joints).index(name) for name in wanted)


def _link(where: str, wanted: str, links: Sequence[str]) -> int:
    refuse_unlisted(
        wanted, links, f"{where}: there is no link '{wanted}'", label="Links", error=RobotError
    )
    return list(links).index(wanted)


def _values(where: str, values: Sequence[float], joints: tuple[int, ...]) -> Floats:
    if len(values) != len(joints):
        raise RobotError(
            f"{where}={list(values)} has {len(values)} values.\n"
            f"Allowed: {len(joints)}, one per joint, in the order of 'joints'."
        )
    return np.asarray(values, dtype=float)
