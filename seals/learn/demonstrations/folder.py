"""Demonstrations as a folder: metadata, and all steps in one file of the format safetensors.

The file holds ``observation`` (before every step and after the last of each episode), ``action``,
``reward``, ``terminated``, ``truncated`` and maybe ``pixels``, episode after episode; how many
steps each has stands in the metadata. Any reader of safetensors opens it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import LogError
from seals.learn.demonstrations.episode import Demonstrations, Episode
from seals.learn.demonstrations.metadata import FORM, Declared, declared, metadata_of
from seals.learn.metadata import CARD, read_metadata
from seals.learn.tensor_file import library, read_tensors, write_tensors
from seals.logs.atomic import atomic_folder, write_json
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
