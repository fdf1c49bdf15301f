"""Load ledger: the wrench of every effect on every link at every step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.motion import Wrench

COMPONENTS = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")

_FORCE, _TORQUE = slice(0, 3), slice(3, 6)


class Ledger:
    """Load ledger: wrenches about the link origins in link axes, one row per step.

    Args:
        effects: names of the effects, in the order of evaluation.
        links: names of the links.
        steps: rows to reserve; the ledger grows when they are used up.

    Attributes:
        time: [s], shape (rows,).
        wrenches: [N, N m], shape (rows, effects, links, 6).

    Example:
        >>> ledger = Ledger(["gravity", "drag"], ["base"])
        >>> ledger.wrenches.shape
        (0, 2, 1, 6)
    """

    effects: tuple[str, ...]
    links: tuple[str, ...]
    rows: int

    def __init__(self, effects: Sequence[str], links: Sequence[str], *, steps: int = 1024) -> None:
        self.effects, self.links = tuple(effects), tuple(links)
        self._index = {name: k for k, name in enumerate(effects)}
        self._time = np.zeros(max(steps, 1))
        self._table = np.zeros((max(steps, 1), len(self.effects), len(self.links), 6))
        self.rows = 0
        self._written: set[int] = set()
        self._begins, self._address = self._table, self._table.ctypes.data

    @property
    def time(self) -> Floats:
        """Time of the rows [s]."""
        return self._time[: self.rows]

    @property
    def wrenches(self) -> Floats:
        """Wrenches of the rows [N, N m]."""
        return self._table[: self.rows]

    def of(self, effect: str) -> Floats:
        """Wrenches of one effect, shape (rows, links, 6)."""
        return self.wrenches[:, self._index[effect]]

    def reserve(self, count: int) -> int:
        """Make room for rows to come; return the address of the first one in memory."""
        while self.rows + count > len(self._time):
            self._time = np.concatenate([self._time, np.zeros_like(self._time)])
            self._table = np.concatenate([self._table, np.zeros_like(self._table)])
        if self._begins is not self._table:
            self._begins, self._address = self._table, self._table.ctypes.data
        return self._address + self.rows * self._table.strides[0]

    def append(self, times: Sequence[float]) -> None:
        """Take rows that were written where `reserve` said, of these times [s]."""
        self._time[self.rows : self.rows + len(times)] = times
        self.rows += len(times)

    def open_row(self, time: float) -> Floats:
        """Start a row and return it for writing, shape (effects, links, 6)."""
        self.reserve(1)
        self._time[self.rows] = time
        row: Floats = self._table[self.rows]
        self._written.clear()
        self.rows += 1
        return row

    def write(self, row: Floats, effect: str, rows: Any, wrench: Wrench) -> None:
        """Add one effect's wrench to a row; several hooks of an effect add up.

        Args:
            row: from `open_row`.
            effect: name of the effect.
            rows: links it acts on: None for all, a slice or an index array.
            wrench: about the link origins, link axes.
        """
        place = self._index[effect]
        where: Any = slice(None) if rows is None else rows
        again = place in self._written
        self._written.add(place)
        for values, part in ((wrench.force, _FORCE), (wrench.torque, _TORQUE)):
            if values is None:
                continue
            if again:
                row[place, where, part] += values
            else:
                # a new row is zero: setting is a third of the work of adding
                row[place, where, part] = values

    def load(self, time: Floats, wrenches: Floats) -> None:
        """Replace all rows by stored ones.

        Args:
            time: [s], shape (rows,).
            wrenches: [N, N m], shape (rows, effects, links, 6).

        Raises:
            ValueError: they are of other effects or links.
        """
        wanted = (len(time), *self._table.shape[1:])
        if np.ndim(time) != 1 or wrenches.shape != wanted:
            raise ValueError(f"a ledger of shape {wrenches.shape}, not {wanted}")
        self.rewind(0)
        more = max(0, len(time) - len(self._time))
        self._time = np.concatenate([self._time, np.zeros(more)])
        self._table = np.concatenate([self._table, np.zeros((more, *self._table.shape[1:]))])
        self._time[: len(time)], self._table[: len(time)] = time, wrenches
        self.rows = len(time)

    def rewind(self, rows: int) -> None:
        """Discard all but the first ``rows`` rows."""
        rows = min(rows, self.rows)
        self._table[rows : self.rows] = 0.0
        self.rows = rows

    def columns(self) -> dict[str, Floats]:
        """Return the ledger as named columns, ``effect.link.component``.

        Those that are zero throughout are left out.
        """
        out = {"t": self.time}
        for e, effect in enumerate(self.effects):
            for k, link in enumerate(self.links):
                for c, component in enumerate(COMPONENTS):
                    values = self.wrenches[:, e, k, c]
                    if values.any():
                        out[f"{effect}.{link}.{component}"] = values
        return out
