"""What parameters of ArduPilot say of its outputs."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from seals.arrays import Floats

_FUNCTION = re.compile(r"SERVO(\d{1,2})_FUNCTION")
_DIRECTION = re.compile(r"MOT_(\d{1,2})_DIRECTION")
_MOTORS = {33 + k: k + 1 for k in range(8)} | {82 + k: k + 9 for k in range(4)}
_MOTORS |= {160 + k: k + 13 for k in range(20)}
_THROTTLES = {70: 1, 73: 1, 74: 2}
"""Value of SERVOn_FUNCTION -> number of the motor; throttles where there are no motors."""


def motor_pulses(
    widths: Mapping[int, Floats], parameters: Mapping[str, float]
) -> dict[str, Floats]:
    """Return the pulse widths of the motors [us], by column of the log.

    Without parameters every output in use counts as a motor. A width of zero is no pulse.

    Args:
        widths: number of the output, from 1 -> its widths [us], shape (samples,).
        parameters: name -> value; those called SERVOn_FUNCTION say which motor an output drives.

    Example:
        >>> pulses = {1: np.array([1500.0]), 2: np.array([1100.0])}
        >>> {k: v.tolist() for k, v in motor_pulses(pulses, {"SERVO2_FUNCTION": 33.0}).items()}
        {'motor_pwm_1': [1100.0]}
    """
    functions = {
        int(match[1]): int(value)
        for name, value in parameters.items()
        if (match := _FUNCTION.fullmatch(name)) and np.isfinite(value)
    }
    motors = {} if functions else {output: output for output in widths}
    for table in (_MOTORS, _THROTTLES):
        if not motors:
            motors = {table[use]: output for output, use in functions.items() if use in table}
    found = {number: widths[output] for number, output in motors.items() if output in widths}
    return {
        f"motor_pwm_{number}": np.where(values > 0.0, values, np.nan)
        for number, values in sorted(found.items())
        if np.any(values > 0.0)
    }


def reversed_motors(parameters: Mapping[str, float]) -> list[int]:
    """Return the numbers of the thrusters whose pulses ArduSub turns about, by MOT_n_DIRECTION.

    Args:
        parameters: name -> value; a direction below zero reverses the pulse of a motor.

    Example:
        >>> reversed_motors({"MOT_4_DIRECTION": -1.0, "MOT_1_DIRECTION": 1.0})
        [4]
    """
    found = ((_DIRECTION.fullmatch(name), value) for name, value in parameters.items())
    return sorted(int(match[1]) for match, value in found if match and value < 0.0)
