"""Linear screen: which candidates are fitted in the first round of a search."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from seals.logs.native import read_native
from seals.logs.shipped import shipped_logs
from seals.sysid.predictors.problem import _parts, prepare
from seals.sysid.selection.nominal_model import estimate_disturbance
from seals.sysid.selection.window_models import extensions, linear_screen


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


def test_what_starts_elsewhere_and_was_likely_alone_is_fitted_beside_others() -> None:
    """A lag stated as none has no slope at zero beside a drag either: it was never tried there."""
    problem = prepare(read_native(shipped_logs()["hidden_effect/flight_a"]).select(np.arange(200)))
    nominal = estimate_disturbance(problem)
    singles = extensions(problem, nominal, nominal)
    base = next(h for h in singles if not h.candidates[-1].starts)
    apart = [h for h in singles if h.candidates[-1].starts]
    plain = {h.label for h in extensions(problem, nominal, base)}
    left = [h for h in apart if h.candidates[-1].label not in " ".join(plain)]
    assert left
    likely = [replace(h, score=problem.policy.evidence + 1.0) for h in left]
    beside = extensions(problem, nominal, base, singles=likely)
    tried = {h.candidates[-1].label for h in beside}
    assert {h.candidates[-1].label for h in left} <= tried
    # what alone was unlikely is left to the screen
    unlikely = [replace(h, score=0.0) for h in left]
    assert {h.label for h in extensions(problem, nominal, base, singles=unlikely)} == plain


def test_rotors_that_are_reversed_are_integrated_in_finer_steps() -> None:
    """Thrust that is quadratic in a lagging speed bends within a row."""

    def parts(*speeds: float, commands: str = "rotor_speed_cmd") -> int:
        vehicle: Any = SimpleNamespace(has_water=True, commands=commands)
        samples: Any = SimpleNamespace(step=0.01, command=np.array([speeds]).T)
        return _parts(vehicle, samples)

    assert parts(300.0, 20.0, -300.0) == 4 * parts(300.0, 20.0, 100.0)
    assert parts(3.0, -3.0, commands="thruster_cmd") == parts(300.0, 20.0, 100.0)
