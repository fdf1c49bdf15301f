"""Typed settings of one comparison of a model with measurements."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.config.run import RunSettings


@dataclass(kw_only=True)
class CompareSettings(RunSettings):
    """A run's settings, which are the model, and the measurement that it is compared with.

    Args:
        log: folder or file of the measurement, a list of them, or None for the reader's own data.
        reader: plug-in that reads the measurement.
        fit: full keys of the parameters to fit, for instance ``effects.hull_drag.coefficient_z``.
        train: names of the logs that are fitted.
        held_out: names of the logs that only judge the fit.
        compare: further settings of the comparison.
        out: folder of the results, or None for the run's folder.
    """

    name: str = "compare"
    log: Any = None
    reader: Any = None
    fit: list[str] = field(default_factory=list)
    train: list[Any] = field(default_factory=list)
    held_out: list[Any] = field(default_factory=list)
    compare: dict[str, Any] = field(default_factory=dict)
    out: str | None = None
