"""Regression of the residual on functions of the conditions, scored on held-out blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.least_squares import inverses_scaled, solve_scaled
from seals.sysid.residual_force.evidence import Evidence

FOLDS = 5
"""Parts of a log that are held out in turn."""
DRAWS = 200
"""Draws of a bootstrap."""
BLOCK = 2
"""Windows that a bootstrap draws together."""
SEED = 20
FLOOR = 0.98
"""Misfit of noise alone per number observed: quantised noise is a little quieter than assumed."""


@dataclass(frozen=True, kw_only=True)
class Gain:
    """Decrease of the held-out misfit by a regression.

    Args:
        share: of the excess over the noise floor [1].
        share_sd: its standard error, from a block bootstrap over windows.
        total: fall of the misfit.
        total_sd: its standard error.
        windows: fall of the misfit of each window, shape (W,).
    """

    share: float
    share_sd: float
    total: float
    total_sd: float
    windows: Floats

    @property
    def sure(self) -> bool:
        """Return true if the decrease is significant against the scatter between windows."""
        return self.share > 2.0 * self.share_sd and self.share > 0.03 and self.total > 25.0


class Table:
    """Normal equations of some columns, window by window.

    Args:
        found: evidence of the log.
        basis: wrenches at the knots, body axes, shape (n, 6, c).
    """

    def __init__(self, found: Evidence, basis: Floats) -> None:
        self.found = found
        self.width = basis.shape[2]
        shaped = basis.reshape(found.count, found.knots, 6, self.width)
        columns = shaped.transpose(0, 2, 1, 3).reshape(found.count, 6 * found.knots, self.width)
        calm = found.calm
        inner = np.matmul(calm[:, :-1, :-1], columns)
        size = self.width
        self.gram = np.empty((found.count, size + 1, size + 1))
        self.gram[:, :size, :size] = np.matmul(columns.transpose(0, 2, 1), inner)
        right = np.matmul(columns.transpose(0, 2, 1), calm[:, :-1, -1:])[:, :, 0]
        self.gram[:, :size, size] = self.gram[:, size, :size] = right
        self.gram[:, size, size] = calm[:, -1, -1]
        self.level = np.einsum("wii->i", self.gram)[:size]

    def solve(
        self,
        chosen: Sequence[int],
        windows: NDArray[np.bool_] | Floats | None = None,
        ridge: Floats | None = None,
    ) -> Floats:
        """Coefficients of some columns.

        Args:
            chosen: columns.
            windows: that count, or a weight for each; all when left out.
            ridge: prior precision of the chosen columns; nearly none when left out.
        """
        if not len(chosen):
            return np.zeros(0)
        block = self._block(chosen)
        total = block.sum(axis=0) if windows is None else np.tensordot(windows * 1.0, block, 1)
        small = 1e-9 * self.level[list(chosen)] + 1e-12 if ridge is None else ridge
        return solve_scaled(total[:-1, :-1] + np.diag(small), total[:-1, -1])

    def misfit(self, chosen: Sequence[int], at: Floats) -> Floats:
        """Misfit of every window at given coefficients, shape (W,)."""
        weights = np.append(-at, 1.0)
        out: Floats = np.einsum("i,wij,j->w", weights, self._block(chosen), weights)
        return out

    def covariance(self, chosen: Sequence[int]) -> Floats:
        """Posterior covariance of the chosen columns' coefficients."""
        total = self._block(chosen).sum(axis=0)[:-1, :-1]
        covariance: Floats = inverses_scaled(total[None])[0]
        return covariance

    def fall(self, chosen: Sequence[int], beside: Sequence[int] = ()) -> float:
        """Decrease of the misfit by some columns added to others, fitted to all windows."""
        both = [*beside, *chosen]
        before = self.misfit(beside, self.solve(beside)).sum()
        return float(before - self.misfit(both, self.solve(both)).sum())

    def held_out(
        self, chosen: Sequence[int], *, ridge: Floats | None = None, mixed: bool = False
    ) -> Floats:
        """Cross-validated misfit of every window, shape (W,).

        Args:
            chosen: columns.
            ridge: their prior precision.
            mixed: whether the parts held out are scattered windows instead of long blocks.
        """
        count = self.found.count
        parts = min(FOLDS, count)
        fold = np.arange(count) % parts if mixed else np.arange(count) * parts // count
        out = np.zeros(self.found.count)
        for part in range(int(fold.max()) + 1):
            test = fold == part
            at = self.solve(chosen, ~test, ridge)
            out[test] = self.misfit(chosen, at)[test]
        return out

    def _block(self, chosen: Sequence[int]) -> Floats:
        index = [*chosen, self.width]
        return self.gram[:, index][:, :, index]


def gain(before: Floats, after: Floats, found: Evidence) -> Gain:
    """Compare two held-out misfits, window by window."""
    fall = before - after
    excess = before - FLOOR * found.observed / found.count
    total = max(float(excess.sum()), 2.0 * float(np.sqrt(2.0 * found.observed)))
    shares, totals = [], []
    for draw in drawn(found.count):
        totals.append(fall[draw].sum())
        shares.append(fall[draw].sum() / max(excess[draw].sum(), 0.1 * total))
    return Gain(
        share=float(fall.sum()) / total,
        share_sd=float(np.std(shares)),
        total=float(fall.sum()),
        total_sd=float(np.std(totals)),
        windows=fall,
    )


def drawn(count: int) -> list[NDArray[np.integer]]:
    """Return the windows of every block-bootstrap draw; the seed is fixed."""
    rng = np.random.default_rng(SEED)
    block = min(BLOCK, count)
    blocks = -(-count // block)
    starts = rng.integers(0, count, (DRAWS, blocks))
    return [((s[:, None] + np.arange(block)) % count).ravel()[:count] for s in starts]
