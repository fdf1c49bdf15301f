"""The delay of the inertial sensors, found by windows that follow it, and how well it is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from seals.sysid.hypothesis import Hypothesis, scored
from seals.sysid.linearise import DELAY
from seals.sysid.problem import rewindowed

_STEPS = (3e-3, 1e-3, 3e-4)
"""Steps of the search for a delay [s]."""


def timed(nominal: Hypothesis, hypothesis: Hypothesis) -> Hypothesis:
    """Find the delay of the inertial sensors with ever finer steps, and the top between the last.

    Args:
        nominal: model against which fits are scored.
        hypothesis: with a delay of the sensors, in windows that follow it.
    """
    best, near = hypothesis, [hypothesis, hypothesis]
    for step in _STEPS:
        for _ in range(3):
            at = best.fitter.windows.delay
            near = [_delayed(nominal, best, at + side * step) for side in (-1.0, 1.0)]
            if max(h.score for h in near) <= best.score:
                break
            best = max(near, key=lambda h: h.score)
    return summit(nominal, best, near)


def summit(nominal: Hypothesis, best: Hypothesis, near: Sequence[Hypothesis]) -> Hypothesis:
    """Fit at the top of the parabola through three delays, with the spread that it tells.

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
    top = _delayed(nominal, best, at + 0.5 * step * (after - before) / bend)
    chosen = max(top, best, key=lambda h: h.score)
    return replace(chosen, fit=replace(chosen.fit, known={DELAY: spread}))


def _delayed(nominal: Hypothesis, hypothesis: Hypothesis, delay: float) -> Hypothesis:
    fitter = rewindowed(hypothesis.fitter, delay=delay)
    fit = fitter.fit(hypothesis.fit.freed, start={**hypothesis.fit.values, DELAY: delay})
    return scored(hypothesis.candidates, fit, fitter, nominal)
