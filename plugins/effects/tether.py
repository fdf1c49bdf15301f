"""Tether: cable from the vehicle to a fixed point, an elastic line or a chain of segments."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects import (
    Addition,
    Freed,
    Identification,
    Residual,
    Stage,
    Subject,
    along_axes,
    cable,
)
from seals.effects.effect import Effect, Parameters
from seals.effects.scene import Scene
from seals.errors import ConfigError
from seals.frames import rotate, unrotate
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import count, param

_PLACE: dict[str, Any] = {
    "bounds": (-1e4, 1e4),
    "tolerance": 0.1,
    "source": "chosen: the world's origin",
}

_FATHOM = "Blue Robotics, Fathom ROV Tether (R2)"
_STIFFNESS = 3.0
"""Plausible stiffness [N/m]."""
_KEEP = 2
"""Starting values that are kept."""
_FREE = (-math.inf, math.inf)


@dataclass(kw_only=True)
class Tether(Effect):
    """Cable between the link origin and an anchor: an elastic line, or a chain of segments.

    Equation:
        ``segments: 0``, a line without mass: F = -K max(|p - a| - L, 0) along (p - a).
        n segments: nodes of mass mu L / n between them, with m_i x'' = sum of the tensions
        n K max(s - L / n, 0) of the two segments at each, s their length; weight less buoyancy
        (mu - rho pi d^2 / 4) g; drag -rho d (C_n |v_n| v_n + pi C_t |v_t| v_t) / 2 across and
        along the cable, by length, v against the fluid at the node; added mass C_a rho pi d^2 / 4
        across it. F is the tension of the last segment with weight and drag of half of it.

    Args:
        anchor_x: a toward east [m].
        anchor_y: a toward north [m].
        anchor_z: a upward [m].
        length: L, free length [m].
        stiffness: K of the whole length [N/m]; EA / L.
        segments: n, zero for a line without mass.
        diameter: d [m].
        line_density: mu, mass by length [kg/m].
        drag_across: C_n [1].
        drag_along: C_t [1].
        added: C_a [1].
        links: the link it pulls, the root by default.

    Assumptions:
        Attached at the link origin. A chain begins at rest in the fluid that is there. Its nodes
        are integrated by implicit Euler steps, with Newton's method: no step is too long for its
        stiffness, and vibrations along it die out within some steps.

    Valid range:
        A line for light cables whose weight and drag are small against their pull. A chain for
        cables that bend freely: ropes, umbilicals, tethers of vehicles.

    Limitations:
        A line has no sag, no damping and no drag along it; slack it does nothing. A chain has no
        stiffness against bending and torsion; the level bottom carries it without friction, and a
        height map does not; the inertia of its last half segment is not added to the vehicle;
        fluid that speeds up does not push it by its acceleration. A diagnosis takes a stated chain
        as it hangs at rest, row by row, in minutes; a missing one is sought as a line. Without
        machine code.

    References:
        Fossen 2011, Handbook of Marine Craft Hydrodynamics, ch. 8 (line); MoorDyn, documentation
        of its theory, after Hall and Goupee 2015, Ocean Engineering 104, 590 (chain).

    Example:
        >>> Tether(anchor_z=0.0, length=2.0, stiffness=1.5).length
        2.0
        >>> Tether(length=30.0, stiffness=1e3, segments=15).memory_size
        85
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
    segments: int = count(0, bounds=(0, cable.MOST_SEGMENTS))
    diameter: float = param(
        0.0076, "m", bounds=(1e-4, 1.0), tolerance=1e-4, source=_FATHOM, fit=False, later=True
    )
    line_density: float = param(
        0.043, "kg/m", bounds=(1e-5, 1e4), tolerance=1e-3, source=_FATHOM, fit=False, later=True
    )
    drag_across: float = param(
        1.2,
        "1",
        bounds=(0.0, 10.0),
        tolerance=0.1,
        source="cylinder across the flow, Reynolds numbers 1e3 to 1e5: Hoerner 1965, ch. 3",
        fit=False,
        later=True,
    )
    drag_along: float = param(
        0.05,
        "1",
        bounds=(0.0, 10.0),
        tolerance=0.03,
        source="line type nylon of MoorDyn's documentation",
        fit=False,
        later=True,
    )
    added: float = param(
        1.0,
        "1",
        bounds=(0.0, 10.0),
        tolerance=0.1,
        source="cylinder in ideal flow: Newman 1977, ch. 4",
        fit=False,
        later=True,
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

    def __post_init__(self) -> None:
        """Refuse a chain without length or stiffness, or of one segment.

        Raises:
            ConfigError: ``segments`` is 1, or ``length`` or ``stiffness`` is zero with segments.
        """
        if self.segments == 1:
            raise ConfigError(
                "segments=1 of a tether is no chain.\n"
                "Allowed: 0 for an elastic line without mass, or 2 and more."
            )
        if self.segments and not (self.length > 0.0 and self.stiffness > 0.0):
            raise ConfigError(
                f"a tether of {self.segments} segments has length={self.length:g} m and "
                f"stiffness={self.stiffness:g} N/m.\n"
                "Allowed: both above zero; the stiffness is EA / L, Young's modulus by area."
            )

    @property
    def memory_size(self) -> int:  # type: ignore[override]
        """Number of memory values per link: places and velocities of the nodes."""
        return cable.memory_size_of(self.segments) if self.segments else 0

    @property
    def surveying(self) -> bool:
        """Whether the fluid along the cable counts: that of a chain."""
        return self.segments > 0

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
        """Return the stiffness K [N/m]; of a chain three times that of its last segment.

        Its pull is that at the end of a step: h^2 k / m is stable up to 4/3 in place of 4.
        """
        return self.stiffness * max(3.0 * self.segments, 1.0)

    @staticmethod
    def loads(  # noqa: PLR0917  arguments of the hook
        motion: Motion,
        medium: Medium,
        inputs: Inputs,
        memory: Array,
        params: Parameters,
        scene: Scene | None = None,
    ) -> tuple[Wrench, Array]:
        """Pull of the cable, link axes [N]."""
        if scene is not None and memory is not None:
            velocity = rotate(motion.rotation, motion.velocity)
            force, memory = cable.pulled(
                (motion.position, velocity), medium, inputs.step, memory, params, scene
            )
            return Wrench(unrotate(motion.rotation, force), None), memory
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
