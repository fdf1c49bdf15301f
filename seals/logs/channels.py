"""Table of known channels: stem, components, unit and meaning."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

_VECTOR = ("x", "y", "z")
_ANY_COMPONENT = re.compile(r"^(?P<stem>.+)_(?:[wxyz]|\d+)$")
_NUMBER = re.compile(r"_(\d+)$")


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One measured or commanded quantity and the columns that hold it.

    Args:
        stem: name without component, such as ``position``.
        suffixes: components in order; empty for a scalar and for numbered channels.
        numbered: whether the components are ``_1 .. _n``.
        command: whether it is an order that was sent, not a measurement.
        body: whether it is a vector in body axes.
        aside: whether it is carried along only, so that its noise need not be stated.
        unit: SI unit as text.
        meaning: one line for people.
    """

    stem: str
    suffixes: tuple[str, ...] = ()
    numbered: bool = False
    command: bool = False
    body: bool = False
    aside: bool = False
    unit: str
    meaning: str


_TABLE = (
    Channel(
        stem="rotor_speed_cmd",
        numbered=True,
        command=True,
        unit="rad/s",
        meaning="commanded rotor speed, held until the next row",
    ),
    Channel(
        stem="thruster_cmd",
        numbered=True,
        command=True,
        unit="N",
        meaning="commanded thruster force along the thruster axis, held",
    ),
    Channel(
        stem="joint_position_cmd",
        numbered=True,
        command=True,
        unit="rad",
        meaning="commanded joint angle, held",
    ),
    Channel(
        stem="motor_pwm",
        numbered=True,
        command=True,
        unit="1",
        meaning="motor command as an autopilot logs it: share of full, pulse width, DShot",
    ),
    Channel(
        stem="aim_velocity",
        suffixes=_VECTOR,
        command=True,
        unit="m/s",
        meaning="velocity that the guide wants, world axes, held",
    ),
    Channel(stem="aim_yaw", command=True, unit="rad", meaning="heading that the guide wants, held"),
    Channel(stem="aim_yaw_rate", command=True, unit="rad/s", meaning="its rate, held"),
    Channel(
        stem="aim_grip",
        numbered=True,
        command=True,
        unit="1",
        meaning="closing that the guide wants of a gripper, 0 open, 1 closed, held",
    ),
    Channel(stem="position", suffixes=_VECTOR, unit="m", meaning="body origin in the world"),
    Channel(
        stem="orientation",
        suffixes=("w", "x", "y", "z"),
        unit="1",
        meaning="unit quaternion that turns body vectors into world vectors",
    ),
    Channel(
        stem="velocity",
        suffixes=_VECTOR,
        body=True,
        unit="m/s",
        meaning="velocity of the body origin over ground, body axes",
    ),
    Channel(
        stem="angular_velocity",
        suffixes=_VECTOR,
        body=True,
        unit="rad/s",
        meaning="gyroscope, body axes",
    ),
    Channel(
        stem="specific_force",
        suffixes=_VECTOR,
        body=True,
        unit="m/s^2",
        meaning="accelerometer, body axes: acceleration minus gravity (+9.81 z level at rest)",
    ),
    Channel(stem="depth", unit="m", meaning="depth of the body origin, positive down"),
    Channel(stem="depth_rate", unit="m/s", meaning="rate of the depth, positive going down"),
    Channel(
        stem="heave_response",
        unit="1",
        meaning="amplitude of the heave over that of the wave, in steady regular waves",
    ),
    Channel(stem="battery_voltage", unit="V", meaning="terminal voltage under load"),
    Channel(stem="battery_current", unit="A", meaning="current out of the battery"),
    Channel(stem="battery_charge", unit="1", meaning="state of charge, 1 for full"),
    Channel(
        stem="rotor_speed",
        aside=True,
        numbered=True,
        unit="rad/s",
        meaning="speed of a rotor, positive in its own direction",
    ),
    Channel(
        stem="velocity_valid",
        aside=True,
        unit="1",
        meaning="whether a Doppler log holds the bottom, 1 or 0; without it there is no velocity",
    ),
    Channel(
        stem="dvl_altitude",
        aside=True,
        unit="m",
        meaning="height of a Doppler log above the bottom, its axis",
    ),
    Channel(
        stem="dvl_beam_velocity",
        aside=True,
        numbered=True,
        unit="m/s",
        meaning="velocity along a beam of a Doppler log, towards the bottom positive",
    ),
    Channel(
        stem="dvl_beam_range", aside=True, numbered=True, unit="m", meaning="range of such a beam"
    ),
    Channel(
        stem="magnetic_field",
        aside=True,
        suffixes=_VECTOR,
        unit="T",
        meaning="magnetic field in the axes of its sensor",
    ),
    Channel(
        stem="gps_position",
        aside=True,
        suffixes=_VECTOR,
        unit="m",
        meaning="antenna, east, north, up",
    ),
    Channel(
        stem="gps_velocity",
        aside=True,
        suffixes=_VECTOR,
        unit="m/s",
        meaning="of the antenna, world axes",
    ),
    Channel(
        stem="range", aside=True, unit="m", meaning="distance to the nearest object along a beam"
    ),
    Channel(
        stem="sonar_range",
        aside=True,
        numbered=True,
        unit="m",
        meaning="first strong return of a sonar beam",
    ),
    Channel(
        stem="lidar_range",
        aside=True,
        numbered=True,
        unit="m",
        meaning="nearest return in a part of a lidar's sector, or its largest range",
    ),
    Channel(
        stem="acoustic_range", aside=True, unit="m", meaning="range of a transponder, by sound"
    ),
    Channel(
        stem="acoustic_bearing",
        aside=True,
        unit="rad",
        meaning="bearing of a transponder, left positive",
    ),
    Channel(
        stem="acoustic_elevation",
        aside=True,
        unit="rad",
        meaning="elevation of a transponder, up positive",
    ),
    Channel(
        stem="acoustic_valid",
        aside=True,
        unit="1",
        meaning="whether a transponder is heard, 1 or 0",
    ),
    Channel(stem="range_valid", aside=True, unit="1", meaning="whether a beam returned, 1 or 0"),
    Channel(stem="contact", aside=True, unit="1", meaning="whether a pad is touched, 1 or 0"),
    Channel(stem="pressing", aside=True, unit="N", meaning="normal force on a pad"),
    Channel(
        stem="offset",
        aside=True,
        suffixes=_VECTOR,
        unit="m",
        meaning="place of another body, link axes",
    ),
    Channel(stem="seen", aside=True, unit="1", meaning="whether a locator sees its target, 1 or 0"),
    Channel(
        stem="estimated_position",
        aside=True,
        suffixes=_VECTOR,
        unit="m",
        meaning="as odometry reports it",
    ),
    Channel(
        stem="estimated_orientation",
        aside=True,
        suffixes=("w", "x", "y", "z"),
        unit="1",
        meaning="quaternion as odometry reports it, body to world",
    ),
    Channel(
        stem="estimated_velocity",
        aside=True,
        suffixes=_VECTOR,
        unit="m/s",
        meaning="as odometry reports it, body axes",
    ),
    Channel(
        stem="estimated_spin",
        aside=True,
        suffixes=_VECTOR,
        unit="rad/s",
        meaning="as odometry reports it, body axes",
    ),
    Channel(stem="joint_position", numbered=True, unit="rad", meaning="joint angle, link side"),
    Channel(stem="joint_velocity", numbered=True, unit="rad/s", meaning="joint rate, link side"),
    Channel(stem="roll", unit="rad", meaning="roll angle of a body that has no quaternion"),
    Channel(stem="pitch", unit="rad", meaning="pitch angle above the horizontal, nose up positive"),
    Channel(stem="pressure", unit="Pa", meaning="water pressure above that at the surface"),
    Channel(
        stem="ballast_volume",
        unit="m^3",
        meaning="volume pumped out of the hull, positive is buoyant",
    ),
    Channel(stem="water_density", unit="kg/m^3", meaning="density of the water at the body"),
    Channel(
        stem="speed_through_water",
        unit="m/s",
        meaning="speed of the body through the water, not negative",
    ),
    Channel(
        stem="wave_elevation",
        numbered=True,
        unit="m",
        meaning="surface elevation at a fixed probe, up positive",
    ),
    Channel(stem="wave_maker_position", unit="m", meaning="stroke of the wave maker"),
    Channel(stem="spring_tension", numbered=True, unit="N", meaning="change of a mooring tension"),
    Channel(stem="spring_force", unit="N", meaning="resultant of the mooring springs in sway"),
    Channel(
        stem="heave_acceleration",
        numbered=True,
        unit="m/s^2",
        meaning="acceleration along body z, gravity removed",
    ),
    Channel(
        stem="sway_acceleration",
        unit="m/s^2",
        meaning="acceleration along body y, gravity removed",
    ),
)

CHANNELS: dict[str, Channel] = {channel.stem: channel for channel in _TABLE}
"""Every known channel by stem; a log may hold others, which are carried along."""


def stem_of(column: str) -> str:
    """Return the channel that a column belongs to.

    Example:
        >>> stem_of("position_x"), stem_of("rotor_speed_cmd_12"), stem_of("depth")
        ('position', 'rotor_speed_cmd', 'depth')
    """
    match = _ANY_COMPONENT.match(column)
    return match["stem"] if match and column not in CHANNELS else column


def columns_of(stem: str, present: Iterable[str]) -> tuple[str, ...]:
    """Return the full list of columns of a channel, in component order.

    A vector has all its components even where a log holds only some; a numbered channel runs to its
    highest number.

    Example:
        >>> columns_of("position", ["t", "position_z"])
        ('position_x', 'position_y', 'position_z')
        >>> columns_of("motor_pwm", ["motor_pwm_2", "motor_pwm_1"])
        ('motor_pwm_1', 'motor_pwm_2')
    """
    mine = [column for column in present if stem_of(column) == stem]
    known = CHANNELS.get(stem)
    if not mine:
        return ()
    if known is not None and known.suffixes:
        return tuple(f"{stem}_{suffix}" for suffix in known.suffixes)
    numbers = [int(match[1]) for column in mine if (match := _NUMBER.search(column))]
    if numbers and len(numbers) == len(mine) and max(numbers) <= len(mine) + 64:
        return tuple(f"{stem}_{k}" for k in range(min(1, *numbers), max(numbers) + 1))
    return tuple(sorted(mine, key=lambda column: ("wxyz".find(column[-1]), column)))


def unit_of(column: str) -> str | None:
    """Return the SI unit of a column, or None for an unknown one.

    Example:
        >>> unit_of("specific_force_z"), unit_of("t"), unit_of("colour")
        ('m/s^2', 's', None)
    """
    if column == "t":
        return "s"
    known = CHANNELS.get(stem_of(column))
    return known.unit if known is not None else None
