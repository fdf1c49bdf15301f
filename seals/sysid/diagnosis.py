"""Diagnosis of a log: result, and its output for `diagnosis.json`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from seals.errors import LogError
from seals.logs.log import Log
from seals.sound_numbers import refuse_undefined, trials
from seals.sysid.calibration.free_numbers import number_behind
from seals.sysid.calibration.stated import hull_of, stated_numbers
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.candidates.reported_values import deviation
from seals.sysid.data.join import join_logs
from seals.sysid.data.robot_description import RobotDescription
from seals.sysid.decision.evidence import EvidenceAnswer, decide
from seals.sysid.decision.exact_numbers import (
    explains_as_well,
    numbers_to_hold,
    still_wrong,
    with_exact,
)
from seals.sysid.decision.intervals import parameters
from seals.sysid.decision.moved_numbers import MovedNumber, moved_numbers
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict
from seals.sysid.predictors.problem import Problem, prepare
from seals.sysid.report.naming import log_names, parameter_words, unit_of
from seals.sysid.scores.held_out import held_out_by_log, held_out_misfit, stated_misfit
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection.log_search import search_log
from seals.sysid.selection.search import Search

_TOLD, _MOVED = 3.0, 3
"""Standard errors from which on a number within its tolerance is told, and how many are at most."""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """Result of a diagnosis: the effects missing in the model of a log.

    Args:
        problem: the log made ready.
        search: what was tried.
        answer: verdict and claims.
        held_out: misfit per degree of freedom on rows that no fit saw: ``stated`` of the stated
            model, ``before`` with its numbers fitted where that predicts better, ``after`` with the
            effects besides, and ``noise_floor``.
        seconds: that it took.
        source: path and checksum of the log, or a list of them, when it came from files.
        next_experiment: the flight that would settle what is open, as ``seals plan`` writes it.
        without: effects that were left out of the stated model.
        hull: link of the robot that has its one hull; empty for the base.
        given_log: word of the command line that gave the log, for the commands that come next.
        given_robot: words that gave the robot and what is left out, each behind a blank.
    """

    problem: Problem
    search: Search[EvidenceHypothesis]
    answer: EvidenceAnswer
    held_out: Mapping[str, float]
    seconds: float
    source: Mapping[str, Any] = field(default_factory=dict)
    next_experiment: Mapping[str, Any] | None = None
    without: tuple[str, ...] = ()
    hull: str = ""
    given_log: str = "log=FOLDER"
    given_robot: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the diagnosis in the form of ``diagnosis.json``."""
        answer = self.answer
        effects = [_effect(*one, self.logs) for one in self.reported]
        sets = [[claim.name, *claim.alike] for claim in answer.claims if claim.alike]
        nominal = self.nominal()
        return {
            "verdict": answer.verdict.value,
            "effects": effects,
            "fitted": self.fitted(),
            "ambiguous_with": sets,
            "next_experiment": self.next_experiment,
            "held_out_error": dict(self.held_out),
            "held_out_by_log": self.by_log(),
            "stated_wrong": self.stated_wrong(),
            "within_tolerance": self.within_tolerance(),
            "channels": [error.to_dict() for error in answer.channels.errors],
            "explained": answer.explained,
            "left_over": {
                "level": answer.disturbance_level.level,
                "gain": answer.disturbance_level.gain,
            },
            "reasons": list(answer.reasons),
            "tried": self.tried(),
            "nominal": nominal,
            "covariance": self.covariance(effects, nominal),
            "log": dict(self.source),
            "without": list(self.without),
            "seconds": self.seconds,
        }

    @property
    def reported(self) -> list[tuple[Candidate, EvidenceHypothesis, float]]:
        """Effects of the answer with their models and confidences: claims, then their rivals."""
        claims = self.answer.claims
        found = [(claim.candidate, claim.hypothesis, claim.confidence) for claim in claims]
        rivals = claims[0].rivals if self.answer.verdict is Verdict.ambiguous else ()
        for name in rivals:
            tried = (h for r in self.search.rounds for h in r)
            model = next(h for h in tried if h.candidates[-1].name == name)
            found.append((model.candidates[-1], model, (1.0 - claims[0].confidence) / len(rivals)))
        return found

    def fitted(self) -> list[dict[str, Any]]:
        """Effects of the best model, the named ones and those too uncertain or small for that."""
        best = self.search.best
        named = {claim.candidate.label for claim in self.answer.claims}
        return [
            {
                "name": c.name,
                **_place(c, best),
                "named": c.label in named,
                "parameters": parameters(c, best.fit, best),
                **_active(c, self.logs),
            }
            for c in best.candidates
        ]

    @property
    def logs(self) -> tuple[str, ...]:
        """Names of the logs."""
        given = self.source.get("logs") or [self.source]
        paths = [str(one["path"]) for one in given if "path" in one]
        spans = self.problem.samples.logs
        return log_names(paths) or tuple(s.name for s in spans) or ("log",)

    def by_log(self) -> list[dict[str, Any]]:
        """Held-out misfit of each of several logs, ``before`` and ``after``; empty for one log."""
        if len(self.problem.samples.logs) < 2:
            return []
        pairs = zip(
            self.logs,
            held_out_by_log(self.search.nominal),
            held_out_by_log(self.hypothesis),
            strict=True,
        )
        return [{"log": n, "before": float(b), "after": float(a)} for n, b, a in pairs]

    def stated_wrong(self) -> list[dict[str, Any]]:
        """Stated numbers that lie too far off to be chance, farthest first.

        Each has ``what`` (its name for ``seals calibrate`` where ``calibrates``), ``words``,
        ``stated``, ``found``, ``unit`` and ``sigma``, the change in tolerances. Where drives turn
        the other way, ``what`` is the name of their directions in ``file``, ``set`` are the right
        ones, and ``by`` says which number shows it.
        """
        return self._moved(self.answer.stated_wrong)

    def within_tolerance(self) -> list[dict[str, Any]]:
        """Stated numbers by which nothing is missing, though the stated model leaves much.

        Empty with any other verdict. Entries as those of `stated_wrong`, three at most: those that
        the log moves by more than `_TOLD` standard errors, first the one whose return to its stated
        value would cost most.

        Equation:
            The cost of the fit rises by (x / s)^2 where a number returns from its change x to none
            and all others are fitted again, with s the standard error of x (Wald).
        """
        if self.answer.verdict is not Verdict.nothing_missing:
            return []
        policy, wrong = self.problem.policy, {m.key for m in self.answer.stated_wrong}
        if not self.held_out["stated"] > policy.misfit_trusted:
            return []
        numbers = [m for m in moved_numbers(self.hypothesis) if m.key not in wrong]
        told = [m for m in numbers if abs(m.sigmas) > _TOLD * m.unknown > 0.0]
        told.sort(key=lambda m: -abs(m.sigmas) / m.unknown)
        return self._moved(told[:_MOVED])

    def _moved(self, numbers: Sequence[MovedNumber]) -> list[dict[str, Any]]:
        if not numbers:
            return []
        sets, vehicle = self.problem.plant.candidate_set, self.problem.vehicle
        known = stated_numbers(vehicle, sets, hull=self.hull).values()
        out = []
        for moved in numbers:
            changes = sets.parameters[moved.key].changes
            number = number_behind(sets, known, moved.key, vehicle.robot.links[0])
            slope = number.slope if number is not None and number.key == moved.key else 1.0
            slope = slope if changes is None else changes.slope
            value = sets.nominal_of(moved.key) if number is None else number.value
            value = value if changes is None else changes.value
            unit = unit_of(sets, moved.key, "") if number is None else number.unit
            fitted = value + slope * moved.change
            entry = {
                "what": moved.key if number is None else number.name,
                "calibrates": number is not None and number.allowed(fitted),
                "words": parameter_words(moved.key),
                "stated": value,
                "found": fitted,
                "unit": unit if changes is None else changes.unit,
                "sigma": moved.sigmas,
            }
            if number is not None and number.directions and value * fitted < 0.0:
                in_folder = bool(vehicle.written)
                drives, name = number.key.partition(".")[0], number.turned_by.rpartition(".")[2]
                entry |= {
                    "what": number.turned_by if in_folder else f"vehicle.{drives}.{name}",
                    "file": "robot.yaml" if in_folder else "meta.yaml",
                    "words": f"directions of {drives}",
                    "by": parameter_words(number.key),
                    "set": [-turn for turn in number.directions],
                }
            out.append(entry)
        return out

    def tried(self) -> list[dict[str, Any]]:
        """Candidate effects of the first search round with their scores, best first."""
        return [
            {"name": h.candidates[-1].name, "label": h.candidates[-1].label, "score": h.score}
            for h in (self.search.rounds[0] if self.search.rounds else ())
        ]

    def known(self) -> dict[str, dict[str, float]]:
        """Fitted values of every effect that was tried, by name and parameter."""
        out: dict[str, dict[str, float]] = {}
        chosen = [c.hypothesis for c in self.answer.claims]
        for h in (*chosen, *(self.search.rounds[0] if self.search.rounds else ())):
            for c in h.candidates:
                named = zip(c.throughout.all_keys, c.all_keys, strict=True)
                out.setdefault(c.name, {k: h.fit.values[key] for k, key in named})
        return out

    def nominal(self) -> dict[str, dict[str, float]]:
        """Fitted changes of the nominal values within their tolerances."""
        hypothesis = self.hypothesis
        fit = hypothesis.fit
        return {
            k: {"value": fit.values[k], "sd": fit.spread(k)}
            for k in hypothesis.fitter.tolerances
            if k not in fit.free
        }

    def covariance(
        self, effects: Sequence[Mapping[str, Any]], nominal: Mapping[str, Mapping[str, float]]
    ) -> dict[str, Any]:
        """Joint covariance of the parameters of all named effects and the nominal values.

        Args:
            effects: as reported, the claims first.
            nominal: fitted changes with their 1-sigma.

        Returns:
            ``parameters``, names such as ``effects.0.velocity_x`` and ``nominal.mass.mass``, and
            ``matrix``, one row for each, in the squares and products of the reported 1-sigma.
        """
        found = self.hypothesis
        rows: list[tuple[str, str, float]] = []
        for k, claim in enumerate(self.answer.claims):
            own, one = effects[k]["parameters"], claim.candidate
            rows += [
                (f"effects.{k}.{name}", key, deviation(own[name]))
                for key, name in zip(one.keys, one.reported, strict=True)
                if name in own and claim.hypothesis is found
            ]
        rows += [(f"nominal.{key}", key, value["sd"]) for key, value in nominal.items()]
        names, keys, spreads = zip(*rows, strict=True) if rows else ((), (), ())
        matrix = found.fit.joint_covariance(keys, spreads).tolist() if rows else []
        return {"parameters": list(names), "matrix": matrix}

    @property
    def hypothesis(self) -> EvidenceHypothesis:
        """Model of the answer: with the claimed effects, or the nominal one."""
        return self.answer.claims[0].hypothesis if self.answer.claims else self.search.nominal


@trials()
def diagnose(
    logs: Log | Sequence[Log],
    *,
    robot: RobotDescription | None = None,
    policy: DecisionPolicy | None = None,
    processes: int = 1,
    tell: Callable[[int], None] | None = None,
    searched: Callable[[Problem, Search[EvidenceHypothesis]], None] | None = None,
) -> Diagnosis:
    """Name the effects that the model of a vehicle is missing.

    Args:
        logs: one log or several of one vehicle, in the native format with all of ``meta.yaml``; the
            runs of all of them are fitted together.
        robot: of a robot folder; left out, the metadata describe the vehicle.
        policy: thresholds of the decisions; the standard ones when left out.
        processes: that share the fits.
        tell: called with the number of stages done.
        searched: called with each problem whose search is done, before it is decided; the last
            call has the problem and the search of the result.

    Raises:
        LogError: a log cannot be used, or the logs do not belong together.
    """
    begin = time.perf_counter()
    say = tell or (lambda stage: None)
    problem = prepare(join_logs(logs), policy=policy, robot=robot)
    say(1)
    found = search_log(problem, processes=processes, tell=lambda done: say(1 + done))
    if found.best.fit.cost == math.inf and math.isfinite(found.best.misfit):
        # differences of products that are all too large: rounding decides from here on
        raise LogError(
            "the fits are ill-conditioned for this log: the model diverges from the stated "
            "initial state."
            "\nGive a measured pose or velocity, a shorter span, or an initial state with a "
            "larger sigma."
        )
    if searched is not None:
        searched(problem, found)
    answer = decide(problem, found, processes=processes)
    chosen = answer.claims[0].hypothesis if answer.claims else found.nominal
    held = numbers_to_hold(problem, answer)
    if held:
        exact = with_exact(problem, held, found=len(answer.claims))
        again = search_log(exact, processes=processes)
        second = decide(exact, again, processes=processes)
        if explains_as_well(answer, second, chosen):
            problem, found = exact, again
            if searched is not None:
                searched(problem, found)
            answer = replace(second, stated_wrong=still_wrong(problem, answer, second, held))
            chosen = answer.claims[0].hypothesis
    stated = stated_misfit(found.nominal)
    # a number that a single manoeuvre tells is predicted badly by all the others: it stays
    before = min(held_out_misfit(found.nominal), stated)
    after = held_out_misfit(chosen) if answer.claims else before
    if problem.samples.posed:
        refuse_undefined("misfit", [before, after])
    held_out = {
        "stated": stated,
        "before": before,
        "after": after,
        "noise_floor": 1.0,
    }
    return Diagnosis(
        problem=problem,
        search=found,
        answer=answer,
        held_out=held_out,
        hull=hull_of(robot),
        seconds=time.perf_counter() - begin,
    )


def _effect(
    candidate: Candidate,
    hypothesis: EvidenceHypothesis,
    confidence: float,
    logs: Sequence[str],
) -> dict[str, Any]:
    candidate_set, values = hypothesis.fitter.candidate_set, hypothesis.fit.values
    found = {
        candidate_set.parameters[key].parameter: candidate_set.nominal_of(key) + values[key]
        for key in candidate.nuisance
    }
    return {
        "name": candidate.name,
        **_place(candidate, hypothesis),
        "confidence": confidence,
        "parameters": parameters(candidate, hypothesis.fit, hypothesis),
        **({"nuisance": found} if found else {}),
        **_active(candidate, logs),
    }


def _active(candidate: Candidate, logs: Sequence[str]) -> dict[str, Any]:
    """Return when the effect acts, if not throughout."""
    activity = candidate.activity
    return {} if activity is None else {"active": activity.to_list(logs)}


def _place(candidate: Candidate, hypothesis: EvidenceHypothesis) -> dict[str, Any]:
    """Return the medium or link of the effect, where its variants differ by it.

    Links of a robot folder are told by their names, those of a log by their numbers.
    """
    vehicle = hypothesis.fitter.plant.vehicle
    variant, out = candidate.variant, dict[str, Any]()
    if "medium" in variant:
        out["medium"] = "water" if variant["medium"] else "air"
    if candidate.law:
        out["law"] = candidate.law
    if "link" in variant:
        link = int(variant["link"])
        out["link"] = vehicle.robot.links[link] if vehicle.written else link
    return out
