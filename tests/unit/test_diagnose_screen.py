"""Linear screen: which candidates are fitted in the first round of a search."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from seals.logs.native import read_native
from seals.logs.shipped import shipped_logs
from seals.sysid.predictors.problem import _parts, prepare
from seals.sysid.selection.nominal_model import estimate_disturbance
from seals.sysid.selection.window_models import linear_screen


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


def test_rotors_that_are_reversed_are_integrated_in_finer_steps() -> None:
    """Thrust that is quadratic in a lagging speed bends within a row."""

    def parts(*speeds: float, commands: str = "rotor_speed_cmd") -> int:
        vehicle: Any = SimpleNamespace(has_water=True, commands=commands)
        samples: Any = SimpleNamespace(step=0.01, command=np.array([speeds]).T)
        return _parts(vehicle, samples)

    assert parts(300.0, 20.0, -300.0) == 4 * parts(300.0, 20.0, 100.0)
    assert parts(3.0, -3.0, commands="thruster_cmd") == parts(300.0, 20.0, 100.0)
