"""No page is longer than a sitting; those that one looks things up in are named."""

from __future__ import annotations

from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
MOST = 2_000
"""Words of a page, tables and code included."""
LOOKED_UP = {
    "glossary.md": "terms, by subject",
    "paper.md": "items of the paper, each with the command that shows it",
    "security.md": "guards, each with its test",
    "thresholds.md": "numbers of the policy, each with its reason",
    "water_validation.md": "errors, case by case",
}
"""Tables that nobody reads from end to end, and what their rows are."""


def prose(text: str) -> int:
    """Count the words that stand in no row of a table and in no list of sources."""
    read = text.partition("\n## Sources\n")[0]
    return sum(len(line.split()) for line in read.splitlines() if not line.startswith("|"))


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda page: page.stem)
def test_a_page_is_read_in_a_sitting(page: Path) -> None:
    """Of a table that one looks things up in, the words around the rows are."""
    text = page.read_text(encoding="utf-8")
    looked_up = page.name in LOOKED_UP
    assert (prose(text) if looked_up else len(text.split())) <= MOST
    # a page that has become short needs no exception
    assert looked_up == (len(text.split()) > MOST)
