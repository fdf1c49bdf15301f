"""Steps that a robot made at once, told step by step, for whoever records them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Configuration
from seals.control import Reference
from seals.world.stretch import Passed

Taken = tuple[int | slice, Mapping[str, Mapping[str, Floats] | None]]
"""Rows, and the readings taken in them by sensor and channel: of one row, or a row each."""


class Given(NamedTuple):
    """Commands in force in the first of some steps.

    Args:
        command: of the drives, shape (1, n); None for none.
        joints: commanded positions of the joints, shape (1, J); None for none.
        aim: of the guide; None without one.
        until: steps before the first command that was given in the loop.
    """

    command: Floats | None
    joints: Floats | None
    aim: Reference | None
    until: int


class History:
    """Steps before the last one that `World.stride` made, N of them.

    Args:
        passed: the steps.
        given: commands in force in the first of them.

    Attributes:
        times: at their ends [s].
        readings: of the sensors; empty where nobody keeps them.
    """

    def __init__(self, passed: Passed, given: Given) -> None:
        self.passed, self._given, self.times = passed, given, passed.times
        self.readings: list[Taken] = []

    def begins(self) -> list[float]:
        """Return the times at which the steps began [s]."""
        return [self.passed.began.time, *self.times[:-1]]

    def states(self) -> Configuration:
        """Return what `RigidBody.read` returned after each step, shapes (N, ...)."""
        return self.passed.states()

    def commands(self) -> Floats | None:
        """Return the commands of the drives in each step, shape (N, n); None for none."""
        first = self._given.command
        return None if first is None else self._changing(first, self.passed.orders)

    def joint_commands(self) -> Floats | None:
        """Return commanded positions of the joints in each step, shape (N, J); None for none."""
        first = self._given.joints
        return None if first is None else self._changing(first, self.passed.targets)

    @property
    def aim(self) -> Reference | None:
        """Reference of the guide in all of them, but for its velocity; None without one."""
        return self._given.aim

    def velocities(self) -> Floats:
        """Return the velocity of the reference in each step [m/s], shape (N, 3)."""
        assert self._given.aim is not None
        return self._changing(self._given.aim.velocity, self.passed.velocities)

    def pressing(self) -> Floats | None:
        """Return normal forces on every link after each step [N], (N, L); None for no contact."""
        return self.passed.pressing()

    def memory(self, name: str) -> Any:
        """Return the memory of an effect after each step, shapes (N, ...); None where it stays."""
        return self.passed.memory(name)

    def _changing(self, first: Any, later: Floats | None) -> Floats:
        """Rows of what stays as it is up to the first command in the loop."""
        rows, until = len(self.times), self._given.until
        found = np.repeat(np.reshape(first, (1, -1)), rows, axis=0)
        if later is not None:
            found[until:] = later[until:]
        return found
