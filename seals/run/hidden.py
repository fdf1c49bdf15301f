"""Hidden effects: they act in a run but are absent from the stated model of its log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from seals.errors import ConfigError, suggestion
from seals.registry import get

WAVES = "waves"
"""Name under which the waves of a run are hidden."""


def hide(
    names: Sequence[str], effects: Sequence[Mapping[str, Any]], wave: Any, *, key: str = "hide"
) -> tuple[set[str], dict[str, Any]]:
    """Return the instances to hide by their names, and changes of the environment's entries.

    Args:
        names: of instances or of effects, or ``waves``.
        effects: entries of the stated model with ``name`` and ``instance``.
        wave: entry of the waves, or None for none.
        key: that gave the names, for messages.

    Raises:
        ConfigError: no effect has such a name.

    Example:
        >>> drift = [{"name": "current", "instance": "drift"}]
        >>> hide(["current"], drift, None)
        ({'drift'}, {})
    """
    found: set[str] = set()
    change: dict[str, Any] = {}
    for name in names:
        own = {str(e.get("instance", e["name"])) for e in effects if _means(e, name)}
        if name == WAVES and _waves(wave):
            change = {"wave": None}
        elif not own:
            known = [str(e.get("instance", e["name"])) for e in effects]
            raise ConfigError(
                f"{key}={name}: there is no such effect in the stated model.\n"
                f"{suggestion(name, [*known, *([WAVES] if _waves(wave) else [])])}"
            )
        found |= own
    return found, change


def holds(name: str, effects: Sequence[Mapping[str, Any]], wave: Any) -> bool:
    """Return whether a stated model holds an effect, or waves, of a name; see `hide`."""
    return any(_means(e, name) for e in effects) or (name == WAVES and _waves(wave))


def _waves(wave: Any) -> bool:
    """Return whether waves, or their entry, are other than still water."""
    if isinstance(wave, Mapping):
        return wave.get("wave") != "still"
    return wave is not None and type(wave) is not get("wave", "still").load()


def _means(entry: Mapping[str, Any], name: str) -> bool:
    return name in (entry.get("instance"), entry["name"])
