"""Tables of other programs, made from docs/others.yaml: ``python docs/building/others.py``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

DOCS = Path(__file__).resolve().parents[1]
PAGES = {
    "simulators": "index.md",
    "more simulators": "index.md",
    "identification": "coming_from.md",
}
"""Page that holds each table."""
BLANK = (
    "Each entry is linked to the page that says so; a blank cell means that no such page was "
    "found, not that the feature is missing."
)


def read() -> dict[str, Any]:
    """Return the data: the date, and columns, rows and cells of every table."""
    found: dict[str, Any] = yaml.safe_load((DOCS / "others.yaml").read_text(encoding="utf-8"))
    return found


def pairs(cell: list[str]) -> list[tuple[str, str]]:
    """Return the texts of a cell, each with the address of the page that says so."""
    return list(zip(cell[::2], cell[1::2], strict=True))


def table(name: str, data: dict[str, Any]) -> str:
    """Return a table in Markdown, with its date.

    Args:
        name: of the table.
        data: of `read`.
    """
    part = data[name]
    columns = part["columns"]
    heads = [f"[{title}]({address})" if address else title for title, address in columns.items()]
    lines = [f"| | {' | '.join(heads)} |", "|" + "---|" * (len(heads) + 1)]
    for row, cells in part["rows"].items():
        given = (cells.get(title) for title in columns)
        shown = ("; ".join(f"[{text}]({at})" for text, at in pairs(cell or [])) for cell in given)
        lines.append(f"| {row} | {' | '.join(shown)} |")
    return (
        f"Sources were read on {data['date']}, some in copies that are months older. {BLANK}\n\n"
        + "\n".join(lines)
    )


def written(page: str, name: str, data: dict[str, Any]) -> str:
    """Return the text of a page with its table made anew.

    Args:
        page: text of the page, with the two marks of the table.
        name: of the table.
        data: of `read`.
    """
    start = f"<!-- table of others: {name}, python docs/building/others.py -->"
    pattern = re.compile(re.escape(start) + r".*?<!-- end of table -->", re.DOTALL)
    block = f"{start}\n{table(name, data)}\n<!-- end of table -->"
    assert len(pattern.findall(page)) == 1, start
    return pattern.sub(lambda _: block, page)


def main() -> None:
    """Write the tables into their pages."""
    data = read()
    for name, page in PAGES.items():
        path = DOCS / page
        path.write_text(written(path.read_text("utf-8"), name, data), encoding="utf-8")


if __name__ == "__main__":
    main()
