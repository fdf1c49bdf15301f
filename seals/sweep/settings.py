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
        metric: measures, such as ``position_z.min, steps_per_second``; empty for those that a run
            noted of itself.
        sort: column to sort by, ``-`` in front for the largest first; empty for the folders' order.
        table: file to write, ``.csv`` or ``.parquet``; None for none.
        plot: picture to draw, ``.png``: the first measure against an override.
        against: the override that the picture has on its abscissa.
        by: override that draws a line of its own for each value; empty for one line.
        replace: whether table and picture may be written over.
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
