"""Demonstrations as HDF5 and as a data set of Minari.

``data`` holds one group an episode: ``demo_0/obs/state``, ``demo_0/next_obs/state``,
``demo_0/actions``, ``rewards``, ``dones``, and SEALS' own ``terminated`` and ``truncated``. The
metadata stands as JSON in the attribute ``card`` of ``data``.
"""

from __future__ import annotations

import importlib
import io
import json
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import ConfigError, MissingExtra, optional_import
from seals.learn.demonstrations.episode import Demonstrations
from seals.learn.demonstrations.folder import metadata_of
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


_ID = re.compile(r"[A-Za-z0-9_\-/]+-v\d+")


def write_minari(demonstrations: Demonstrations, name: str) -> Path:
    """Write demonstrations into the folder of Minari's local data sets.

    Args:
        demonstrations: to be written; images are left out.
        name: id of the data set, such as ``seals/reach/scripted-v0``.

    Returns:
        Folder of the data set.

    Raises:
        MissingExtra: Minari, or what it needs to make a data set, is not installed.
        ConfigError: the id is none, or there is such a data set.
    """
    if not _ID.fullmatch(name):
        raise ConfigError(
            f"minari={name} is not the id of a data set.\nAllowed: words and a version: "
            "seals/reach-v0"
        )
    try:
        minari = importlib.import_module("minari")
    except ImportError as cause:
        raise MissingExtra(_words(cause)) from cause
    import gymnasium

    seen, done = demonstrations.sizes
    limits: dict[str, Any] = {"dtype": "float32"}
    settings: dict[str, Any] = {
        "observation_space": gymnasium.spaces.Box(-np.inf, np.inf, (seen,), **limits),
        "action_space": gymnasium.spaces.Box(-1.0, 1.0, (done,), **limits),
        "algorithm_name": demonstrations.origin.by or demonstrations.origin.who.value,
        "author": "SEALS",
        "author_email": "none",
        "code_permalink": "none",
        "description": f"{demonstrations.origin.who.value} in {demonstrations.origin.env}",
    }
    buffers = [
        minari.data_collector.EpisodeBuffer(
            id=number,
            seed=episode.seed,
            observations=list(episode.observation),
            actions=list(episode.action),
            rewards=episode.reward.tolist(),
            terminations=episode.terminated.tolist(),
            truncations=episode.truncated.tolist(),
            infos={},
        )
        for number, episode in enumerate(demonstrations.episodes)
    ]
    try:
        with warnings.catch_warnings():
            # the spaces are given: Minari would like the environments beside them
            warnings.filterwarnings("ignore", category=UserWarning, module="minari")
            made = minari.create_dataset_from_buffers(dataset_id=name, buffer=buffers, **settings)
    except ImportError as cause:
        raise MissingExtra(_words(cause)) from cause
    except (ValueError, AssertionError) as cause:
        raise ConfigError(
            f"minari={name} cannot be written: {cause}\nChoose another id."
        ) from cause
    return Path(str(made.storage.data_path))


def _words(cause: ImportError) -> str:
    return (
        f"a Minari data set needs {cause.name or 'minari'}, which is not installed.\n"
        "Install it: pip install minari; or write hdf5=FILE"
    )
