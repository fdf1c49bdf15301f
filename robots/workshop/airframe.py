"""Airframe of the flying robots: pressure hull, booms with rotors, legs, cameras."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.environment.seawater import FRESH_WATER
from seals.robots.workshop.links import Joint, Link
from seals.robots.workshop.pieces import Piece, ball, box, can, rod, turned

WATER = round(FRESH_WATER, 1)
"""Fresh water at 20 degC [kg/m^3]."""
DISC_MASS = 0.012
"""Mass of a propeller [kg]."""
MOTOR = 0.060
"""Mass of a motor, flooded [kg]."""
TUBE, BOOM_MASS, BOOM_HEIGHT = 0.008, 0.030, 0.030
"""Radius of a boom [m], its mass at 0.16 m of length [kg], and its height [m]."""
MOTOR_VOLUME, LEG_VOLUME = 12.0e-6, 4.7e-6
"""Displaced by the metal of a motor, and by a flooded leg with its foot [m^3]."""
FOOT, LEG_OUT = -0.165, 0.180
"""Height of the feet, and their distance from the middle [m]."""
BELLY, BELLY_TILT = (0.02, 0.055, -0.052), 1.25
"""Place [m] and downward tilt [rad] of the belly camera, beside the arm."""
THIN = np.array([0.0, 0.0, 0.002])
"""Half the thickness of a propeller's disc [m]."""
COLOURS = {
    "shell": (0.95, 0.62, 0.10, 1.0),
    "dark": (0.16, 0.17, 0.20, 1.0),
    "metal": (0.65, 0.67, 0.70, 1.0),
    "blade": (0.10, 0.45, 0.75, 1.0),
    "rubber": (0.80, 0.12, 0.12, 1.0),
    "glass": (0.05, 0.05, 0.35, 1.0),
}


@dataclass(frozen=True, kw_only=True)
class Airframe:
    """Sizes and masses of a flying hull.

    Args:
        rotors: number of rotors, evenly spaced, the first between front and right.
        reach: distance of the hubs from the middle [m].
        propeller: radius of the propellers [m].
        radius: of the can [m].
        height: of the can [m].
        shell: mass of the can [kg].
        inside: mass of the electronics [kg].
        battery: mass of the battery [kg].
        shoulders: places of the arms' shoulders [m].
        legs: number of legs, evenly spaced like the rotors of a quadrotor.
        reserve: buoyancy above the weight, as a share of it [1]. Below zero the robot sinks: what
            moves by leaning its thrust needs a weight to carry under water as well.
    """

    rotors: int = 4
    reach: float = 0.24
    propeller: float = 0.127
    radius: float = 0.085
    height: float = 0.080
    shell: float = 0.38
    inside: float = 0.24
    battery: float = 0.60
    shoulders: tuple[tuple[float, float, float], ...] = ((0.07, 0.0, -0.08),)
    legs: int = 4
    reserve: float = -0.08

    def hubs(self) -> list[tuple[float, float, float]]:
        """Return the hubs of the rotors, clockwise from above, front right first [m]."""
        step = 2.0 * math.pi / self.rotors
        at = [-(k + 0.5) * step for k in range(self.rotors)]
        return [(self.reach * math.cos(a), self.reach * math.sin(a), 0.070) for a in at]

    def pieces(self, trim: float, at: tuple[float, float] = (0.0, 0.0)) -> list[Piece]:
        """Return the pieces of the body, with a mass at its keel.

        Args:
            trim: that mass [kg].
            at: its place [m].
        """
        half = self.height / 2.0
        found = [
            self._can(),
            box((0.10, 0.08, 0.024), (0, 0, 0.052 - half), self.inside),
            box((0.14, 0.05, 0.038), (0, 0, 0.020 - half), self.battery),
            box((0.10, 0.12, 0.010), (*at, 0.006 - half), trim),
            rod(self.radius * 0.55, (0, 0, half), (0, 0, half + 0.004), colour="dark"),
        ]
        for hub in self.hubs():
            found += self._boom(np.array(hub))
        for k in range(self.legs):
            found += self._leg(-(k + 0.5) * 2.0 * math.pi / self.legs)
        for x, y, z in self.shoulders:
            found += self._bracket(x, y, z)
        return found + self._eyes()

    def _can(self) -> Piece:
        look = {"colour": "shell", "chamfer": 0.004}
        return can(self.radius, self.height, (0, 0, 0), self.shell, solid=True, wet=True, **look)

    def _boom(self, hub: Floats) -> list[Piece]:
        """Tube, motor and propeller of one rotor."""
        out = np.array([hub[0], hub[1], 0.0]) / self.reach
        level = np.array([0.0, 0.0, BOOM_HEIGHT])
        start, end = self.radius * out + level, (self.reach + 0.005) * out + level
        length = self.reach + 0.005 - self.radius
        # tube, flooded motor and leg displace as much as one thicker tube
        volume = math.pi * TUBE**2 * length + MOTOR_VOLUME + LEG_VOLUME * self.legs / self.rotors
        thick = math.sqrt(volume / (math.pi * length))
        foot, top = self.reach * out + level, hub - np.array([0.0, 0.0, 0.006])
        blade = (self.propeller, 0.022, 0.002)
        turn = math.atan2(out[1], out[0]) + 0.6
        halves = [
            Piece(
                kind="blade",
                size=blade,
                centre=hub + turned("z", a) @ np.array([self.propeller / 2, 0, 0]),
                turn=turned("z", a) @ turned("x", 0.25),
                colour="blade",
            )
            for a in (turn, turn + math.pi)
        ]
        return [
            rod(TUBE, start, end, colour="dark"),
            rod(thick, start, end, BOOM_MASS * length / 0.16, wet=True, solid=True),
            rod(0.014, foot, top, MOTOR, colour="metal", solid=True),
            rod(self.propeller, hub - THIN, hub + THIN, DISC_MASS, solid=True),
            rod(0.006, top, hub + 3.0 * THIN, colour="metal"),
            *halves,
        ]

    def _leg(self, angle: float) -> list[Piece]:
        """A flooded tube, splayed outwards, with a rubber foot."""
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        top = 0.9 * self.radius * out + np.array([0.0, 0.0, -0.040])
        foot = LEG_OUT * out + np.array([0.0, 0.0, FOOT])
        return [
            rod(0.004, top, foot, 0.014, colour="dark", solid=True),
            ball(0.009, foot, 0.004, colour="rubber", solid=True),
        ]

    def _bracket(self, x: float, y: float, z: float) -> list[Piece]:
        """Two cheeks that carry the shoulder, with its servo between them."""
        top = -self.height / 2.0
        size = (0.036, 0.005, top - z + 0.014)
        cheeks = [
            box(size, (x, y + side * 0.028, (top + z - 0.014) / 2), 0.012, colour="metal")
            for side in (1, -1)
        ]
        servo = box((0.040, 0.040, 0.018), (x, y, top - 0.009), 0.065, colour="dark")
        return [*cheeks, servo]

    def _eyes(self) -> list[Piece]:
        """The two cameras: windows in small housings."""
        front, belly = np.array(self.front()), np.array(BELLY)
        look = turned("y", BELLY_TILT) @ np.array([0.012, 0.0, 0.0])
        sides = {"colour": "glass"}
        return [
            rod(0.011, front - (0.014, 0, 0), front, 0.020, **sides),
            rod(0.011, belly - look, belly, 0.020, **sides),
        ]

    def front(self) -> tuple[float, float, float]:
        """Return the place of the front camera [m]."""
        return (self.radius + 0.012, 0.0, 0.010)

    def base(self, others: list[Link]) -> Link:
        """Return the body with a mass at its keel that sets trim and balance.

        The mass makes the whole robot lighter than its water by the reserve and puts the body's own
        centre of gravity on its axis.
        """
        bare = Link(name="body", pieces=self.pieces(0.0))
        volume = bare.volume + sum(link.volume for link in others)
        wanted = WATER * volume / (1.0 + self.reserve)
        trim = round(wanted - bare.mass - sum(link.mass for link in others), 3)
        x, y, _ = (-bare.mass / trim * bare.centre()).tolist()
        return Link(name="body", pieces=self.pieces(trim, (round(x, 4), round(y, 4))))

    def frames(self) -> tuple[list[Link], list[Joint]]:
        """Return the frames of cameras and inertial sensor, x along the view, z up."""
        places = {
            "camera_front": (self.front(), (0.0, 0.0, 0.0)),
            "camera_belly": (BELLY, (0.0, BELLY_TILT, 0.0)),
            "imu_link": ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        }
        joints = [
            Joint(name=f"{name}_mount", parent="body", child=name, at=at, rpy=rpy)
            for name, (at, rpy) in places.items()
        ]
        return [Link(name=name) for name in places], joints
