"""Layout of the arrays of demonstrations by name, for files and checks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import LogError
from seals.learn.demonstrations.episode import Demonstrations, Episode
from seals.learn.demonstrations.metadata import Declared

Arrays = dict[str, NDArray[Any]]
"""Arrays by path: ``action``, ``next/reward``; the first axis is the step."""


def expected(found: Declared) -> dict[str, tuple[tuple[int, ...], str]]:
    """Return shape and type of every array that metadata declares, by path."""
    steps = sum(found.steps)
    seen, done = found.sizes
    flag = ((steps, 1), "bool")
    out: dict[str, tuple[tuple[int, ...], str]] = {
        "observation": ((steps, seen), "float32"),
        "action": ((steps, done), "float32"),
        "done": flag,
        "terminated": flag,
        "truncated": flag,
        "next/observation": ((steps, seen), "float32"),
        "next/reward": ((steps, 1), "float32"),
        "next/done": flag,
        "next/terminated": flag,
        "next/truncated": flag,
    }
    if found.pixels is not None:
        out["pixels"] = out["next/pixels"] = ((steps, *found.pixels), "uint8")
    return out


def arrays_of(demonstrations: Demonstrations) -> Arrays:
    """Return the arrays in the layout that torchrl's losses and buffers take."""
    rows = demonstrations.transitions()
    none = np.zeros((demonstrations.steps, 1), dtype=bool)
    ends = {name: rows[name][:, None] for name in ("terminated", "truncated")}
    out = {
        "observation": rows["observation"],
        "action": rows["action"],
        "done": none,
        "terminated": none,
        "truncated": none,
        "next/observation": rows["next_observation"],
        "next/reward": rows["reward"][:, None],
        "next/done": ends["terminated"] | ends["truncated"],
        **{f"next/{name}": flags for name, flags in ends.items()},
    }
    if "pixels" in rows:
        out |= {"pixels": rows["pixels"], "next/pixels": rows["next_pixels"]}
    return out


def episodes_of(
    arrays: Mapping[str, NDArray[Any]], found: Declared, *, where: str
) -> list[Episode]:
    """Return the episodes of arrays in the layout.

    Args:
        arrays: by path, of the shapes that :func:`expected` gives.
        found: what the metadata declares.
        where: the folder or file, for the words of a refusal.

    Raises:
        LogError: the arrays contradict each other or the metadata.
    """
    last = np.cumsum(found.steps)
    out = []
    for number, end in enumerate(last):
        rows = slice(int(end) - found.steps[number], int(end))
        part = {name: values[rows] for name, values in arrays.items()}
        try:
            out.append(_episode(part, seed=found.seeds[number], success=found.success[number]))
        except LogError as cause:
            raise LogError(f"{where}: {cause}") from cause
    return out


def _episode(part: Mapping[str, NDArray[Any]], *, seed: int, success: bool) -> Episode:
    images = None
    if "pixels" in part:
        images = joined(part["pixels"], part["next/pixels"], seed)
    return Episode(
        observation=joined(part["observation"], part["next/observation"], seed),
        action=np.ascontiguousarray(part["action"]),
        reward=part["next/reward"][:, 0].copy(),
        terminated=part["next/terminated"][:, 0].astype(bool),
        truncated=part["next/truncated"][:, 0].astype(bool),
        success=success,
        seed=seed,
        pixels=images,
    )


def joined(now: NDArray[Any], following: NDArray[Any], seed: int) -> NDArray[Any]:
    """Return observations with the final one appended to those before every step.

    Raises:
        LogError: what is seen after a step is not what is seen before the next.
    """
    if not np.array_equal(now[1:], following[:-1], equal_nan=now.dtype.kind == "f"):
        raise LogError(
            f"episode of seed {seed}: what a step ends with is not what the next begins with.\n"
            "Steps were lost or mixed: record it again."
        )
    return np.concatenate([now, following[-1:]])
