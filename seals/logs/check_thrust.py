"""Check of rotor speeds against the weight, which finds wrong units and coefficients."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.logs.finding import Finding, Severity
from seals.logs.log import Log

_SQUARED = {
    "rpm": (60.0 / (2.0 * math.pi)) ** 2,
    "Hz": (1.0 / (2.0 * math.pi)) ** 2,
}
_WITHIN = 1.6
"""Factor within which a ratio of squares points to a unit."""
_ODD = 1.35
"""Ratio of thrust and weight that no tolerance of a data sheet explains."""
_FLYING = 5.0
"""Least specific force along the rotors in flight [m/s^2]."""
_FEWEST = 50


def hover_ratio(log: Log, vehicle: Mapping[str, Any], channel: str = "rotor_speed_cmd") -> Floats:
    """Return thrust over mass, and specific force along the rotors' mean axis, row by row.

    1 in a flight whose rotor speeds, thrust coefficients and mass belong together.

    Args:
        log: with rotor speeds and specific force.
        vehicle: ``mass`` and ``rotors`` as in ``meta.yaml``.
        channel: of the speeds.
    """
    stated = vehicle.get("rotors")
    listed = stated if isinstance(stated, list | tuple) else ()
    rotors = [rotor for rotor in listed if isinstance(rotor, Mapping)]
    mass = vehicle.get("mass")
    usable = log.has(channel) and log.has("specific_force") and isinstance(mass, int | float)
    if not rotors or not usable or log.channel(channel).shape[1] != len(rotors):
        return np.zeros(0)
    try:
        factor = np.array([float(rotor["thrust_coefficient"]) for rotor in rotors])
        axis = np.array([rotor["axis"] for rotor in rotors], dtype=float).mean(axis=0)
    except (KeyError, TypeError, ValueError):
        # what is wrong in a description is the business of the check of it
        return np.zeros(0)
    speed = np.stack([_filled(log.time, v) for v in log.channel(channel).T], axis=1)
    used = axis != 0.0
    force = log.channel("specific_force")[:, used] @ axis[used] / max(np.linalg.norm(axis), 1e-9)
    thrust = (speed**2) @ factor
    flying = np.isfinite(force) & (force > _FLYING) & (thrust > 0.1 * float(np.nanmedian(thrust)))
    ratio: Floats = thrust[flying] / (float(mass or 1.0) * force[flying])
    return ratio[np.isfinite(ratio) & (ratio > 0.0)]


def _filled(time: Floats, values: Floats) -> Floats:
    good = np.isfinite(values)
    return np.interp(time, time[good], values[good]) if good.any() else values


def check_thrust(log: Log, vehicle: Mapping[str, Any]) -> list[Finding]:
    """Return the finding about rotor speeds that do not carry the vehicle."""
    found = []
    for channel in ("rotor_speed_cmd", "rotor_speed"):
        ratios = hover_ratio(log, vehicle, channel)
        if ratios.size < _FEWEST:
            continue
        ratio = float(np.median(ratios))
        text = f"in flight the rotors' thrust is {ratio:.3g} times mass and acceleration"
        unit = next(
            (
                unit
                for unit, factor in _SQUARED.items()
                if abs(math.log(ratio / factor)) < math.log(_WITHIN)
            ),
            "",
        )
        if unit:
            advice = (
                f"{text}: the speeds are in {unit}, rad/s is needed.\nGive the reader the unit "
            )
            advice += f"{unit}, or say motors.command={unit}."
            found.append(_finding(channel, "unit_rotor_speed", advice, Severity.REFUSE))
        elif abs(math.log(ratio)) > math.log(_ODD):
            advice = (
                f"{text}.\nLook at thrust_coefficient, max_speed and mass of the robot, and at "
                "motors.command, motors.range and motors.order."
            )
            found.append(_finding(channel, "thrust_unlike_weight", advice, Severity.WARN))
    return found


def _finding(channel: str, code: str, text: str, severity: Severity) -> Finding:
    return Finding(severity=severity, code=code, channel=channel, message=text)
