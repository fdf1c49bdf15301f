"""Conversion of a robot and its effects to one with held joints."""

from __future__ import annotations

from collections.abc import Sequence

from seals.effects.binding import EffectSet, bind_effects, has_hook
from seals.robot.fusing import fused
from seals.robot.model import RobotModel

EVERYWHERE = ("*", "root")


def hold(
    robot: RobotModel, effects: EffectSet, joints: Sequence[float]
) -> tuple[RobotModel, EffectSet]:
    """Return robot and effects with the joints held at given values.

    Links that no effect names become part of others; effects of joints are left out, for nothing
    moves there. The others are given the held joints.

    Args:
        robot: with a free base.
        effects: bound to its links.
        joints: held joint values [rad or m], J of them.

    Raises:
        ConfigError: the number of joint values is wrong.
    """
    still = {
        b.name: b.effect
        for b in effects.bound
        if not (has_hook(b.effect, "joint_loads") or has_hook(b.effect, "joint_drive"))
    }
    named = {link for effect in still.values() for link in effect.links if link not in EVERYWHERE}
    whole = fused(robot, joints, named)
    bound = bind_effects(still, whole.links)
    bound.held = tuple(float(x) for x in joints)
    return whole, bound
