"""The AAM-SEALS paper item by item, as a page: ``python benchmarks/paper.py``.

Reads ``benchmarks/paper.yaml`` and writes ``docs/paper.md``; nothing is run, the figures stand on
the pages that each row links. ``--check`` ends with 1 where the page is not that of the rows.
``--run`` runs every command anew, in the present folder, and writes no page; those with ``FILE``,
``FOLDER`` or ``NAME`` and those that need a person are left out.
"""

from __future__ import annotations

import argparse
import re
import shlex
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
ROWS, PAGE = ROOT / "benchmarks" / "paper.yaml", ROOT / "docs" / "paper.md"
WORDS = {"yes": "**Y**", "partly": "partly", "no": "**no**"}
HEAD = """# The paper, item by item

This page lists the figures, tables, equations and claims of the AAM-SEALS paper ("Developing
Aerial-Aquatic Manipulators in SEa, Air, and Land Simulator") in its order. Each row states the
command of SEALS, the page that shows the result, a figure from that page, and whether the item is
reached. Of {count} items {yes} are reached, {partly} partly, {no} not. Replace `FILE`, `FOLDER` and
`NAME` by your own.

The page is written by `python benchmarks/paper.py` from `benchmarks/paper.yaml`; a test compares
the two, and checks every command and link. `python benchmarks/paper.py --run` runs the commands
again (days with the trainings; `--only check` for some, `--seconds 60` for the fast ones).
"""
TAIL = """
## Measured and simulated on one axis

![A drop at 4 m/s: measured and simulated acceleration over time](images/drop_overlay.webp)

<!-- run: slow, 2 min: measurements, downloaded where SEALS_DATA names no folder -->
```console
$ seals compare experiment=impack_entry
```

A hemisphere of the public IMpack data enters water at 4 m/s, a speed that was not fitted; 2 and
6 m/s were fitted. The AAM itself has not been built or dropped.
"""


def rows() -> dict[str, list[dict[str, str]]]:
    """Return the rows by section."""
    import yaml

    return yaml.safe_load(ROWS.read_text(encoding="utf-8"))


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


def run_anew(seconds: float, only: str) -> int:
    """Run the commands, and print exit code, duration and last line of each.

    Args:
        seconds: after which a command is ended [s].
        only: what those that are run contain.

    Returns:
        1 if one failed. Diagnoses end with 10 or more where they find something.
    """
    commands = dict.fromkeys(row["run"] for part in rows().values() for row in part)
    programs = {"seals": ["-m", "seals.cli"], "pytest": ["-m", "pytest", "-q"], "python": []}
    failed = 0
    for command in commands:
        if only not in command or re.search(r"\b(FILE|FOLDER|NAME|teleop)\b", command):
            continue
        program, *words = shlex.split(command)
        words = [str(ROOT / w) if w.startswith("tests/") else w for w in words]
        begin = time.perf_counter()
        try:
            done = subprocess.run(
                [sys.executable, "-P", *programs[program], *words],
                capture_output=True, text=True, timeout=seconds, check=False,
            )  # fmt: skip
            code, said = str(done.returncode), (done.stdout + done.stderr).strip()
        except subprocess.TimeoutExpired:
            code, said = "late", ""
        failed |= code not in ("0", "10", "11", "12", "late")
        last = said.splitlines()[-1][:100] if said else ""
        print(f"{code:>4} {time.perf_counter() - begin:5.0f} s  {command}  {last}", flush=True)
    return failed


def main() -> int:
    """Write, check or run the page."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--check", action="store_true", help="compare, write nothing")
    options.add_argument("--run", action="store_true", help="run all commands anew")
    options.add_argument("--seconds", type=float, default=7200.0, help="time of each")
    options.add_argument("--only", default="", help="commands that contain this")
    given = options.parse_args()
    if given.run:
        return run_anew(given.seconds, given.only)
    if given.check:
        return int(PAGE.read_text(encoding="utf-8") != page())
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
