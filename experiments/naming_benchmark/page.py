"""The table of a page that a command writes anew."""

from __future__ import annotations

from pathlib import Path

from seals.errors import ConfigError
from seals.untrusted_io import read_text

BEGIN, END = "<!-- benchmark: begin -->", "<!-- benchmark: end -->"


def into_page(page: Path, text: str) -> None:
    """Put the table between the marks of a page.

    Raises:
        ConfigError: the page has no such marks.
    """
    old = read_text(page)
    before, begin, rest = old.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ConfigError(f"page={page} has no {BEGIN} and {END}.\nPut both on lines of their own.")
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")
