"""Pulls toward a point that a log locates, and those that it does not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.effects.identification import Identification
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.reasons_against import centre_error, unlocated

KEYS = tuple(f"pull.anchor_{axis}" for axis in "xyz")


def model(spread: float, *, centre: str = "anchor", away: float = 2.0) -> Any:
    """A fit with a point two metres above a flight that stays in place."""
    candidate = SimpleNamespace(
        keys=(*KEYS, "pull.stiffness"), identification=Identification(centre=centre)
    )
    values = dict(zip(KEYS, (0.0, 0.0, away), strict=True)) | {"pull.stiffness": 1.0}
    trajectory = SimpleNamespace(position=np.zeros((5, 3)))
    policy = SimpleNamespace(policy=DecisionPolicy())
    return SimpleNamespace(
        candidates=(candidate,),
        fit=SimpleNamespace(values=values, robust_spread=lambda key: spread),
        fitter=SimpleNamespace(trajectory=trajectory, candidate_set=policy),
    )


def test_the_error_of_a_point_is_a_share_of_its_distance() -> None:
    """Errors of 0.1 m along three axes at 2 m: sqrt(3) of 5 %."""
    found = model(0.1)
    assert centre_error(found, found.candidates[0]) == pytest.approx(np.sqrt(3.0) * 0.05)


@pytest.mark.parametrize(("spread", "expected"), [(0.1, []), (0.5, [0])])
def test_a_point_that_is_not_located_is_no_name(spread: float, expected: list[int]) -> None:
    """Known to 9 % of its distance, or to 43 %."""
    assert unlocated(model(spread)) == expected


def test_what_does_not_act_toward_a_point_has_none_to_locate() -> None:
    """However uncertain its parameters are."""
    assert unlocated(model(50.0, centre="")) == []
