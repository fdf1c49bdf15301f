"""Damped Gauss-Newton iteration of many least-squares problems at a time.

One driver serves all fits. A model evaluates and linearises its problems together, in one batch
where it can; a step rule, which is data, says what steps are proposed and when a problem is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

Tell = Callable[[float], None]


@dataclass(kw_only=True)
class Iterate:
    """State of one least-squares problem.

    Args:
        cost: sum of squares, priors included, at the present point.
        floor: cost of a complete model.
        steps: that were kept.
        refused: trials since the last step that was kept.
        damping: of the next step, as a share of the curvature.
        linear: whether the equations at the present point are known.
        done: whether the problem is solved.
    """

    cost: float = np.inf
    floor: float = 0.0
    steps: int = 0
    refused: int = 0
    damping: float = 0.0
    linear: bool = False
    done: bool = False

    def kept(self) -> None:
        """Count an accepted step."""
        self.steps, self.refused, self.linear = self.steps + 1, 0, False


class Proposal(NamedTuple):
    """Trial step.

    Args:
        damping: Levenberg-Marquardt damping, as a share of the curvature.
        share: of the damped step.
    """

    damping: float
    share: float


class Outcome(Protocol):
    """Result of a trial step."""

    @property
    def cost(self) -> float:
        """Sum of squares, priors included."""
        ...


T = TypeVar("T", bound=Iterate)
T_contra = TypeVar("T_contra", bound=Iterate, contravariant=True)
Found = TypeVar("Found", bound=Outcome)


class LeastSquares(Protocol[T_contra, Found]):
    """Least-squares problems of one kind."""

    def linearise(self, tasks: Sequence[T_contra]) -> None:
        """Linearise all tasks at their points; mark tasks without a useful step as done."""
        ...

    def evaluate(
        self, tasks: Sequence[T_contra], proposals: Sequence[Sequence[Proposal]]
    ) -> Sequence[Sequence[Found]]:
        """Evaluate the proposed steps of every task; an unusable step has no result."""
        ...

    def keep(self, task: T_contra, outcome: Found) -> None:
        """Move a task to the point that a trial reached."""
        ...


class StepRule(Protocol[T_contra]):
    """Schedule of steps.

    Args:
        trials: most trials for each step.
    """

    @property
    def trials(self) -> int:
        """Most trials for each step."""
        ...

    def proposals(self, task: T_contra) -> Sequence[Proposal]:
        """Return the steps to try next."""
        ...

    def accepts(self, task: T_contra, cost: float) -> bool:
        """Return true if a trial with this cost is accepted."""
        ...

    def update(self, task: T_contra, before: float) -> None:
        """Adapt damping and progress after trials; ``before`` is the cost before them."""
        ...


def minimise(
    model: LeastSquares[T, Found],
    tasks: Sequence[T],
    rule: StepRule[T],
    *,
    steps: int,
    tell: Tell | None = None,
) -> None:
    """Solve least-squares problems together, in place.

    Args:
        model: evaluates and linearises the problems.
        tasks: problems at points that were evaluated.
        rule: schedule of steps.
        steps: most steps of every task.
        tell: takes the share of the tasks that are done.
    """
    most = {id(t): t.steps + steps for t in tasks}
    # a step that is refused costs trials only and does not count
    for _ in range(rule.trials * steps):
        active = [t for t in tasks if not t.done and t.steps < most[id(t)]]
        if not active:
            break
        if tell is not None:
            tell(1.0 - len(active) / len(tasks))
        model.linearise([t for t in active if not t.linear])
        active = [t for t in active if not t.done]
        settle(model, active, model.evaluate(active, [rule.proposals(t) for t in active]), rule)


def settle(
    model: LeastSquares[T, Found],
    tasks: Sequence[T],
    found: Sequence[Sequence[Found]],
    rule: StepRule[T],
) -> None:
    """Keep the outcomes of trials that the rule accepts, and adapt the tasks.

    Args:
        model: of the problems.
        tasks: that were tried.
        found: outcomes of every task.
        rule: schedule of steps.
    """
    for task, row in zip(tasks, found, strict=True):
        before = task.cost
        for outcome in row:
            if rule.accepts(task, outcome.cost):
                model.keep(task, outcome)
                task.cost = outcome.cost
        rule.update(task, before)
