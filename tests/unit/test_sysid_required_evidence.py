"""Evidence required of the next effect: one rule for search and report."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.required_evidence import required_evidence

POLICY = replace(
    DecisionPolicy(),
    evidence=10.0,
    evidence_further=7.0,
    evidence_surface=3.0,
    evidence_arm=50.0,
    first_order_error=0.01,
    activity_share=0.1,
)
FLOATS, PIERCES = SimpleNamespace(floats=True), SimpleNamespace(floats=False)


def effect(*, in_arm: bool = False, activity: Any = None, approximate: bool = False) -> Any:
    """Return what the rule reads of a candidate."""
    known = SimpleNamespace(approximate=approximate)
    return SimpleNamespace(in_arm=in_arm, activity=activity, identification=known)


@pytest.mark.parametrize(
    ("servo", "beside", "added", "surface_error", "required"),
    [
        (False, (), effect(), None, 10.0),
        (False, (), effect(), PIERCES, 13.0),
        (False, (effect(),), effect(), None, 17.0),
        (False, (effect(),), effect(), PIERCES, 20.0),
        (False, (effect(),), effect(), FLOATS, 22.0),
        (False, (effect(approximate=True),), effect(), None, 19.0),
        (False, (effect(),), effect(activity=(1.0, 2.0)), None, 37.0),
        (True, (), effect(), None, 60.0),
        (True, (), effect(in_arm=True), None, 10.0),
        (True, (effect(),), effect(), None, 67.0),
    ],
)
def test_each_case_adds_its_own_threshold(
    servo: bool, beside: tuple[Any, ...], added: Any, surface_error: Any, required: float
) -> None:
    """The base's score is 200: shares of it count only where they are asked for."""
    problem: Any = SimpleNamespace(policy=POLICY, vehicle=SimpleNamespace(servo=servo))
    base: Any = SimpleNamespace(candidates=beside, score=200.0 if beside else 0.0)
    found = required_evidence(problem, base, added, surface_error=surface_error)
    assert found == pytest.approx(required)
