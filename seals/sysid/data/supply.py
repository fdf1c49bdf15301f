"""Commands that drives can follow at the battery voltage of a log."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import has_hook
from seals.effects.effect import EffectOptions
from seals.plugin_options import options_of
from seals.sysid.data.vehicle import Vehicle
from seals.world.drivetrain import response_of

_NEAR = 0.9
"""Share of the limit from which on a low battery may limit a drive."""
_UNFELT = 1e-3
"""Missing share of the full voltage that counts as none."""


def supplied(command: Floats, voltage: Floats, time: Floats, vehicle: Vehicle) -> Floats:
    """Return commands within the limits that fall with the battery's voltage, shape (T, n).

    The law is that of the drivetrain. The voltage is taken as measured: it falls with the current
    within milliseconds, which smoothing would hide. Without a battery in the vehicle's model the
    commands are returned as they are.

    Args:
        command: in the unit of the drives, shape (T, n).
        voltage: at the battery's terminals, NaN for no sample [V], shape (T,).
        time: of the rows of one log [s], shape (T,).
        vehicle: with its battery.
    """
    full, measured = full_voltage(vehicle), np.isfinite(voltage)
    if full is None or not measured.any() or not command.size:
        return command
    volts = np.interp(time, time[measured], voltage[measured])
    # when a command arrives makes no difference to how far it is followed
    limited: Any = response_of(vehicle.bound).limited(command, (volts / full)[:, None])
    return np.asarray(limited, dtype=np.float64)


def full_voltage(vehicle: Vehicle) -> float | None:
    """Return the voltage of the full battery of the vehicle's model [V]; None without one."""
    for effect in vehicle.effects.values():
        if has_hook(effect, "battery_update"):
            return options_of(effect, EffectOptions).full_voltage
    return None


def typical_shortfall(voltage: Floats | None, full: float | None) -> float:
    """Return the typical missing share of the full voltage [1]; 0.1 where it never falls.

    Equation:
        x_0 with ln x_0 = sum x^2 ln x / sum x^2 over the rows, x = 1 - V / V_full > 0: there a
        change of the exponent of a law k x leaves the best k as it is, to first order.

    Args:
        voltage: at the battery's terminals [V], shape (T,); None if it is not measured.
        full: V_full [V]; None if it is not known.

    Example:
        >>> round(typical_shortfall(np.array([9.0, 9.0, 10.0]), 10.0), 9)
        0.1
    """
    short = np.zeros(1) if voltage is None or not full else 1.0 - np.ravel(voltage) / full
    short = short[short > _UNFELT]
    if not short.size:
        return 0.1
    return float(np.exp(np.average(np.log(short), weights=short**2)))


def supply_words(command: Floats, vehicle: Vehicle) -> str:
    """Return a remark on drives near their limit if no log states the voltage, else nothing.

    Args:
        command: in the unit of the drives, shape (T, n).
        vehicle: with or without a battery.
    """
    if full_voltage(vehicle) is None or not command.size:
        return ""
    near = (np.abs(command) > _NEAR * response_of(vehicle.bound).limit).any(axis=1)
    if not near.any():
        return ""
    return (
        f"{100.0 * near.mean():.2g} % of the rows command a drive beyond {_NEAR:.0%} of its limit, "
        "which falls with the battery's voltage: without battery_voltage in the log, the commands "
        "are assumed to be followed."
    )
