"""Recorder of the diagnostics of a fluid."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.fluid import Fluid
from seals.run.recorder import Moment, Recorder, refill

GAP = "momentum balance gap [1]"
"""Part of the momentum exchanged in a step that is not accounted for."""


class FluidBook(Recorder):
    """Recorder of a fluid's diagnostics, one row per row of the log.

    Args:
        fluid: of the world, or None.
    """

    def __init__(self, fluid: Fluid | None) -> None:
        self._fluid = fluid
        self._rows: list[dict[str, float]] = []

    def record(self, moment: Moment) -> None:
        """Record the present diagnostics."""
        if self._fluid is None:
            return
        row = dict(self._fluid.diagnostics())
        balance = self._fluid.momentum_balance()
        if balance is not None:
            row[GAP] = float(np.abs(balance.gap).max()) / max(balance.gross, 1e-12)
        self._rows.append(row)

    def snapshot(self) -> dict[str, Floats]:
        """Return a table for each name: values, and whether a row has one, shape (rows, 2)."""
        names = dict.fromkeys(name for row in self._rows for name in row)
        return {
            name: np.array([(row.get(name, np.nan), name in row) for row in self._rows])
            for name in names
        }

    def restore(self, kept: Mapping[str, Any], rows: int, folder: Path) -> None:
        """Continue after the rows of a snapshot."""
        if self._fluid is None:
            return
        self._rows = [{} for _ in range(rows)]
        for name, table in kept.items():
            values = np.zeros((rows, 2))
            refill(values, table, rows)
            for row, (value, given) in zip(self._rows, values.tolist(), strict=True):
                if given:
                    row[name] = value

    def columns(self, rows: int) -> dict[str, Floats]:
        """Return the first rows as columns by name, absent values as NaN."""
        kept = self._rows[:rows]
        names = dict.fromkeys(name for row in kept for name in row)
        return {name: np.array([row.get(name, np.nan) for row in kept]) for name in names}

    def note(self) -> str:
        """Return a short text for the progress bar."""
        if not self._rows:
            return ""
        row = self._rows[-1]
        words = [f"{int(row['particles']):,} particles"] if "particles" in row else []
        if "mean compression [1]" in row:
            words.append(f"compressed {row['mean compression [1]']:.2%}")
        return ", ".join(words)
