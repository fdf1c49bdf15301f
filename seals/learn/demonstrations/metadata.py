"""Metadata of demonstrations: writing, and reading as untrusted input."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from seals.errors import ConfigError, suggestion
from seals.learn.demonstrations.episode import Demonstrations, Origin, Who
from seals.learn.metadata import entry

FORM = "seals-demonstrations"
MOST_EPISODES = 100_000
MOST_STEPS = 20_000_000
MOST_BYTES = 4 * 2**30
"""Of all arrays together: what metadata declares is not believed beyond it."""


@dataclass(frozen=True, kw_only=True)
class Declared:
    """Sizes and names of the files, as the metadata declares them.

    Args:
        origin: where the demonstrations come from.
        steps: of every episode.
        success: of every episode.
        seeds: of every episode.
        sizes: of observation and action.
        pixels: channels, height and width of the images, or None without.
    """

    origin: Origin
    steps: tuple[int, ...]
    success: tuple[bool, ...]
    seeds: tuple[int, ...]
    sizes: tuple[int, int]
    pixels: tuple[int, int, int] | None


def metadata_of(demonstrations: Demonstrations) -> dict[str, Any]:
    """Return the metadata of demonstrations as plain values."""
    from seals.run.provenance import versions

    origin, episodes = demonstrations.origin, demonstrations.episodes
    image = episodes[0].pixels
    return {
        "format": FORM,
        "version": 1,
        "env": origin.env,
        "config_hash": origin.config_hash,
        "who": origin.who.value,
        "human": origin.who is Who.human,
        "by": origin.by,
        "tried": origin.tried,
        "rate": float(origin.rate),
        "observation": list(origin.observation),
        "action": list(origin.action),
        "sizes": list(demonstrations.sizes),
        "pixels": None if image is None else list(image.shape[1:]),
        "steps": [e.steps for e in episodes],
        "success": [bool(e.success) for e in episodes],
        "seeds": [int(e.seed) for e in episodes],
        "returns": [e.earned for e in episodes],
        "versions": versions(),
        "config": dict(origin.config),
    }


def declared(metadata: Mapping[str, Any], *, where: str) -> Declared:
    """Return the declarations of the metadata, checked for types and bounds.

    Args:
        metadata: as read.
        where: file that it stands in, for the words of a refusal.

    Raises:
        ConfigError: an entry is missing, of another type, or beyond its bound.
    """
    who = entry(metadata, "who", str, where=where)
    if who not in [w.value for w in Who]:
        raise ConfigError(f"{where}: who is '{who}'.\n{suggestion(who, [w.value for w in Who])}")
    origin = Origin(
        env=entry(metadata, "env", str, where=where),
        config_hash=entry(metadata, "config_hash", str, where=where),
        who=Who(who),
        by=entry(metadata, "by", str, where=where),
        observation=_items(metadata, "observation", str, where),
        action=_items(metadata, "action", str, where),
        rate=entry(metadata, "rate", float, where=where),
        tried=entry(metadata, "tried", int, where=where),
        config=entry(metadata, "config", dict, where=where),
    )
    sizes = _items(metadata, "sizes", int, where)
    image = None if metadata.get("pixels") is None else _items(metadata, "pixels", int, where)
    found = Declared(
        origin=origin,
        steps=_items(metadata, "steps", int, where),
        success=_items(metadata, "success", bool, where),
        seeds=_items(metadata, "seeds", int, where),
        sizes=(sizes[0], sizes[1]) if len(sizes) == 2 else (0, 0),
        pixels=None if image is None else (*image, 0, 0, 0)[:3],
    )
    _refuse_sizes(found, where)
    return found


def _items(metadata: Mapping[str, Any], name: str, kind: type, where: str) -> tuple[Any, ...]:
    """Return a list, checked to hold items of one type."""
    values = entry(metadata, name, list, where=where)
    for value in values:
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise ConfigError(
                f"{where}: '{name}' holds {value!r}.\nAllowed: values of type {kind.__name__}"
            )
    return tuple(values)


def _refuse_sizes(found: Declared, where: str) -> None:
    """Refuse sizes that contradict one another or exceed the memory."""
    count = len(found.steps)
    if not 1 <= count <= MOST_EPISODES or {len(found.success), len(found.seeds)} != {count}:
        raise ConfigError(
            f"{where} lists {count} episodes, {len(found.success)} outcomes and "
            f"{len(found.seeds)} seeds.\nAllowed: as many of each, 1 to {MOST_EPISODES}"
        )
    total = sum(found.steps)
    if min(found.steps) < 1 or total > MOST_STEPS:
        raise ConfigError(
            f"{where} declares episodes of {min(found.steps)} steps and {total} in all.\n"
            f"Allowed: at least one step each, at most {MOST_STEPS} in all"
        )
    if not all(0 <= seed < 2**63 for seed in found.seeds):
        raise ConfigError(f"{where} holds a seed beyond 64 bits.\nAllowed: 0 to {2**63 - 1}")
    image = found.pixels or (1, 1, 1)
    if min(*found.sizes, *image) < 1:
        raise ConfigError(
            f"{where} declares sizes {found.sizes} and images {found.pixels}.\n"
            "Allowed: whole numbers of at least 1"
        )
    numbers = 2 * found.sizes[0] + found.sizes[1]
    pixels = 2 * image[0] * image[1] * image[2] if found.pixels else 0
    if total * (4 * numbers + pixels) > MOST_BYTES:
        raise ConfigError(
            f"{where} declares {total * (4 * numbers + pixels)} bytes.\nAllowed: {MOST_BYTES}"
        )
