"""Damped Gauss-Newton iteration of many least-squares problems at a time, and its step rules.

One driver serves all fits. A model evaluates and linearises its problems together, in one batch
where it can; a step rule, which is data, says what steps are proposed and when a problem is solved:
backtracking line search, Levenberg-Marquardt damping, step length by block.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from seals.arrays import Floats

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


class _Outcome(Protocol):
    """Result of a trial step."""

    @property
    def cost(self) -> float:
        """Sum of squares, priors included."""


T = TypeVar("T", bound=Iterate)
T_contra = TypeVar("T_contra", bound=Iterate, contravariant=True)
Found = TypeVar("Found", bound=_Outcome)


class LeastSquares(Protocol[T_contra, Found]):
    """Least-squares problems of one kind."""

    def linearise(self, tasks: Sequence[T_contra]) -> None:
        """Linearise all tasks at their points; mark tasks without a useful step as done."""

    def evaluate(
        self, tasks: Sequence[T_contra], proposals: Sequence[Sequence[Proposal]]
    ) -> Sequence[Sequence[Found]]:
        """Evaluate the proposed steps of every task; an unusable step has no result."""

    def keep(self, task: T_contra, outcome: Found) -> None:
        """Move a task to the point that a trial reached."""


class StepRule(Protocol[T_contra]):
    """Schedule of steps.

    Args:
        trials: most trials for each step.
    """

    @property
    def trials(self) -> int:
        """Most trials for each step."""

    def proposals(self, task: T_contra) -> Sequence[Proposal]:
        """Return the steps to try next."""

    def accepts(self, task: T_contra, cost: float) -> bool:
        """Return true if a trial with this cost is accepted."""

    def update(self, task: T_contra, before: float) -> None:
        """Adapt damping and progress after trials; ``before`` is the cost before them."""


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


@dataclass(frozen=True, kw_only=True)
class Backtracking:
    """Backtracking line search: Gauss-Newton steps, shortened while the cost does not fall.

    A problem is solved when a step gains less than the largest of the thresholds.

    Args:
        shares: of a step, tried in turn.
        absolute: fall of the cost.
        relative: fall as a share of the cost.
        excess: fall as a share of the cost above that of a complete model.
        excess_of_whole: the same for a step that was not shortened.
    """

    shares: tuple[float, ...] = (1.0, 0.5, 0.2, 0.05)
    absolute: float = 0.3
    relative: float = 3e-5
    excess: float = 0.0
    excess_of_whole: float = 3e-3

    @property
    def trials(self) -> int:
        """Most trials for each step."""
        return len(self.shares)

    def proposals(self, task: Iterate) -> list[Proposal]:
        """Return the next share of the step."""
        return [Proposal(0.0, self.shares[task.refused])]

    def accepts(self, task: Iterate, cost: float) -> bool:
        """Return true if the cost falls."""
        return cost < task.cost

    def update(self, task: Iterate, before: float) -> None:
        """Shorten a rejected step; end after a small gain."""
        if not task.cost < before:
            task.refused += 1
            task.done = task.refused == len(self.shares)
            return
        whole = self.excess_of_whole if self.shares[task.refused] == 1.0 else 0.0
        far = max(whole, self.excess) * (task.cost - task.floor)
        task.kept()
        task.done = before - task.cost < max(self.absolute, self.relative * task.cost, far)


@dataclass(frozen=True, kw_only=True)
class LevenbergMarquardt:
    """Levenberg-Marquardt steps; after a rejection also a fraction of the undamped step.

    Along a bent valley damping shortens the way along it far more than is needed.

    Args:
        start: damping of the first step.
        raised: factor on the damping after a refusal.
        lowered: divisor of the damping after a step that was kept.
        lowered_after_refusal: the same where the step was kept after a refusal.
        least: damping.
        most: damping beyond which a problem is given up.
        refusals: of one step after which a problem is given up.
        shorter: share of the undamped step, to the power of the refusals; 0 for damped steps alone.
        settled: relative gain of a step below which a problem is solved: long valleys gain little
            at a time.
        trials: most trials for each step.
    """

    start: float = 1e-3
    raised: float = 10.0
    lowered: float = 10.0
    lowered_after_refusal: float = 2.0
    least: float = 1e-9
    most: float = 1e5
    refusals: int = 100
    shorter: float = 0.4
    settled: float = 1e-4
    trials: int = 2

    def proposals(self, task: Iterate) -> list[Proposal]:
        """Return the damped step, and after a rejection a fraction of the undamped one."""
        out = [Proposal(task.damping, 1.0)]
        if task.refused and self.shorter:
            out.append(Proposal(0.0, self.shorter**task.refused))
        return out

    def accepts(self, task: Iterate, cost: float) -> bool:
        """Return true if the cost falls."""
        return cost < task.cost

    def update(self, task: Iterate, before: float) -> None:
        """Raise the damping after a rejected step, lower it after an accepted one."""
        if task.cost < before:
            gain = (before - task.cost) / max(task.cost, 1e-12)
            # after a refusal the damping has just become right
            divisor = self.lowered_after_refusal if task.refused else self.lowered
            task.damping = max(task.damping / divisor, self.least)
            task.kept()
            task.done = bool(gain < self.settled)
        else:
            task.damping *= self.raised
            task.refused += 1
            task.done = bool(task.damping > self.most) or task.refused == self.refusals


@dataclass(kw_only=True)
class BlockIterate(Iterate):
    """State of a least-squares problem whose unknowns form blocks.

    Args:
        pace: share of a step that each block takes, shape (blocks,).
        misfit: sum of squares of each block at the present point, shape (blocks,).
        best_misfit: the same at the best point, shape (blocks,).
        best_cost: cost at the best point.
        moved: largest move of the last step, in units of the longest one.
    """

    pace: Floats
    misfit: Floats
    best_misfit: Floats = field(default_factory=lambda: np.zeros(0))
    best_cost: float = np.inf
    moved: float = np.inf

    @abstractmethod
    def remember(self) -> None:
        """Store the present point as the best one."""

    @abstractmethod
    def recall(self) -> None:
        """Return to the best point."""


@dataclass(frozen=True, kw_only=True)
class BlockPace:
    """Undamped steps with a step length for every block; the cost may rise temporarily.

    Far from a model that could be true full steps swing about: a block whose misfit rises goes half
    as far the next time.

    Args:
        longer: factor on the pace of a block whose misfit fell.
        shorter: factor on the pace of a block whose misfit rose.
        least: pace.
        slack: rise of a block's misfit above the best one that does not count.
        still: move below which a problem may be solved, in units of the longest one.
        settled: change of the cost below which it may be.
        trials: most trials for each step.
    """

    longer: float = 1.5
    shorter: float = 0.5
    least: float = 0.1
    slack: float = 1.0
    still: float = 0.1
    settled: float = 0.5
    trials: int = 1

    def proposals(self, task: BlockIterate) -> list[Proposal]:
        """Return the full step; the problem applies the step lengths."""
        return [Proposal(0.0, 1.0)]

    def accepts(self, task: BlockIterate, cost: float) -> bool:
        """Keep every step."""
        return True

    def update(self, task: BlockIterate, before: float) -> None:
        """Adapt the step lengths; keep the best point and return to it from an invalid one."""
        if task.done:
            return
        task.kept()
        # numbers that ran out of digits give squares below zero
        sound = bool(np.all(task.misfit > 0.0))
        task.done = sound and task.moved < self.still and abs(before - task.cost) < self.settled
        falls = task.misfit <= task.best_misfit + self.slack
        pace = np.where(falls, self.longer * task.pace, self.shorter * task.pace)
        task.pace = np.clip(pace, self.least, 1.0)
        if not sound:
            task.recall()
        elif task.done or task.cost < task.best_cost:
            task.remember()


def bounded_step(
    normal: Floats,
    gradient: Floats,
    low: Floats,
    high: Floats,
    *,
    damping: float = 0.0,
    held: Sequence[int] = (),
) -> Floats:
    """Compute the least-squares step of all unknowns inside its bounds, by an active set.

    An unknown that would leave its bounds goes to the bound, and the others take their best step
    beside it: a step that is merely cut off need not lead downhill.

    Args:
        normal: normal matrix, shape (p, p).
        gradient: right side, shape (p,).
        low: least step of every unknown, shape (p,).
        high: largest step of every unknown, shape (p,).
        damping: Levenberg-Marquardt damping, as a share of the curvature.
        held: unknowns that stay.

    Example:
        >>> bounded_step(np.diag([1.0, 4.0]), np.ones(2), -np.ones(2), np.array([0.5, 9.0]))
        array([0.5 , 0.25])
    """
    step, free = np.zeros(len(gradient)), np.ones(len(gradient), dtype=bool)
    free[list(held)] = False
    while free.any():
        right = gradient[free] - normal[np.ix_(free, ~free)] @ step[~free]
        step[free] = solve_scaled(normal[np.ix_(free, free)], right, damping=damping)
        beyond = free & ((step < low) | (step > high))
        if not beyond.any():
            break
        step[beyond] = np.clip(step, low, high)[beyond]
        free &= ~beyond
    return step


def solve_scaled(matrix: Floats, right: Floats, *, damping: float = 0.0) -> Floats:
    """Solve a symmetric positive system after scaling its diagonal to one, damped by a share."""
    # rounding can leave a diagonal below zero: such a value has a size, too
    scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(matrix)), 1e-300))
    scaled = matrix * scale[:, None] * scale[None, :] + (damping + 1e-12) * np.eye(len(scale))
    return np.linalg.solve(scaled, right * scale) * scale


def inverses_scaled(blocks: Floats) -> Floats:
    """Invert symmetric positive matrices after scaling their diagonals to one, (W, p, p)."""
    scale = 1.0 / np.sqrt(np.maximum(np.einsum("wii->wi", blocks), 1e-300))
    scaled = blocks * scale[:, :, None] * scale[:, None, :] + 1e-12 * np.eye(blocks.shape[1])
    inverses: Floats = np.linalg.inv(scaled) * scale[:, :, None] * scale[:, None, :]
    return inverses


def factors_scaled(blocks: Floats) -> tuple[Floats, Floats]:
    """Factor symmetric positive matrices after scaling their diagonals to one; in their memory.

    Args:
        blocks: shape (W, p, p); overwritten.

    Returns:
        The scale of each row and column, shape (W, p), and Cholesky factors, shape (W, p, p).
    """
    scale = 1.0 / np.sqrt(np.maximum(np.einsum("wii->wi", blocks), 1e-300))
    blocks *= scale[:, :, None]
    blocks *= scale[:, None, :]
    blocks += 1e-11 * np.eye(blocks.shape[1])
    return scale, np.asarray(np.linalg.cholesky(blocks), dtype=np.float64)
