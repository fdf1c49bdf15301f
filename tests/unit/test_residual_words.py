"""Sentences on a residual force where the misfit has no excess over noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from seals.sysid.residual_force.signature import Findings, signature


def findings(ceiling: float, spread: float) -> Findings:
    """A force that stands out, and the share of the misfit that any force explains."""
    left = SimpleNamespace(
        missing=True, before=0.87, after=0.77, ceiling=ceiling, ceiling_sd=spread
    )
    whole = SimpleNamespace(force=2.6, force_ratio=1.9, torque=0.25, torque_ratio=2.6)
    return cast(Any, SimpleNamespace)(residual=left, regimes=[whole], jointed=False)


@pytest.mark.parametrize(
    ("ceiling", "spread", "said"),
    [(0.0, 1.0, "that of noise"), (0.1, 0.1, "sensors disagree")],
)
def test_sensors_are_blamed_only_for_what_is_there(
    ceiling: float, spread: float, said: str
) -> None:
    """Of a misfit at the floor a force explained '0 +- 100 %', and sensors were suspected."""
    first, second = signature(findings(ceiling, spread)).sentences
    assert first.startswith("Left over: a force of about 2.6 N")
    assert said in second
    assert ("sensors" in second) is (spread < 1.0)
