"""Tether: elastic cable from the vehicle to a fixed point."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects import Addition, Freed, Identification, Residual, Stage, Subject, along_axes
from seals.effects.effect import Effect, Parameters
from seals.frames import unrotate
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param

_PLACE: dict[str, Any] = {
    "bounds": (-1e4, 1e4),
    "tolerance": 0.1,
    "source": "chosen: the world's origin",
}

_STIFFNESS = 3.0
"""Plausible stiffness [N/m]."""
_KEEP = 2
"""Starting values that are kept."""
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
    material: ClassVar[dict[str, float]] = {"anchor_z": -40.0, "length": 1.0, "stiffness": 0.2}
    identification: ClassVar[Identification] = Identification(
        confounders=("wind", "accelerometer_bias"),
        may_begin=True,
        may_end=True,
        guessed=True,
        placed=True,
        centre="anchor",
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a cable of unknown anchor; known cables have tolerances.

        Starting values of the unknown one come from the log.
        """
        parameters = {
            **{k: replace(v, bounds=_FREE) for k, v in along_axes("anchor", 0.0, 1.0).items()},
            "length": Freed(scale=1.0, bounds=(0.0, 1e3)),
            "stiffness": Freed(scale=_STIFFNESS, bounds=(0.0, 1e4)),
        }
        order = (Stage.surroundings, 0, 0)
        missing = Addition(
            instance=name, effect=cls(length=0.0), parameters=parameters, order=order
        )
        return [missing, *cls._stated(name, subject)]

    @classmethod
    def _stated(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the tolerances of the cables that the stated model holds."""
        found = []
        for instance, own in subject.effects.items():
            if not isinstance(own, cls):
                continue
            parameters = {
                "stiffness": Freed(
                    tolerance=subject.spread(f"{name}_stiffness") * own.stiffness,
                    # a share of a stated stiffness of zero would be no size at all
                    scale=own.stiffness or _STIFFNESS,
                    bounds=(-own.stiffness, math.inf),
                ),
                "length": Freed(
                    tolerance=subject.spread(f"{name}_length"),
                    scale=max(own.length, 1.0),
                    bounds=(-own.length, math.inf),
                ),
            }
            order = (Stage.surroundings, 0, 1)
            found.append(
                Addition(
                    instance=instance, effect=None, parameters=parameters, named=(), order=order
                )
            )
        return found

    @staticmethod
    def guesses(residual: Residual) -> list[dict[str, float]]:
        """Return starting values: the cables that fit the residual force best."""
        return _cables(residual.position, residual.force)

    @staticmethod
    def plausible(position: Floats) -> dict[str, float]:
        """Return a plausible cable, anchored below and slightly to one side."""
        return {
            "length": 0.8,
            "stiffness": 1.0,
            "anchor_x": float(position[0]) + 0.3,
            "anchor_y": float(position[1]),
            "anchor_z": float(position[2]) - 1.0,
        }

    def spring(self) -> float:
        """Return the stiffness K [N/m]."""
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


def _cables(position: Floats, force: Floats) -> list[dict[str, float]]:
    """Cables that fit the force best, from several guesses of the anchor."""
    from scipy.optimize import least_squares

    middle = position.mean(axis=0)
    size = np.sqrt(np.mean(np.sum(force**2, axis=1)))
    spread = max(float(np.sqrt(((position - middle) ** 2).sum(axis=1).mean())), 0.1)
    pull = force[np.argmax(np.sum(force**2, axis=1))]
    toward = pull / max(float(np.linalg.norm(pull)), 1e-9)
    lowest = np.array([middle[0], middle[1], 0.0])
    anchors = [middle + toward * s * spread for s in (1.0, 3.0)] + [lowest, middle]
    found = []
    for anchor in anchors:
        reach = np.linalg.norm(position - anchor, axis=1)
        first = np.array([*anchor, np.quantile(reach, 0.5), size / (0.3 * spread + 1e-3)])

        def miss(x: Floats) -> Floats:
            gap = position - x[:3]
            length = np.maximum(np.linalg.norm(gap, axis=1, keepdims=True), 1e-6)
            model = -x[4] * np.maximum(length - x[3], 0.0) * gap / length
            out: Floats = (force - model).ravel()
            return out

        bounds = ([-50, -50, -50, 0.0, 0.0], [50, 50, 50, 50.0, 1e3])
        start = np.clip(first, np.array(bounds[0]) + 1e-6, np.array(bounds[1]) - 1e-6)
        fit = least_squares(miss, start, bounds=bounds, loss="soft_l1", max_nfev=60)
        found.append((float(fit.cost), fit.x))
    found.sort(key=lambda f: f[0])
    keys = ("anchor_x", "anchor_y", "anchor_z", "length", "stiffness")
    return [dict(zip(keys, map(float, x), strict=True)) for _, x in found[:_KEEP]]
