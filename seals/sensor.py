"""The protocol of sensor plug-ins."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from seals.arrays import Floats

NO_CONTACT: Floats = np.zeros(6)
NO_CONTACT.setflags(write=False)
NOBODY: Mapping[str, Floats] = MappingProxyType({})


class Felt(NamedTuple):
    """What a sensor on a link may use, at one instant.

    Args:
        time: [s].
        step: time since the last call [s].
        position: link origin, world [m], shape (3,).
        rotation: R_WL, shape (3, 3).
        velocity: of the link origin, link axes [m/s], shape (3,).
        spin: angular velocity, link axes [rad/s], shape (3,).
        specific_force: mean acceleration of the link origin over the last step minus gravity, link
            axes [m/s^2], shape (3,).
        spin_rate: mean angular acceleration over the last step, link axes [rad/s^2], shape (3,).
        contact: force and torque of all contacts of the link in the last step, about the link
            origin, link axes [N, N m], shape (6,).
        pressing: sum of the normal forces of those contacts [N]; zero means nothing touches.
        others: origins of the scene's other bodies, world [m], by name.
    """

    time: float
    step: float
    position: Floats
    rotation: Floats
    velocity: Floats
    spin: Floats
    specific_force: Floats
    spin_rate: Floats
    contact: Floats = NO_CONTACT
    pressing: float = 0.0
    others: Mapping[str, Floats] = NOBODY


@runtime_checkable
class Sensor(Protocol):
    """A sensor: a keyword-only dataclass with explicit memory and a random state passed in.

    One that reads neither ``specific_force`` nor ``spin_rate`` may say so by a class attribute
    ``inertial`` that is false; they are zero for it then.
    """

    link: str
    rate: float

    def channels(self) -> dict[str, int]:
        """Return the channel names of the native log and their numbers of components."""
        ...

    def start(self, rng: np.random.Generator) -> Any:
        """Return the memory at reset."""
        ...

    def sense(
        self, felt: Felt, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Return readings (None when not due) and the new memory.

        Args:
            felt: motion of the sensor's link.
            memory: from the last call.
            rng: random state.
            due: whether a reading is wanted now; filters advance in either case.
        """
        ...
