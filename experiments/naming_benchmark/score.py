"""Score of answers to the public logs: names, false alarms, and where an effect is said to act."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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


@dataclass(frozen=True, kw_only=True)
class Counts:
    """True, false and missed declarations.

    Args:
        true: declared and there.
        false: declared and not there.
        missed: there and not declared.
    """

    true: int = 0
    false: int = 0
    missed: int = 0

    def __add__(self, other: Counts) -> Counts:
        """Add up."""
        return Counts(
            true=self.true + other.true,
            false=self.false + other.false,
            missed=self.missed + other.missed,
        )

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall; 1 where there is nothing, and nothing is said.

        Example:
            >>> Counts(true=2, false=1, missed=1).f1
            0.6666666666666666
        """
        total = 2 * self.true + self.false + self.missed
        return 2.0 * self.true / total if total else 1.0

    @property
    def false_discovery(self) -> float:
        """Share of what is declared but not present; 0 where nothing is declared.

        Example:
            >>> Counts(true=2, false=1).false_discovery
            0.3333333333333333
        """
        said = self.true + self.false
        return self.false / said if said else 0.0


def compared(there: set[str], said: set[str]) -> Counts:
    """Count what is declared against what is there."""
    return Counts(true=len(there & said), false=len(said - there), missed=len(there - said))
