"""Demonstrations as a folder: metadata, and all steps in one file of the format safetensors.

The file holds ``observation`` (before every step and after the last of each episode), ``action``,
``reward``, ``terminated``, ``truncated`` and maybe ``pixels``, episode after episode; how many
steps each has stands in the metadata. Any reader of safetensors opens it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from seals import schema
from seals.errors import ConfigError, LogError
from seals.learn.demonstrations.episode import Demonstrations, Episode, Origin, Who
from seals.learn.metadata import CARD, read_metadata
from seals.learn.tensor_file import library, read_tensors, write_tensors
from seals.logs.atomic import atomic_folder, write_json
from seals.schema import Within
from seals.state_file import open_regular

FILE = "episodes.safetensors"
"""Name of the file in the folder, beside the metadata."""
FLAGS = ("terminated", "truncated")
BEYOND = ("observation", "pixels")
"""Arrays with a row more than an episode has steps."""
_HEADER = 10_000
"""Bytes of the file beside those of the arrays, at most."""


def write(demonstrations: Demonstrations, folder: str | Path, *, replace: bool = False) -> Path:
    """Write demonstrations as a folder, atomically.

    Args:
        demonstrations: to be kept.
        folder: to be made.
        replace: whether a folder of that name is replaced.

    Raises:
        MissingExtra: safetensors is not installed.
        SealsError: the folder exists and must stay.
        DiskFull: there is no room for it.
    """
    library()
    metadata = metadata_of(demonstrations)
    arrays = {
        name: np.concatenate([getattr(e, name) for e in demonstrations.episodes]).astype(kind, "C")
        for name, (_, kind) in _expected(declared(metadata, where=str(folder))).items()
    }
    with atomic_folder(folder, replace=replace) as beside:
        write_tensors(beside / FILE, arrays)
        write_json(beside / CARD, metadata)
    return Path(folder)


def read(folder: str | Path) -> Demonstrations:
    """Read demonstrations from a folder; nothing in it is executed.

    Args:
        folder: that :func:`write` made, or memory-mapped files of the former format.

    Raises:
        ConfigError: metadata or arrays are missing, broken, or larger than they may be.
        LogError: the arrays are not those that the metadata declares.

    Example:
        >>> read("no/such/folder")
        Traceback (most recent call last):
            ...
        seals.errors.ConfigError: demonstrations=no/such/folder: there is no card.json.
        Give the folder that seals record wrote: demonstrations=FOLDER
    """
    path = Path(folder) / FILE
    where = str(path.with_name(CARD))
    found = declared(read_metadata(Path(folder), form=FORM, key="demonstrations"), where=where)
    wanted = _expected(found)
    # whether a folder holds demonstrations of the former format
    if (path.parent / f"action{SUFFIX}").exists() and not path.exists():
        arrays = _read_memory_mapped(path.parent, list(found.steps), wanted)
    else:
        size = sum(math.prod(shape) * np.dtype(kind).itemsize for shape, kind in wanted.values())
        arrays = read_tensors(path, most=size + _HEADER)
    given = {name: (values.shape, values.dtype.name) for name, values in arrays.items()}
    if given != wanted:
        apart = min(name for name in {*given, *wanted} if given.get(name) != wanted.get(name))
        shape, kind = wanted.get(apart, ("none", ""))
        raise LogError(
            f"{path}: '{apart}' is {given.get(apart, 'missing')}.\n"
            f"The metadata says: {shape} {kind}"
        )
    arrays |= {name: arrays[name] != 0 for name in FLAGS}
    ends = np.cumsum(found.steps)[:-1]
    beyond = ends + np.arange(1, len(found.steps))
    parts = {n: np.split(x, beyond if n in BEYOND else ends) for n, x in arrays.items()}
    try:
        episodes = [
            Episode(**{n: x[k] for n, x in parts.items()}, success=success, seed=found.seeds[k])
            for k, success in enumerate(found.success)
        ]
    except LogError as cause:
        raise LogError(f"{path}: {cause}") from cause
    return Demonstrations(origin=found.origin, episodes=episodes)


def _expected(found: Declared) -> dict[str, tuple[tuple[int, ...], str]]:
    """Return shape and type of every array that metadata declares, by name."""
    steps = sum(found.steps)
    rows, (seen, done) = steps + len(found.steps), found.sizes
    out: dict[str, tuple[tuple[int, ...], str]] = {
        "observation": ((rows, seen), "float32"),
        "action": ((steps, done), "float32"),
        "reward": ((steps,), "float32"),
        **dict.fromkeys(FLAGS, ((steps,), "uint8")),
    }
    return out if found.pixels is None else {**out, "pixels": ((rows, *found.pixels), "uint8")}


SUFFIX = ".memmap"
"""Ending of the files, one for each array."""
Layout = Mapping[str, tuple[tuple[int, ...], str]]
"""Shape and type of every array of the present format, by name."""


def _read_memory_mapped(folder: Path, steps: list[int], wanted: Layout) -> dict[str, NDArray[Any]]:
    """Read the arrays in the present layout; descriptions by tensordict are not looked at.

    Args:
        folder: as ``TensorDict.memmap`` wrote it.
        steps: of each episode.
        wanted: of the present format.

    Raises:
        LogError: a file is missing, of another size than the metadata declares, or what a step ends
            with is not what the next begins with.
    """
    total, ends = sum(steps), np.cumsum(steps)
    inner = np.ones(total, dtype=bool)
    inner[[0, *ends[:-1]]] = False
    out = {}
    for name, (shape, kind) in wanted.items():
        if name == "action":
            out[name] = _numbers(folder / f"{name}{SUFFIX}", shape, kind)
            continue
        rows = (total, *shape[1:])
        following = _numbers(folder / "next" / f"{name}{SUFFIX}", rows, kind)
        if shape[0] == total:
            out[name] = following
            continue
        now = _numbers(folder / f"{name}{SUFFIX}", rows, kind)
        if not np.array_equal(now[1:][inner[1:]], following[:-1][inner[1:]]):
            raise LogError(
                f"{folder}: the end of a step differs from the beginning of the next, in "
                f"'{name}'.\n"
                "Steps were lost or mixed: record the demonstrations again."
            )
        out[name] = np.insert(now, ends, following[ends - 1], axis=0)
    return out


def _numbers(path: Path, shape: tuple[int, ...], kind: str) -> NDArray[Any]:
    size = math.prod(shape) * np.dtype(kind).itemsize
    if not path.is_file() or path.stat().st_size != size:
        given = f"{path.stat().st_size} bytes" if path.is_file() else "missing"
        raise LogError(f"{path} is {given}.\nThe metadata promises {size} bytes.")
    with open_regular(path) as file:
        return np.frombuffer(file.read(size), dtype=kind).reshape(shape)


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
    found: Declared = schema.read(
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
