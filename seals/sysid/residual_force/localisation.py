"""Analysis of a model's residual force: time course, location, dependences."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

from seals.errors import LogError
from seals.sysid.predictors.problem import Problem
from seals.sysid.residual_force.conditions import conditions
from seals.sysid.residual_force.dependence import Dependence, dependences
from seals.sysid.residual_force.evidence import evidence
from seals.sysid.residual_force.exponents import Exponent, exponents
from seals.sysid.residual_force.formula import Formula, formula
from seals.sysid.residual_force.lagged import Following, following
from seals.sysid.residual_force.place import Pull, pull
from seals.sysid.residual_force.regimes import Regime, regimes
from seals.sysid.residual_force.residual import Residual, residual
from seals.sysid.residual_force.signature import Findings, Signature, signature
from seals.sysid.residual_force.spectrum import Spectrum, spectrum
from seals.sysid.residual_force.spot import Spot, spot
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


@dataclass(frozen=True, kw_only=True)
class Localisation:
    """Residual force of a log: time course, location, dependences and formula.

    Args:
        residual: the free wrench over time.
        regimes: its size by condition.
        dependences: shares that functions of one quantity explain on held-out blocks.
        exponents: of power laws of speed, throttle and height.
        spectrum: sinusoids in it.
        following: how it goes with the commands; None without actuators.
        pull: a point that it points to or away from; None if nothing is missing.
        spot: a place about which it acts; None if nothing is missing.
        signature: all of this in words.
        formula: a law of at most three terms; None when none explains anything.
        seconds: that it took.
    """

    residual: Residual
    regimes: tuple[Regime, ...]
    dependences: tuple[Dependence, ...]
    exponents: tuple[Exponent, ...]
    spectrum: Spectrum
    following: Following | None
    pull: Pull | None
    spot: Spot | None
    signature: Signature
    formula: Formula | None
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Return the analysis as plain data, curves of at most 400 points."""
        parts = {
            name: None if (part := getattr(self, name)) is None else part.to_dict()
            for name in (
                "residual",
                "spectrum",
                "following",
                "pull",
                "spot",
                "signature",
                "formula",
            )
        }
        return parts | {
            "regimes": [r.to_dict() for r in self.regimes],
            "dependences": [d.to_dict() for d in self.dependences],
            "exponents": [e.to_dict() for e in self.exponents],
            "seconds": self.seconds,
        }


def residual_of(problem: Problem, hypothesis: EvidenceHypothesis) -> Residual:
    """Estimate the residual force of a model over time, without an analysis of it.

    Args:
        problem: the log made ready.
        hypothesis: model whose left-overs are looked at.
    """
    found = evidence(problem, hypothesis)
    return residual(found, conditions(hypothesis.fitter, found))


def locate_residual_force(
    problem: Problem, hypothesis: EvidenceHypothesis | None = None
) -> Localisation:
    """Analyse the residual force of a model: time course, location, dependences.

    Args:
        problem: the log made ready.
        hypothesis: model whose left-overs are looked at; the nominal one when left out. The effects
            it holds stay within the error bars of their fit.

    Raises:
        LogError: the log is too short for a time course.
    """
    begin = time.perf_counter()
    fitter = problem.fitter if hypothesis is None else hypothesis.fitter
    found = evidence(problem, hypothesis)
    around = conditions(fitter, found)
    left = residual(found, around)
    known = regimes(left, around)
    if not known:
        raise LogError(
            f"the log is too short: the residual force has {len(left.time)} points in time, "
            "too few to be evaluated.\nGive a longer log."
        )
    lines = spectrum(found, around)
    toward = pull(found, around, left) if left.missing else None
    near = spot(found, around, left) if left.missing else None
    parts = Findings(
        residual=left,
        regimes=known,
        dependences=dependences(found, around),
        exponents=exponents(found, around),
        spectrum=lines,
        following=following(found, around, left),
        places=(toward, near),
        jointed=problem.vehicle.robot.tree.joints > 0,
    )
    words = signature(parts)
    law = None
    # a signature without a ceiling blames no force
    if left.missing and "ceiling" in words.facts:
        law = formula(found, around, left, (toward, near), lines)
    return Localisation(
        residual=left,
        regimes=tuple(parts.regimes),
        dependences=tuple(parts.dependences),
        exponents=tuple(parts.exponents),
        spectrum=lines,
        following=parts.following,
        pull=toward,
        spot=near,
        signature=words,
        formula=law,
        seconds=time.perf_counter() - begin,
    )
