"""Result of a diagnosis as text for the terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from seals.config.overrides import typed
from seals.report.style import unit_text
from seals.sysid.candidates.activity import active_words
from seals.sysid.decision.verdict import Verdict
from seals.sysid.diagnosis import Diagnosis
from seals.sysid.report.naming import figure, parameter_text

SHOWN = ("position", "specific_force", "angular_velocity")
"""Channels whose errors stand beside the misfit."""
EXACT, QUIET = 0.1, 0.6
"""Error in units of the expected one below which too much noise was stated: about a third of the
variance; the expected one holds gusts that are good to a factor of two.
Below the first the channel has no noise, as in a run's own log."""


def sentence(found: Diagnosis) -> str:
    """Return verdict, stated numbers that are wrong, effects and errors as a few lines of text."""
    answer, table = found.answer, found.to_dict()
    verdict, reasons = answer.verdict, "; ".join(answer.reasons)
    wrong = wrong_lines(table["stated_wrong"], given_by(found))
    refused = verdict is Verdict.none_of_these
    why = "nearest of the library" if refused else "fitted, too uncertain or small to be named"
    beside = [f"  {why}: {effect['name']}" for effect in table["fitted"] if not effect["named"]]
    if verdict is Verdict.nothing_missing:
        said = "Nothing is missing: the misfit is within noise and tolerances."
        unseen = [f"  not to be seen in this log: {', '.join(answer.blind)}"] * bool(answer.blind)
        moved = moved_lines(table["within_tolerance"], given_by(found))
        return "\n".join([said, *unseen, *error_lines(table), *moved]) + _by_log(found, table)
    if verdict is Verdict.cannot_tell:
        advice = " Move the vehicle more." if answer.blind else ""
        return "\n".join([f"Cannot tell: {reasons}.{advice}", *wrong, *error_lines(table)])
    if verdict is Verdict.bad_data:
        return f"bad data: {reasons}."
    if refused:
        said = f"No effect of the library explains the log: {reasons}."
        return "\n".join([said, *beside]) + _by_log(found, table)
    lines = ["Missing:" if verdict is Verdict.named else "One of these is missing:"]
    for effect in table["effects"]:
        when = active_words(effect["active"], found.logs) if "active" in effect else ""
        when = f" {when}," if when else ","
        lines.append(f"  {effect['name']}{when} confidence {100 * effect['confidence']:.0f} %")
        lines += [f"    {parameter_text(name, p)}" for name, p in effect["parameters"].items()]
    for claim in answer.claims:
        rest = [name for name in claim.alike if name not in claim.rivals]
        if claim.rivals and verdict is Verdict.named:
            lines.append(f"  {claim.name} cannot be distinguished from: {', '.join(claim.rivals)}")
        if rest:
            lines.append(f"  nearly as good as {claim.name}, not excluded: {', '.join(rest)}")
    return "\n".join([*lines, *wrong, *beside, *error_lines(table)]) + _by_log(found, table)


def given_by(found: Diagnosis) -> str:
    """Return the words of the command line that gave log and robot."""
    return f"{found.given_log}{found.given_robot}"


def wrong_lines(found: Sequence[Mapping[str, Any]], given: str = "log=FOLDER") -> list[str]:
    """Describe the stated numbers that are too far off, one a line, and what to do about them.

    Args:
        found: entries of ``stated_wrong``.
        given: words of the command line that gave log and robot.
    """
    lines = [f"  stated wrong: {_stated_and_found(number)}" for number in found]
    turned = turned_words(found)
    if turned:
        return [*lines, *(f"  {words}" for words in turned), f"  then: seals diagnose {given}"]
    if found:
        command = calibration_of(found, given)
        lines.append("  measure again" + (f", or: {command}" if command else ""))
    return lines


def moved_lines(found: Sequence[Mapping[str, Any]], given: str = "log=FOLDER") -> list[str]:
    """Describe the stated numbers whose change within tolerance takes most of the error away.

    Args:
        found: entries of ``within_tolerance``.
        given: words of the command line that gave log and robot.
    """
    if not found:
        return []
    command = calibration_of(found, given)
    lines = [f"  within its tolerance: {_stated_and_found(number)}" for number in found]
    return lines + [f"  to correct the stated model: {command}"] * bool(command)


def _stated_and_found(number: Mapping[str, Any]) -> str:
    unit = "" if number["unit"] in ("", "1") else f" {number['unit']}"
    named = number["calibrates"] or "set" in number
    words = number["words"] + (f" ({number['what']})" if named else "")
    words += f", by the {number['by']}" if "by" in number else ""
    line = (
        f"{words}: stated {figure(number['stated'])}{unit}, "
        f"found {figure(number['found'])}{unit}, {abs(number['sigma']):.1f} tolerances apart"
    )
    if "set" not in number and number["stated"] * number["found"] < 0.0:
        line += "; the sign is opposite: check directions and axes"
    return line


def turned_words(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the line of the robot's file to change for drives that turn the other way.

    Args:
        found: entries of ``stated_wrong``.
    """
    out = []
    for number in found:
        if "set" in number:
            place, _, name = str(number["what"]).rpartition(".")
            values = ", ".join(f"{turn:.1f}" for turn in number["set"])
            out.append(
                f"they turn in the opposite direction: in {number['file']}, {place}: "
                f"{name}: [{values}]"
            )
    return out


def calibration_of(found: Sequence[Mapping[str, Any]], given: str) -> str:
    """Return the command that calibrates stated numbers; empty where none has a name for it.

    Args:
        found: entries of ``stated_wrong``.
        given: words of the command line that gave log and robot.
    """
    names = list(dict.fromkeys(str(n["what"]) for n in found if n["calibrates"]))
    return f"seals calibrate {given} {typed('parameters', names)}" if names else ""


def error_lines(table: Mapping[str, Any]) -> list[str]:
    """Describe how the error falls: stated model, numbers within their tolerances, with effects.

    The misfit, and of each of `SHOWN` the component whose error falls most.

    Args:
        table: of the diagnosis, as `Diagnosis.to_dict` returns it.
    """
    held, effects = table["held_out_error"], [e["name"] for e in table["effects"]]
    whole = [held[k] for k in ("stated", "before", "after")]
    steps = ["stated model", "numbers within their tolerances"]
    steps += [f"with {' and '.join(effects)}"] if effects else []
    count = len(steps)
    lines = [
        f"Error ({' -> '.join(steps)}):",
        f"  held-out misfit {_fall(whole[:count])} (floor 1)",
    ]
    for channel in SHOWN:
        own = [e for e in table["channels"] if e["channel"] == channel]
        if own:
            most = max(own, key=lambda e: e["stated"] ** 2 - e["after"] ** 2)
            unit = unit_text(most["unit"])
            lines.append(f"  {most['name']} {_fall(most['rms'][:count])} {unit} within a second")
    # residuals far below the stated noise and gusts, as shares, with their channels
    levels: dict[str, list[float]] = {}
    for error in table["channels"]:
        levels.setdefault(error["channel"], []).append(error["after"])
    found = {c: math.sqrt(sum(x * x for x in own) / len(own)) for c, own in levels.items()}
    parts = [f"{figure(x)} ({c})" for c, x in found.items() if EXACT < x < QUIET]
    quiet = ", ".join(parts)
    if quiet:
        lines.append(
            f"  stated noise or gusts are too large: the residual is {quiet} of the stated noise. "
            "Smaller values in datasheet.yaml let smaller effects be detected."
        )
    return lines


def _fall(values: Sequence[float]) -> str:
    return " -> ".join(figure(v) for v in values)


def _by_log(found: Diagnosis, table: dict[str, Any]) -> str:
    """Held-out misfit log by log, and which logs hold something that the others do not."""
    logs = table["held_out_by_log"]
    if not logs:
        return ""
    parts = [
        f"{x['log']} {figure(x['before'], digits=3)} -> {figure(x['after'], digits=3)}"
        for x in logs
    ]
    odd = [x["log"] for x in logs if x["after"] > found.problem.policy.misfit_trusted]
    out = f"\n  by log: {'; '.join(parts)}"
    if odd and len(odd) < len(logs):
        out += (
            f"\n  A further effect is missing in {' and '.join(odd)}: diagnose this log separately."
        )
    return out
