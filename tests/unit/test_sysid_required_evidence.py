"""Evidence required of the next effect: one rule for search and report."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.required_evidence import required_evidence
from seals.sysid.predictors.normal_equations import Fit

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


def effect(
    *,
    in_arm: bool = False,
    activity: Any = None,
    approximate: bool = False,
    drag_in: int | None = None,
    family: str = "",
) -> Any:
    """Return what the rule reads of a candidate."""
    known = SimpleNamespace(approximate=approximate, resists=drag_in is not None, family=family)
    variant = {} if drag_in is None else {"medium": drag_in}
    return SimpleNamespace(
        in_arm=in_arm, activity=activity, identification=known, variant=variant, keys=("d.c",)
    )


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


@pytest.mark.parametrize(
    ("medium", "activity", "required"),
    [(1, (1.0, 2.0), 317.0), (0, (1.0, 2.0), 37.0), (1, None, 17.0)],
)
def test_a_drag_for_a_time_beside_another_pays_for_the_law_of_that_one(
    medium: int, activity: Any, required: float
) -> None:
    """A tenth of what the first drag accounts for, 3,000, and not of its score of 200."""
    problem: Any = SimpleNamespace(policy=POLICY, vehicle=SimpleNamespace(servo=False))
    fit = SimpleNamespace(accounted=lambda keys: 3000.0 * len(keys))
    base: Any = SimpleNamespace(candidates=(effect(drag_in=1),), score=200.0, fit=fit)
    added = effect(drag_in=medium, activity=activity)
    assert required_evidence(problem, base, added, surface_error=None) == pytest.approx(required)
    other = effect(activity=(1.0, 2.0))
    assert required_evidence(problem, base, other, surface_error=None) == pytest.approx(37.0)


@pytest.mark.parametrize(
    ("medium", "family", "required"), [(1, "drag", 317.0), (0, "drag", 17.0), (1, "other", 17.0)]
)
def test_a_second_power_of_one_drag_pays_for_the_law_of_the_first(
    medium: int, family: str, required: float
) -> None:
    """Laws hold to a few per cent: what a drag leaves over is no further drag."""
    problem: Any = SimpleNamespace(policy=POLICY, vehicle=SimpleNamespace(servo=False))
    fit = SimpleNamespace(accounted=lambda keys: 3000.0 * len(keys))
    first = effect(drag_in=1, family="drag")
    base: Any = SimpleNamespace(candidates=(first,), score=200.0, fit=fit)
    added = effect(drag_in=medium, family=family)
    assert required_evidence(problem, base, added, surface_error=None) == pytest.approx(required)


def test_what_an_effect_accounts_for_leaves_others_what_they_can_take() -> None:
    """Back at zero, the misfit of a linear model rises by just that after a new fit."""
    rng = np.random.default_rng(3)
    columns, truth = rng.normal(size=(4, 30, 3)), np.array([2.0, -1.0, 0.3])
    seen = columns @ truth + 0.1 * rng.normal(size=(4, 30))
    prior = np.array([0.0, 1e-9, 4.0])

    def fitted(free: list[int]) -> tuple[np.ndarray, float]:
        some = columns[:, :, free]
        normal = np.einsum("wri,wrj->ij", some, some) + np.diag(prior[free])
        at = np.linalg.solve(normal, np.einsum("wri,wr->i", some, seen))
        return at, float(np.sum((seen - some @ at) ** 2) + np.sum(prior[free] * at**2))

    at, cost = fitted([0, 1, 2])
    fit = Fit(
        free=("a", "b"),
        keys=("a", "b", "c"),
        values=dict(zip("abc", map(float, at), strict=True)),
        cost=cost,
        misfit=np.zeros(4),
        normal=np.einsum("wri,wrj->wij", columns, columns),
        right=np.zeros((4, 3)),
        precision=prior,
        centre=np.zeros(3),
        penalty=0.0,
    )
    assert fit.accounted(["a"]) == pytest.approx(fitted([1, 2])[1] - cost, rel=1e-6)
    assert fit.accounted(["a", "b"]) == pytest.approx(fitted([2])[1] - cost, rel=1e-6)
