"""Linear screen: which candidates are fitted in the first round of a search."""

from __future__ import annotations

import numpy as np

from seals.logs.native import read_native
from seals.logs.shipped import shipped_logs
from seals.sysid.predictors.problem import prepare
from seals.sysid.selection.window_models import estimate_disturbance, linear_screen


def test_what_starts_elsewhere_is_always_fitted() -> None:
    """A payload's size and place multiply, so that it seems to explain nothing about zero."""
    problem = prepare(read_native(shipped_logs()["hidden_effect/flight_a"]).select(np.arange(200)))
    nominal = estimate_disturbance(problem)
    every = [c for c in problem.plant.candidate_set.candidates if not c.identification.guessed]
    _, kept = linear_screen(nominal, every)
    elsewhere = {c.label for c in every if c.starts}
    assert elsewhere
    assert elsewhere <= {c.label for c, _ in kept}
    # of the others the screen leaves out some
    assert len(kept) < len(every)
