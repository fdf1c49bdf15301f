"""Tables of other programs come from one dated file, and each entry has its source."""

from __future__ import annotations

import datetime
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS / "building"))

from others import PAGES, pairs, read, table, written  # noqa: E402


@pytest.mark.parametrize("name", PAGES)
def test_a_page_holds_its_table_as_it_is_made(name: str) -> None:
    """Nothing on the page was changed by hand."""
    page = (DOCS / PAGES[name]).read_text(encoding="utf-8")
    assert written(page, name, read()) == page


@pytest.mark.parametrize("name", PAGES)
def test_each_entry_has_a_source(name: str) -> None:
    """A text and an address: a page of the web for others, one of these pages for SEALS."""
    data = read()
    assert isinstance(data["date"], datetime.date)
    part = data[name]
    for row, cells in part["rows"].items():
        assert set(cells) <= set(part["columns"]), row
        assert "SEALS" in cells or "SEALS" not in part["columns"]
        entries = [(title, *pair) for title, cell in cells.items() for pair in pairs(cell)]
        assert {title for title, *_ in entries} == set(cells), row
        for title, text, address in entries:
            assert text, row
            own = address.split("#")[0]
            if title != "SEALS":
                assert address.startswith("https://"), (row, title)
            elif not own.startswith("reference/"):
                assert (DOCS / own).is_file(), (row, own)


def test_an_entry_of_two_sources_has_two_links() -> None:
    """Each text leads to the page that says so; a text without an address is refused."""
    data = read()
    data["simulators"]["rows"]["land"]["Gazebo"] = [
        "wheels",
        "https://a.b",
        "tracks",
        "https://c.d",
    ]
    assert "| [wheels](https://a.b); [tracks](https://c.d) |" in table("simulators", data)
    with pytest.raises(ValueError, match="shorter"):
        pairs(["wheels", "https://a.b", "tracks"])


def test_what_no_page_was_found_for_is_blank() -> None:
    """An entry that is taken out of the data leaves its cell empty, and a sentence says so."""
    data = read()
    del data["simulators"]["rows"]["land"]["Gazebo"]
    made = table("simulators", data)
    row = next(line for line in made.splitlines() if line.startswith("| land"))
    assert row.split(" | ")[4].strip() == ""
    assert "a blank cell means that no such page was found" in made
