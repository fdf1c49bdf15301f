"""Second look at a log whose stated numbers were moved too far to be chance.

A wrong mass, lag or bias is itself an effect of the library. As long as its number may move within
a tolerance, the fit of every model takes it over, and no effect brings evidence. With the number
held at its stated value, the effects compete to explain what it did.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from seals.sysid.candidates.parameters import Candidate, CandidateSet
from seals.sysid.decision.evidence import EvidenceAnswer
from seals.sysid.decision.moved_numbers import MovedNumber
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.problem import Linearisation, Problem
from seals.sysid.scores.held_out import held_out_misfit
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

_MOST = 5
"""Effects that a second search looks for at most."""


def numbers_to_hold(problem: Problem, answer: EvidenceAnswer) -> tuple[str, ...]:
    """Return the keys of the numbers that a second search holds at their stated values.

    A moved number is held together with the others of its effect, such as the three coordinates of
    a centre of gravity, or alone where the effect adds to it, as a payload does to a stated mass;
    one that no effect of the library changes keeps its tolerance.

    Args:
        problem: of the log.
        answer: of the first search.
    """
    known = problem.plant.candidate_set
    moved = {m.key for m in answer.stated_wrong}
    keys = [c.all_keys for c in known.candidates if moved & set(c.all_keys)]
    keys += [(key,) for key in sorted(moved) if _added_to(key, known.candidates, known)]
    found = dict.fromkeys(k for own in keys for k in own)
    return tuple(k for k in found if known.parameters[k].tolerance > 0.0)


def _added_to(key: str, candidates: Iterable[Candidate], known: CandidateSet) -> bool:
    """Return true for a vehicle's own number that a candidate of the same law adds to.

    Waves are a candidate, but no effect.
    """
    own = known.effects.get(key.partition(".")[0])
    laws = (known.effects.get(c.instance) for c in candidates)
    return own is not None and any(type(law) is type(own) for law in laws)


def with_exact(problem: Problem, keys: Iterable[str], *, found: int = 0) -> Problem:
    """Return the problem with some stated numbers taken as exact; no fit moves them.

    Args:
        problem: of the log.
        keys: of the numbers' parameters.
        found: effects that the first search found.
    """
    known, held = problem.plant.candidate_set, set(keys)
    parameters = {
        k: replace(p, tolerance=0.0) if k in held else p for k, p in known.parameters.items()
    }
    # each effect behind them comes on top of those that the first search found
    more = len({k.partition(".")[0] for k in held})
    effects = max(known.budget.effects, min(found + more, _MOST))
    budget = replace(known.budget, effects=effects)
    exact = replace(known, parameters=parameters, budget=budget)
    plant = ExtendedModel(problem.vehicle, exact, problem.samples, parts=problem.plant.parts)
    fitter = Linearisation.of(problem.fitter).fitter(plant)
    return replace(problem, plant=plant, fitter=fitter)


def explains_as_well(
    first: EvidenceAnswer, second: EvidenceAnswer, model: EvidenceHypothesis
) -> bool:
    """Return whether named effects stand for the numbers that a first answer moved.

    Those of the first answer, or what it could not tell from them, are among them, and the
    held-out misfit does not rise by more than the share that a name must let it fall, or stays
    below that of the stated noise, where the model that predicts better follows noise.

    Args:
        first: answer with the numbers free within their tolerances.
        second: answer with some of them held.
        model: of the first answer.
    """
    names = {c.name for c in second.claims}
    if not names or any(not names & {c.name, *c.rivals, *c.alike} for c in first.claims):
        return False
    found = second.claims[0].hypothesis
    most = 1.0 + found.fitter.candidate_set.policy.error_falls
    return held_out_misfit(found) <= max(most * held_out_misfit(model), 1.0)


def still_wrong(
    problem: Problem, first: EvidenceAnswer, second: EvidenceAnswer, held: Iterable[str]
) -> tuple[MovedNumber, ...]:
    """Return the numbers that are wrong by a second answer that explains as much.

    A number that was held and whose own effect is not named is right: another effect did what
    had moved it, such as late sensors a delay of the commands. One that lies too far off beside
    the named effects is wrong as well: only what the first answer left unexplained had hidden it.

    Args:
        problem: of the log.
        first: answer with the numbers free within their tolerances.
        second: answer with some of them held.
        held: keys of the numbers held.
    """
    known = problem.plant.candidate_set
    named = [claim.candidate for claim in second.claims]
    mine = {key for candidate in named for key in candidate.all_keys}
    right = {key for key in set(held) - mine if not _added_to(key, named, known)}
    wrong = {m.key: m for m in (*second.stated_wrong, *first.stated_wrong)}
    return tuple(
        sorted((m for k, m in wrong.items() if k not in right), key=lambda m: -abs(m.sigmas))
    )
