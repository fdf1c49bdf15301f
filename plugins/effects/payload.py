"""A point mass fixed to a link."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, Floats, fixed, namespace
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import (
    Addition,
    Comparison,
    Freed,
    Identification,
    Property,
    Stage,
    Subject,
)
from seals.frames import AXES, skew_last
from seals.motion import Body
from seals.robot.model import RobotModel
from seals.schema import param

_PLACE: dict[str, Any] = {
    "bounds": (-10.0, 10.0),
    "tolerance": 0.02,
    "source": "chosen: the origin",
}
_EYE = np.eye(3)[None]

_REACH = 4.0
"""Distance along an axis within which a body carries loads, by its radius of gyration [1]; that of
a box is 0.58 of its half width."""


@dataclass(kw_only=True)
class Payload(Effect):
    """Point mass fixed to a link: weight, inertia and shift of the centre of gravity.

    Equation:
        dM = m [[1, -S(p)], [S(p), -S(p)^2]] about the link origin, order [linear, angular], with
        S(p) b = p x b.

    Args:
        mass: m, negative for a mass that is missing [kg].
        position_x: p along link x [m].
        position_y: p along link y [m].
        position_z: p along link z [m].
        links: the link that carries it, the root by default.

    Assumptions:
        A point: no inertia about its own centre; no volume, no drag.

    Valid range:
        As long as the mass of the link with it stays positive.

    Limitations:
        Nothing swings or slips.

    References:
        Featherstone 2008, Rigid Body Dynamics Algorithms, ch. 2.

    Example:
        >>> Payload(mass=0.15, position_z=-0.1).mass
        0.15
    """

    mass: float = param(
        0.0,
        "kg",
        bounds=(-100.0, 100.0),
        tolerance=0.01,
        source="zero: the mass of the link applies",
    )
    position_x: float = param(0.0, "m", **_PLACE)
    position_y: float = param(0.0, "m", **_PLACE)
    position_z: float = param(0.0, "m", **_PLACE)
    accounts_for: ClassVar[tuple[str, ...]] = ("payload",)
    identification: ClassVar[Identification] = Identification(
        confounders=("thrust_coefficient", "buoyancy", "wind"),
        data_sheet="thrust and mass",
        may_begin=True,
        may_end=True,
        in_arm=True,
        measurement="Weighing the vehicle would distinguish them.",
        compared=Comparison(
            order=(Stage.body, 0),
            scales={"mass": lambda s: 0.1 * s.mass},
            held=("position",),
            rigid=True,
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: payload on base and last link; every link's mass has a tolerance.

        A load is added: what a robot lacks against its data sheet is an error of the mass.
        """
        robot = subject.robot
        found = [cls._own("mass", subject, 0, "mass")]
        for k, link in enumerate(robot.links):
            if k:
                found.append(cls._own(f"mass_{link}", subject, k, "link_mass"))
            if k == 0 or k in _ends(robot):
                found.append(cls._load(f"{name}_{link}", subject, k))
        # where a load hangs is three numbers more, which one at the centre does not need; in water
        # its weight there would be that of a buoyancy
        if MediumKind.water not in subject.media:
            found.append(cls._load(f"{name}_central", subject, 0, law="at the centre"))
        return found

    @classmethod
    def _own(cls, instance: str, subject: Subject, link: int, tolerance: str) -> Addition:
        """A link's own mass within its tolerance, at its centre of mass."""
        robot = subject.robot
        mass = float(robot.mass[link])
        at: dict[str, Any] = {
            f"position_{a}": float(robot.centre[link][i]) for i, a in enumerate(AXES)
        }
        where: dict[str, Any] = {"links": [robot.links[link]]} if link else {}
        own = Freed(
            tolerance=subject.spread(tolerance) * mass,
            scale=mass,
            changes=None if link else Property(name="mass", value=subject.mass, unit="kg"),
        )
        return Addition(
            instance=instance,
            effect=cls(**at, **where),
            parameters={"mass": own},
            named=(),
            order=(Stage.joints, link, 0) if link else (Stage.body, 0, 0),
        )

    @classmethod
    def _load(cls, instance: str, subject: Subject, link: int, *, law: str = "") -> Addition:
        """A load on the base, spread as its mass is and near it; on an arm about the tip of it.

        With a law its place is known: the centre of mass of the link.
        """
        total = subject.mass
        centre = subject.robot.centre[link]
        at: dict[str, Any] = {
            f"position_{a}": (2.0 if link else 1.0) * float(centre[i]) for i, a in enumerate(AXES)
        }
        along = int(np.argmax(np.abs(centre)))
        robot = subject.robot
        turning = np.diag(robot.inertia[link])
        second: Floats = 0.5 * turning.sum() - turning
        spread = np.sqrt(np.maximum(second, 0.0) / float(robot.mass[link]))
        # what is carried is near the body: far off, a gram would pass for any change of its inertia
        reach = max(_REACH * float(spread.max()), 0.1)
        place = {
            f"position_{a}": Freed(
                scale=0.03 if link else float(spread[i]),
                bounds=(-math.inf, math.inf) if link else (-reach, reach),
            )
            for i, a in enumerate(AXES)
            if not law and (not link or i == along)
        }
        load = Freed(scale=0.1 * total, bounds=(0.0, 2.0 * total))
        return Addition(
            instance=instance,
            effect=cls(links=[subject.robot.links[link]], **at),
            parameters={"mass": load, **place},
            named=("mass",),
            nuisance=tuple(place),
            variant={"link": link},
            law=law,
            starts=[(s * total, *(0.0 for _ in place)) for s in (0.03, 0.06, 0.12)],
            order=(Stage.body, 0, 4 if law else 3),
        )

    @staticmethod
    def inertia_change(body: Body, params: Parameters) -> Array:
        """Inertia of the point mass about the link origin [kg, kg m, kg m^2]."""
        xp = namespace(params["mass"])
        arm = skew_last(params["position"] + body.centre_of_mass * 0.0)
        one = arm * 0.0 + fixed(_EYE, arm)
        upper = xp.concat((one, -arm), axis=2)
        lower = xp.concat((arm, -xp.matmul(arm, arm)), axis=2)
        return params["mass"][:, :, None] * xp.concat((upper, lower), axis=1)


def _ends(robot: RobotModel) -> set[int]:
    """Links that end a limb; where it ends in links side by side, such as jaws, what bears them."""
    parent = robot.tree.parent
    leaves = [k for k in range(1, len(parent)) if k not in parent]
    beside = {up for up in parent if up > 0 and sum(parent[k] == up for k in leaves) > 1}
    return {parent[k] if parent[k] in beside else k for k in leaves}
