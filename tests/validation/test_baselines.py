"""The classical answers beside the diagnosis: each answers, and with names of the library."""

from __future__ import annotations

from seals.logs import read_native
from seals.logs.shipped import find_log
from seals.sysid.predictors.problem import prepare


def test_every_classical_answer_is_an_answer() -> None:
    """Asked about a flight in a hidden wind, all name effects; all at once names far too many."""
    from seals.experiments.naming_benchmark.answers import METHODS, Question

    problem = prepare(read_native(find_log("hidden_effect/flight_a")))
    asked = Question.of(problem)
    known = {c.name for c in problem.plant.candidate_set.candidates}
    found = {name: method(asked) for name, method in METHODS.items()}
    for names in found.values():
        assert names
        assert set(names) <= known
    assert len(found["all at once"]) > 4
    assert found["BIC with tolerances"] == ("wind",)
