"""Task catch_seen: catch an animal of which nothing is known but what cameras show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Array
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.learn.task import Draw, Instant
from seals.plugins.tasks.catch import TaskCatch
from seals.plugins.tasks.sighting.detector import load_detector
from seals.plugins.tasks.sighting.watcher import Watcher
from seals.schema import setting

DETECTOR = "aam/crab"
"""Detector that ships with the manipulator."""
_TRIES = 1000


@roles(data="black", read="detector")
@dataclass(kw_only=True)
class TaskCatchSeen(TaskCatch):
    """Find an animal by cameras, grip it and hold it above the water.

    Policies, the scripted one too, are told its place and velocity as a detector and a filter find
    them in the pictures of the robot's cameras; rewards and success are by the true ones. It begins
    behind the robot, whose cameras look ahead and down, out of their sight.

    Args:
        detector: folder of a trained one, ``ROBOT/NAME`` of one that is shipped, or ``parts``: told
            by the renderer, which knows what it drew, as a control.
        black: whether all pictures are made black, as a control.
        stance: height of the animal's origin above the ground on which it stands [m].
        behind: how far behind the robot the animal begins at least [m].

    All other fields are those of `TaskCatch`; ``view`` is not used.

    Assumptions:
        The robot knows its own state. The renderer draws lines of sight straight through the
        surface of the water.

    Example:
        >>> TaskCatchSeen().detector
        'aam/crab'
    """

    detector: str = DETECTOR
    black: bool = False
    stance: float = setting(0.029, "m", bounds=(0.0, 10.0), source="crab.urdf, stance")
    behind: float = setting(0.7, "m", bounds=(0.0, 100.0), source="views of conf/env/catch_seen")

    def watcher(self) -> Watcher:
        """Return the watcher; see `seals.learn.task.SeeingTask`.

        Raises:
            ConfigError: there is no such detector.
        """
        found = load_detector(self.detector, animal=self.object, stance=self.stance)
        return Watcher(found, firm=self.firm, black=self.black)

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return random starts with the animal far enough behind, drawn until it is.

        Raises:
            ConfigError: it never is.
        """
        rows = [self._drawn(rng) for _ in range(count)]
        return Draw(*(np.concatenate(column) for column in zip(*rows, strict=True)))

    def _drawn(self, rng: np.random.Generator) -> Draw:
        for _ in range(_TRIES):
            drawn = super().draw(rng, 1)
            if drawn.position[0, 0] - drawn.goal[0, 0] >= self.behind:
                return drawn
        raise ConfigError(
            f"task.behind={self.behind:g} m: no animal started that far behind in {_TRIES} draws.\n"
            "Use a smaller value, or move the boxes task.start_* and task.target_* farther "
            "apart along x."
        )

    def seen(self, now: Instant) -> Array:
        """Return 1 for an animal that is seen or followed, else 0, shape (N, 1).

        It is not where nobody says so: without cameras there is nothing to see.
        """
        return now.facts.get("seen", now.time * 0.0)
