"""Table of known channels: stem, components, unit and meaning."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

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


_TABLE = """
rotor_speed_cmd     n    command rad/s  commanded rotor speed, held until the next row
thruster_cmd        n    command N      commanded thruster force along the thruster axis, held
joint_position_cmd  n    command rad    commanded joint angle, held
motor_pwm n command 1 motor command as an autopilot logs it: share of full, pulse width, DShot
aim_velocity        xyz  command m/s    velocity that the guide wants, world axes, held
aim_yaw             -    command rad    heading that the guide wants, held
aim_yaw_rate        -    command rad/s  its rate, held
aim_grip n command 1 closing that the guide wants of a gripper, 0 open, 1 closed, held
position            xyz  -       m      body origin in the world
orientation         wxyz -       1      unit quaternion that turns body vectors into world vectors
velocity            xyz  body    m/s    velocity of the body origin over ground, body axes
angular_velocity    xyz  body    rad/s  gyroscope, body axes
specific_force xyz body m/s^2 accelerometer, body axes: acceleration minus gravity (+9.81 z at rest)
depth               -    -       m      depth of the body origin, positive down
depth_rate          -    -       m/s    rate of the depth, positive going down
heave_response - - 1 amplitude of the heave over that of the wave, in steady regular waves
battery_voltage     -    -       V      terminal voltage under load
battery_current     -    -       A      current out of the battery
battery_charge      -    -       1      state of charge, 1 for full
rotor_speed         n    aside   rad/s  speed of a rotor, positive in its own direction
velocity_valid - aside 1 whether a Doppler log holds the bottom, 1 or 0; if not, no velocity
dvl_altitude        -    aside   m      height of a Doppler log above the bottom, its axis
dvl_beam_velocity n aside m/s velocity along a beam of a Doppler log, towards the bottom positive
dvl_beam_range      n    aside   m      range of such a beam
magnetic_field      xyz  aside   T      magnetic field in the axes of its sensor
gps_position        xyz  aside   m      antenna, east, north, up
gps_velocity        xyz  aside   m/s    of the antenna, world axes
range               -    aside   m      distance to the nearest object along a beam
sonar_range         n    aside   m      first strong return of a sonar beam
lidar_range n aside m nearest return in a part of a lidar's sector, or its largest range
acoustic_range      -    aside   m      range of a transponder, by sound
acoustic_bearing    -    aside   rad    bearing of a transponder, left positive
acoustic_elevation  -    aside   rad    elevation of a transponder, up positive
acoustic_valid      -    aside   1      whether a transponder is heard, 1 or 0
modem_position      xyz  aside   m      position that a message by sound tells, world axes
modem_delay         -    aside   s      travel of such a message
modem_echo_delay    n    aside   s      how much later an echo of it came
modem_echo_level    n    aside   dB     level of that echo relative to the direct sound
range_valid         -    aside   1      whether a beam returned, 1 or 0
contact             -    aside   1      whether a pad is touched, 1 or 0
pressing            -    aside   N      normal force on a pad
offset              xyz  aside   m      place of another body, link axes
seen                -    aside   1      whether a locator sees its target, 1 or 0
estimated_position  xyz  aside   m      as odometry reports it
estimated_orientation wxyz aside   1      quaternion as odometry reports it, body to world
estimated_velocity  xyz  aside   m/s    as odometry reports it, body axes
estimated_spin      xyz  aside   rad/s  as odometry reports it, body axes
joint_position      n    -       rad    joint angle, link side
joint_velocity      n    -       rad/s  joint rate, link side
roll                -    -       rad    roll angle of a body that has no quaternion
pitch               -    -       rad    pitch angle above the horizontal, nose up positive
pressure            -    -       Pa     water pressure above that at the surface
ballast_volume      -    -       m^3    volume pumped out of the hull, positive is buoyant
water_density       -    -       kg/m^3 density of the water at the body
speed_through_water -    -       m/s    speed of the body through the water, not negative
wave_elevation      n    -       m      surface elevation at a fixed probe, up positive
wave_maker_position -    -       m      stroke of the wave maker
spring_tension      n    -       N      change of a mooring tension
spring_force        -    -       N      resultant of the mooring springs in sway
heave_acceleration  n    -       m/s^2  acceleration along body z, gravity removed
sway_acceleration   -    -       m/s^2  acceleration along body y, gravity removed
"""
"""Stem, components (``n``: numbered), command or body axes or carried aside, unit, meaning."""


def _channel(row: str) -> Channel:
    stem, components, role, unit, meaning = row.split(maxsplit=4)
    return Channel(
        stem=stem,
        suffixes=() if components in "-n" else tuple(components),
        numbered=components == "n",
        command=role == "command",
        body=role == "body",
        aside=role == "aside",
        unit=unit,
        meaning=meaning,
    )


CHANNELS: dict[str, Channel] = {
    channel.stem: channel for channel in map(_channel, _TABLE.strip().splitlines())
}
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


def column_names(name: str, width: int, channel: str) -> list[str]:
    """Return the names of the columns of a channel.

    Args:
        name: of the channel in the log.
        width: number of its components.
        channel: that it is of, known or not; components of joints are numbered.

    Example:
        >>> column_names("gps_velocity", 3, "velocity"), column_names("q", 2, "joint_position")
        (['gps_velocity_x', 'gps_velocity_y', 'gps_velocity_z'], ['q_1', 'q_2'])
    """
    known = CHANNELS.get(channel)
    numbered = channel.startswith("joint_") or (known is not None and known.numbered)
    if width == 1 and not numbered:
        return [name]
    letters = "" if numbered else {3: "xyz", 4: "wxyz"}.get(width, "")
    return [f"{name}_{part}" for part in letters or range(1, width + 1)]


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
