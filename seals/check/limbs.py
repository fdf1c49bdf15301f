"""Checks of the stated poses of arms and grippers."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from seals.arrays import Floats
from seals.check.finding import RobotFinding, listed, passed, warned
from seals.robot.model import RobotModel

ROUNDING = 1e-6
"""Excess over a limit that is one of rounding [rad or m]."""


def look_at_limbs(robot: RobotModel) -> Iterator[RobotFinding]:
    """Yield findings about poses beyond joint limits, and arms listed from tip to base."""
    poses = [(f"{a.name}.stowed", a.joints, a.stowed) for a in robot.arms.values()]
    for hand in robot.grippers.values():
        poses += [
            (f"{hand.name}.{word}", hand.joints, getattr(hand, word)) for word in ("open", "closed")
        ]
    if not poses:
        return
    beyond = [word for where, joints, pose in poses for word in _beyond(robot, where, joints, pose)]
    # a joint moves all links beyond it: the nearer the base, the more
    moved = robot.tree.moves.sum(axis=0)
    turned = [
        arm.name
        for arm in robot.arms.values()
        if any(moved[near] < moved[far] for near, far in pairwise(arm.joints))
    ]
    if beyond:
        advice = (
            "The joints stop before; correct the pose in robot.yaml, or the limits in the URDF."
        )
        yield warned("arm poses", f"beyond a joint limit: {listed(beyond)}", advice)
    if turned:
        advice = "Name the joints of an arm from the base on, and its stowed values likewise."
        yield warned("arm joints", f"not in order from the base: {listed(turned)}", advice)
    if not beyond and not turned:
        yield passed("arm poses", f"{len(poses)} within the joint limits")


def _beyond(robot: RobotModel, where: str, joints: tuple[int, ...], pose: Floats) -> Iterator[str]:
    """Yield messages about values outside the limits."""
    for j, value in zip(joints, pose, strict=True):
        low, high = float(robot.lower[j]), float(robot.upper[j])
        if not low - ROUNDING <= value <= high + ROUNDING:
            yield f"{where}: {robot.joints[j]} {value:.3g} ({low:.3g} to {high:.3g})"
