"""Data-quality check of a log: all checks in one list of findings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.errors import LogError
from seals.logs.check_filled import check_filled
from seals.logs.check_frames import check_frames
from seals.logs.check_meta import check_meta
from seals.logs.check_motion import check_motion
from seals.logs.check_thrust import check_thrust
from seals.logs.check_time import check_time
from seals.logs.check_units import check_units
from seals.logs.check_values import check_values
from seals.logs.finding import LARGEST, Finding, Severity
from seals.logs.log import Log

_GRAVEST_FIRST = {Severity.REFUSE: 0, Severity.WARN: 1, Severity.NOTE: 2}
_TURNED = ("attitude_convention", "frame_down", "quaternion_norm", "unit_acceleration", "filled")
_BROKEN = ("too_few_rows", "time_not_finite", "time_too_fast")


def check_log(log: Log, vehicle: Mapping[str, Any] | None = None) -> list[Finding]:
    """Return all findings about a log, the most severe first.

    Args:
        log: the log.
        vehicle: mass and rotors, as in ``meta.yaml``; left out, those of the log itself.

    Example:
        >>> import numpy as np
        >>> time = np.arange(100) * 0.01
        >>> noisy = 1.0 + 0.001 * np.sin(37.0 * np.arange(100))
        >>> log = Log(name="a", columns={"t": time[::-1], "specific_force_z": noisy})
        >>> check_log(log)[0].code
        'time_backwards'
    """
    found = [*check_meta(log), *check_time(log)]
    # the other checks count on finite times, a few rows and steps that can be divided by
    if not any(finding.code in _BROKEN for finding in found):
        infinite = {key: np.abs(values) > LARGEST for key, values in log.columns.items()}
        spoilt = {
            key: np.where(mask, np.nan, log.columns[key])
            for key, mask in infinite.items()
            if mask.any()
        }
        finite = log.with_columns(spoilt) if spoilt else log
        found += [*check_values(log), *check_units(finite), *check_frames(finite)]
        stated = log.meta.get("vehicle")
        own = stated if isinstance(stated, Mapping) else {}
        weighed = check_thrust(finite, vehicle or own)
        # the weight tells the unit of rotor speeds surer than their size
        found = [f for f in found if not (weighed and f.code == "unit_rotor_speed")]
        found += [*check_filled(finite), *weighed]
        # wrong axes of the attitude are told once, by the gyroscope or by gravity
        if not any(finding.code in _TURNED for finding in found):
            found += check_motion(finite)
    return sorted(found, key=lambda finding: _GRAVEST_FIRST[finding.severity])


def refuse_if_bad(log: Log, vehicle: Mapping[str, Any] | None = None) -> list[Finding]:
    """Return the findings about a log, or refuse one with an error; see `check_log`.

    Raises:
        LogError: the log cannot be used; the message holds every reason.
    """
    found = check_log(log, vehicle)
    grave = [finding for finding in found if finding.severity is Severity.REFUSE]
    if grave:
        reasons = "\n".join(f"- {finding.channel or 'log'}: {finding.message}" for finding in grave)
        raise LogError(f"log '{log.name}' cannot be used:\n{reasons}")
    return found
