"""Allowed space and limits of a planned manoeuvre: box, speeds, tilt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.effects.effect import MediumKind
from seals.sysid.data.vehicle import Vehicle

AIR, WATER, CROSSING, ARM, DROP = "air", "water", "crossing", "arm", "drop"
"""Kinds of vehicles that manoeuvres are made for."""
_CLEAR = 0.2
"""Least height of the origin above the ground [m]."""
_FLOOR = 0.5
"""Least height above the bottom of the tank [m]."""
_DEEP = 0.3
"""Least depth of a submerged vehicle [m]."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Allowed space and limits of one vehicle.

    Args:
        kind: of the vehicle.
        home: position at which manoeuvres begin [m], shape (3,).
        low: least height of the origin [m].
        high: largest height of the origin [m].
        reach: largest distance from home along x and y [m].
        speed: that the vehicle may reach [m/s].
        push: horizontal acceleration that may be asked for [m/s^2].
        lift: vertical acceleration that may be asked for [m/s^2].
        tilt: largest angle between the body's and the world's vertical [rad].
        joints: angles of the stowed arm [rad], shape (J,).
        level: height of the water surface [m]; None for none.
        slowness: factor on all durations of single motions, 1 in air.
    """

    kind: str
    home: Floats
    low: float
    high: float
    reach: float
    speed: float
    push: float
    lift: float
    tilt: float
    joints: Floats
    level: float | None
    slowness: float = 1.0


def scene_of(vehicle: Vehicle, *, around: Floats | None = None) -> Scene:
    """Return the allowed space and limits of a vehicle.

    Args:
        vehicle: stated model.
        around: position near which to stay, as far as it is safe [m], shape (3,).
    """
    kind = _kind_of(vehicle)
    home = np.zeros(3) if around is None else np.array(around, dtype=float)
    level = vehicle.environment.water_level
    ground = vehicle.environment.ground_level
    bottom = vehicle.environment.tank_bottom
    joints = np.zeros(vehicle.robot.tree.joints)
    if kind in (AIR, ARM):
        base = 0.0 if ground is None else ground
        home[2] = base + 1.5
        low = base + (0.6 if kind == ARM else _CLEAR)
        high, reach = base + 3.5, 4.0
        speed, push, tilt = 3.0, 2.5, 0.6
        # largest thrust of all rotors over the weight
        rotors = vehicle.effects["rotors"].constants()
        limit = np.asarray(vehicle.effects["rotors"].limit)  # type: ignore[attr-defined]  # of rotors
        most = float(np.sum(rotors["thrust_coefficient"] * limit**2))
        lift = float(
            np.clip(
                0.35 * ((most / (vehicle.mass * vehicle.environment.gravity)) - 1.0) * 9.81,
                0.5,
                3.5,
            )
        )
        if kind == ARM:
            joints = np.array([0.3, -0.95, -0.25, *([0.0] * len(joints))])[: len(joints)]
            speed, push, lift = 1.2, 1.2, min(lift, 2.5)
        slow = 1.0
    elif kind == WATER:
        assert level is not None
        low = level - 6.0 if bottom is None else bottom + _FLOOR
        high = level - _DEEP
        home[2] = max(level - 2.0, 0.5 * (low + high))
        speed, push, lift = _swims(vehicle)
        reach, tilt, slow = 4.0, 0.5, 2.0
    else:
        level = 0.0 if level is None else level
        low = (level - 3.0 if bottom is None else bottom) + _FLOOR
        high, reach, speed, push, lift = level + 1.5, 3.0, 1.0, 1.2, 1.2
        home[2] = level + 0.6
        tilt, slow = (np.pi, 1.0) if kind == DROP else (0.6, 1.5)
    return Scene(
        kind=kind,
        home=home,
        low=low,
        high=high,
        reach=reach,
        speed=speed,
        push=push,
        lift=lift,
        tilt=tilt,
        joints=joints,
        level=level,
        slowness=slow,
    )


def _kind_of(vehicle: Vehicle) -> str:
    """Kind of a vehicle by its actuators and medium."""
    if not len(vehicle.lag):
        return DROP
    if len(vehicle.robot.links) > 1:
        return ARM
    if vehicle.commands == "thruster_cmd":
        return WATER
    return CROSSING if vehicle.has_water else AIR


def _swims(vehicle: Vehicle) -> tuple[float, float, float]:
    """Speed and accelerations that thrusters reach with a third of their force."""
    thrusters = vehicle.effects["thrusters"]
    axis = np.asarray(thrusters.constants()["axis"], dtype=float)
    force = float(np.mean(thrusters.limit)) / 3.0  # type: ignore[attr-defined]  # of thrusters
    ahead = force * float(np.abs(axis[:, 0]).sum())
    up = force * float(np.abs(axis[:, 2]).sum())
    drags = [e for e in vehicle.effects.values() if e.identification.family]
    square = sum(
        float(getattr(e, "coefficient_x", 0.0)) for e in drags if e.medium is MediumKind.water
    )
    square = square or 2.0 * vehicle.mass
    heavy = 1.8 * vehicle.mass
    speed = float(np.clip(np.sqrt(ahead / square), 0.2, 0.8))
    return speed, float(np.clip(ahead / heavy, 0.05, 0.5)), float(np.clip(up / heavy, 0.05, 0.4))
