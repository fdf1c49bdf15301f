"""Text tables for a terminal."""

from __future__ import annotations

from seals.errors import printable


def table(rows: list[tuple[str, ...]], *, indent: str = "  ") -> str:
    """Return rows of text as aligned columns, each cell without the signs that steer a terminal.

    Example:
        >>> print(table([("a", "one"), ("bcd", "two")]))
          a    one
          bcd  two
    """
    rows = [tuple(map(printable, row)) for row in rows]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = (
        indent + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        for row in rows
    )
    return "\n".join(line.rstrip() for line in lines)
