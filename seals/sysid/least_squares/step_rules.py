"""Step rules: backtracking line search, Levenberg-Marquardt damping, step length by block."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Floats
from seals.sysid.least_squares.solver import Iterate, Proposal


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
        shorter: share of the undamped step, to the power of the refusals.
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
    shorter: float = 0.4
    settled: float = 1e-4
    trials: int = 2

    def proposals(self, task: Iterate) -> list[Proposal]:
        """Return the damped step, and after a rejection a fraction of the undamped one."""
        out = [Proposal(task.damping, 1.0)]
        if task.refused:
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
            task.done = bool(task.damping > self.most)


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
