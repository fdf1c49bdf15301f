"""The glossary: each term once, with a source that is listed; effects and kinds are in it."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from seals import registry

PAGE = Path(__file__).parents[2] / "docs" / "glossary.md"
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.read_text(encoding="utf-8").splitlines()
    if line.startswith("|") and not line.startswith(("| term", "|---"))
]
TERMS = {re.sub(r"`[^`]*`", "", row[0]).strip(" ,").casefold() for row in ROWS}
TYPED = set(re.findall(r"`([^`]+)`", " ".join(row[0] for row in ROWS)))
"""What the first column says that a configuration or a program types."""


def test_each_row_has_term_symbol_unit_meaning_and_source() -> None:
    """Five cells, none empty, and no term twice."""
    assert [row for row in ROWS if len(row) != 5 or not all(row)] == []
    assert [term for term, n in Counter(row[0].casefold() for row in ROWS).items() if n > 1] == []
    assert len(TERMS) == len(ROWS)


@pytest.mark.parametrize("name", registry.names("effect"))
def test_an_effect_of_seals_is_in_the_glossary(name: str) -> None:
    """Its registered name stands beside a term; effects of other packages need not."""
    if registry.get("effect", name).distribution == "aam-seals":
        assert name in TYPED


@pytest.mark.parametrize("kind", registry.GROUPS)
def test_a_kind_of_plugin_is_in_the_glossary(kind: str) -> None:
    """It is a term, or what one types beside a term."""
    assert kind in TERMS or {kind, f"{kind}="} & TYPED


def test_each_source_is_listed() -> None:
    """A name in the last column begins an entry of the list of sources."""
    listed = PAGE.read_text(encoding="utf-8").partition("## Sources")[2]
    cited = {part for row in ROWS for part in row[4].split(", ") if part != "–"}
    for source in cited:
        author, _, year = source.replace(" et al.", "").rpartition(" ")
        entries = [e for e in listed.splitlines() if (author or source).split(" ")[0] in e]
        assert any(year in entry for entry in entries), source
