"""Packed demonstrations: one compressed ``.npz`` file in place of the memory-mapped files.

Each observation is held once, not again as the next step's, and the bytes are deflated: less than
half of the size. Demonstrations that come with a robot are kept so.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from seals.errors import LogError
from seals.learn.demonstrations.episode import Demonstrations, Episode
from seals.learn.demonstrations.metadata import Declared
from seals.logs.arrays import read_npz

PACKED = "episodes.npz"
"""Name of the file in the folder, beside the metadata."""
_ROWS = ("action", "reward", "terminated", "truncated")


def write_packed(demonstrations: Demonstrations, folder: Path) -> Path:
    """Write the arrays of demonstrations without images as one compressed file.

    Args:
        demonstrations: to be kept; observations, actions and rewards in single precision.
        folder: which exists.
    """
    every = demonstrations.episodes
    arrays = {name: np.concatenate([getattr(e, name) for e in every]) for name in _ROWS}
    observation = np.concatenate([e.observation for e in every])
    flags = {name: arrays[name].astype(np.uint8) for name in ("terminated", "truncated")}
    # by column: neighbouring numbers are alike, and deflate to less
    arrays |= {"observation": observation.T, "action": arrays["action"].T, **flags}
    np.savez_compressed(folder / PACKED, allow_pickle=False, **arrays)
    return folder / PACKED


def read_packed(folder: Path, found: Declared) -> list[Episode]:
    """Return the episodes of a packed file.

    Args:
        folder: that holds it.
        found: what the metadata declares.

    Raises:
        LogError: it is damaged, or not of the size that the metadata declares.
    """
    path, total = folder / PACKED, sum(found.steps)
    arrays = read_npz(path, ("observation", *_ROWS))
    seen, done = found.sizes
    wanted = {"observation": (seen, total + len(found.steps)), "action": (done, total)}
    for name, values in arrays.items():
        shape = wanted.get(name, (total,))
        if values.shape != shape:
            raise LogError(
                f"{path}: '{name}' has the shape {values.shape}.\nThe metadata says: {shape}"
            )
    ends = np.cumsum(found.steps)[:-1]
    rows = {name: np.split(arrays[name].T, ends) for name in _ROWS}
    observations = np.split(arrays["observation"].T, ends + np.arange(1, len(found.steps)))
    try:
        return [
            Episode(
                observation=np.ascontiguousarray(observations[k], np.float32),
                action=np.ascontiguousarray(rows["action"][k], np.float32),
                reward=rows["reward"][k].astype(np.float32),
                terminated=rows["terminated"][k] != 0.0,
                truncated=rows["truncated"][k] != 0.0,
                success=found.success[k],
                seed=found.seeds[k],
            )
            for k in range(len(found.steps))
        ]
    except LogError as cause:
        raise LogError(f"{path}: {cause}") from cause
