"""Typed settings of ``seals runs``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from seals.field_roles import roles


@roles(
    data="name where metric sort against by",
    read="folder",
    write="table plot",
    permission="replace",
)
@dataclass(kw_only=True)
class RunsSettings:
    """Settings of ``seals runs``: selection, columns and output.

    Args:
        name: of the listing, part of the name of Hydra's own folder.
        folder: folder in which runs are searched, at any depth.
        where: conditions that a run must meet, such as ``state=done, seed<5``; empty for all.
        metric: measures, such as ``position_z.min, steps_per_second``; empty for those that the run
            recorded.
        sort: column to sort by, with ``-`` in front for descending order; empty for the order of
            folders.
        table: file to write, ``.csv`` or ``.parquet``; None for none.
        plot: plot to write, ``.png``: the first measure against an override.
        against: override on the abscissa of the plot.
        by: override with one line for each of its values; empty for a single line.
        replace: whether existing files may be overwritten.
    """

    name: str = "runs"
    folder: str | None = None
    where: str = ""
    metric: str = ""
    sort: str = ""
    table: str | None = None
    plot: str | None = None
    against: str = ""
    by: str = ""
    replace: bool = False


_TEXTS = ("folder", "where", "metric", "sort", "table", "plot", "against", "by")


def quoted(words: Sequence[str]) -> list[str]:
    """Return the words of ``seals runs`` with their values in quotes.

    Conditions hold characters of Hydra's grammar.

    Example:
        >>> quoted(["where=seed<5, state=done", "replace=true"])
        ["where='seed<5, state=done'", 'replace=true']
    """
    found = []
    for word in words:
        key, sign, value = word.partition("=")
        if key in _TEXTS and value[:1] not in "'\"" and not word.startswith("-"):
            value = "'" + value.replace("'", "\\'") + "'"
        found.append(word if word.startswith("-") else f"{key}{sign}{value}")
    return found
