"""Possible outcomes of a diagnosis and their exit codes."""

from __future__ import annotations

from enum import Enum


class Verdict(Enum):
    """Outcome of a diagnosis; `exit_code` is that of the command."""

    nothing_missing = "nothing_missing"
    named = "named"
    ambiguous = "ambiguous"
    none_of_these = "none_of_these"
    cannot_tell = "cannot_tell"
    bad_data = "bad_data"

    @property
    def exit_code(self) -> int:
        """Exit code of the command."""
        return _EXIT_CODES[self.value]


_EXIT_CODES = {
    "nothing_missing": 0,
    "named": 10,
    "ambiguous": 11,
    "none_of_these": 12,
    "cannot_tell": 13,
    "bad_data": 20,
}
