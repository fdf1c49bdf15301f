"""Page of the water validation: one table, and one picture per case."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from seals.errors import MissingExtra
from seals.experiments.water_validation.case import Case, Grade, Line, Outcome
from seals.logs.atomic import write_text
from seals.report.pictures import write_picture

PAGE, FIGURES = "water_validation.md", "water_validation.json"


class Result(NamedTuple):
    """Result of one case on the page.

    Args:
        case: the case.
        outcome: what it found; None where its data are absent.
        seconds: wall time [s].
        missing: what was absent.
    """

    case: Case
    outcome: Outcome | None
    seconds: float
    missing: str = ""

    @property
    def passed(self) -> bool:
        """Whether no figure is outside its bar."""
        return self.outcome is None or all(line.passed is not False for line in self.outcome.lines)

    def words(self) -> list[str]:
        """Return the figures for a terminal."""
        if self.outcome is None:
            return [f"left out: {self.missing}"]
        return [
            f"{_verdict(line):6} {line.what}: {_number(line.found)} ({_error(line)})"
            for line in self.outcome.lines
        ]


def write_page(folder: Path, results: Sequence[Result], *, grade: Grade, cases: Any) -> Path:
    """Write the page, its pictures and its figures; those of cases not run are kept.

    Args:
        folder: of the page.
        results: of the cases run now.
        grade: how they were run.
        cases: all cases, in the order of the page.
    """
    pictures = folder / "water_validation"
    pictures.mkdir(parents=True, exist_ok=True)
    path = pictures / FIGURES
    # figures of earlier runs stay
    known = dict(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else {}
    for result in results:
        if result.outcome is None:
            continue
        o = result.outcome
        assert o is not None
        known[result.case.name] = {
            "lines": [_plain(line) for line in o.lines],
            "particles": o.particles,
            "spacing": o.spacing,
            "across": o.across,
            "source": o.source,
            "remark": o.remark,
            "seconds": round(result.seconds),
            "command": grade.command(result.case.name),
            "machine": platform.machine() + (", CUDA" if grade.accelerated else ""),
        }
        try:
            write_picture(pictures / f"{result.case.name}.webp", list(result.outcome.charts))
        except MissingExtra as absent:
            print(f"no picture of {result.case.name}: {str(absent).splitlines()[0]}")
    write_text(path, json.dumps(known, indent=1))
    shown = [(case, known[case.name]) for case in cases if case.name in known]
    parts = [_head(shown)] + [_section(case, record, pictures) for case, record in shown]
    write_text(folder / PAGE, "\n".join(parts))
    return folder / PAGE


def _plain(line: Line) -> list[Any]:
    """A line as JSON holds it: nan becomes null."""
    values = [float(x) if isinstance(x, float) else x for x in line]
    return [None if isinstance(x, float) and math.isnan(x) else x for x in values]


def _line(row: list[Any]) -> Line:
    what, found, reference, off, allowed, share = row
    nan = float("nan")
    given = [nan if x is None else float(x) for x in (found, reference, off)]
    return Line(what, given[0], given[1], given[2], allowed, share)


def _head(shown: Sequence[tuple[Case, dict[str, Any]]]) -> str:
    rows = [
        "| case | figure | simulated | reference | error | allowed | |",
        "|---|---|---|---|---|---|---|",
    ]
    for case, record in shown:
        for line in map(_line, record["lines"]):
            bar = "-" if line.allowed is None else _size(line, line.allowed)
            rows.append(
                f"| {case.title} | {line.what} | {_number(line.found)} | "
                f"{_number(line.reference)} | {_error(line)} | {bar} | {_verdict(line)} |"
            )
    return (
        "# Validation of the particle water\n\n"
        "Written by `seals validate water`, case by case; each says how it was run. "
        "Figures without an allowed error are reported but not judged. The error of the drag, as "
        "identified by the diagnosis: [the loop on particle water](water_drag_loop.md). The causes "
        "of missed requirements: [water_misses.md](water_misses.md).\n\n" + "\n".join(rows) + "\n"
    )


def _section(case: Case, r: dict[str, Any], pictures: Path) -> str:
    name = f"{case.name}.webp"
    picture = f"![{case.title}]({pictures.name}/{name})\n" if (pictures / name).is_file() else ""
    facts = (
        f"`{r['command']}` ({r['machine']}): {r['particles']:,} particles of "
        f"{r['spacing'] * 1e3:.3g} mm, {r['across']:.3g} across the reference length; "
        f"{r['seconds']} s. Reference: {r['source']}. {r['remark']}"
    )
    return f"## {case.title}\n\n{facts.strip()}\n\n{picture}"


def _verdict(line: Line) -> str:
    """Return one word on a figure."""
    return {None: "", True: "pass", False: "missed"}[line.passed]


def _error(line: Line) -> str:
    """Return the error as text."""
    return _size(line, line.error)


def _size(line: Line, value: float) -> str:
    if math.isnan(value):
        return "-"
    return f"{value:.1%}" if line.share else f"{value:.1e}"


def _number(value: float) -> str:
    """Return a number as text.

    Example:
        >>> _number(0.12345)
        '0.1235'
    """
    return "-" if math.isnan(value) else f"{value:.4g}"
