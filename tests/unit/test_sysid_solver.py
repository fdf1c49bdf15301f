"""The least-squares driver and its step rules, on problems whose minimum is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pytest

from seals.arrays import Floats
from seals.least_squares import (
    Backtracking,
    Iterate,
    LevenbergMarquardt,
    Proposal,
    StepRule,
    bounded_step,
    minimise,
    settle,
)


@dataclass(kw_only=True)
class Valley(Iterate):
    """Problem at a point of the plane."""

    at: Floats
    normal: Floats = field(default_factory=lambda: np.eye(2))
    gradient: Floats = field(default_factory=lambda: np.zeros(2))


class Place(NamedTuple):
    """Point with its cost."""

    cost: float
    at: Floats


class Rosenbrock:
    """Sum of squares of 10 (y - x^2) and 1 - x, inside bounds; every evaluation is counted."""

    def __init__(self, high: Sequence[float] = (np.inf, np.inf)) -> None:
        self.high, self.evaluations = np.array(high), 0

    def place(self, at: Floats) -> Place:
        """Evaluate a point."""
        self.evaluations += 1
        left = np.array([10.0 * (at[1] - at[0] ** 2), 1.0 - at[0]])
        return Place(float(left @ left), at)

    def linearise(self, tasks: Sequence[Valley]) -> None:
        """Find the equations from the derivatives in closed form."""
        for task in tasks:
            x, y = task.at
            slope = np.array([[-20.0 * x, 10.0], [-1.0, 0.0]])
            left = np.array([10.0 * (y - x**2), 1.0 - x])
            task.normal, task.gradient = slope.T @ slope, -slope.T @ left
            task.linear = True

    def evaluate(
        self, tasks: Sequence[Valley], proposals: Sequence[Sequence[Proposal]]
    ) -> list[list[Place]]:
        """Evaluate proposed steps."""
        return [
            [self.place(self._moved(t, p)) for p in row]
            for t, row in zip(tasks, proposals, strict=True)
        ]

    def _moved(self, task: Valley, proposal: Proposal) -> Floats:
        low = np.full(2, -np.inf)
        step = bounded_step(
            task.normal, task.gradient, low, self.high - task.at, damping=proposal.damping
        )
        return task.at + proposal.share * step

    def keep(self, task: Valley, outcome: Place) -> None:
        """Move to a point."""
        task.at = outcome.at


def solved(rule: StepRule[Valley], model: Rosenbrock, starts: Sequence[Floats]) -> list[Valley]:
    """Solve from several starts together."""
    tasks = [Valley(at=np.array(s, dtype=float)) for s in starts]
    settle(model, tasks, [[model.place(t.at)] for t in tasks], rule)
    for task in tasks:
        task.damping = 1e-3
    minimise(model, tasks, rule, steps=60)
    return tasks


@pytest.mark.parametrize(
    "rule", [Backtracking(absolute=1e-14, excess_of_whole=0.0), LevenbergMarquardt(settled=1e-12)]
)
def test_a_bent_valley_is_followed_to_its_end(rule: StepRule[Valley]) -> None:
    """The minimum of Rosenbrock's function is 0 at (1, 1), from both sides."""
    for task in solved(rule, Rosenbrock(), [np.array([-1.2, 1.0]), np.array([2.0, -3.0])]):
        assert task.at == pytest.approx([1.0, 1.0], abs=1e-5)
        assert task.done


def test_a_bound_holds_and_the_other_unknown_is_at_its_best() -> None:
    """With x at most 0.5 the minimum is at (0.5, 0.25), of cost 0.25."""
    (task,) = solved(LevenbergMarquardt(), Rosenbrock((0.5, np.inf)), [np.array([-1.2, 1.0])])
    assert task.at == pytest.approx([0.5, 0.25], abs=1e-4)
    assert task.cost == pytest.approx(0.25, abs=1e-6)


def test_a_task_that_is_solved_costs_nothing_more() -> None:
    """Beside a long one, a task at its minimum costs no more than its refused trials."""
    model = Rosenbrock()
    alone = Rosenbrock()
    solved(LevenbergMarquardt(), alone, [np.array([-1.2, 1.0])])
    solved(LevenbergMarquardt(), model, [np.array([-1.2, 1.0]), np.array([1.0, 1.0])])
    refusals = 1 + int(np.ceil(np.log10(1e5 / 1e-3)))
    assert alone.evaluations < model.evaluations <= alone.evaluations + 2 + 2 * refusals


def test_the_number_of_steps_is_bounded() -> None:
    """Two steps are taken and no more."""
    task = Valley(at=np.array([-1.2, 1.0]))
    model, rule = Rosenbrock(), Backtracking(absolute=0.0, excess_of_whole=0.0)
    settle(model, [task], [[model.place(task.at)]], rule)
    before = task.steps
    minimise(model, [task], rule, steps=2)
    assert task.steps - before == 2
    assert not task.done
