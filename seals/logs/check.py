"""Data-quality check of a log: all checks in one list of findings.

The checks of the time base are here: order, repeats, gaps, jitter, unit, length.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError
from seals.logs.check_meta import check_meta
from seals.logs.check_motion import check_frames, check_motion, check_thrust
from seals.logs.check_values import check_filled, check_units, check_values
from seals.logs.clock import CLOCK, FACTORS, guessed, remark
from seals.logs.finding import LARGEST, Finding, Severity
from seals.logs.log import Log

FEWEST_ROWS = 10
"""A log with fewer rows says nothing about dynamics."""
_GAP_STEPS = 5.0
_JITTER_SHARE = 0.2
_LONGEST_STEP = 2.0
_ABSURD_STEP = 5e3
_SHORTEST_STEP = 1e-6
_MOST_STEPS = 2e7
_FILLED = 4.0
"""Steps for each row above which most of a long run would be missing."""
_LONGEST_SPAN = 3.2e8
"""Ten years, longer than any run [s]."""


def _check_time(log: Log) -> list[Finding]:
    """Return the findings about time; steps are taken within each segment."""
    if log.rows < FEWEST_ROWS:
        text = f"{log.rows} rows; at least {FEWEST_ROWS} are needed."
        return [_time("too_few_rows", text, count=log.rows)]
    bad = ~(np.abs(log.time) < LARGEST)
    if bad.any():
        text = f"{bad.sum()} time stamps are not finite, or beyond {LARGEST:g} s.\n"
        text += "Remove these rows."
        return [_time("time_not_finite", text, count=int(bad.sum()))]
    begins, spans = [], []
    for number in np.unique(log.segment):
        time = log.time[log.segment == number]
        begins.append(time[:-1])
        spans.append(np.diff(time))
    starts, steps = np.concatenate(begins), np.concatenate(spans)
    if steps.size == 0:
        return [_time("too_few_rows", "no segment has two rows.")]
    found = [
        *_converted(log),
        *_backwards(starts, steps),
        *_repeated(starts, steps),
        *_short_segments(log),
    ]
    rising = steps[steps > 0.0]
    if rising.size:
        median = float(np.median(rising))
        gaps = steps > _GAP_STEPS * median
        if gaps.any():
            words = (
                f"{gaps.sum()} gaps, the longest {steps.max():.6g} s, where the usual step is "
                f"{median:.6g} s. Gaps are not interpolated."
            )
            where = _first(starts, gaps)
            found += [
                _time("gaps", words, severity=Severity.WARN, count=int(gaps.sum()), where=where)
            ]
        found += _jitter(rising)
        found += _unit(float(np.median(rising)))
        found += _span(log, float(np.median(rising)))
    return found


def _time(
    code: str,
    message: str,
    *,
    severity: Severity = Severity.REFUSE,
    count: int = 0,
    where: float | None = None,
) -> Finding:
    return Finding(
        severity=severity, code=code, channel="t", message=message, count=count, where=where
    )


def _first(starts: Floats, mask: NDArray[np.bool_]) -> float:
    return float(starts[np.argmax(mask)])


def _backwards(starts: Floats, steps: Floats) -> list[Finding]:
    back = steps < 0.0
    if not back.any():
        return []
    text = (
        f"time runs backwards {back.sum()} times, by up to {-steps.min():.6g} s.\n"
        "Sort the rows, or give separate runs a 'segment' number of their own."
    )
    return [_time("time_backwards", text, count=int(back.sum()), where=_first(starts, back))]


def _repeated(starts: Floats, steps: Floats) -> list[Finding]:
    same = steps == 0.0
    if not same.any():
        return []
    text = (
        f"{same.sum()} time stamps equal the preceding one.\n"
        "Keep one row for each time; merge rows that carry different sensors."
    )
    return [_time("time_repeated", text, count=int(same.sum()), where=_first(starts, same))]


def _short_segments(log: Log) -> list[Finding]:
    numbers, counts = np.unique(log.segment, return_counts=True)
    short = numbers[counts < FEWEST_ROWS]
    if short.size == 0:
        return []
    names = ", ".join(str(number) for number in short[:8])
    text = f"segments with fewer than {FEWEST_ROWS} rows: {names}. They will hardly count."
    return [_time("short_segment", text, severity=Severity.WARN, count=int(short.size))]


def _jitter(rising: Floats) -> list[Finding]:
    median = float(np.median(rising))
    usual = rising[rising <= _GAP_STEPS * median]
    share = float(np.std(usual)) / median
    if share <= _JITTER_SHARE:
        return []
    text = f"time steps scatter by {share:.0%} of the usual {median:.6g} s. Stamps may be late."
    return [_time("jitter", text, severity=Severity.WARN, count=int(usual.size))]


def _unit(median: float) -> list[Finding]:
    if 0.0 < median < _SHORTEST_STEP:
        text = f"the usual step is {median:.6g} s: no sensor is that fast. Is the time in days?\n"
        text += f"Allowed: steps from {_SHORTEST_STEP:g} s, with the time in seconds."
        return [_time("time_too_fast", text)]
    if median <= _LONGEST_STEP:
        return []
    absurd = median >= _ABSURD_STEP
    text = f"the usual step is {median:.6g} s. Is the time in {guessed(median)}?\n"
    text += (
        "State it: seals convert log=FILE out=FOLDER reader=csv 'reader.units={t: ms}', or "
        "convert the times."
    )
    severity = Severity.REFUSE if absurd else Severity.WARN
    return [_time("time_unit", text, severity=severity)]


def _converted(log: Log) -> list[Finding]:
    clock = log.meta.get(CLOCK)
    # the entry stands in a file as well, and may be anything there
    if not isinstance(clock, dict) or str(clock.get("unit")) not in FACTORS:
        return []
    if not isinstance(clock.get("start"), int | float):
        return []
    return [_time("time_converted", remark(clock), severity=Severity.NOTE)]


def _span(log: Log, median: float) -> list[Finding]:
    """Refuse a duration that needs too many time steps."""
    found = []
    for number in np.unique(log.segment):
        time = log.time[log.segment == number]
        span = float(time.max() - time.min())
        steps = span / median
        if steps > max(_MOST_STEPS, _FILLED * time.size) or span > _LONGEST_SPAN:
            text = (
                f"its {time.size:,} rows span {span:.6g} s ({span / 86400.0:.4g} days), "
                f"{steps:.4g} of the usual steps of {median:.6g} s.\n"
                "Remove wrong time stamps, or give each run its own 'segment' number."
            )
            found.append(_time("time_span", text, count=int(time.size)))
    return found[:1]


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
    found = [*check_meta(log), *_check_time(log)]
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
