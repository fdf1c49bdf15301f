"""Metadata of demonstrations: writing, and reading as untrusted input."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from seals.errors import ConfigError
from seals.learn.demonstrations.episode import Demonstrations, Origin, Who
from seals.schema import Within, read

FORM = "seals-demonstrations"
MOST_EPISODES = 100_000
MOST_STEPS = 20_000_000
MOST_BYTES = 4 * 2**30
"""Of all arrays together: what metadata declares is not believed beyond it."""


_Size = Annotated[int, Within(1, MOST_BYTES)]


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
    steps: tuple[Annotated[int, Within(1, MOST_STEPS)], ...]
    success: tuple[bool, ...]
    seeds: tuple[Annotated[int, Within(0, 2**63 - 1)], ...]
    sizes: tuple[_Size, _Size]
    pixels: tuple[_Size, _Size, _Size] | None = None


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
    # the entries of the origin stand beside those of the files
    found: Declared = read(
        Declared, {**metadata, "origin": metadata}, where=f"{where}:", extra=True
    )
    count, total = len(found.steps), sum(found.steps)
    if not 1 <= count <= MOST_EPISODES or {len(found.success), len(found.seeds)} != {count}:
        raise ConfigError(
            f"{where} lists {count} episodes, {len(found.success)} outcomes and "
            f"{len(found.seeds)} seeds.\nAllowed: as many of each, 1 to {MOST_EPISODES}"
        )
    image = found.pixels or (1, 1, 1)
    numbers = 2 * found.sizes[0] + found.sizes[1]
    pixels = 2 * image[0] * image[1] * image[2] if found.pixels else 0
    size = total * (4 * numbers + pixels)
    if total > MOST_STEPS or size > MOST_BYTES:
        raise ConfigError(
            f"{where} declares {total} steps of {size} bytes.\n"
            f"Allowed: {MOST_STEPS} steps, {MOST_BYTES} bytes"
        )
    return found
