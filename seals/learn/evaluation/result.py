"""Evaluation result: success rates with intervals, and quantiles over episodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import Floats
from seals.learn.statistics.interval import Interval, wilson

if TYPE_CHECKING:
    from seals.learn.training.scoring import Scores

SHARE = "success"
"""Facts of this name, or that begin with it, are truth values: shares are told of them."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
_OWN = ("return", SHARE)
"""Facts that the scores hold by themselves."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EvaluationResult:
    """Result of a policy in a world.

    Args:
        policy: name or folder.
        world: name of the variant, empty for the world of the configuration.
        columns: one row an episode, by name, each of shape (episodes,).
        seconds: wall time of all episodes together [s].
    """

    policy: str
    world: str
    columns: Mapping[str, Floats]
    seconds: float = 0.0

    @property
    def episodes(self) -> int:
        """Number of starts."""
        return len(self.columns[SHARE])

    def share(self, name: str = SHARE) -> Interval:
        """Return the share of episodes with a property, such as success, with Wilson's interval."""
        return wilson(int(self.columns[name].sum()), self.episodes)

    def shares(self) -> dict[str, Interval]:
        """Return the shares of all such properties by name."""
        return {n: self.share(n) for n in self.columns if n == SHARE or n.startswith(f"{SHARE}_")}

    def quantiles(self, name: str) -> list[float]:
        """Return the quantiles of a column, NaN if an episode lacks it."""
        values = self.columns[name]
        if not np.isfinite(values).any():
            return [float("nan")] * len(QUANTILES)
        return [float(q) for q in np.nanquantile(values, QUANTILES)]

    def to_dict(self) -> dict[str, Any]:
        """Return success rates and quantiles as plain data; unknown ones are None."""
        rest = [n for n in self.columns if n != "seed" and n not in self.shares()]
        return {
            "policy": self.policy,
            "world": self.world,
            "episodes": self.episodes,
            "seconds": self.seconds,
            "shares": {name: list(value) for name, value in self.shares().items()},
            "quantiles": {
                name: [q if np.isfinite(q) else None for q in self.quantiles(name)] for name in rest
            },
        }


def summarise(scores: Scores, *, policy: str, world: str, seconds: float) -> EvaluationResult:
    """Summarise the scores of some episodes."""
    columns = {
        "seed": scores.seed.astype(float),
        SHARE: scores.success.astype(float),
        "return": scores.returns,
        "length": scores.length.astype(float),
        **{name: values for name, values in scores.facts.items() if name not in _OWN},
    }
    return EvaluationResult(policy=policy, world=world, columns=columns, seconds=seconds)
