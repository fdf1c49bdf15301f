"""Effects that no flight distinguishes from a data sheet error, such as mass from thrust.

A vehicle in air whose mass and inertia are larger by a share than stated moves as one whose thrusts
are smaller: F / m and T / I are all that its motion shows. Where a hull displaces water, weight is
measured against buoyancy, and the two come apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from seals.sysid.decision.answer import Claim
from seals.sysid.predictors.linear_screen import candidate_keys
from seals.sysid.predictors.problem import Problem
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, scored
from seals.sysid.selection.search import Search

EvidenceClaim = Claim[EvidenceHypothesis]


def with_data_sheet(
    problem: Problem, search: Search[EvidenceHypothesis], claims: Sequence[EvidenceClaim]
) -> list[EvidenceClaim]:
    """Add the data sheet errors to each claim that they explain equally well.

    Two claims that are sides of one proportion become a single one, the set of all its sides, where
    the vehicle's own stated value alone explains the log as well as both.

    Args:
        problem: of the log.
        search: result of the search.
        claims: effects that were found, best first.
    """
    best = search.best
    sheet = next(iter(best.fitter.candidate_set.data_sheet), None)
    if sheet is None:
        return list(claims)
    word = sheet.identification.data_sheet
    # what acts for a time is no error of the data sheet
    constant = [c for c in claims if c.candidate.activity is None]
    sides = [c for c in constant if c.candidate.identification.data_sheet == word]
    if len(sides) > 1:
        own = {c.index for c in sides}
        rest = tuple(c for k, c in enumerate(best.candidates) if k not in own)
        together = (*rest, sheet)
        keys = candidate_keys(together)
        start = {k: v for k, v in best.fit.values.items() if k in keys}
        fit = best.fitter.fit(keys, start=start)
        stated = scored(together, fit, best.fitter, search.nominal)
        if stated.score > best.score - problem.policy.indistinguishable:
            return _one_set(claims, sides, stated)
    if len(sides) == 1 and not problem.vehicle.has_water:
        return [_beside(c, sheet.name) if c is sides[0] else c for c in claims]
    return list(claims)


def _one_set(
    claims: Sequence[EvidenceClaim], sides: Sequence[EvidenceClaim], stated: EvidenceHypothesis
) -> list[EvidenceClaim]:
    """Replace the claims on both factors of a ratio by one claim with all names."""
    index = len(stated.candidates) - 1
    name = stated.candidates[index].name
    names = tuple(c.name for c in sides if c.name != name)
    claim = Claim(
        hypothesis=stated,
        index=index,
        confidence=1.0 / (1.0 + len(names)),
        rivals=names,
        alike=names,
        shared=float(len(names)),
    )
    return [claim, *(c for c in claims if c not in sides)]


def _beside(claim: EvidenceClaim, name: str) -> EvidenceClaim:
    """Add a name to a claim, first among those that resemble it."""
    if name == claim.name:
        return claim
    others = tuple(n for n in claim.alike if n != name)
    return replace(claim, alike=(name, *others[:2]))
