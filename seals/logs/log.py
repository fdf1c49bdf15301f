"""Measured or simulated log: one time base, flat columns, segments, vehicle metadata."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from seals.arrays import Floats
from seals.errors import LogError, refuse_unlisted, suggestion
from seals.logs.channels import columns_of, stem_of
from seals.untrusted_io import first_bad_number

Integers = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Log:
    """Rows of samples over time, in SI units, world ENU and body FLU.

    The arrays are handed out read-only. NaN means: no sample in this row.

    Args:
        name: what to call it in tables and plots.
        columns: flat columns by name, each of shape (rows,), ``t`` [s] among them.
        segment: number of the separate run each row belongs to, shape (rows,); left out, one run.
        meta: what is known of vehicle, environment and sensors, as in ``meta.yaml``.
        source: where the data come from.
        licence: licence of the data.

    Raises:
        LogError: ``t`` is missing, lengths differ, there are no rows, or ``meta`` holds a number
            that is not finite.

    Example:
        >>> log = Log(name="drop", columns={"t": [0.0, 0.1], "position_z": [1.0, 0.95]})
        >>> log.rows, log.channels(), log.channel("position")[:, 2].tolist()
        (2, ['position'], [1.0, 0.95])
    """

    name: str
    columns: Mapping[str, Floats]
    segment: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    meta: dict[str, Any] = field(default_factory=dict)
    source: str = ""
    licence: str = ""

    def __post_init__(self) -> None:
        columns = {key: _vector(self.name, key, value) for key, value in self.columns.items()}
        refuse_unlisted(
            "t", columns, f"log '{self.name}' has no time column 't' [s]", error=LogError
        )
        if "segment" in columns:
            raise LogError(f"log '{self.name}': give segments as segment=, not as a column.")
        segment = np.asarray(self.segment, dtype=np.int64).view()
        rows = columns["t"].size
        if segment.size == 0:
            segment = np.zeros(rows, dtype=np.int64)
        segment.flags.writeable = False
        every = {**columns, "segment": segment}
        if rows == 0:
            raise LogError(
                f"log '{self.name}' has no rows.\n"
                "A header of column names is followed by rows of numbers."
            )
        wrong = {key: value.shape for key, value in every.items() if value.shape != (rows,)}
        if wrong:
            raise LogError(
                f"log '{self.name}': columns must all have the {rows} rows of 't'; "
                f"these differ: {wrong}"
            )
        bad = first_bad_number(self.meta)
        if bad is not None:
            raise LogError(f"log '{self.name}': meta.{bad} is not a finite number.")
        object.__setattr__(self, "columns", columns)
        object.__setattr__(self, "segment", segment)

    @property
    def time(self) -> Floats:
        """Time [s], shape (rows,)."""
        return self.columns["t"]

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.time.size)

    def channels(self) -> list[str]:
        """Return the stems of the channels present, in column order, time left out."""
        return list(dict.fromkeys(stem_of(column) for column in self.columns if column != "t"))

    def has(self, stem: str) -> bool:
        """Return whether at least one column of the channel is present."""
        return any(stem_of(column) == stem for column in self.columns if column != "t")

    def channel(self, stem: str) -> Floats:
        """Return one channel, shape (rows, components); components that the log lacks are NaN.

        Raises:
            LogError: the log has no column of this channel.
        """
        names = columns_of(stem, self.columns)
        if not names:
            raise LogError(
                f"log '{self.name}' has no channel '{stem}'.\n"
                + suggestion(stem, self.channels(), label="Present")
            )
        absent = np.full(self.rows, np.nan)
        return np.stack([self.columns.get(name, absent) for name in names], axis=1)

    def segments(self) -> list[Log]:
        """Return one log for each separate run, in order of first row; each keeps its number."""
        numbers, first = np.unique(self.segment, return_index=True)
        ordered = numbers[np.argsort(first)]
        if ordered.size == 1:
            return [self]
        return [
            replace(self.select(self.segment == number), name=f"{self.name}/{number}")
            for number in ordered
        ]

    def select(self, mask: ArrayLike | slice) -> Log:
        """Return the rows given by a boolean mask, a slice or an index array.

        Raises:
            LogError: no row is left, or the mask has another length.
        """
        picked = mask if isinstance(mask, slice) else np.asarray(mask)
        try:
            columns = {key: value[picked] for key, value in self.columns.items()}
        except IndexError as error:
            raise LogError(
                f"log '{self.name}': the selection does not fit {self.rows} rows."
            ) from error
        return replace(self, columns=columns, segment=self.segment[picked])

    def with_columns(self, columns: Mapping[str, ArrayLike]) -> Log:
        """Return a log with columns added or replaced, each of shape (rows,)."""
        more = {key: _vector(self.name, key, value) for key, value in columns.items()}
        return replace(self, columns={**self.columns, **more})


def _vector(log: str, key: str, value: ArrayLike) -> Floats:
    try:
        array: Floats = np.asarray(value, dtype=np.float64).view()
    except (TypeError, ValueError) as error:
        raise LogError(
            f"log '{log}': column '{key}' does not contain numbers ({error})."
        ) from error
    if array.ndim != 1:
        raise LogError(f"log '{log}': column '{key}' has shape {array.shape}, allowed is (rows,).")
    array.flags.writeable = False
    return array
