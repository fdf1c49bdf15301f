"""Export of demonstrations as one HDF5 file, in the layout that robomimic introduced.

``data`` holds one group an episode: ``demo_0/obs/state``, ``demo_0/next_obs/state``,
``demo_0/actions``, ``rewards``, ``dones``, and SEALS' own ``terminated`` and ``truncated``. The
metadata stands as JSON in the attribute ``card`` of ``data``.
"""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import optional_import
from seals.learn.demonstrations.episode import Demonstrations
from seals.learn.demonstrations.metadata import metadata_of
from seals.logs.atomic import atomic_path

_SMALL = 4096
"""Bytes of an array that is not packed."""


def write_hdf5(demonstrations: Demonstrations, path: str | Path) -> Path:
    """Write demonstrations as one HDF5 file, atomically.

    Args:
        demonstrations: to be kept.
        path: of the file, ending in ``.hdf5``.

    Raises:
        MissingExtra: h5py is not installed.
        DiskFull: there is no room for it.
    """
    with optional_import("HDF5 files need h5py", "Install it: pip install 'aam-seals[learn]'"):
        import h5py
    metadata = metadata_of(demonstrations)
    # in memory: HDF5 cannot give up a file whose disk is full
    whole = io.BytesIO()
    with h5py.File(whole, "w", libver="v110") as file:
        data = file.create_group("data")
        data.attrs["card"] = json.dumps(metadata, allow_nan=False)
        data.attrs["total"] = demonstrations.steps
        # what robomimic builds an environment from
        data.attrs["env_args"] = json.dumps(
            {"env_name": metadata["env"], "type": 2, "env_kwargs": {}}, allow_nan=False
        )
        for number, episode in enumerate(demonstrations.episodes):
            group = data.create_group(f"demo_{number}")
            group.attrs["num_samples"] = episode.steps
            out: dict[str, NDArray[Any]] = {
                "obs/state": episode.observation[:-1],
                "next_obs/state": episode.observation[1:],
                "actions": episode.action,
                "rewards": episode.reward,
                "dones": (episode.terminated | episode.truncated).astype(np.uint8),
                "terminated": episode.terminated.astype(np.uint8),
                "truncated": episode.truncated.astype(np.uint8),
            }
            if episode.pixels is not None:
                out |= {"obs/pixels": episode.pixels[:-1], "next_obs/pixels": episode.pixels[1:]}
            for name, values in out.items():
                # packing costs more than it saves where there is little
                packed = {"compression": "gzip", "shuffle": True} if values.nbytes > _SMALL else {}
                group.create_dataset(name, data=values, **packed)
    with atomic_path(path) as beside:
        beside.write_bytes(whole.getbuffer())
    return Path(path)
