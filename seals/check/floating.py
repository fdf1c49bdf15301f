"""Hydrostatic equilibrium of a robot on calm water, legs in stance, other joints at zero."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.multibody.tree import poses_in_base
from seals.robot.limbs import standing
from seals.robot.model import RobotModel

_TILT = math.radians(0.5)
_HALVINGS = 80


class FloatingBody:
    """All hulls of a robot in base axes, legs in stance, other joints at zero.

    Args:
        robot: the robot.

    Attributes:
        volume: displaced when wholly submerged [m^3].
        mass: of the robot [kg].
        gravity_centre: [m], shape (3,).
    """

    def __init__(self, robot: RobotModel) -> None:
        origins, turns = poses_in_base(robot.tree, standing(robot.legs, robot.tree.joints))
        self.parts = [
            (hull, origins[k], turns[k]) for k, hull in enumerate(robot.hulls) if hull is not None
        ]
        self.volume = float(sum(hull.volume for hull, _, _ in self.parts))
        self.mass = float(robot.mass.sum())
        places = origins + np.einsum("lij,lj->li", turns, robot.centre)
        self.gravity_centre: Floats = (
            robot.mass @ places / self.mass if self.mass > 0 else np.zeros(3)
        )
        self.reach = max(
            (hull.reach + float(np.linalg.norm(origin)) for hull, origin, _ in self.parts),
            default=0.0,
        )

    def wetted(self, up: Floats, level: float) -> tuple[float, Floats]:
        """Return volume [m^3] and centroid [m] of the submerged part.

        Args:
            up: unit normal of the surface in base axes, shape (3,).
            level: height of the surface above the base origin along ``up`` [m].
        """
        volume, moment = 0.0, np.zeros(3)
        for hull, origin, turn in self.parts:
            wet = hull.wetted(turn.T @ up, level - float(up @ origin))
            volume += wet.volume
            moment += wet.volume * (origin + turn @ wet.centroid)
        return volume, moment / volume if volume > 0.0 else np.zeros(3)

    def level_of(self, up: Floats, volume: float) -> float:
        """Return the surface height at which ``volume`` is wet, by bisection [m]."""
        low, high = -self.reach, self.reach
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if self.wetted(up, middle)[0] > volume:
                high = middle
            else:
                low = middle
        return 0.5 * (low + high)

    def draught(self, volume: float) -> float:
        """Return the draught of the upright robot [m]."""
        return self.level_of(np.array([0.0, 0.0, 1.0]), volume) - self.lowest()

    def lowest(self) -> float:
        """Return the height of the lowest point of the upright robot above its base origin [m]."""
        # the level at which the first billionth of the volume is wet stands for it
        return self.level_of(np.array([0.0, 0.0, 1.0]), 1e-9 * self.volume)

    def metacentric_height(self, axis: Sequence[float], volume: float) -> float:
        """Return the restoring moment per weight and angle for a small tilt about a level axis [m].

        Equation:
            GM = -d/da [axis . ((B - G) x up)] at a = 0; for a submerged body the height of the
            centre of buoyancy above the centre of gravity. Positive is stable.

        Args:
            axis: unit vector in base axes.
            volume: that is wet [m^3]; kept while tilting.
        """
        arms = [self.righting_arm(axis, volume, tilt) for tilt in (-_TILT, _TILT)]
        return -(arms[1] - arms[0]) / (2.0 * _TILT)

    def righting_arm(self, axis: Sequence[float], volume: float, tilt: float = 0.0) -> float:
        """Return the moment of the buoyancy about the centre of gravity, per weight [m].

        Args:
            axis: unit vector in base axes.
            volume: that is wet [m^3].
            tilt: angle of the body about the axis [rad].
        """
        along = np.asarray(axis, dtype=float)
        z = np.array([0.0, 0.0, 1.0])
        # a body turned by +tilt sees the vertical turned by -tilt
        up = z * math.cos(tilt) - np.cross(along, z) * math.sin(tilt)
        level = self.reach if volume >= self.volume else self.level_of(up, volume)
        _, centre = self.wetted(up, level)
        return float(along @ np.cross(centre - self.gravity_centre, up))
