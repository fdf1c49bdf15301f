"""Export of demonstrations as a Minari data set."""

from __future__ import annotations

import importlib
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import ConfigError, MissingExtra
from seals.learn.demonstrations.episode import Demonstrations

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
            f"minari={name} is no id of a data set.\nAllowed: words and a version: seals/reach-v0"
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
