"""Result of a diagnosis as text for the terminal."""

from __future__ import annotations

from typing import Any

from seals.sysid.candidates.activity import active_words
from seals.sysid.decision.verdict import Verdict
from seals.sysid.diagnosis import Diagnosis
from seals.sysid.report.naming import figure, interval


def sentence(found: Diagnosis) -> str:
    """Return verdict, effects and held-out misfit as a few lines of text."""
    answer, table = found.answer, found.to_dict()
    held = found.held_out
    first, last = (figure(held[k], digits=3) for k in ("before", "after"))
    fall = f"Held-out misfit {first} -> {last} (floor 1)."
    verdict = answer.verdict
    if verdict is Verdict.nothing_missing:
        quiet = f"Nothing is missing: the misfit is within noise and tolerances. {fall}"
        return quiet + _by_log(found, table)
    if verdict is Verdict.cannot_tell:
        advice = " Move the vehicle more." if answer.blind else ""
        return f"Cannot tell: {'; '.join(answer.reasons)}.{advice}"
    beside = [
        f"  fitted, too uncertain or small to be named: {effect['name']}"
        for effect in table["fitted"]
        if not effect["named"]
    ]
    if verdict is Verdict.none_of_these:
        refused = f"None of the effects in the library: {'; '.join(answer.reasons)}."
        return "\n".join([refused, *beside]) + _by_log(found, table)
    lines = ["Missing:" if verdict is Verdict.named else "One of these is missing:"]
    for effect in table["effects"]:
        when = active_words(effect["active"], found.logs) if "active" in effect else ""
        when = f" {when}," if when else ","
        lines.append(f"  {effect['name']}{when} confidence {100 * effect['confidence']:.0f} %")
        lines += [f"    {_value(name, p)}" for name, p in effect["parameters"].items()]
    lines += [f"  cannot be told from: {', '.join(s[1:])}" for s in table["ambiguous_with"]]
    return "\n".join([*lines, *beside, fall]) + _by_log(found, table)


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
        out += f"\n  Something else is missing in {' and '.join(odd)}: diagnose it on its own."
    return out


def _value(name: str, p: dict[str, Any]) -> str:
    unit = "" if p["unit"] == "1" else f" {p['unit']}"
    limits = interval(p["low90"], p["high90"])
    return f"{name} = {figure(p['value'])}{unit}  (90 %: {limits})"
