"""Diagnosis of several runs of an experiment, and its output for `diagnosis.json`."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.compare.score import score_case
from seals.compare.settings import CompareSettings
from seals.compare.variants import FittedValue, ModelVariant
from seals.logs import Log, refuse_if_bad
from seals.run.progress import progress
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.candidates.reported_values import with_interval
from seals.sysid.decision.cross_validation import RunsAnswer, RunsClaim, decide
from seals.sysid.decision.verdict import Verdict
from seals.sysid.predictors.batch import prepare, spread_of
from seals.sysid.scores.cross_validation import ValidatedHypothesis
from seals.sysid.selection.run_models import RunsSearch, expected_fits, search_runs

_GRAIN = 32
"""Units of the progress bar for every hypothesis: it looks up at multiples of this."""


@dataclass(frozen=True, kw_only=True)
class RunsDiagnosis:
    """Result of a diagnosis of several runs: the effects missing in their model.

    Args:
        name: of the experiment, or of the log where each is fitted by itself.
        search: what was tried.
        answer: verdict and claims.
        variants: nominal and chosen model as model variants, for tables and pictures.
        seconds: that it took.
    """

    name: str
    search: RunsSearch
    answer: RunsAnswer
    variants: tuple[ModelVariant, ...]
    seconds: float

    def rms(self, channel: str, *, after: bool) -> float:
        """Error on held-out runs; without any, on all runs, each held out in turn."""
        unseen = bool(self.search.validator.experiment.unseen)
        return self.variants[-1 if after else 0].rms(channel, held_out=unseen)

    def held_out(self) -> dict[str, float]:
        """Mean squared errors on held-out training runs, in units of the noise floor."""
        nominal, best = self.search.nominal, self.search.best
        return {
            "before": float(np.mean(np.expm1(2.0 * nominal.held_out_log_rms))),
            "after": float(np.mean(np.expm1(2.0 * best.held_out_log_rms))),
            "noise_floor": 1.0,
        }

    def to_dict(self) -> dict[str, Any]:
        """Return the diagnosis in the form of ``diagnosis.json``."""
        answer, found = self.answer, self.search
        effects = [_effect(found, c) for c in answer.claims]
        if answer.verdict is Verdict.ambiguous:
            effects += [_effect(found, c) for c in answer.others]
        channels = sorted({c for case in found.validator.experiment.cases for c in case.measured})
        return {
            "experiment": self.name,
            "verdict": answer.verdict.value,
            "effects": effects,
            "ambiguous_with": [[c.candidate.label, *c.rivals] for c in answer.claims if c.rivals],
            "next_experiment": None,
            "held_out_error": self.held_out(),
            "rms": {
                c: {k: _plain(self.rms(c, after=k == "after")) for k in ("before", "after")}
                for c in channels
            },
            "tried": [_tried(found, h) for h in found.tried],
            "unseen_by_any_channel": [
                c.label for c in found.validator.experiment.candidate_set.unobservable
            ],
            "reasons": list(answer.reasons),
            "seconds": self.seconds,
        }


def diagnose_runs(settings: CompareSettings, logs: Sequence[Log]) -> list[RunsDiagnosis]:
    """Name the effects that the model of an experiment is missing.

    Args:
        settings: the recipe, as for ``seals compare``.
        logs: its measurements.

    Returns:
        One diagnosis, or one for every log where the recipe fits each by itself.

    Raises:
        LogError: a log fails the data check, or nothing in it can be predicted.
        ConfigError: a name or a key does not fit.
    """
    for log in logs:
        refuse_if_bad(log)
    groups = [[log] for log in logs] if settings.per_log else [list(logs)]
    return [_one(settings, g, g[0].name if settings.per_log else settings.name) for g in groups]


def _one(settings: CompareSettings, logs: Sequence[Log], name: str) -> RunsDiagnosis:
    began = time.perf_counter()
    experiment = prepare(settings, logs)
    total = _GRAIN * expected_fits(experiment)
    with progress(f"naming {name}", total) as tell:
        # an estimate: the bar waits before its end until the answer is there
        found = search_runs(experiment, tell=lambda n: tell(min(_GRAIN * int(n), total - _GRAIN)))
        answer = decide(found)
    models = [found.nominal, *([found.best] if found.best.candidates else [])]
    return RunsDiagnosis(
        name=name,
        search=found,
        answer=answer,
        variants=tuple(_variant(found, h) for h in models),
        seconds=time.perf_counter() - began,
    )


def _variant(found: RunsSearch, model: ValidatedHypothesis) -> ModelVariant:
    """Evaluate a model on all runs, each by a fit that left it out if none is held out."""
    experiment = found.validator.experiment
    unseen = found.validator.unseen(model)
    trained = model.fit.predicted if experiment.unseen else model.held
    predicted = {**trained, **unseen.predicted}
    deviations = {**model.fit.deviations, **unseen.deviations}
    spread = dict(zip(model.fit.free, spread_of(model.fit, experiment), strict=True))
    fitted = [
        FittedValue(
            key=experiment.names[k],
            value=float(model.fit.values[k]),
            sigma=float(spread[k]),
            unit=experiment.parameter(k).unit,
            at_bound=bool(model.fit.values[k] in experiment.parameter(k).bounds),
        )
        for k in model.fit.free
    ]
    cases = list(enumerate(experiment.cases))
    return ModelVariant(
        name=model.label,
        effects=[*experiment.candidate_set.nominal, *(c.instance for c in model.candidates)],
        fitted=fitted,
        scores=[score_case(case, predicted[k]) for k, case in cases],
        predicted=[predicted[k] for k, _ in cases],
        deviations=[deviations[k] for k, _ in cases],
        start_sigma=[0.0 * deviations[k] for k, _ in cases],
    )


def _effect(found: RunsSearch, claim: RunsClaim) -> dict[str, Any]:
    return {
        "name": claim.candidate.name,
        "law": claim.candidate.law,
        "confidence": claim.confidence,
        "parameters": _parameters(found, claim.candidate, claim.hypothesis),
    }


def _parameters(
    found: RunsSearch, candidate: Candidate, model: ValidatedHypothesis
) -> dict[str, Any]:
    experiment = found.validator.experiment
    spread = dict(zip(model.fit.free, spread_of(model.fit, experiment), strict=True))
    out = {}
    for name in candidate.keys:
        k = found.validator.index[name]
        value = float(model.fit.values[k])
        out[name.partition(".")[2]] = with_interval(
            value, float(spread[k]), experiment.parameter(k).unit
        )
    return out


def _tried(found: RunsSearch, model: ValidatedHypothesis) -> dict[str, Any]:
    margin = found.validator.margin(model, found.nominal)
    return {
        "effects": [c.label for c in model.candidates],
        "gain": margin.mean,
        "standard_error": margin.error,
        "price": model.complexity_penalty,
        "seen": float(model.training_log_rms.mean()),
        "held_out": float(model.held_out_log_rms.mean()),
    }


def _plain(value: float) -> float | None:
    return value if math.isfinite(value) else None
