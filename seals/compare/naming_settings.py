"""Typed settings of a diagnosis from several runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.schema import param


@dataclass(kw_only=True)
class NamingSettings:
    """Settings of a diagnosis from several runs: nominal model, tolerances, validation.

    Args:
        nominal: instances of effects that the nominal model holds; empty for the first variant of
            ``ladder``, or all effects without one.
        tolerances: full keys of nominal parameters and how uncertain they are, one standard
            deviation in their unit; they are fitted in every model.
        judge: channels that are never fitted, but judge.
        floor: by channel, the error that systematic faults of the measurement leave in any model.
        step: integration step of the twin [s] instead of that of the comparison; 0 for the same.
        stride: keep every n-th row instead of the comparison's choice; 0 for the same.
        folds: most parts into which the training runs are divided; each is held out in turn.
        most: most effects that are named together.
    """

    nominal: list[str] = field(default_factory=list)
    tolerances: dict[str, float] = field(default_factory=dict)
    judge: list[str] = field(default_factory=list)
    floor: dict[str, Any] = field(default_factory=dict)
    step: float = param(0.0, "s", bounds=(0.0, 0.1), tolerance=0.0, source="chosen", fit=False)
    stride: int = 0
    folds: int = 6
    most: int = 3
