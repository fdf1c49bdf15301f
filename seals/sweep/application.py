"""``seals runs``: lists run folders as a table, with file and picture on request.

Conditions select runs: ``state=done, seed<5, robot=*arm``.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from operator import ge, gt, le, lt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.errors import ConfigError, refuse_absent, suggestion
from seals.file_names import refuse_taken
from seals.logs.atomic import write_table
from seals.report.figures import Chart, Series
from seals.report.pictures import write_picture
from seals.sweep.metrics import USUAL, Measures, refuse_unknown
from seals.sweep.rows import (
    FIXED,
    RUN,
    Row,
    Value,
    column_of,
    differing_keys,
    find_rows,
    parts,
    read_value,
    shared_words,
    shown,
    written,
)
from seals.text_table import table as aligned

_SIGNS: dict[str, Callable[[float, float], bool]] = {"<=": le, ">=": ge, "<": lt, ">": gt}
_FORM = re.compile(r"^\s*([^=<>!\s]+)\s*(!=|<=|>=|=|<|>)\s*(.+?)\s*$")


class Condition(NamedTuple):
    """One condition.

    Args:
        key: column.
        sign: one of =, !=, <, <=, > and >=.
        text: to be compared with; for = and != it may hold * and ?.
    """

    key: str
    sign: str
    text: str

    def holds(self, found: Value) -> bool:
        """Return whether a value satisfies the condition; a missing one satisfies only !=."""
        if self.sign in ("=", "!="):
            return self._same(found) == (self.sign == "=")
        bound = read_value(self.text)
        if not isinstance(found, float) or not isinstance(bound, float):
            return False
        return _SIGNS[self.sign](found, bound)

    def _same(self, found: Value) -> bool:
        if isinstance(found, float):
            return found == read_value(self.text)
        if not isinstance(found, str):
            return False
        # brackets are those of lists, no choice of letters; blanks in lists do not count
        pattern, value = (re.sub(r"([\[,])\s+", r"\1", text) for text in (self.text, found))
        return fnmatchcase(value, pattern.replace("[", "[[]"))


def read_conditions(text: str) -> list[Condition]:
    """Parse conditions, separated by commas outside brackets.

    Raises:
        ConfigError: one of them is none.

    Example:
        >>> [c.sign for c in read_conditions("seed<5, initial.position=[0,0,1]")]
        ['<', '=']
    """
    found = []
    for part in parts(text):
        match = _FORM.match(part)
        if match is None:
            raise ConfigError(
                f"where={part.strip()}: this is not a condition.\n"
                "Allowed: KEY=VALUE, KEY!=VALUE, KEY<NUMBER, <=, >, >=, separated by commas"
            )
        key, sign, value = match.groups()
        if sign in _SIGNS and not isinstance(read_value(value), float):
            raise ConfigError(
                f"where={part.strip()}: '{value}' is not a number.\n"
                f"Compare it with = or !=: where={key}={value}"
            )
        found.append(Condition(key, sign, value))
    return found


SUFFIXES = (".png",)
"""Kinds of pictures."""
_NUMBERS = "Its values must be numbers"


def execute(config: Any) -> int:
    """List the runs below a folder; write table and picture on request.

    Raises:
        ConfigError: a setting is wrong, or no run is left.
    """
    refuse_absent(config.folder or None, "folder", "seals runs FOLDER")
    _refuse_targets(config)
    rows = find_rows(Path(str(config.folder)))
    for row in rows:
        if row.damage:
            print(f"note: {row.values[RUN]}: {row.damage}", file=sys.stderr)
    metrics = [name.strip() for name in str(config.metric).split(",") if name.strip()]
    columns = _columns(rows, metrics)
    chosen = _chosen(rows, columns, str(config.where))
    picked = [rows[k] for k in chosen]
    kept = {*FIXED, *differing_keys(picked), *(metrics or USUAL)}
    columns = _picked({key: columns[key] for key in columns if key in kept}, chosen)
    columns = _sorted(columns, str(config.sort))
    shared = " ".join(shared_words(picked)) or "(nothing)"
    print(f"{len(picked)} of {len(rows)} runs; common to all: {shared}")
    # overrides with all digits, metrics with four
    stated = {key for row in rows for key in row.words}
    cells = [
        [(written if key in stated else shown)(value) for value in values]
        for key, values in columns.items()
    ]
    print(aligned([tuple(columns), *zip(*cells, strict=True)], indent=""))
    if config.table is not None:
        table: dict[str, Any] = {}
        for key, values in columns.items():
            if any(isinstance(value, str) for value in values):
                table[key] = ["" if value is None else str(value) for value in values]
            else:
                table[key] = np.array([np.nan if v is None else float(v) for v in values])
        write_table(Path(str(config.table)), table)
        print(f"table: {config.table}")
    if config.plot is not None:
        draw(Path(str(config.plot)), columns, metrics[0], str(config.against), str(config.by))
        print(f"picture: {config.plot}")
    return 0


def _refuse_targets(config: Any) -> None:
    """Refuse files that cannot be written, before anything is read."""
    for key, suffixes in (("table", (".csv", ".parquet")), ("plot", SUFFIXES)):
        value = config.get(key)
        if value is None:
            continue
        path = Path(str(value))
        if path.suffix not in suffixes:
            raise ConfigError(
                f"{key}={value}: '{path.suffix}' is not a file type for {key}.\n"
                f"Allowed: {' or '.join(suffixes)}"
            )
        refuse_taken(path, key=key, replace=config.replace)
    if config.plot is not None and not (config.metric and config.against):
        missing = "against" if config.metric else "metric"
        raise ConfigError(
            f"plot={config.plot}: {missing} is not given.\n"
            "State what to plot: plot=FILE.png metric=position_z.min against=seed"
        )
    for key in ("against", "by"):
        if config.get(key) and config.plot is None:
            raise ConfigError(
                f"{key}={config[key]} belongs to a plot, but no plot is requested.\n"
                f"Name its file, plot=FILE.png, or leave {key} out"
            )


def _columns(rows: Sequence[Row], metrics: Sequence[str]) -> dict[str, list[Value]]:
    """Return the columns of all runs: the fixed ones, overrides that differ, measures."""
    found: dict[str, list[Value]] = {key: [row.get(key) for row in rows] for key in FIXED}
    found |= {key: [row.get(key) for row in rows] for key in differing_keys(rows)}
    readers = [Measures(row) for row in rows]
    for name in metrics or USUAL:
        values: list[Value] = [reader.value(name) for reader in readers]
        if any(value is not None for value in values):
            found[name] = values
        elif metrics:
            refuse_unknown(name, readers[0], rows[0])
    return found


def _chosen(rows: Sequence[Row], columns: Mapping[str, list[Value]], where: str) -> list[int]:
    """Return the indices of the runs that satisfy all conditions."""
    conditions = read_conditions(where)
    known = {*columns, *(key for row in rows for key in row.words)}
    for condition in conditions:
        key = condition.key
        if key not in known and all(row.get(key) is None for row in rows):
            raise ConfigError(
                f"where={where}: no run has '{key}'.\n{suggestion(key, known, label='Columns')}"
            )
    found = [
        k
        for k, row in enumerate(rows)
        if all(
            c.holds(columns[c.key][k] if c.key in columns else row.get(c.key)) for c in conditions
        )
    ]
    if not found:
        raise ConfigError(
            f"where={where}: none of the {len(rows)} runs satisfies it.\nLeave some conditions out."
        )
    return found


def _picked(columns: Mapping[str, list[Value]], places: Sequence[int]) -> dict[str, list[Value]]:
    """Return the columns of some runs, by their indices."""
    return {key: [values[k] for k in places] for key, values in columns.items()}


def _sorted(columns: dict[str, list[Value]], by: str) -> dict[str, list[Value]]:
    if not by:
        return columns
    key = by.removeprefix("-")
    values = column_of(columns, key)
    if values is None:
        raise ConfigError(f"sort={by}: there is no column '{key}'.\n{suggestion(key, columns)}")
    known = [k for k, value in enumerate(values) if value is not None]
    known.sort(key=lambda k: (isinstance(values[k], str), values[k]), reverse=by.startswith("-"))
    order = [*known, *(k for k, value in enumerate(values) if value is None)]
    return _picked(columns, order)


def draw(
    path: Path, columns: Mapping[str, Sequence[Value]], metric: str, against: str, by: str = ""
) -> None:
    """Draw every run as a point, and the mean over runs of equal value as a line.

    Args:
        path: of the picture.
        columns: of the table.
        metric: column on the ordinate.
        against: column on the abscissa, or one place of a column of lists: ``KEY.2``.
        by: column with a line for each of its values; empty for one line.

    Raises:
        ConfigError: a column is not there, or holds no numbers.
    """
    across, up = _numbers(columns, "against", against), _numbers(columns, "metric", metric)
    groups = column_of(columns, by) if by else [metric] * len(across)
    if groups is None:
        raise ConfigError(f"by={by}: it is the same in all runs.\n{suggestion(by, columns)}")
    series: list[Series] = []
    for name in dict.fromkeys(groups):
        mine = np.array([group == name for group in groups]) & np.isfinite(across + up)
        if not mine.any():
            continue
        x, y = across[mine], up[mine]
        places = np.unique(x)
        means = np.array([y[x == place].mean() for place in places])
        label = f"{by}={written(name)}" if by else "mean"
        series += [
            Series(name=label, x=places, y=means),
            Series(name=f"{label}: runs" if by else "runs", x=x, y=y, points=True),
        ]
    if not series:
        raise ConfigError(f"metric={metric}: no run has a number of both.\n{_NUMBERS}.")
    title = f"{metric} against {against}"
    write_picture(path, Chart(title=title, y_label=metric, x_label=against, series=tuple(series)))


def _numbers(columns: Mapping[str, Sequence[Value]], what: str, key: str) -> np.ndarray:
    """Return a column as numbers, NaN where a run has none."""
    values = column_of(columns, key)
    if values is None:
        raise ConfigError(f"{what}={key}: it is the same in all runs.\n{suggestion(key, columns)}")
    words = [value for value in values if isinstance(value, str)]
    if words:
        listed = words[0].startswith("[")
        hint = f"Name one element of the list: {what}={key}.0" if listed else _NUMBERS + "."
        raise ConfigError(f"{what}={key} is '{words[0]}' in a run.\n{hint}")
    return np.array([np.nan if value is None else float(value) for value in values])
