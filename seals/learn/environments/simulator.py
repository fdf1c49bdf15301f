"""What moves the robots of N environments: the base of batch dynamics and worlds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from seals.arrays import Array, Floats
from seals.learn.task import Draw, Instant
from seals.robot.model import RobotModel


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


class BatchSimulator(ABC):
    """N robots of one task, batch first, state in and state out.

    Order of calls: `begin`, `instant`; then, each control step, `advance`, `instant`, and `begin`
    and `merged` for the rows whose episode ended.

    Attributes:
        like: array whose library, type and device all states have.
        robot: model of the task's robot.
        pure: whether `advance`, `instant` and `merged` are pure functions of arrays without
            branches on values, so that they can be compiled and recorded.
        values: parameters of effects that differ between the robots, tensors (N, 1) by name.
        seeded: whether each episode needs a seed of its own.
        coded: whether its robots run as machine code, so that verdicts on them do, too.
        films: whether it calls ``frame_callback`` itself, at each of its own steps.
        frame_callback: receives frames of the first robot, or None.
    """

    like: Array
    robot: RobotModel
    pure: bool = False
    values: Mapping[str, Any] = MappingProxyType({})
    seeded: bool = False
    coded: bool = False
    films: bool = False
    frame_callback: FrameCallback | None = None

    @abstractmethod
    def begin(
        self, draw: Draw, rows: Array | None, seeds: Sequence[int] | None
    ) -> tuple[Any, Array]:
        """Set robots to their starts; return the state of all robots and the goals, shape (N, g).

        Args:
            draw: starts and goals of N episodes.
            rows: which of them begin, bool (N,); None for all.
            seeds: of the episodes that begin; None if they have none.
        """

    @abstractmethod
    def advance(self, robots: Any, action: Array, now: Instant) -> Any:
        """Return the state of the robots one control step later.

        Args:
            robots: their state.
            action: from -1 to 1, shape (N, a).
            now: before the step.
        """

    @abstractmethod
    def instant(self, robots: Any, goal: Array, action: Array, start: Array) -> Instant:
        """Return the present facts.

        Args:
            robots: their state.
            goal: of the draws, shape (N, g).
            action: of the last step, shape (N, a).
            start: distance at the start of the episode [m], shape (N, 1).
        """

    def of_one(self, values: Mapping[str, Any]) -> BatchSimulator:
        """Return a pure simulator of one robot on traced arrays, with values of the parameters."""
        raise NotImplementedError

    def merged(self, fresh: Any, robots: Any, ended: Array) -> Any:
        """Return fresh states where ``ended`` (N,) is set, else the present ones."""
        return robots

    def failed(self, robots: Any) -> Array | None:
        """Return which robots the engine gave up in the last step, bool (N,); None if it cannot."""
        return None

    def perceive(self, now: Instant, rows: Array | None) -> Instant:
        """Return the state that policies receive; called once after each step and start.

        Args:
            now: of all environments.
            rows: those that have just begun, bool (N,); None for all.
        """
        return now

    def drawn_ahead(self, draws: Iterable[Draw]) -> Any:
        """Return a store of starts, with ``chances`` and ``picked``, of a pure simulator."""
        raise NotImplementedError

    def frame(self, now: Instant, row: int = 0) -> EpisodeFrame:
        """Return the frame of one environment, by default of the first."""
        raise NotImplementedError

    def snapshot(self) -> dict[str, Any]:
        """Return what belongs to the complete state beside ``robots``.

        Raises:
            NotImplementedError: the state cannot be put back.
        """
        return {}

    def restore(self, kept: Mapping[str, Any], robots: Any) -> Any:
        """Restore a snapshot and return the state of the robots."""
        return robots

    def close(self) -> None:
        """Release all resources."""
        self.frame_callback = None
