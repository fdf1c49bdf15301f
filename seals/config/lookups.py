"""Detection of interpolations in configuration that call a resolver, as ``${oc.env:HOME}``.

A plain reference to another key, ``${time.step}``, is no lookup: it can say nothing that the
configuration does not hold. The project itself uses no resolver below a run's own keys.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from seals.errors import ConfigError

_PLAIN = re.compile(r"\$\{(?!hydra\b)[\w.\[\]-]+\}")
_MOST = 200_000


def lookup_in(content: Any) -> str | None:
    """Return the first text in plain data that calls a resolver, or None.

    What cannot be told apart, such as one reference inside of another, counts as a lookup.

    Example:
        >>> lookup_in({"a": ["${time.step}", 1], "b": "${.c}"}) is None
        True
        >>> lookup_in({"a": ["${oc.env:HOME}"]})
        '${oc.env:HOME}'
    """
    waiting = [content]
    for _ in range(_MOST):
        if not waiting:
            return None
        value = waiting.pop()
        if isinstance(value, Mapping):
            waiting += [*value.keys(), *value.values()]
        elif isinstance(value, list | tuple):
            waiting += value
        elif isinstance(value, str) and "${" in _PLAIN.sub("", value):
            return value
    return f"more than {_MOST:,} entries"


def refuse_lookups(content: Any, *, where: str, remedy: str) -> None:
    """Refuse untrusted configuration that calls a resolver.

    Args:
        content: what a YAML file holds.
        where: its name, for the message.
        remedy: what to do, for the message.

    Raises:
        ConfigError: a text in it asks a resolver.
    """
    found = lookup_in(content)
    if found is not None:
        shown = " ".join(found.split())[:80]
        raise ConfigError(f"{where} looks something up by '{shown}'.\n{remedy}")
