"""Demonstrations of the former format: memory-mapped files of a TensorDict, read as numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import LogError
from seals.state_file import open_regular

SUFFIX = ".memmap"
"""Ending of the files, one for each array."""
Layout = Mapping[str, tuple[tuple[int, ...], str]]
"""Shape and type of every array of the present format, by name."""


def is_memory_mapped(folder: Path) -> bool:
    """Return whether a folder holds demonstrations of the former format."""
    return (folder / f"action{SUFFIX}").exists()


def read_memory_mapped(folder: Path, steps: list[int], wanted: Layout) -> dict[str, NDArray[Any]]:
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
                f"{folder}: what a step ends with is not what the next begins with, in '{name}'.\n"
                "Steps were lost or mixed: record it again."
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
