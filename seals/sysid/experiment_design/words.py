"""Text of a plan: proposal and ranked table."""

from __future__ import annotations

from seals.sysid.candidates.vehicle import installed
from seals.sysid.experiment_design.plan import SEPARATED, Plan, Ranked, sum_of, windows_of_run
from seals.sysid.experiment_design.separation import NOTHING, difference

_CHANNELS = {
    "angular_velocity": "gyroscope",
    "specific_force": "accelerometer",
    "orientation": "attitude",
    "joint_position": "joint angles",
}


def proposal(plan: Plan) -> str:
    """Return the proposal in a few sentences."""
    best = plan.best
    head = f"Fly '{best.manoeuvre.name}' ({best.manoeuvre.seconds:g} s: {best.manoeuvre.words})"
    if best.manoeuvre.releases:
        head = f"Make '{best.manoeuvre.name}' ({best.manoeuvre.words})"
    lines = [f"{head}: {_gain(plan, best)}."]
    if best.manoeuvre.logs > 1:
        lines.append("Diagnose both logs: the right effect has the same size in both.")
    plain = plan.plain
    if plain is not best:
        verb = "would not" if plain.confidence < SEPARATED else "would, too,"
        what = "tell them apart" if len(plan.names) > 1 else f"show {plan.names[0]}"
        name = plain.manoeuvre.name
        lines.append(f"{name.capitalize()} {verb} {what} ({percent(plain.confidence)}).")
    if best.confidence < SEPARATED:
        lines.append("No manoeuvre of the library would be sure to.")
        laws = installed()
        advice = [laws[n].identification.measurement for n in plan.names if n in laws]
        advice = [a for a in advice if a]
        lines += list(dict.fromkeys(advice))[:2]
    return " ".join(lines)


def percent(share: float) -> str:
    """Format a confidence in per cent; 100 % is never shown.

    Example:
        >>> percent(0.998), percent(0.55)
        ('> 99 %', '55 %')
    """
    return "> 99 %" if share > 0.99 else f"{100.0 * share:.0f} %"


def _gain(plan: Plan, best: Ranked) -> str:
    said = _seen(plan, best)
    if len(plan.names) == 1:
        return (
            f"{plan.names[0]} of its supposed size would then show {said}"
            f" (expected chance to find it {percent(best.confidence)})"
        )
    worst = min(best.contests, key=lambda c: c.separation)
    return (
        f"{worst.truth} and {worst.rival} then differ {said}"
        f" (expected confidence {percent(best.confidence)})"
    )


def _seen(plan: Plan, best: Ranked) -> str:
    """Name the channel that separates the closest pair most."""
    worst = min(best.contests, key=lambda c: c.separation)
    names = list(plan.names)
    rival = len(names) if worst.rival == NOTHING else names.index(worst.rival)
    sums = sum_of(best.manoeuvre, plan.flown)
    seen: dict[str, tuple[float, float]] = {}
    for flown in plan.flown:
        chosen = windows_of_run(flown, best.manoeuvre)
        if chosen.any():
            pair = (names.index(worst.truth), rival)
            seen = difference(flown.gram, sums, chosen, pair)
    loudest = max(seen, key=lambda c: seen[c][1])
    return (
        f"by a chi-square of {worst.separation:.3g} beyond all tolerances,"
        f" mostly at the {_CHANNELS.get(loudest, loudest)}"
    )


def table(plan: Plan) -> str:
    """Return the ranked table of all manoeuvres as text."""
    width = max(len(r.manoeuvre.name) for r in plan.ranked)
    lines = [f"{'manoeuvre':{width}}  seconds  chi-square  expected confidence"]
    for r in plan.ranked:
        note = f"  unsafe: {r.unsafe[0]}" if r.unsafe else ""
        note += "  (two logs)" if r.manoeuvre.logs > 1 else ""
        mark = "*" if r is plan.best else " "
        lines.append(
            f"{r.manoeuvre.name:{width}}  {duration(r):7g}  {r.separation:10.3g}"
            f"  {percent(r.confidence):>8} {mark}{note}"
        )
    return "\n".join(lines)


def duration(ranked: Ranked) -> float:
    """Time of all runs of a manoeuvre together [s]."""
    m = ranked.manoeuvre
    return m.seconds * max(len(m.releases), len(m.batteries) * len(m.loads))
