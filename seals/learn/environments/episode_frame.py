"""Poses of robot, objects and target of one environment, for films of an episode."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from seals.arrays import Floats


class ActorPose(NamedTuple):
    """Pose and joint values of a robot or an object.

    Args:
        position: of its base, world [m], shape (3,).
        quaternion: q_WB_xyzw, shape (4,).
        joints: [rad or m], shape (J,).
    """

    position: Floats
    quaternion: Floats
    joints: Floats


class EpisodeFrame(NamedTuple):
    """One instant of an episode.

    Args:
        time: since the start of the episode [s].
        actors: places by the name of robot and objects, the robot first.
        target: place of the target, world [m], shape (3,).
    """

    time: float
    actors: Mapping[str, ActorPose]
    target: Floats


FrameCallback = Callable[[EpisodeFrame], None]
"""Takes one instant after the other."""
