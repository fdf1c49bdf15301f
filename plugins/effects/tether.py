"""A cable from the vehicle to a fixed point."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from seals.arrays import Array, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject, along_axes
from seals.frames import unrotate
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param

_PLACE: dict[str, Any] = {
    "bounds": (-1e4, 1e4),
    "tolerance": 0.1,
    "source": "chosen: the world's origin",
}

_FREE = (-math.inf, math.inf)


@dataclass(kw_only=True)
class Tether(Effect):
    """Elastic cable that pulls the link origin toward an anchor once it is taut.

    Equation:
        F = -K max(abs(p - a) - L, 0) along (p - a).

    Args:
        anchor_x: a toward east [m].
        anchor_y: a toward north [m].
        anchor_z: a upward [m].
        length: L, free length [m].
        stiffness: K [N/m].
        links: the link it pulls, the root by default.
        correction: see `seals.effects.Effect`.

    Assumptions:
        Straight and without mass; attached at the link origin.

    Valid range:
        Light cables whose weight and drag are small against their pull.

    Limitations:
        No sag, no damping, no drag along the cable; slack it does nothing.

    References:
        Fossen 2011, Handbook of Marine Craft Hydrodynamics, ch. 8.

    Example:
        >>> Tether(anchor_z=0.0, length=2.0, stiffness=1.5).length
        2.0
    """

    anchor_x: float = param(0.0, "m", **_PLACE)
    anchor_y: float = param(0.0, "m", **_PLACE)
    anchor_z: float = param(0.0, "m", **_PLACE)
    length: float = param(
        0.0, "m", bounds=(0.0, 1e4), tolerance=0.1, source="zero until the cable is stated"
    )
    stiffness: float = param(
        0.0, "N/m", bounds=(0.0, 1e6), tolerance=0.1, source="zero: no cable unless stated"
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("tether",)
    twins: ClassVar[tuple[str, ...]] = ("wind", "accelerometer_bias")
    material: ClassVar[dict[str, float]] = {"anchor_z": -40.0, "length": 1.0, "stiffness": 0.2}
    identification: ClassVar[Identification] = Identification(guessed=True, placed=True)

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return a cable of unknown anchor; its starting values come from the log."""
        parameters = {
            **{k: replace(v, bounds=_FREE) for k, v in along_axes("anchor", 0.0, 1.0).items()},
            "length": Freed(scale=1.0, bounds=(0.0, 1e3)),
            "stiffness": Freed(scale=3.0, bounds=(0.0, 1e4)),
        }
        order = (Stage.surroundings, 0, 0)
        return [Addition(instance=name, effect=cls(length=0.0), parameters=parameters, order=order)]

    def spring(self) -> float:
        """Return K [N/m]."""
        return self.stiffness

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Pull of the cable, link axes [N]."""
        xp = namespace(motion.position)
        span = motion.position - params["anchor"]
        # a nanometre keeps the direction defined at the anchor itself
        distance = xp.sqrt(xp.sum(span * span, axis=1, keepdims=True) + 1e-18)
        stretch = xp.clip(distance - params["length"], 0.0, None)
        pull = span * (-params["stiffness"] * stretch / distance)
        return Wrench(unrotate(motion.rotation, pull), None), memory
