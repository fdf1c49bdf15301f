"""Conditions that select runs: ``state=done, seed<5, robot=*arm``."""

from __future__ import annotations

import re
from collections.abc import Callable
from fnmatch import fnmatchcase
from operator import ge, gt, le, lt
from typing import NamedTuple

from seals.errors import ConfigError
from seals.sweep.rows import Value, parts, read_value

_SIGNS: dict[str, Callable[[float, float], bool]] = {"<=": le, ">=": ge, "<": lt, ">": gt}
_FORM = re.compile(r"^\s*([^=<>!\s]+)\s*(!=|<=|>=|=|<|>)\s*(.+?)\s*$")


class Condition(NamedTuple):
    """One condition.

    Args:
        key: column.
        sign: one of =, !=, <, <=, > and >=.
        text: to be compared with; for = and != it may hold * and ?.
    """

    key: str
    sign: str
    text: str

    def holds(self, found: Value) -> bool:
        """Return whether a value satisfies the condition; a missing one satisfies only !=."""
        if self.sign in ("=", "!="):
            return self._same(found) == (self.sign == "=")
        bound = read_value(self.text)
        if not isinstance(found, float) or not isinstance(bound, float):
            return False
        return _SIGNS[self.sign](found, bound)

    def _same(self, found: Value) -> bool:
        if isinstance(found, float):
            return found == read_value(self.text)
        if not isinstance(found, str):
            return False
        # brackets are those of lists, no choice of letters; blanks in lists do not count
        pattern, value = (re.sub(r"([\[,])\s+", r"\1", text) for text in (self.text, found))
        return fnmatchcase(value, pattern.replace("[", "[[]"))


def read_conditions(text: str) -> list[Condition]:
    """Parse conditions, separated by commas outside brackets.

    Raises:
        ConfigError: one of them is none.

    Example:
        >>> [c.sign for c in read_conditions("seed<5, initial.position=[0,0,1]")]
        ['<', '=']
    """
    found = []
    for part in parts(text):
        match = _FORM.match(part)
        if match is None:
            raise ConfigError(
                f"where={part.strip()}: this is not a condition.\n"
                "Allowed: KEY=VALUE, KEY!=VALUE, KEY<NUMBER, <=, >, >=, separated by commas"
            )
        key, sign, value = match.groups()
        if sign in _SIGNS and not isinstance(read_value(value), float):
            raise ConfigError(
                f"where={part.strip()}: '{value}' is not a number.\n"
                f"Compare it with = or !=: where={key}={value}"
            )
        found.append(Condition(key, sign, value))
    return found
