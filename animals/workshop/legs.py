"""Legs of three joints: a hip that turns fore and aft, and two hinges that lift and bend."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from seals.robots.workshop.links import Joint, Link
from seals.robots.workshop.pieces import Piece, ball, rod

UP, DOWN = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)
"""Axes of the hip and of the hinges: positive hinges turn the leg, which points along x, down."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Measures that all legs of an animal share.

    Args:
        names: of the three links.
        lengths: of the three links along x, the last one to the toe [m].
        toe: radius of the ball that stands on the ground [m].
        friction: Coulomb coefficient of the toe [1].
        limits: lower and upper of hip, lift and bend, counted from the leg that is straight and
            level [rad].
        stance: from the hip's axis to the toe, horizontally, and to the ground [m]; joints are
            counted from there.
        effort: largest torque of the three joints [N m].
        speed: largest speed of the joints [rad/s].
    """

    names: Sequence[str]
    lengths: Sequence[float]
    toe: float
    friction: float
    limits: Sequence[tuple[float, float]]
    stance: tuple[float, float]
    effort: Sequence[float]
    speed: float

    def posture(self) -> tuple[float, float, float]:
        """Return hip, lift and bend of the stance, from the straight and level leg [rad]."""
        first, second, third = self.lengths
        reach, drop = self.stance[0] - first, self.stance[1] - self.toe
        far = math.hypot(reach, drop)
        cosine = (far**2 - second**2 - third**2) / (2.0 * second * third)
        bend = math.acos(cosine)
        lead = math.atan2(third * math.sin(bend), second + third * math.cos(bend))
        return 0.0, math.atan2(drop, reach) - lead, bend


def legs(
    plan: Plan,
    hips: Sequence[tuple[float, float, float]],
    fanned: Sequence[float],
    segments: Callable[[], Sequence[Sequence[Piece]]],
) -> tuple[list[Link], list[Joint]]:
    """Return links and joints of the legs of both sides, ``left_1`` being the foremost left one.

    Args:
        plan: of the animal.
        hips: of the left side in the body, from front to rear [m].
        fanned: angle of each leg forwards of straight sideways [rad].
        segments: makes the pieces of the three links of a leg, along x.
    """
    links, joints = [], []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for k, (x, y, z) in enumerate(hips):
            yaw = sign * (0.5 * math.pi - fanned[k])
            name = f"{side}_{k + 1}"
            found = leg(plan, name, at=(x, sign * y, z), yaw=yaw, pieces=segments())
            links += found[0]
            joints += found[1]
    return links, joints


def cylinders(plan: Plan, radii: Sequence[float], density: float) -> list[Piece]:
    """Return the links of a leg as full cylinders along x.

    Args:
        plan: of the animal.
        radii: of the links [m].
        density: of their material [kg/m^3].
    """
    return [
        rod(radius, (0, 0, 0), (length, 0, 0)).weighed(density)
        for radius, length in zip(radii, plan.lengths, strict=True)
    ]


def leg(
    plan: Plan, name: str, *, at: Sequence[float], yaw: float, pieces: Sequence[Sequence[Piece]]
) -> tuple[list[Link], list[Joint]]:
    """Return links and joints of one leg.

    Args:
        plan: of the animal.
        name: of the leg, in front of all names.
        at: hip in the body [m].
        yaw: of the leg in the body, joints at zero [rad].
        pieces: of the three links, along x.
    """
    toe = ball(plan.toe, (plan.lengths[2], 0.0, 0.0), solid=True)
    stems = list(plan.names)
    links = [
        Link(
            name=f"{name}_{stem}",
            stem=stem,
            pieces=[*pieces[k], toe] if k == 2 else list(pieces[k]),
            friction=plan.friction if k == 2 else None,
        )
        for k, stem in enumerate(stems)
    ]
    parents = ["body", f"{name}_{stems[0]}", f"{name}_{stems[1]}"]
    places = [tuple(at), (plan.lengths[0], 0.0, 0.0), (plan.lengths[1], 0.0, 0.0)]
    stance = plan.posture()
    turns = [(0.0, 0.0, yaw), (0.0, stance[1], 0.0), (0.0, stance[2], 0.0)]
    joints = [
        Joint(
            name=f"{name}_{word}",
            parent=parents[k],
            child=links[k].name,
            at=places[k],
            rpy=turns[k],
            axis=UP if k == 0 else DOWN,
            limits=(plan.limits[k][0] - stance[k], plan.limits[k][1] - stance[k]),
            effort=plan.effort[k],
            speed=plan.speed,
        )
        for k, word in enumerate(("hip", "lift", "bend"))
    ]
    return links, joints
