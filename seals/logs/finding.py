"""Finding of a log check: an observation, its severity and a remedy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

LARGEST = 1e15
"""No measured quantity in SI units is larger; squares of such numbers still fit a double."""


class Severity(Enum):
    """Severity of a finding."""

    REFUSE = "refuse"
    """The log cannot be used as it is: results would be wrong."""
    WARN = "warn"
    """Probably a mistake; the log can be used."""
    NOTE = "note"
    """Worth knowing."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One observation about a log.

    Args:
        severity: how grave it is.
        code: short name for programs, such as ``time_backwards``.
        channel: the channel or column concerned; empty for the whole log.
        message: what was seen and what to do, in words.
        count: how many rows, windows or samples show it.
        where: time of the first one [s], where that means something.
    """

    severity: Severity
    code: str
    channel: str
    message: str
    count: int = 0
    where: float | None = None

    def __str__(self) -> str:
        place = f" at t = {self.where:.6g} s" if self.where is not None else ""
        channel = f" {self.channel}" if self.channel else ""
        return f"[{self.severity.value}]{channel}{place}: {self.message}"


def lines_of(findings: Sequence[Finding], *, most: int = 3) -> list[str]:
    """Return findings as lines; columns of which the same is said share one.

    Args:
        findings: in their order.
        most: names of columns in a line.

    Example:
        >>> note = {"severity": Severity.NOTE, "code": "held", "message": "held."}
        >>> lines_of([Finding(**note, channel=c) for c in ("x", "y", "z", "w")])
        ['[note] x, y, z and 1 more: held.']
    """
    groups: dict[tuple[Severity, str, float | None], list[str]] = {}
    for finding in findings:
        key = finding.severity, finding.message, finding.where
        groups.setdefault(key, []).append(finding.channel)
    lines = []
    for (severity, message, where), channels in groups.items():
        more = f" and {len(channels) - most} more" if len(channels) > most else ""
        whole = Finding(
            severity=severity,
            code="",
            channel=", ".join(channels[:most]) + more,
            message=message,
            where=where,
        )
        lines.append(" ".join(str(whole).split()))
    return lines
