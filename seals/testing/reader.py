"""Contract tests of readers of measured logs."""

from __future__ import annotations

import inspect
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.contract import class_of, require
from seals.errors import LogError
from seals.logs import Log, Severity, check_log
from seals.logs.reader import Reader
from seals.testing.declaration import check_declaration

HEADINGS = ("Channels:", "Units:", "Limitations:")
"""What a reader's docstring must tell."""


@dataclass(frozen=True, kw_only=True)
class ReaderReport:
    """Result of `check_reader`.

    Args:
        name: of the reader.
        logs: number of logs read.
        rows: number of samples in them.
        channels: stems present in any of them.
    """

    name: str
    logs: int
    rows: int
    channels: tuple[str, ...]

    def table(self) -> str:
        """Return the figures as text."""
        channels = ", ".join(self.channels) or "no source given"
        return f"{self.name}: {self.logs} logs, {self.rows} rows, {channels}"


def check_reader(
    reader: str | type, source: str | Path | None = None, *, values: Mapping[str, Any] | None = None
) -> ReaderReport:
    """Check the contract of a reader.

    It must refuse a missing, an empty and a senseless source with a `LogError` in words, and turn a
    good source into logs in SI units with rising time, the same each time.

    Args:
        reader: name of an installed reader, or its class.
        source: a file or folder it can read; None checks the refusals only.
        values: fields of the reader.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.

    Example:
        >>> check_reader("csv").name
        'csv'
    """
    name, cls = class_of("reader", reader)
    check_declaration(name, cls, headings=False)
    stated = [h for h in HEADINGS if h in (inspect.getdoc(cls) or "")]
    require(
        len(stated) == len(HEADINGS),
        name,
        f"its docstring has the headings {stated}",
        f"Tell: {', '.join(HEADINGS)}",
    )
    made = cls(**(values or {}))
    require(
        isinstance(made, Reader),
        name,
        "has no method read(source)",
        "See seals.logs.reader.Reader.",
    )
    _check_refusals(name, made)
    if source is None:
        return ReaderReport(name=name, logs=0, rows=0, channels=())
    logs = made.read(source)
    require(
        len(logs) > 0,
        name,
        f"finds no log in {source}",
        "Raise LogError, or return at least one log.",
    )
    for log, again in zip(logs, made.read(source), strict=True):
        _check_log(name, log, again)
    channels = tuple(sorted({stem for log in logs for stem in log.channels()}))
    return ReaderReport(
        name=name, logs=len(logs), rows=sum(log.rows for log in logs), channels=channels
    )


def _check_refusals(name: str, reader: Reader) -> None:
    """Check that files which are not logs are refused with a `LogError`."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "hollow").mkdir()
        (root / "empty.csv").write_bytes(b"")
        (root / "noise.bin").write_bytes(bytes(range(256)) * 16)
        for source in (
            root / "absent.csv",
            root / "hollow",
            root / "empty.csv",
            root / "noise.bin",
        ):
            try:
                logs = reader.read(source)
            except LogError as refusal:
                require(
                    "\n" in str(refusal) or "." in str(refusal),
                    name,
                    "refuses without words",
                    "Say what to do.",
                )
                continue
            except Exception as cause:  # any other error is the breach looked for
                require(
                    False,
                    name,
                    f"answers {source.name} with {type(cause).__name__}: {cause}",
                    "Raise LogError.",
                )
            else:
                require(
                    False, name, f"reads {len(logs)} logs from {source.name}", "Raise LogError."
                )


def _check_log(name: str, log: Log, again: Log) -> None:
    """Check one log: usable, rising time, the same when read again."""
    grave = [finding.message for finding in check_log(log) if finding.severity is Severity.REFUSE]
    require(
        not grave,
        name,
        f"log '{log.name}' cannot be used: {'; '.join(grave)}",
        "Convert it in the reader.",
    )
    same = log.columns.keys() == again.columns.keys() and all(
        np.array_equal(values, again.columns[key], equal_nan=True)
        for key, values in log.columns.items()
    )
    require(same, name, f"log '{log.name}' differs when read again", "Keep no state between calls.")
    for number in np.unique(log.segment):
        steps = np.diff(log.time[log.segment == number])
        require(
            bool((steps > 0.0).all()),
            name,
            f"time does not increase in segment {number}",
            "Sort, or split segments.",
        )
