"""Conversion of autopilot motor commands to rotor speeds and thruster forces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError, refuse_unlisted
from seals.logs.log import Log
from seals.schema import Within, read

COMMANDS: dict[str, tuple[float, float]] = {
    "thrust_share": (0.0, 1.0),
    "speed_share": (0.0, 1.0),
    "percent": (0.0, 100.0),
    "pwm": (1000.0, 2000.0),
    "dshot": (48.0, 2047.0),
    "share_16_bit": (0.0, 65535.0),
    "rpm": (0.0, math.inf),
    "rad/s": (0.0, math.inf),
}
"""Kinds of motor commands, and the range that runs from standstill to full."""
_SPEEDS = {"rpm": 2.0 * math.pi / 60.0, "rad/s": 1.0}
_SHARES_THRUST = "thrust_share"


@dataclass(frozen=True, kw_only=True)
class MotorCurve:
    """Map from a motor command to the speed of a rotor or the force of a thruster.

    Equation:
        u = (command - low) / (high - low) within 0 and 1. Of a share of thrust: w = w_max sqrt(u);
        of any other share: w = w_max (f u^2 + (1 - f) u)^(1/2) with the thrust factor f, for f = 1
        w = w_max u. Points take the place of the equation. The speed is then multiplied by
        (V / V_full)^power. Of a thruster u runs from -1 at ``low`` over 0 in the middle to 1 at
        ``high``, and F = F_max (f u abs(u) + (1 - f) u), or the points.

    Args:
        command: kind of the command, one of `COMMANDS`; empty to recognise it by its values.
        range: command at standstill and at full; empty for that of the kind.
        thrust_factor: share of the square in thrust by command, f [1]; 1 for thrust by the square.
        points: pairs of u and rotor speed [rad/s] or force [N], not falling, with a dead zone as a
            level part; empty for the equation.
        full_voltage: of the battery [V]; zero where the voltage does not matter.
        voltage_power: of the speed in the voltage [1].
        order: number of the motor in the log that drives each rotor or thruster of the robot; empty
            for the order of the log.
        reverse: numbers of the motors in the log that push against their thruster's axis by a
            positive command; empty for those that the log states.
    """

    command: str = ""
    range: Sequence[float] = ()
    thrust_factor: Annotated[float, Within(0.0, 1.0)] = 1.0
    points: Sequence[tuple[float, float]] = ()
    full_voltage: Annotated[float, Within(0.0, 1e6)] = 0.0
    voltage_power: Annotated[float, Within(0.0, 1e3)] = 1.0
    order: Sequence[int] = ()
    reverse: Sequence[int] = ()

    def __post_init__(self) -> None:
        """Refuse values that no motor can have."""
        if self.command:
            refuse_unlisted(
                self.command,
                COMMANDS,
                f"motors.command={self.command} is not allowed",
                error=LogError,
            )
        span = [float(x) for x in self.range]
        if span and (len(span) != 2 or not span[0] < span[1]):
            raise LogError(f"motors.range={span} is not allowed.\nAllowed: [low,high]")
        curve = np.asarray([list(p) for p in self.points], dtype=float)
        steps = np.diff(curve, axis=0) if len(self.points) > 1 else np.zeros((1, 2))
        if len(self.points) and (np.any(steps[:, 0] <= 0) or np.any(steps[:, 1:] < 0)):
            raise LogError(
                "motors.points is not an increasing curve.\nWrite: [[0, 0], [0.5, 600], [1, 900]], "
                "share of the range and rotor speed [rad/s], or force [N] with shares from -1 to 1"
            )


def motor_curve(entry: Any, changes: Mapping[str, Any] | None = None) -> MotorCurve:
    """Return the motor curve that a mapping states.

    Args:
        entry: of a data sheet or of a log's metadata; None for none.
        changes: entries that replace those of ``entry``.

    Raises:
        LogError: it is no mapping, or an entry is unknown or of the wrong kind.

    Example:
        >>> motor_curve({"full_voltage": "high"})
        Traceback (most recent call last):
        seals.errors.LogError: motors.full_voltage=high is not allowed.
        Allowed: a finite number
    """
    given = read(dict[str, Any] | None, entry, where="motors", error=LogError) or {}
    return read(MotorCurve, {**given, **(changes or {})}, where="motors", error=LogError)


def recognised(values: Floats, stated: str = "") -> str:
    """Detect the kind of motor commands by their values.

    Args:
        values: commands of all motors, shape (rows, motors), NaN where there is none.
        stated: what the file itself says of them, which decides where the values allow it.

    Raises:
        LogError: they fit no kind, or several.

    Example:
        >>> recognised(np.array([[1000.0, 1480.0], [1550.0, 1620.0]]))
        'pwm'
    """
    finite = values[np.isfinite(values)]
    high = float(finite.max()) if finite.size else 0.0
    moving = finite[finite > 0.02 * high]
    low = float(moving.min()) if moving.size else 0.0
    if stated:
        refuse_unlisted(
            stated, COMMANDS, f"motor_command={stated:.60} is not known", error=LogError
        )
    if stated and high <= 1.05 * COMMANDS[stated][1]:
        return stated
    if high <= 1.05:
        return "speed_share"
    if high <= 105.0:
        return "percent"
    whole = bool(np.all(finite == np.round(finite)))
    if low >= 800.0 and high <= 2200.0:
        return "pwm"
    if whole and high <= 2047.0:
        return "dshot"
    raise LogError(
        f"motor commands from {low:g} to {high:g} cannot be recognised from their values.\n"
        f"Name the kind: motors.command= one of {', '.join(COMMANDS)}"
    )


def with_rotor_speeds(
    log: Log, curve: MotorCurve, rotors: Sequence[Mapping[str, Any]]
) -> tuple[Log, list[str]]:
    """Return a log with commanded rotor speeds, and a description of the conversion.

    Args:
        log: with ``motor_pwm``, and ``battery_voltage`` where the curve depends on it.
        curve: of the motors.
        rotors: of the robot, with ``max_speed`` [rad/s] each.

    Raises:
        LogError: the commands cannot be understood, or do not fit the robot's rotors.
    """
    values = log.channel("motor_pwm")
    full = _full_speeds(rotors)
    kind = curve.command or recognised(values, str(log.meta.get("motor_command", "")))
    columns = _columns(curve, values.shape[1], full.size)
    sent = values[:, columns]
    low, high = (float(x) for x in curve.range) if curve.range else COMMANDS[kind]
    said = f"motor commands are {kind}" + (f" of {low:g} to {high:g}" if high < math.inf else "")
    if kind in _SPEEDS:
        speed: Floats = sent * _SPEEDS[kind]
    else:
        share = np.clip((sent - low) / (high - low), 0.0, 1.0)
        speed = _speed(curve, kind, share, full)
        said += f"; full is {', '.join(f'{x:g}' for x in np.unique(full))} rad/s"
        if curve.full_voltage:
            said += f" at {curve.full_voltage:g} V"
            speed = speed * _sag(log, curve)[:, None]
    named = {f"rotor_speed_cmd_{k + 1}": speed[:, k] for k in range(full.size)}
    order = ", ".join(str(k + 1) for k in columns)
    by = "by their values" if kind != log.meta.get("motor_command") else "as the log says"
    hint = "" if curve.command else f" ({by}; motors.command= says otherwise)"
    return log.with_columns(named), [
        f"{said}{hint}",
        f"rotors 1 to {full.size} are driven by motors {order} (motors.order= says otherwise)",
    ]


PULSES_BOTH_WAYS = (1100.0, 1900.0)
"""Pulse widths of a thruster full astern and full ahead [us]; it stands still in the middle."""


def with_thruster_forces(
    log: Log, curve: MotorCurve, thrusters: Sequence[Mapping[str, Any]]
) -> tuple[Log, list[str]]:
    """Return a log with commanded thruster forces, and a description of the conversion.

    Args:
        log: with ``motor_pwm``; its metadata may state the reversed motors, ``motor_reverse``.
        curve: of the thrusters, for pulse widths or shares from -1 to 1.
        thrusters: of the robot, with ``max_force`` [N] each.

    Raises:
        LogError: the commands are of another kind, or do not fit the robot's thrusters.
    """
    values = log.channel("motor_pwm")
    full = np.array([float(one["max_force"]) for one in thrusters])
    kind = curve.command or str(log.meta.get("motor_command", "")) or recognised(np.abs(values))
    ranges = {"pwm": PULSES_BOTH_WAYS, "thrust_share": (-1.0, 1.0), "speed_share": (-1.0, 1.0)}
    refuse_unlisted(kind, ranges, f"motors.command={kind} drives no thrusters", error=LogError)
    columns = _columns(curve, values.shape[1], full.size, "thrusters")
    low, high = (float(x) for x in curve.range) if curve.range else ranges[kind]
    share = np.clip(2.0 * (values[:, columns] - low) / (high - low) - 1.0, -1.0, 1.0)
    turned = [int(k) for k in curve.reverse or log.meta.get("motor_reverse") or ()]
    share = share * np.where(np.isin(np.array(columns) + 1, turned), -1.0, 1.0)
    if len(curve.points):
        points = np.asarray([list(p) for p in curve.points], dtype=float)
        force: Floats = np.interp(share, points[:, 0], points[:, 1])
        force[~np.isfinite(share)] = np.nan
    else:
        f = 0.0 if kind == _SHARES_THRUST else curve.thrust_factor
        force = full * (f * share * np.abs(share) + (1.0 - f) * share)
    order = ", ".join(str(k + 1) for k in columns)
    back = f", of which {', '.join(map(str, turned))} are reversed" if turned else ""
    return log.with_columns({f"thruster_cmd_{k + 1}": force[:, k] for k in range(full.size)}), [
        f"motor commands are {kind} of {low:g} to {high:g}; full is "
        f"{np.nanmax(np.abs(force)):.3g} N at most in this log (motors.points= says otherwise)",
        f"thrusters 1 to {full.size} are driven by motors {order}{back} (motors.order=, "
        "motors.reverse= say otherwise)",
    ]


def _full_speeds(rotors: Any) -> Floats:
    """Largest speeds of the rotors in a vehicle's description [rad/s], shape (n,)."""
    try:
        full = np.array([float(rotor["max_speed"]) for rotor in rotors])
    except (TypeError, ValueError, KeyError, OverflowError) as cause:
        raise LogError(
            f"vehicle.rotors={rotors!r:.60} is not allowed.\nAllowed: a list of rotors, each with "
            "max_speed [rad/s]"
        ) from cause
    if not np.all((full > 0.0) & np.isfinite(full)):
        raise LogError("vehicle.rotors: a max_speed is not above zero.\nAllowed: speeds in rad/s")
    return full


def _speed(curve: MotorCurve, kind: str, share: Floats, full: Floats) -> Floats:
    if len(curve.points):
        points = np.asarray([list(p) for p in curve.points], dtype=float)
        return np.where(np.isfinite(share), np.interp(share, points[:, 0], points[:, 1]), np.nan)
    if kind == _SHARES_THRUST:
        return full * np.sqrt(share)
    factor = curve.thrust_factor
    return full * np.sqrt(factor * share**2 + (1.0 - factor) * share)


def _columns(curve: MotorCurve, motors: int, rotors: int, drives: str = "rotors") -> list[int]:
    order = [int(k) for k in curve.order] or list(range(1, rotors + 1))
    if len(order) != rotors or any(not 1 <= k <= motors for k in order):
        raise LogError(
            f"the log has commands of {motors} motors, the robot {rotors} {drives}.\n"
            f"State which motor drives each of them: motors.order={list(range(1, rotors + 1))}"
        )
    return [k - 1 for k in order]


def _sag(log: Log, curve: MotorCurve) -> Floats:
    """Fraction of full speed that the battery voltage allows, at every row."""
    if not log.has("battery_voltage"):
        raise LogError(
            "motors.full_voltage is stated, but the log has no battery_voltage.\n"
            "Leave motors.full_voltage out, or map the voltage."
        )
    volts = log.columns["battery_voltage"]
    good: NDArray[np.bool_] = np.isfinite(volts)
    if not good.any():
        raise LogError(
            "motors.full_voltage is stated, but every battery_voltage in the log is missing.\n"
            "Leave motors.full_voltage out, or map the voltage."
        )
    even = np.interp(log.time, log.time[good], volts[good])
    return np.clip(even / curve.full_voltage, 0.0, None) ** curve.voltage_power
