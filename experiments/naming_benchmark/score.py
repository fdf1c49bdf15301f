"""Score of answers to the public logs: names, false alarms, and where an effect is said to act."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from seals.experiments.naming_benchmark.counts import Counts, compared
from seals.experiments.naming_benchmark.told import beside, named, right

KINDS = ("by_time", "by_phase")


@dataclass(frozen=True, kw_only=True)
class Score:
    """Score of one method.

    Args:
        method: name.
        logs: that it answered.
        right: answers that are right as a whole.
        alarms: logs without an effect in which one is named.
        calm: logs without an effect.
        names: of effects.
        regions: by kind.
        seconds: median processor time of an answer.
    """

    method: str
    logs: int
    right: int
    alarms: int
    calm: int
    names: Counts
    regions: Mapping[str, Counts]
    seconds: float


def score(method: str, pairs: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> Score:
    """Score the answers of a method.

    Args:
        method: name.
        pairs: truth and answer of every log.
    """
    names, regions = Counts(), dict.fromkeys(KINDS, Counts())
    alarms = calm = 0
    for truth, answer in pairs:
        want = {str(e["name"]) for e in truth["effects"]} if truth["in_library"] else set()
        said = named(answer) - beside(want)
        names += compared(want, said)
        for kind in KINDS:
            known = answer["regions"]
            regions[kind] += compared(set(known["true"][kind]), set(known["declared"][kind]))
        if not truth["effects"]:
            calm, alarms = calm + 1, alarms + bool(said)
    times = sorted(float(answer.get("seconds") or 0.0) for _, answer in pairs)
    return Score(
        method=method,
        logs=len(pairs),
        right=sum(right(truth, answer) for truth, answer in pairs),
        alarms=alarms,
        calm=calm,
        names=names,
        regions=regions,
        seconds=times[len(times) // 2] if times else 0.0,
    )


def table(scores: Sequence[Score]) -> str:
    """Return the scores as a table in Markdown."""
    head = (
        "method", "logs", "right", "false alarms", "names F1", "names FDR",
        "time F1", "time FDR", "phase F1", "phase FDR", "CPU s a log",
    )  # fmt: skip
    rows = [head, ("---",) * len(head)]
    for one in scores:
        counts = (one.names, *(one.regions[kind] for kind in KINDS))
        figures = [f"{x:.2f}" for c in counts for x in (c.f1, c.false_discovery)]
        alarms = f"{one.alarms} of {one.calm}"
        rows.append(
            (one.method, str(one.logs), str(one.right), alarms, *figures, f"{one.seconds:.1f}")
        )
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)
