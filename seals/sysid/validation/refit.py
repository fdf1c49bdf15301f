"""Refit of named effects and nuisance parameters on the log of the diagnosis.

The written answer holds what a reader wants to know. An overlay needs a little more: in which
medium, on which link, and the nominal values that were fitted alongside.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from seals.arrays import Floats
from seals.errors import ConfigError, suggestion
from seals.logs.log import Log
from seals.sound_numbers import refuse_undefined, trials
from seals.sysid.candidates.activity import ACTIVE, read_activity
from seals.sysid.candidates.parameters import Candidate, CandidateSet
from seals.sysid.data.robot_description import RobotDescription
from seals.sysid.predictors.linear_screen import candidate_keys
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.problem import (
    Problem,
    follow_measurements,
    linearise_model,
    prepare,
    rewindowed,
    typical_speeds,
)
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.selection.nominal_model import estimate_disturbance
from seals.sysid.validation.answer import Finding

_LATE = 2e-3
"""Delay of the inertial sensors from which on the windows follow it [s]."""
_MOST_CHOICES = 256
"""Choices of variants that are fitted: two effects of a vehicle with 16 rotors."""


@dataclass(frozen=True, kw_only=True)
class Refit:
    """Named effects and nominal values fitted to the log of the diagnosis.

    Args:
        candidates: one for each effect, in the order of the answer.
        values: of all keys.
        spread: 1-sigma of all keys.
        candidate_set: that knows the keys.
        own: names of the nominal model's effects.
        speeds: typical ones of the log [m/s], shape (3,).
        alone: nominal values that a fit without the effects chooses, by key.
    """

    candidates: tuple[Candidate, ...]
    values: Mapping[str, float]
    spread: Mapping[str, float]
    candidate_set: CandidateSet
    own: tuple[str, ...]
    speeds: Floats
    alone: Mapping[str, float]

    @property
    def nominal(self) -> dict[str, dict[str, float]]:
        """Fitted nominal values; zero where a named effect changes the same value."""
        taken = set(candidate_keys(self.candidates))
        out = {}
        for key in self.candidate_set.tolerances:
            own = key in taken
            out[key] = {
                "value": 0.0 if own else self.values[key],
                "sd": 0.0 if own else self.spread[key],
                "alone": self.alone[key],
            }
        return out


@trials()
def refit(
    log: Log,
    finding: Finding,
    *,
    robot: RobotDescription | None = None,
    names: Sequence[str] = (),
) -> Refit:
    """Fit the effects of a diagnosis again, starting from its values.

    Args:
        log: in which they were found, or several joined ones.
        finding: effects to fit.
        robot: as its folder describes it; None for the vehicle of the metadata.
        names: of the logs in the diagnosis; the log's own when left out.

    Raises:
        ConfigError: an effect is none that this vehicle could be missing, or has too many variants.
        LogError: the log cannot be used.
    """
    problem = prepare(log, robot=robot)
    choices = [
        [_acting(c, effect, names or (log.name,)) for c in candidates_for(problem, effect)]
        for effect in finding.effects
    ]
    _refuse_many(choices)
    fits = [(combo, *_fitted(problem, combo, finding)) for combo in itertools.product(*choices)]
    combo, fit, fitter = min(fits, key=lambda f: f[1].cost)
    # the model holds an effect as it is while it acts
    own = {key: key.removesuffix(ACTIVE) for key in fit.keys}
    values = {own[key]: value for key, value in fit.values.items()}
    spread = {own[key]: fit.spread(key) for key in fit.keys}
    combo = tuple(c.throughout for c in combo)
    for candidate, effect in zip(combo, finding.effects, strict=True):
        values |= stated(candidate, effect, fitter.candidate_set)
    refuse_undefined("fit", values.values())
    return Refit(
        candidates=combo,
        values=values,
        spread=spread,
        candidate_set=fitter.candidate_set,
        own=tuple(problem.vehicle.effects),
        speeds=typical_speeds(problem.fitter.trajectory),
        alone=estimate_disturbance(problem).fit.values,
    )


def _refuse_many(choices: list[list[Candidate]]) -> None:
    """Refuse effects that leave too many variants open.

    Raises:
        ConfigError: there are more choices than are fitted.
    """
    count = math.prod(map(len, choices))
    if count > _MOST_CHOICES:
        names = ", ".join(dict.fromkeys(found[0].name for found in choices if len(found) > 1))
        raise ConfigError(
            f"the diagnosis leaves {count:.3g} choices open, at most {_MOST_CHOICES} are fitted.\n"
            f"Give the variant (rotor, link) of: {names}; or diagnose the log again."
        )


def _acting(candidate: Candidate, effect: Mapping[str, Any], logs: Sequence[str]) -> Candidate:
    """Return the effect with its active times in some logs.

    Raises:
        ConfigError: it does not act there.
    """
    if "active" not in effect:
        return candidate
    entries = [entry for entry in effect["active"] if entry["log"] in logs]
    if not entries:
        others = ", ".join(str(entry["log"]) for entry in effect["active"])
        raise ConfigError(
            f"'{candidate.name}' does not act in log '{', '.join(logs)}'.\n"
            f"Give a log in which it does: {others}"
        )
    return candidate.acting(read_activity(entries, list(logs)))


def candidates_for(problem: Problem, effect: Mapping[str, Any]) -> list[Candidate]:
    """Return the variants of an effect that agree with a diagnosis.

    Raises:
        ConfigError: there is none.
    """
    every, name = problem.plant.candidate_set.candidates, str(effect["name"])
    given = {k: p["value"] for k, p in (effect.get("parameters") or {}).items()}
    given |= effect.get("variant") or {}
    if isinstance(link := effect.get("link"), str):
        names = problem.vehicle.robot.links
        link = names.index(link) if link in names else link
    given |= {} if link is None else {"link": link}
    found = [
        c
        for c in every
        if c.name == name
        and c.law == str(effect.get("law", ""))
        and all(given.get(k, v) == v for k, v in c.variant.items())
    ]
    if not found:
        raise ConfigError(
            f"'{name}' is none of the effects that this vehicle could be missing.\n"
            f"{suggestion(name, {c.name for c in every})}"
        )
    return found


def stated(
    candidate: Candidate, effect: Mapping[str, Any], candidate_set: CandidateSet
) -> dict[str, float]:
    """Return the values of a diagnosis by parameter key, nuisance parameters included.

    Raises:
        ConfigError: a parameter is a text.
    """
    given, beside = effect.get("parameters") or {}, effect.get("nuisance") or {}
    for name in {*candidate.reported} & {*given}:
        value = given[name]["value"]
        if isinstance(value, str):
            raise ConfigError(
                f"{candidate.name}: {name} is {value!r:.60}, a number belongs there.\n"
                "Diagnose the log again."
            )
    pairs = zip(candidate.keys, candidate.reported, strict=True)
    found = {key: float(given[name]["value"]) for key, name in pairs if name in given}
    names = ((key, candidate_set.parameters[key].parameter) for key in candidate.nuisance)
    return found | {
        key: float(beside[name]) - candidate_set.nominal_of(key)
        for key, name in names
        if name in beside
    }


def _fitted(problem: Problem, combo: tuple[Candidate, ...], finding: Finding) -> tuple[Fit, Fitter]:
    """Fit one choice of variants, linearised about that fit."""
    start: dict[str, float] = {}
    for candidate, effect in zip(combo, finding.effects, strict=True):
        start |= stated(candidate, effect, problem.plant.candidate_set)
    keys, fitter = candidate_keys(combo), estimate_disturbance(problem).fitter.acting(combo)
    delay = start.get(fitter.candidate_set.sensor_delay, 0.0)
    if delay > _LATE:
        fitter = rewindowed(fitter, delay=delay)
    fit = fitter.fit(keys, start=start)
    if problem.samples.posed and not problem.impact:
        gusts = fitter.windows.gusts
        fitter = linearise_model(fitter.plant, fitter.trajectory, fit.values, gusts=gusts)
    else:
        fitter = follow_measurements(fitter, keys, at=fit.values, rounds=1)
    return fitter.fit(keys, start={k: fit.values[k] for k in keys}), fitter
