"""Line-of-sight guidance: course towards a point ahead on a straight leg."""

from __future__ import annotations

import math
from typing import NamedTuple

from seals.arrays import Floats


class LegPosition(NamedTuple):
    """Position of a vehicle relative to a straight leg.

    Args:
        along: distance flown along the leg, level [m].
        left: to come to its end, level [m].
        cross: cross-track error, positive to the left of the leg [m].
        above: height above the leg [m].
        course: of the leg, anticlockwise from world x [rad].
        climb: angle of the leg above the horizontal [rad].
    """

    along: float
    left: float
    cross: float
    above: float
    course: float
    climb: float

    @classmethod
    def of(cls, a: Floats, b: Floats, p: Floats) -> LegPosition:
        """Return where a point lies relative to the leg from a to b.

        Args:
            a: start of the leg [m], shape (3,).
            b: its end, apart from a in the level plane [m], shape (3,).
            p: the point [m], shape (3,).

        Example:
            >>> import numpy as np
            >>> LegPosition.of(np.zeros(3), np.array([10.0, 0, 0]), np.array([4.0, 1.0, -2.0]))[:4]
            (4.0, 6.0, 1.0, -2.0)
        """
        (ax, ay, az), (bx, by, bz), (px, py, pz) = a.tolist(), b.tolist(), p.tolist()
        length = math.hypot(bx - ax, by - ay)
        ex, ey = (bx - ax) / length, (by - ay) / length
        # level coordinates of the point along and to the left of the leg's direction e
        along = (px - ax) * ex + (py - ay) * ey
        cross = (py - ay) * ex - (px - ax) * ey
        height = az + (bz - az) * min(max(along / length, 0.0), 1.0)
        climb = math.atan2(bz - az, length)
        return cls(along, length - along, cross, pz - height, math.atan2(ey, ex), climb)


def los_angle(error: float, lookahead: float, offset: float = 0.0) -> float:
    """Return the angle towards the point ahead, from the direction of the leg [rad].

    Equation:
        chi - pi_p = -atan((e + offset) / Delta). At the speed U on that course e' = -U e /
        sqrt(e^2 + Delta^2): globally stable, exp(-U t / Delta) near the leg.

    Args:
        error: e across the leg [m].
        lookahead: Delta [m].
        offset: that an integral of the error adds [m].

    References:
        Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 12; Boerhaug,
        Pavlov and Pettersen 2008, Integral LOS control, CDC (doi 10.1109/CDC.2008.4739352).

    Example:
        >>> round(los_angle(5.0, 5.0), 6) == round(-math.pi / 4, 6)
        True
    """
    return -math.atan2(error + offset, lookahead)


def integral_rate(error: float, lookahead: float, offset: float) -> float:
    """Return the rate of the integral of the cross-track error [m/m], to be scaled by its gain.

    Equation:
        y' = Delta e / ((e + offset)^2 + Delta^2): it winds up little where the error is large.

    Args:
        error: e across the leg [m].
        lookahead: Delta [m].
        offset: of the integral so far [m].
    """
    return lookahead * error / ((error + offset) ** 2 + lookahead**2)
