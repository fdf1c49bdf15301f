"""Result of a calibration as text: table, undetermined and correlated parameters."""

from __future__ import annotations

from seals.sysid.calibration.calibration import Calibration
from seals.sysid.calibration.stated import StatedNumber
from seals.sysid.report.naming import figure, interval
from seals.sysid.report.words import joined

_PAIRS = 3
"""Pairs of tied numbers that are named."""
HEAD = ("number", "stated", "calibrated", "90 % interval", "change")
"""Head of the table of numbers."""


def row(found: Calibration, number: StatedNumber) -> tuple[str, ...]:
    """Return the row of one number in the table."""
    change = found.value(number) / number.value - 1.0 if number.value else None
    return (
        number.name,
        figure(number.value, number.unit),
        figure(found.value(number), number.unit),
        interval(*found.interval(number), number.unit),
        "not determined"
        if not found.determined(number)
        else ("" if change is None else f"{100.0 * change:+.1f} %"),
    )


def error_sentence(found: Calibration) -> str:
    """Return the held-out error before and after in a sentence."""
    before, after = (figure(found.held_out[k], digits=3) for k in ("before", "after"))
    where = "the held-out log" if found.unseen else "parts of the logs left out in turn"
    return f"Error on {where}: {before} times the noise floor as stated, {after} calibrated."


def remarks(found: Calibration) -> list[str]:
    """Return remarks on a calibration, such as undetermined or correlated numbers."""
    diagnose = f"seals diagnose {found.given}" if found.given else "seals diagnose"
    out = []
    held = [n for n in found.numbers if found.at_bound(n)]
    lost = [n.name for n in found.numbers if not found.determined(n) and n not in held]
    for number in held:
        low, high = (figure(bound, number.unit) for bound in number.bounds)
        line = f"The logs require a value of {number.name} outside its bounds, {low} to {high}: "
        check = f"reverse {number.turned_by}, or check axes." if number.turned_by else ""
        out.append(line + (check or "check directions and axes, or what else may be missing."))
    if lost:
        out.append(
            f"The logs do not determine {joined(lost)}: the interval is about as wide as the prior."
        )
    for one, other, correlation in found.tied()[:_PAIRS]:
        way = "rise together" if correlation > 0.0 else "trade against each other"
        out.append(
            f"{one} and {other} {way} (correlation {correlation:+.2f}): a measurement of either on "
            "the ground determines both."
        )
    if found.widening > _LOUD:
        out.append(
            f"The model does not explain the logs down to the noise: all intervals are widened by "
            f"{found.widening:.2g}. An effect is missing; to find it: {diagnose}"
        )
    if not found.solution.settled:
        out.append(
            f"The parameters had not converged after {found.solution.rounds} linearisations: "
            "give better "
            "initial values, or calibrate fewer parameters."
        )
    return out


_LOUD = 1.2
"""Widening of the intervals from which on it is mentioned."""
