"""Ranking of manoeuvres by the expected separation of effects."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.sysid.experiment_design.flight import LOAD, Rehearsal, Run, rehearse
from seals.sysid.experiment_design.manoeuvres import Manoeuvre, manoeuvres
from seals.sysid.experiment_design.safety import breaches
from seals.sysid.experiment_design.scene import ARM, Scene, scene_of
from seals.sysid.experiment_design.separation import (
    Contest,
    Gram,
    Supposed,
    chance,
    confidence,
    expected_odds,
    gram_of,
)
from seals.sysid.experiment_design.supposed import supposed_of
from seals.sysid.predictors.problem import Problem, linearise_model
from seals.sysid.predictors.windows_fit import Fitter

SEPARATED = 0.9
"""Expected confidence from which on effects count as told apart."""
_QUICK = ("hover", "heave", "all axes", "arm swing")
"""Manoeuvres that are tried on a vehicle with an arm when time is short."""


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
    """Simulated manoeuvres with their linearised model."""

    rehearsal: Rehearsal
    fitter: Fitter
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
            f"'{ranked.manoeuvre.name}' was not rehearsed.\nChoose one that the plan lists."
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the plan in the form of ``plan.json`` and of ``next_experiment``."""
        from seals.sysid.experiment_design.words import proposal

        return {
            "effects": list(self.names),
            "supposed": {s.name: {k: float(v) for k, v in s.values.items()} for s in self.supposed},
            **self.best.to_dict(),
            "sentence": proposal(self),
            "ranked": [r.to_dict() for r in self.ranked],
            "planning_seconds": round(self.seconds, 2),
        }


def propose(
    problem: Problem,
    names: Sequence[str],
    *,
    known: Mapping[str, Mapping[str, float]] | None = None,
    quick: bool = True,
    seed: int = 0,
    tell: Callable[[int], None] = lambda done: None,
) -> Plan:
    """Choose the manoeuvre that separates effects best, or makes a single one most observable.

    Args:
        problem: the log made ready: vehicle, sensors, disturbance.
        names: of effects in the catalogue, the likeliest first; one for "does it act at all".
        known: fitted values by parameter key for some of the names; the others are fitted here.
        quick: leave out what a vehicle with an arm would take long to linearise.
        seed: of gusts and noise in the rehearsals.
        tell: takes the number of stages done, of `STAGES`.

    Raises:
        ConfigError: an effect is unknown for this vehicle, or given twice.
    """
    begin = time.perf_counter()
    if not names or len(set(names)) < len(names):
        raise ConfigError(
            f"effects=[{','.join(names)}] is not a set of effects.\n"
            "Give one effect, or several different ones: effects=[payload,thrust_coefficient]"
        )
    supposed = supposed_of(problem, names, known)
    tell(1)
    around = problem.fitter.trajectory.position.mean(axis=0) if problem.samples.posed else None
    scene = scene_of(problem.vehicle, around=around)
    chosen = manoeuvres(scene.kind)
    if quick and scene.kind == ARM:
        chosen = tuple(m for m in chosen if m.name in _QUICK)
    flown = [_flown(problem, scene, chosen, supposed, load=0.0, seed=seed)]
    tell(2)
    for load in sorted({x for m in chosen for x in m.loads if x}):
        loaded = [m for m in chosen if load in m.loads]
        flown.append(_flown(problem, scene, loaded, supposed, load=load, seed=seed))
    tell(STAGES)
    ranked = [_ranked(scene, m, flown) for m in chosen]
    ranked.sort(key=lambda r: (bool(r.unsafe), -r.separation))
    return Plan(
        problem=problem,
        scene=scene,
        supposed=supposed,
        ranked=tuple(ranked),
        flown=tuple(flown),
        seconds=time.perf_counter() - begin,
    )


STAGES = 3
"""Stages of a plan: sizes, rehearsals, rehearsals with a known load."""


def _flown(
    problem: Problem,
    scene: Scene,
    chosen: Sequence[Manoeuvre],
    supposed: Sequence[Supposed],
    *,
    load: float,
    seed: int,
) -> Flown:
    truth = supposed[0].values
    rehearsal = rehearse(problem, scene, chosen, truth, load=load, seed=seed)
    base = {LOAD: load * problem.vehicle.mass} if load else {}
    gusts = problem.fitter.windows.gusts
    fitter = linearise_model(rehearsal.plant, rehearsal.trajectory, base, gusts=gusts)
    return Flown(rehearsal=rehearsal, fitter=fitter, gram=gram_of(fitter, supposed, base))


def _ranked(scene: Scene, manoeuvre: Manoeuvre, flown: Sequence[Flown]) -> Ranked:
    """Compare all pairs of effects over the windows of one manoeuvre."""
    gram = flown[0].gram
    table = sum_of(manoeuvre, flown)
    count = len(gram.supposed)
    if count == 1:
        contests = [expected_odds(gram, table, 0, 1)]
        sure = chance(contests[0])
    else:
        # beside the others, every effect has to be told from nothing at all
        contests = [
            expected_odds(gram, table, a, b)
            for a, b in permutations(range(count + 1), 2)
            if a < count
        ]
        each = [confidence([c for c in contests if c.truth == s.name]) for s in gram.supposed]
        sure = float(np.mean(each))
    found = [w for f in flown for w in breaches(scene, f.rehearsal, manoeuvre)]
    return Ranked(
        manoeuvre=manoeuvre,
        contests=tuple(contests),
        confidence=sure,
        separation=min(c.separation for c in contests),
        unsafe=tuple(dict.fromkeys(found)),
    )


def sum_of(manoeuvre: Manoeuvre, flown: Sequence[Flown]) -> Floats:
    """Inner products over all windows of a manoeuvre, shape (c, c)."""
    size = flown[0].gram.table.shape[1]
    total = np.zeros((size, size))
    for f in flown:
        total += f.gram.table[windows_of_run(f, manoeuvre)].sum(axis=0)
    return total


def windows_of_run(flown: Flown, manoeuvre: Manoeuvre) -> Floats:
    """Return a mask of the windows of a manoeuvre, shape (W,)."""
    first = flown.fitter.windows.rows[:, 0]
    inside = np.zeros(len(first), dtype=bool)
    for run in flown.rehearsal.runs:
        if run.manoeuvre.name == manoeuvre.name:
            inside |= (first >= run.first) & (first < run.last)
    return inside
