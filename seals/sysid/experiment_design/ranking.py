"""Ranking of manoeuvres by how well they separate effects in rehearsals."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from itertools import permutations

import numpy as np

from seals.errors import ConfigError
from seals.frames import matrix_of
from seals.sysid.experiment_design.flight import LOAD, Rehearsal, rehearse
from seals.sysid.experiment_design.manoeuvres import LONGEST, Manoeuvre, manoeuvres
from seals.sysid.experiment_design.plan import Flown, Plan, Ranked, sum_of
from seals.sysid.experiment_design.scene import ARM, DROP, Scene, scene_of
from seals.sysid.experiment_design.separation import (
    Supposed,
    chance,
    confidence,
    expected_odds,
    gram_of,
)
from seals.sysid.experiment_design.supposed import supposed_of
from seals.sysid.predictors.problem import Problem, linearise_model

_QUICK = ("hover", "heave", "all axes", "arm swing")
"""Manoeuvres that are tried on a vehicle with an arm when time is short."""
_MARGIN = 0.1
"""Distance by which the room may be left [m]."""
_LEAN = 0.2
"""Angle by which the lean may exceed its bound in passing [rad]."""
_FAST = 1.6
"""Factor by which the speed may exceed its bound in passing."""


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
    return Flown(rehearsal=rehearsal, gram=gram_of(fitter, supposed, base))


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
    found = [w for f in flown for w in _breaches(scene, f.rehearsal, manoeuvre)]
    return Ranked(
        manoeuvre=manoeuvre,
        contests=tuple(contests),
        confidence=sure,
        separation=min(c.separation for c in contests),
        unsafe=tuple(dict.fromkeys(found)),
    )


def _breaches(scene: Scene, rehearsal: Rehearsal, manoeuvre: Manoeuvre) -> list[str]:
    """Return the limits that a manoeuvre violates, in words; empty when it is safe."""
    found = []
    if manoeuvre.seconds > LONGEST:
        found.append(f"it takes {manoeuvre.seconds:g} s, more than {LONGEST:g} s")
    for run in rehearsal.runs:
        if run.manoeuvre.name != manoeuvre.name:
            continue
        rows, trajectory = rehearsal.rows(run), rehearsal.trajectory
        place = trajectory.position[rows]
        if not np.isfinite(place).all():
            found.append("the vehicle is lost")
            continue
        if place[:, 2].min() < scene.low - _MARGIN:
            found.append(f"it descends to {place[:, 2].min():.2f} m, below {scene.low:.2f} m")
        if place[:, 2].max() > scene.high + _MARGIN:
            found.append(f"it rises to {place[:, 2].max():.2f} m, above {scene.high:.2f} m")
        if scene.kind == DROP:
            continue
        away = float(np.abs(place[:, :2] - scene.home[:2]).max())
        if away > scene.reach + _MARGIN:
            found.append(f"it moves {away:.1f} m, more than {scene.reach:g} m")
        speed = float(np.linalg.norm(trajectory.velocity[rows], axis=1).max())
        if speed > _FAST * scene.speed:
            found.append(f"it reaches {speed:.1f} m/s, more than {_FAST * scene.speed:.1f} m/s")
        up = matrix_of(trajectory.quaternion[rows])[:, 2, 2]
        lean = float(np.arccos(np.clip(up, -1.0, 1.0)).max())
        if lean > scene.tilt + _LEAN:
            found.append(f"it leans {np.degrees(lean):.0f} degrees")
    return found
