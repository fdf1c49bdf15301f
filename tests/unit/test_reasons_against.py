"""The power of the speed is asked of drags by axis alone."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from seals.effects.effect import MediumKind
from seals.effects.identification import Identification
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision import reasons_against

KEYS = ("foam.x", "foam.y", "foam.z")


@pytest.mark.parametrize(
    ("keys", "law", "asked"),
    [
        (KEYS, {"medium": MediumKind.water}, True),
        (KEYS[:1], {"medium": MediumKind.water}, False),
        (KEYS, {}, False),
    ],
)
def test_a_law_of_another_form_keeps_its_name(
    monkeypatch: pytest.MonkeyPatch, keys: tuple[str, ...], law: dict[str, Any], asked: bool
) -> None:
    """One coefficient for all axes, or no medium, as an installed effect may have it."""
    drag = Candidate(name="foam", keys=keys, identification=Identification(family="drag", power=2))
    effects = {drag.instance: SimpleNamespace(constants=dict, **law)}
    best: Any = SimpleNamespace(
        candidates=(drag,), fitter=SimpleNamespace(candidate_set=SimpleNamespace(effects=effects))
    )
    problem: Any = SimpleNamespace(
        samples=SimpleNamespace(posed=True), impact=False, policy=SimpleNamespace(other_power=0.5)
    )
    monkeypatch.setattr(reasons_against, "fitted_change", lambda *given: (1.2, 0.1))
    assert bool(reasons_against.other_power(problem, best)) is asked
