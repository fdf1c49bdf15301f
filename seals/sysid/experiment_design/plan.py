"""Plan of the next experiment: ranked manoeuvres, and its text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.sysid.candidates.catalogue import installed
from seals.sysid.experiment_design.flight import Rehearsal, Run
from seals.sysid.experiment_design.manoeuvres import Manoeuvre, manoeuvres
from seals.sysid.experiment_design.scene import Scene
from seals.sysid.experiment_design.separation import NOTHING, Contest, Gram, Supposed, difference
from seals.sysid.predictors.problem import Problem

SEPARATED = 0.9
"""Expected confidence from which on effects count as told apart."""
_CHANNELS = {
    "angular_velocity": "gyroscope",
    "specific_force": "accelerometer",
    "orientation": "attitude",
    "joint_position": "joint angles",
}


@dataclass(frozen=True, kw_only=True)
class Ranked:
    """Manoeuvre with the expected confidence of the diagnosis after it.

    Args:
        manoeuvre: what would be flown.
        contests: of every effect as the truth against every other one and against nothing.
        confidence: that the diagnosis is expected to give to the truth, whichever effect it is;
            for a single effect, the chance that it is found.
        separation: smallest chi-square that a wrong effect leaves.
        unsafe: why it must not be flown; empty when it may.
    """

    manoeuvre: Manoeuvre
    contests: tuple[Contest, ...]
    confidence: float
    separation: float
    unsafe: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the row of the table."""
        return {
            "manoeuvre": self.manoeuvre.name,
            "words": self.manoeuvre.words,
            "seconds": self.manoeuvre.seconds,
            "logs": self.manoeuvre.logs,
            "expected_confidence": round(self.confidence, 4),
            "separation": round(self.separation, 2),
            "unsafe": list(self.unsafe),
        }


@dataclass(frozen=True, kw_only=True)
class Flown:
    """Simulated manoeuvres with the inner products of their responses."""

    rehearsal: Rehearsal
    gram: Gram


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Plan of the next experiment: ranked manoeuvres.

    Args:
        problem: the log that left the question open.
        scene: room and powers of the vehicle.
        supposed: effects in question, at their supposed sizes.
        ranked: manoeuvres, the best first.
        flown: rehearsals behind the ranking.
        seconds: that planning took.
    """

    problem: Problem
    scene: Scene
    supposed: tuple[Supposed, ...]
    ranked: tuple[Ranked, ...]
    flown: tuple[Flown, ...] = field(repr=False)
    seconds: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects in question."""
        return tuple(s.name for s in self.supposed)

    @property
    def best(self) -> Ranked:
        """Proposed manoeuvre: a safe one, with a single log where that is enough."""
        safe = [r for r in self.ranked if not r.unsafe]
        if not safe:
            reasons = "; ".join(w for r in self.ranked[:1] for w in r.unsafe)
            raise ConfigError(
                f"no manoeuvre is safe with this vehicle: {reasons}.\nGive more room."
            )
        single = [r for r in safe if r.manoeuvre.logs == 1]
        first = single[0] if single else safe[0]
        if first.confidence < SEPARATED <= safe[0].confidence:
            return safe[0]
        return first

    @property
    def plain(self) -> Ranked:
        """The simplest manoeuvre, as a baseline."""
        simplest = manoeuvres(self.scene.kind)[0].name
        return next(r for r in self.ranked if r.manoeuvre.name == simplest)

    def run_of(self, ranked: Ranked) -> tuple[Flown, Run]:
        """Simulated flights and first run of a manoeuvre."""
        for flown in self.flown:
            for run in flown.rehearsal.runs:
                if run.manoeuvre.name == ranked.manoeuvre.name:
                    return flown, run
        raise ConfigError(
            f"'{ranked.manoeuvre.name}' was not rehearsed.\nChoose one of those listed by the plan."
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the plan in the form of ``plan.json`` and of ``next_experiment``."""
        return {
            "effects": list(self.names),
            "supposed": {s.name: {k: float(v) for k, v in s.values.items()} for s in self.supposed},
            **self.best.to_dict(),
            "sentence": proposal(self),
            "ranked": [r.to_dict() for r in self.ranked],
            "planning_seconds": round(self.seconds, 2),
        }


def sum_of(manoeuvre: Manoeuvre, flown: Sequence[Flown]) -> Floats:
    """Inner products over all windows of a manoeuvre, shape (c, c)."""
    size = flown[0].gram.table.shape[1]
    total = np.zeros((size, size))
    for f in flown:
        total += f.gram.table[_windows_of_run(f, manoeuvre)].sum(axis=0)
    return total


def _windows_of_run(flown: Flown, manoeuvre: Manoeuvre) -> Floats:
    """Return a mask of the windows of a manoeuvre, shape (W,)."""
    first = flown.gram.windows.rows[:, 0]
    inside = np.zeros(len(first), dtype=bool)
    for run in flown.rehearsal.runs:
        if run.manoeuvre.name == manoeuvre.name:
            inside |= (first >= run.first) & (first < run.last)
    return inside


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
        lines.append("No manoeuvre of the library would do so with certainty.")
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
            f"{plan.names[0]} of its assumed size would then show {said}"
            f" (expected probability of finding it {percent(best.confidence)})"
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
        chosen = _windows_of_run(flown, best.manoeuvre)
        if chosen.any():
            pair = (names.index(worst.truth), rival)
            seen = difference(flown.gram, sums, chosen, pair)
    loudest = max(seen, key=lambda c: seen[c][1])
    return (
        f"by a chi-square of {worst.separation:.3g} beyond all tolerances,"
        f" mostly in the {_CHANNELS.get(loudest, loudest)}"
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
