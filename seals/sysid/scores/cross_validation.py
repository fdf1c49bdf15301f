"""Cross-validation over runs: held-out errors, gains with standard errors, complexity penalty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Floats
from seals.compare.solve import FitTask
from seals.least_squares import Tell
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.predictors.batch import Experiment, RunFitter
from seals.sysid.scores.hypothesis import Hypothesis
from seals.sysid.scores.innovations import autocorrelation, gain, innovations

_SIZES = (1.0, 0.1, 10.0)
"""Sizes from which a fit may set out, in those that are plausible."""
_PRIOR_RUNS = 2.0
"""Weight of the expected scatter of a run's error beside the scatter that was seen, in runs."""
_FEWEST_RUNS = 3
"""Runs below which innovations decide nothing."""
Set = tuple[tuple[Candidate, ...], Floats | None]
"""Candidates of a model, and the values from which its fit starts; None for its own ones."""


@dataclass(frozen=True, kw_only=True)
class ValidatedHypothesis(Hypothesis):
    """Hypothesis fitted to all training runs and cross-validated.

    Args:
        fit: on all training runs.
        folds: fits that lacked a part of the runs, by part.
        held_out_log_rms: log of the held-out error in units of the floor, by training run.
        training_log_rms: the same of the fit on all runs, on the runs that it saw.
        held: samples of every training run, predicted by the fit that lacked it.
        parameter_price: log error that every key of a candidate must bring.
    """

    fit: FitTask
    folds: tuple[FitTask, ...] = ()
    held_out_log_rms: Floats = field(default_factory=lambda: np.zeros(0))
    training_log_rms: Floats = field(default_factory=lambda: np.zeros(0))
    held: Mapping[int, dict[str, Floats]] = field(default_factory=dict)
    parameter_price: float = DecisionPolicy.parameter_price

    @property
    def complexity_penalty(self) -> float:
        """Penalty on the number of its parameters."""
        return self.parameter_price * sum(len(c.keys) for c in self.candidates)

    @property
    def log_rms(self) -> float:
        """Mean held-out log error with the complexity penalty."""
        return float(self.held_out_log_rms.mean()) + self.complexity_penalty


@dataclass(frozen=True, kw_only=True)
class Margin:
    """Difference of the held-out log errors of two hypotheses.

    Args:
        mean: of the log of the error ratio, prices included.
        error: standard error over runs.
        least: standard errors from which the difference is significant.
    """

    mean: float
    error: float
    least: float = DecisionPolicy.standard_errors

    @property
    def significant(self) -> bool:
        """True when the difference is significant."""
        return self.mean > self.least * self.error


class CrossValidator:
    """Cross-validator of hypotheses: fits with runs held out in turn.

    Args:
        experiment: runs and model.
        iterations: most steps of a fit.
        tell: takes the number of hypotheses that are done, with the share of those under way.
    """

    def __init__(
        self, experiment: Experiment, *, iterations: int = 10, tell: Tell | None = None
    ) -> None:
        self.experiment, self._tell, self._done = experiment, tell, 0
        self.solver = RunFitter(experiment, iterations=iterations)
        self.index = {n: k for k, n in enumerate(experiment.names)}
        self._known: dict[frozenset[Candidate], ValidatedHypothesis] = {}
        self.nominal = self.fitted([((), None)])[0]

    def fitted(self, sets: Sequence[Set]) -> list[ValidatedHypothesis]:
        """Fit several sets of candidates together, each from its own starting values.

        A set that was fitted before is not fitted again.
        """
        new = [s for s in sets if frozenset(s[0]) not in self._known]
        for found in self._fitted(new) if new else []:
            self._known[frozenset(found.candidates)] = found
        return [self._known[frozenset(s[0])] for s in sets]

    def _fitted(self, sets: Sequence[Set]) -> list[ValidatedHypothesis]:
        train = self.experiment.train
        near = self._known.get(frozenset())
        fits = [
            self.solver.nearest(
                [
                    FitTask(
                        free=self._free(candidates),
                        cases=train,
                        values=values,
                        deviations={} if near is None else dict(near.fit.deviations),
                    )
                    for values in self._outsets(candidates, start)
                ]
            )
            for candidates, start in sets
        ]
        self.solver.solve(fits, tell=self._part(len(sets), 0.0, 0.4))
        parts = sorted(set(self.experiment.fold.values()))
        folds = [[self._without(fit, part) for part in parts] for fit in fits]
        every = [t for row in folds for t in row]
        self.solver.solve(every, most=5, tell=self._part(len(sets), 0.4, 0.9))
        judged = [
            [self._held(t, self._cases(part), fit) for t, part in zip(row, parts, strict=True)]
            for row, fit in zip(folds, fits, strict=True)
        ]
        self.solver.solve([t for row in judged for t in row], most=5)
        self._done += len(sets)
        return [
            self._hypothesis(candidates, fit, row, held)
            for (candidates, _), fit, row, held in zip(sets, fits, folds, judged, strict=True)
        ]

    def _part(self, count: int, low: float, high: float) -> Tell | None:
        """Return a progress function for one part of the work."""
        tell = self._tell
        if tell is None:
            return None
        return lambda share: tell(self._done + count * (low + (high - low) * share))

    def _outsets(self, candidates: Sequence[Candidate], start: Floats | None) -> list[Floats]:
        """Starting values: those of a smaller model, and defaults for new parameters.

        A key that leaves a corner at its nominal value sets out from several sizes.
        """
        near = self._known.get(frozenset())
        values = self.experiment.nominal() if near is None else near.fit.values.copy()
        values = values if start is None else start.copy()
        out = [values.copy() for _ in _SIZES]
        for k in (self.index[name] for c in candidates for name in c.keys):
            key = self.experiment.parameter(k)
            if values[k] != key.nominal:
                continue
            for share, other in zip(_SIZES, out, strict=True):
                moved = key.nominal + share * (key.start - key.nominal)
                other[k] = float(np.clip(moved, *key.bounds))
        return out if any(np.any(o != out[0]) for o in out) else out[:1]

    def _free(self, candidates: Sequence[Candidate]) -> tuple[int, ...]:
        names = [
            *self.experiment.candidate_set.tolerances,
            *(k for c in candidates for k in c.keys),
        ]
        return tuple(dict.fromkeys(self.index[n] for n in names))

    def _cases(self, part: int) -> tuple[int, ...]:
        return tuple(c for c, p in self.experiment.fold.items() if p == part)

    def _without(self, fit: FitTask, part: int) -> FitTask:
        out = set(self._cases(part))
        cases = tuple(c for c in fit.cases if c not in out)
        return FitTask(
            free=fit.free,
            cases=cases,
            values=fit.values.copy(),
            deviations={c: fit.deviations[c] for c in cases},
        )

    def _held(self, task: FitTask, cases: tuple[int, ...], near: FitTask) -> FitTask:
        """Task of the held-out runs, in which only start states are free."""
        known = {c: near.deviations[c] for c in cases if c in near.deviations}
        return FitTask(free=(), cases=cases, values=task.values, deviations=known)

    def _hypothesis(
        self,
        candidates: tuple[Candidate, ...],
        fit: FitTask,
        folds: list[FitTask],
        held: list[FitTask],
    ) -> ValidatedHypothesis:
        predicted = {c: t.predicted[c] for t in held for c in t.cases}
        return ValidatedHypothesis(
            candidates=candidates,
            fit=fit,
            folds=tuple(folds),
            held=predicted,
            parameter_price=self.experiment.policy.parameter_price,
            held_out_log_rms=np.array(
                [self.log_rms(c, predicted[c]) for c in self.experiment.train]
            ),
            training_log_rms=np.array(
                [self.log_rms(c, fit.predicted[c]) for c in self.experiment.train]
            ),
        )

    def log_rms(self, case: int, predicted: dict[str, Floats]) -> float:
        """Log error of one run in units of the noise floor; the floor itself gives log sqrt 2."""
        squares = [
            float(np.nanmean(part**2)) if np.isfinite(part).any() else np.nan
            for part in self.experiment.white(case, predicted, judged=True).values()
        ]
        good = [s for s in squares if np.isfinite(s)]
        return 0.5 * float(np.log1p(np.mean(good))) if good else 0.0

    def without(self, hypothesis: ValidatedHypothesis, candidate: Candidate) -> Floats:
        """Return the fitted values of a hypothesis with one candidate at its nominal values."""
        values: Floats = hypothesis.fit.values.copy()
        for k in (self.index[key] for key in candidate.keys):
            values[k] = self.experiment.parameter(k).nominal
        return values

    def unseen(self, hypothesis: ValidatedHypothesis) -> FitTask:
        """Predict the runs that are held out from all fits."""
        task = self._held(hypothesis.fit, self.experiment.unseen, hypothesis.fit)
        self.solver.solve([task])
        return task

    def margin(self, better: ValidatedHypothesis, worse: ValidatedHypothesis) -> Margin:
        """Compare two hypotheses on held-out runs."""
        gains = worse.held_out_log_rms - better.held_out_log_rms
        policy = self.experiment.policy
        counts = [self.independent(better, c) for c in self.experiment.train]
        return _margin(
            gains,
            worse.complexity_penalty - better.complexity_penalty,
            float(np.mean([1.0 / (2.0 * n) for n in counts])),
            policy,
        )

    def compare_innovations(
        self, better: ValidatedHypothesis, worse: ValidatedHypothesis
    ) -> Margin:
        """Compare two rivals by held-out error, or by innovations where that is not significant.

        Slow faults of the runs weigh on both alike and hide which of them follows fast changes.
        A systematic fault has no innovations: there the margin stands.
        """
        margin = self.margin(better, worse)
        train = self.experiment.train
        if margin.significant or any(self.experiment.systematic(c) for c in train):
            return margin
        one, two = (
            [self.experiment.white(c, h.held[c], judged=True) for c in train]
            for h in (better, worse)
        )
        rho = autocorrelation([*one, *two])
        gains = np.array([gain(a, b, rho) for a, b in zip(one, two, strict=True)])
        gains = gains[np.isfinite(gains)]
        if len(gains) < _FEWEST_RUNS:
            return margin
        counts = [_samples(innovations(a, rho)) for a in one]
        expected = float(np.mean([0.5 / max(n, 1.0) for n in counts]))
        innovation = _margin(
            gains,
            worse.complexity_penalty - better.complexity_penalty,
            expected,
            self.experiment.policy,
        )
        return innovation if innovation.significant else margin

    def independent(self, hypothesis: ValidatedHypothesis, case: int) -> float:
        """Effective number of independent samples in the residual of a run.

        Where a systematic fault sets the floor, a run has one: its fault is the same throughout.
        """
        if self.experiment.systematic(case):
            return 1.0
        parts = self.experiment.white(case, hypothesis.fit.predicted[case], judged=False)
        free = len(self.experiment.cases[case].start.free)
        return max(_samples(parts) - free, 1.0)


def _margin(
    gains: Floats, complexity_penalty: float, expected: float, policy: DecisionPolicy
) -> Margin:
    """Mean over runs, with its error from the observed and the expected scatter."""
    runs = len(gains)
    training_log_rms = float(np.sum((gains - gains.mean()) ** 2))
    variance = (training_log_rms + _PRIOR_RUNS * expected) / (runs - 1 + _PRIOR_RUNS)
    error = float(np.sqrt(variance / runs))
    return Margin(
        mean=float(gains.mean()) + complexity_penalty, error=error, least=policy.standard_errors
    )


def _samples(parts: Mapping[str, Floats]) -> float:
    """Independent samples in the best measured channel of a residual."""
    best = max(parts.values(), key=lambda p: np.isfinite(p).sum())
    columns = (column[np.isfinite(column)] for column in best.T)
    return float(sum(x.size / _length(x) for x in columns if x.size >= 2))


def _length(x: Floats) -> float:
    """Integrated autocorrelation of a residual, in samples, cut at its first zero."""
    power = float(x @ x)
    if power <= 0.0 or x.size < 4:
        return 1.0
    total = 1.0
    for lag in range(1, x.size):
        share = float(x[:-lag] @ x[lag:]) / power
        if share <= 0.0:
            break
        total += 2.0 * share
    return total


def ranked(hypotheses: Sequence[ValidatedHypothesis]) -> list[ValidatedHypothesis]:
    """Return the hypotheses sorted by score, best first."""
    return sorted(hypotheses, key=lambda h: h.log_rms)
