"""Cards: small JSON files that say what lies beside them, read without trust."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from seals.errors import ConfigError, suggestion

CARD = "card.json"
_MOST_BYTES = 1_000_000
"""Of a card: a stranger's file is not read without a bound."""

T = TypeVar("T")


def read_card(folder: Path, *, form: str, key: str) -> dict[str, Any]:
    """Read the card of a folder.

    Args:
        folder: that holds `CARD`.
        form: what the card must say that it is, as ``seals-policy``.
        key: of the command line that named the folder, for the words of a refusal.

    Raises:
        ConfigError: there is no card, it cannot be read, or it is that of something else.
    """
    path = folder / CARD
    if not folder.is_dir() or not path.is_file() or path.is_symlink():
        below = sorted(path.parent for path in folder.glob(f"*/{CARD}"))
        advice = f"Did you mean {key}={below[0]}?" if below else "Give a folder that holds one."
        raise ConfigError(f"{key}={folder}: there is no {CARD}.\n{advice}")
    if path.stat().st_size > _MOST_BYTES:
        raise ConfigError(f"{path} has {path.stat().st_size} bytes.\nAllowed: {_MOST_BYTES}")
    try:
        card = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as cause:
        raise ConfigError(f"{path} cannot be read: {cause}.\nIt must be JSON.") from cause
    return checked_card(card, form=form, where=str(path))


def checked_card(card: Any, *, form: str, where: str) -> dict[str, Any]:
    """Return what was read as a card of a form, or refuse it.

    Raises:
        ConfigError: it is none.
    """
    if not isinstance(card, dict) or card.get("format") != form:
        given = card.get("format") if isinstance(card, dict) else type(card).__name__
        raise ConfigError(f"{where} is of the format {given!r}.\nAllowed here: '{form}'")
    if card.get("version") != 1:
        raise ConfigError(
            f"{where} is of version {card.get('version')!r}.\nThis program reads version 1: update."
        )
    return card


def entry(card: Mapping[str, Any], name: str, kind: type[T], *, where: str) -> T:
    """Return an entry of a card, of the type that it must have.

    Raises:
        ConfigError: it is missing or of another type.
    """
    if name not in card:
        raise ConfigError(f"{where} has no '{name}'.\n{suggestion(name, map(str, card))}")
    value = card[name]
    # a truth value is an integer to Python, but not to a reader
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if not isinstance(value, kind) or (kind is not bool and isinstance(value, bool)):
        raise ConfigError(
            f"{where}: '{name}' is {value!r}.\nAllowed: a value of type {kind.__name__}"
        )
    return value


def config_hash(config: Mapping[str, Any]) -> str:
    """Return a short name of a configuration: equal for equal values, whatever their order.

    Example:
        >>> config_hash({"a": 1, "b": 2.0}) == config_hash({"b": 2.0, "a": 1})
        True
    """
    text = json.dumps(config, sort_keys=True, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
