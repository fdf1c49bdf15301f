"""The comparison of what commands answer before and after a change."""

from __future__ import annotations

import pytest

from benchmarks.golden import COMPARED, PASSING, differences, jobs


def test_differences_are_told_with_their_place() -> None:
    """Rounding noise is none; a value, a row and a line that is missing are."""
    old = {"numbers": {"log.z": [1.0, 2.0]}, "printed": ["a", "b"], "exit code": 0}
    same = {"numbers": {"log.z": [1.0 + 1e-12, 2.0]}, "printed": ["a", "b"], "exit code": 0}
    new = {"numbers": {"log.z": [1.0, 2.1]}, "printed": ["a"], "exit code": 2}
    assert list(differences(old, same)) == []
    assert list(differences(old, new)) == [
        "/exit code: 0 -> 2",
        "/numbers/log.z[1]: 2 -> 2.1",
        "/printed: ['a', 'b'] -> ['a']",
    ]


@pytest.mark.parametrize("text", ["simulated 8.5 s in 12.1 s (8500 steps, 0.7 times real time)"])
def test_times_do_not_count(text: str) -> None:
    """What differs from run to run is blotted out."""
    assert PASSING.sub("#", text) == "simulated # in # (8500 steps, #)"


def test_every_experiment_is_a_job() -> None:
    """Experiments with measurements are compared, all others run; shipped logs are named."""
    found = jobs([])
    assert {name for name in found if name.startswith("compare:")} == {
        f"compare:{name}" for name in COMPARED
    }
    assert {"run:drop_test", "train:reach", "name:quad_drag"} <= set(found)
