"""Finding of a robot check: subject, verdict, observation and advice."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


class Verdict(enum.Enum):
    """Outcome of a check."""

    OK = "pass"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True, kw_only=True)
class RobotFinding:
    """One line of the check of a robot.

    Args:
        verdict: how it came out.
        subject: what was looked at.
        found: what was found, with units.
        advice: what to do about it; empty when all is well.
    """

    verdict: Verdict
    subject: str
    found: str
    advice: str = ""

    def __str__(self) -> str:
        advice = f" {self.advice}" if self.advice else ""
        return f"[{self.verdict.value}] {self.subject}: {self.found}{advice}"


def passed(subject: str, found: str) -> RobotFinding:
    """Return a finding that needs no advice."""
    return RobotFinding(verdict=Verdict.OK, subject=subject, found=found)


def warned(subject: str, found: str, advice: str) -> RobotFinding:
    """Return a warning."""
    return RobotFinding(verdict=Verdict.WARN, subject=subject, found=found, advice=advice)


def failed(subject: str, found: str, advice: str) -> RobotFinding:
    """Return a failure: the robot cannot be simulated as it is."""
    return RobotFinding(verdict=Verdict.FAIL, subject=subject, found=found, advice=advice)


def triple(values: object) -> str:
    """Return a vector as text.

    Example:
        >>> triple([0.0, -0.0, 1.23456])
        '(0, 0, 1.235)'
    """
    # adding zero turns -0 into 0
    return "(" + ", ".join(f"{float(value) + 0.0:.4g}" for value in np.asarray(values)) + ")"


def listed(names: Sequence[str], most: int = 6) -> str:
    """Return the first names in words, and how many more there are.

    Example:
        >>> listed(list("abcdefgh"))
        'a, b, c, d, e, f and 2 more'
    """
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
