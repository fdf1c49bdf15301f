"""The page of the water's validation: one table, one picture a case."""

from __future__ import annotations

import math
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from seals.errors import MissingExtra
from seals.experiments.water_validation.case import Case, Line, Outcome
from seals.logs.atomic import write_text
from seals.report.pictures import write_picture

PAGE = "water_validation.md"


class Result(NamedTuple):
    """One case as it went.

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
            f"{verdict(line):6} {line.what}: {number(line.found)} ({error(line)})"
            for line in self.outcome.lines
        ]


def write_page(folder: Path, results: Sequence[Result], *, full: bool) -> Path:
    """Write the page and its pictures; other cases' pictures stay."""
    pictures = folder / "water_validation"
    pictures.mkdir(parents=True, exist_ok=True)
    parts = [_head(results, full=full)]
    for result in results:
        parts.append(_section(result, pictures))
    write_text(folder / PAGE, "\n".join(parts))
    return folder / PAGE


def _head(results: Sequence[Result], *, full: bool) -> str:
    mode = "full" if full else "quick"
    rows = [
        "| case | figure | simulated | reference | error | allowed | |",
        "|---|---|---|---|---|---|---|",
    ]
    for result in results:
        if result.outcome is None:
            rows.append(f"| {result.case.title} | left out: {result.missing} | | | | | |")
            continue
        for line in result.outcome.lines:
            bar = "-" if line.allowed is None else _size(line, line.allowed)
            rows.append(
                f"| {result.case.title} | {line.what} | {number(line.found)} | "
                f"{number(line.reference)} | {error(line)} | {bar} | {verdict(line)} |"
            )
    return (
        "# Validation of the particle water\n\n"
        f"Written by `seals validate water{' --full' if full else ''}` "
        f"({mode} mode, {platform.machine()}). "
        "Figures without a bar are published, not judged. What the water gets wrong of a "
        "textbook's drag, found by the diagnosis: [water_drag_loop.md](water_drag_loop.md).\n\n"
        + "\n".join(rows)
        + "\n"
    )


def _section(result: Result, pictures: Path) -> str:
    if result.outcome is None:
        return ""
    o = result.outcome
    name = f"{result.case.name}.png"
    try:
        write_picture(pictures / name, list(o.charts))
        picture = f"![{result.case.title}]({pictures.name}/{name})\n"
    except MissingExtra:
        picture = ""
    facts = (
        f"{o.particles:,} particles of {o.spacing * 1e3:.3g} mm, {o.across:.3g} across the length "
        f"that matters; {result.seconds:.0f} s. Reference: {o.source}. {o.remark}"
    )
    return f"## {result.case.title}\n\n{facts.strip()}\n\n{picture}"


def verdict(line: Line) -> str:
    """Return one word on a figure."""
    return {None: "", True: "pass", False: "missed"}[line.passed]


def error(line: Line) -> str:
    """Return the error as text."""
    return _size(line, line.error)


def _size(line: Line, value: float) -> str:
    if math.isnan(value):
        return "-"
    return f"{value:.1%}" if line.share else f"{value:.1e}"


def number(value: float) -> str:
    """Return a number as text.

    Example:
        >>> number(0.12345)
        '0.1235'
    """
    return "-" if math.isnan(value) else f"{value:.4g}"
