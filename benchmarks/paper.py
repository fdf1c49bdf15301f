"""The AAM-SEALS paper item by item, as a page: ``python benchmarks/paper.py``.

Reads ``benchmarks/paper.yaml`` and writes ``docs/paper.md``; nothing is run, the figures stand on
the pages that each row links. ``--check`` ends with 1 where the page is not that of the rows.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
ROWS, PAGE = ROOT / "benchmarks" / "paper.yaml", ROOT / "docs" / "paper.md"
WORDS = {"yes": "**Y**", "partly": "partly", "no": "**no**"}
HEAD = """# The paper, item by item

Figures, tables, equations and claims of the AAM-SEALS paper ("Developing Aerial-Aquatic
Manipulators in SEa, Air, and Land Simulator"), in its order: the command that does it here, where
it is, a figure from there, and whether it is reached. Of {count} items {yes} are reached, {partly}
partly, {no} not. `FILE`, `FOLDER` and `NAME` stand for yours.

Written by `python benchmarks/paper.py` from `benchmarks/paper.yaml`; a test compares the two, and
every command and link with what is there.
"""
TAIL = """
## Measured and simulated on one axis

![A drop at 4 m/s: measured and simulated acceleration over time](images/drop_overlay.webp)

<!-- run: slow, some minutes, and measurements that are downloaded -->
```console
$ seals compare experiment=impack_entry
```

A hemisphere of the public IMpack data enters water at 4 m/s, which no fit has seen; 2 and 6 m/s
were fitted. The AAM itself has not been built or dropped.
"""


def rows() -> dict[str, list[dict[str, str]]]:
    """Return the rows by section."""
    import yaml

    found: dict[str, list[dict[str, str]]] = yaml.safe_load(ROWS.read_text(encoding="utf-8"))
    return found


def page() -> str:
    """Return the page in Markdown."""
    sections = rows()
    count: Any = Counter(row["reached"] for part in sections.values() for row in part)
    total = sum(count.values())
    parts = [HEAD.format(count=total, yes=count["yes"], partly=count["partly"], no=count["no"])]
    for section, part in sections.items():
        lines = [f"\n## {section}\n"]
        lines += [
            "| paper | shows | command | here | figure | reached |",
            "|---|---|---|---|---|---|",
        ]
        for row in part:
            gap = f": {row['gap']}" if "gap" in row else ""
            cells = [row["paper"], row["shows"], f"`{row['run']}`", row["here"], row["figure"]]
            lines.append("| " + " | ".join([*cells, WORDS[row["reached"]] + gap]) + " |")
        parts.append("\n".join(lines) + "\n")
    return "".join([*parts, TAIL])


def main() -> int:
    """Write or check the page."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--check", action="store_true", help="compare, write nothing")
    if options.parse_args().check:
        return int(PAGE.read_text(encoding="utf-8") != page())
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
