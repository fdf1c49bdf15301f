"""Estimate of the inertial sensors' delay and its standard deviation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from seals.sysid.predictors.problem import rewindowed
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, scored

_STEPS = (3e-3, 1e-3, 3e-4)
"""Steps of the search for a delay [s]."""


def estimate_sensor_delay(
    nominal: EvidenceHypothesis, hypothesis: EvidenceHypothesis
) -> EvidenceHypothesis:
    """Estimate the delay of the inertial sensors by a line search and a parabola.

    Args:
        nominal: model against which fits are scored.
        hypothesis: with a delay of the sensors, in windows that follow it.
    """
    best, near = hypothesis, [hypothesis, hypothesis]
    for step in _STEPS:
        for _ in range(3):
            at = best.fitter.windows.delay
            near = [_at_delay(nominal, best, at + side * step) for side in (-1.0, 1.0)]
            if max(h.score for h in near) <= best.score:
                break
            best = max(near, key=lambda h: h.score)
    return parabola_peak(nominal, best, near)


def parabola_peak(
    nominal: EvidenceHypothesis, best: EvidenceHypothesis, near: Sequence[EvidenceHypothesis]
) -> EvidenceHypothesis:
    """Return the fit at the peak of a parabola through three delays, with its standard deviation.

    Equation:
        the score falls by 1 at one standard deviation; with s the step and c the score's second
        difference, sigma = s / sqrt(-c / 2), and the top is half the first difference over -c away.

    Args:
        nominal: model against which fits are scored.
        best: at the middle.
        near: a step earlier and a step later.
    """
    before, after = (h.score - best.score for h in near)
    bend = -(before + after)
    at = best.fitter.windows.delay
    step = near[1].fitter.windows.delay - at
    if before > 0.0 or after > 0.0 or bend <= 0.0 or step <= 0.0:
        return best
    spread = float(step / np.sqrt(0.5 * bend))
    top = _at_delay(nominal, best, at + 0.5 * step * (after - before) / bend)
    chosen = max(top, best, key=lambda h: h.score)
    return replace(
        chosen, fit=replace(chosen.fit, known={best.fitter.candidate_set.sensor_delay: spread})
    )


def _at_delay(
    nominal: EvidenceHypothesis, hypothesis: EvidenceHypothesis, delay: float
) -> EvidenceHypothesis:
    fitter = rewindowed(hypothesis.fitter, delay=delay)
    start = {**hypothesis.fit.values, fitter.candidate_set.sensor_delay: delay}
    fit = fitter.fit(hypothesis.fit.free, start=start)
    return scored(hypothesis.candidates, fit, fitter, nominal)
