"""Plot of a metric of many runs against one override."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from seals.errors import ConfigError, suggestion
from seals.report.figures import Chart, Series
from seals.report.pictures import write_picture
from seals.sweep.rows import Value, column_of, written

SUFFIXES = (".png",)
"""Kinds of pictures."""
_NUMBERS = "Its values must be numbers"


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
        raise ConfigError(f"by={by}: it differs in no run.\n{suggestion(by, columns)}")
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
        raise ConfigError(f"{what}={key}: it differs in no run.\n{suggestion(key, columns)}")
    words = [value for value in values if isinstance(value, str)]
    if words:
        listed = words[0].startswith("[")
        hint = f"Name one place of the list: {what}={key}.0" if listed else _NUMBERS + "."
        raise ConfigError(f"{what}={key} is '{words[0]}' in a run.\n{hint}")
    return np.array([np.nan if value is None else float(value) for value in values])
