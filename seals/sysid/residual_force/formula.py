"""Formula of at most three terms for a residual force that no effect explains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.frames import rotate
from seals.sysid.candidates.catalogue import formula_effect
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.laws import DRIVEN
from seals.sysid.residual_force.place import Pull, pull
from seals.sysid.residual_force.regress import FLOOR, Table, gain
from seals.sysid.residual_force.residual import Residual
from seals.sysid.residual_force.spectrum import Spectrum
from seals.sysid.residual_force.spot import Spot, spot
from seals.sysid.residual_force.terms import Term, basis_of

MOST = 3
"""Terms at most."""
_TRIED = 6
"""Terms that are judged on held-out blocks in every round."""
_EDGES = np.linspace(0.1, 0.9, 9)
_POWERS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)


@dataclass(frozen=True, kw_only=True)
class Formula:
    """Formula fitted to the residual force of a log.

    Args:
        terms: most telling first.
        share: of the misfit's excess over the noise floor that it explains on blocks that were
            held out.
        share_sd: its standard error, from a block bootstrap.
        after: misfit per number observed on held-out blocks, over the noise floor.
    """

    terms: tuple[Term, ...]
    share: float
    share_sd: float
    after: float

    @property
    def medium(self) -> str:
        """Medium in which the force acts."""
        return self.terms[0].medium

    def parameters(self) -> dict[str, float]:
        """Parameters of the effect ``formula``; those left out are zero or unused."""
        out: dict[str, float] = {}
        for term in self.terms:
            out |= term.parameters()
        return out

    def to_dict(self) -> dict[str, Any]:
        """Return terms, explained fractions, and the effect entry for a simulation."""
        return {
            "text": str(self),
            "terms": [term.to_dict() for term in self.terms],
            "share": self.share,
            "share_sd": self.share_sd,
            "after": self.after,
            "effect": {
                "name": formula_effect(),
                "medium": self.medium,
                "parameters": self.parameters(),
            },
        }

    def __str__(self) -> str:
        """Terms joined by plus signs."""
        return "  +  ".join(str(term) for term in self.terms)


def formula(
    found: Evidence,
    around: Conditions,
    left: Residual,
    places: Sequence[Pull | Spot | None],
    lines: Spectrum,
) -> Formula | None:
    """Add terms one at a time while the held-out misfit decreases.

    Args:
        found: evidence of the log.
        around: conditions at the knots.
        left: the missing force.
        places: points about which the force was found to act.
        lines: lines of its spectrum.

    Returns:
        The formula; None when no term explains anything on held-out blocks.
    """
    chosen: list[Term] = []
    before = now = found.before
    for _ in range(MOST):
        candidates = _candidates(around, chosen, places, lines)
        judged = _judged(found, around, chosen, candidates)
        if judged is None:
            break
        term, held = judged
        step = gain(now, held, found)
        won = gain(before, held, found).share - gain(before, now, found).share
        sure = step.total > max(2.0 * step.total_sd, 25.0) or (
            step.total > 25.0 and float(np.mean(step.windows > -2.0)) > 0.8 and step.sure
        )
        if won < found.policy.term_share or not sure:
            break
        chosen, now = [*chosen, term], held
        if len(chosen) < MOST:
            # force of the chosen terms in world axes
            wrench = wrench_of(_fitted(found, around, chosen), around)
            known = rotate(around.turn, wrench[:, :3])
            places = [fit(found, around, left, without=known) for fit in (pull, spot)]
    if not chosen:
        return None
    whole = gain(before, now, found)
    return Formula(
        terms=_fitted(found, around, chosen),
        share=whole.share,
        share_sd=whole.share_sd,
        after=float(now.sum()) / (FLOOR * found.observed),
    )


def _candidates(
    around: Conditions,
    chosen: Sequence[Term],
    places: Sequence[Pull | Spot | None],
    lines: Spectrum,
) -> list[Term]:
    """Return the terms that may come next."""
    media = ("any", "water", "air") if around.crossing and not chosen else ("any",)
    if chosen:
        media = (chosen[0].medium,)
    out = []
    for medium in media:
        plain = ("push", "hold", "twist", "lift", "spin", "wheel")
        out += [Term(kind=k, medium=medium) for k in plain]
        out += [Term(kind="drag", medium=medium, settings={"drag_power": p}) for p in _POWERS]
        if around.drive is not None:
            out.append(Term(kind=DRIVEN, medium=medium))
        for place in places:
            if place is not None:
                kind = "pull" if isinstance(place, Pull) else "spot"
                out.append(Term(kind=kind, medium=medium, settings=place.settings))
        if lines.chance < 0.5:
            rate = {"rate": 2.0 * np.pi * lines.peak}
            kind = "swing" if lines.axis.startswith("force") else "shake"
            out.append(Term(kind=kind, medium=medium, settings=rate))
        if around.ground is not None:
            level = {"level": around.ground}
            out += [
                Term(kind="near", medium=medium, settings=level | {"near_power": p})
                for p in (1.0, 2.0, 3.0)
            ]
        out += _borders(around, medium)
    taken = {t.kind for t in chosen}
    if taken & {"pull", "spot"}:
        # an effect knows one place
        taken |= {"pull", "spot"}
    return [t for t in out if t.kind not in taken]


def _borders(around: Conditions, medium: str) -> list[Term]:
    """Forces on one side of planes across the world's axes, at several positions."""
    out = []
    for axis in range(3):
        values = around.position[:, axis]
        if np.ptp(values) < 0.2:
            continue
        for edge in np.quantile(values, _EDGES):
            normal = tuple(1.0 if k == axis else 0.0 for k in range(3))
            for sign in (1.0, -1.0):
                settings = {
                    "normal": tuple(sign * n for n in normal),
                    "edge": sign * float(edge),
                    "width": 0.05,
                }
                out.append(Term(kind="beyond", medium=medium, settings=settings))
    return out


def _judged(
    found: Evidence, around: Conditions, chosen: Sequence[Term], candidates: Sequence[Term]
) -> tuple[Term, Floats] | None:
    """Best next term on held-out blocks, and the misfit of the windows with it."""
    pieces = [basis_of(t.kind, t.settings, around, t.medium) for t in (*chosen, *candidates)]
    ends = np.cumsum([0, *(p.shape[2] for p in pieces)])
    table = Table(found, np.concatenate(pieces, axis=2))
    columns = [list(range(a, b)) for a, b in pairwise(ends.tolist())]
    beside = [c for group in columns[: len(chosen)] for c in group]
    penalty = found.policy.term_price
    ranked = []
    for term, own in zip(candidates, columns[len(chosen) :], strict=True):
        ranked.append((table.fall(own, beside) - penalty * term.freedom, term, own))
    ranked.sort(key=lambda r: -r[0])
    tried: list[tuple[float, Term, Floats]] = []
    seen: dict[str, int] = {}
    for fall, term, own in ranked:
        seen[term.kind] = seen.get(term.kind, 0) + 1
        if fall <= 0.0 or seen[term.kind] > 2 or len(tried) >= 2 * _TRIED:
            continue
        held = table.held_out([*beside, *own])
        tried.append((float(held.sum()) + penalty * term.freedom, term, held))
    if not tried:
        return None
    # of terms that do about as well the simplest
    excess = float(found.before.sum()) - FLOOR * found.observed
    near = min(t[0] for t in tried) + max(found.policy.term_simpler * excess, 10.0)
    best = min((t for t in tried if t[0] <= near), key=lambda t: (t[1].freedom, t[0]))
    return best[1:]


def _fitted(found: Evidence, around: Conditions, chosen: Sequence[Term]) -> tuple[Term, ...]:
    """Terms with the coefficients of the whole log."""
    pieces = [basis_of(t.kind, t.settings, around, t.medium) for t in chosen]
    table = Table(found, np.concatenate(pieces, axis=2))
    every = list(range(table.width))
    values, spread = table.solve(every), np.sqrt(np.diag(table.covariance(every)))
    out, first = [], 0
    for term, piece in zip(chosen, pieces, strict=True):
        own = slice(first, first + piece.shape[2])
        first = own.stop
        out.append(
            Term(
                kind=term.kind,
                medium=term.medium,
                settings=term.settings,
                coefficients=tuple(map(float, values[own])),
                sd=tuple(map(float, spread[own])),
            )
        )
    return tuple(out)


def wrench_of(terms: Sequence[Term], around: Conditions) -> Floats:
    """Return the wrench of fitted terms at the knots, body axes, shape (n, 6)."""
    out = np.zeros((len(around.time), 6))
    for term in terms:
        basis = basis_of(term.kind, term.settings, around, term.medium)
        out += basis @ np.array(term.coefficients)
    return out


def options(found: Formula) -> Mapping[str, Any]:
    """Return the arguments of the effect, for example ``EffectFormula(**options(formula))``."""
    from seals.effects.effect import MediumKind

    return {**found.parameters(), "medium": MediumKind(found.medium)}
