"""Demonstrations as one HDF5 file, in the layout that robomimic introduced.

``data`` holds one group an episode: ``demo_0/obs/state``, ``demo_0/next_obs/state``,
``demo_0/actions``, ``rewards``, ``dones``, and SEALS' own ``terminated`` and ``truncated``. The
metadata stands as JSON in the attribute ``card`` of ``data``.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import ConfigError, LogError, optional_import
from seals.isolated_reading import read_isolated
from seals.learn.demonstrations.episode import Demonstrations, Episode
from seals.learn.demonstrations.metadata import FORM, Declared, declared, metadata_of
from seals.learn.metadata import check_metadata
from seals.logs.atomic import atomic_path
from seals.untrusted_io import plain_json

_FILTERS = {1: "gzip", 2: "shuffle", 3: "fletcher32"}
"""Filters of HDF5 itself; any other would load a library from this machine."""
_MOST_CARD = 1_000_000
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
    h5py = _h5py()
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
            for name, values in _columns(episode).items():
                # packing costs more than it saves where there is little
                packed = {"compression": "gzip", "shuffle": True} if values.nbytes > _SMALL else {}
                group.create_dataset(name, data=values, **packed)
    with atomic_path(path) as beside:
        beside.write_bytes(whole.getbuffer())
    return Path(path)


def read_hdf5(path: str | Path) -> Demonstrations:
    """Read demonstrations from an HDF5 file that :func:`write_hdf5` wrote.

    Links, objects, foreign filters and arrays of other sizes than the card's are refused.

    Raises:
        MissingExtra: h5py is not installed.
        ConfigError: the metadata is missing, broken, or declares too much.
        LogError: the file cannot be read, or holds something else than the metadata declares.
    """
    _h5py()
    place = Path(path)
    if not place.is_file() or place.is_symlink():
        raise ConfigError(f"demonstrations={path}: there is no such file.\nGive an HDF5 file.")
    found = read_isolated(f"{__name__}:hdf5_content", place)
    return Demonstrations(
        origin=declared(found["card"], where=str(place)).origin,
        episodes=[Episode(**fields) for fields in found["episodes"]],
    )


def hdf5_content(place: Path) -> dict[str, Any]:
    """Return the metadata of an HDF5 file, ``card``, and the fields of its ``episodes``.

    A damaged file can crash the library or let it hang: call it by `read_isolated`.

    Raises:
        ConfigError: the metadata is missing, broken, or declares too much.
        LogError: the file cannot be read, or holds something else than the metadata declares.
    """
    h5py = _h5py()
    try:
        with h5py.File(place, "r") as file:
            data = _group(file, "data", place)
            card = dict(_metadata(data, place))
            found = declared(card, where=str(place))
            episodes = [_episode(data, number, found, place) for number in range(len(found.steps))]
    except (OSError, KeyError, RuntimeError, ValueError) as cause:
        raise LogError(
            f"{place} cannot be read: {cause}.\nIt must be a whole HDF5 file."
        ) from cause
    return {"card": card, "episodes": episodes}


def _columns(episode: Episode) -> dict[str, NDArray[Any]]:
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
    return out


def _metadata(data: Any, place: Path) -> Mapping[str, Any]:
    text = data.attrs.get("card")
    if not isinstance(text, str) or len(text) > _MOST_CARD:
        raise ConfigError(
            f"{place} has no metadata, or one that is too long.\n"
            "Give a file that seals record wrote: who showed what is not to be guessed."
        )
    try:
        metadata = plain_json(text)
    except ValueError as cause:
        raise ConfigError(
            f"{place}: its metadata cannot be read: {cause}.\nIt must be JSON."
        ) from cause
    return check_metadata(metadata, form=FORM, where=f"{place}, card")


def _group(parent: Any, name: str, place: Path) -> Any:
    """Return a group that is stored in the file itself, not behind a link."""
    import h5py

    child = parent.get(name) if isinstance(parent.get(name, getlink=True), h5py.HardLink) else None
    if not isinstance(child, h5py.Group):
        raise LogError(f"{place}: '{parent.name}/{name}' is missing or a link.\nAllowed: a group")
    return child


def _episode(data: Any, number: int, found: Declared, place: Path) -> dict[str, Any]:
    group = _group(data, f"demo_{number}", place)
    steps, seed = found.steps[number], found.seeds[number]
    seen, done = found.sizes
    state = {}
    for part in ("obs", "next_obs"):
        inner = _group(group, part, place)
        state[part] = _numbers(inner, "state", (steps, seen), "float32", place)
        if found.pixels is not None:
            state[f"{part}/pixels"] = _numbers(
                inner, "pixels", (steps, *found.pixels), "uint8", place
            )
    images = None
    if found.pixels is not None:
        images = joined(state["obs/pixels"], state["next_obs/pixels"], seed)
    flags = {
        name: _numbers(group, name, (steps,), "uint8", place) != 0
        for name in ("terminated", "truncated")
    }
    return {
        "observation": joined(state["obs"], state["next_obs"], seed),
        "action": _numbers(group, "actions", (steps, done), "float32", place),
        "reward": _numbers(group, "rewards", (steps,), "float32", place),
        "terminated": flags["terminated"],
        "truncated": flags["truncated"],
        "success": found.success[number],
        "seed": seed,
        "pixels": images,
    }


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


def _numbers(group: Any, name: str, shape: tuple[int, ...], kind: str, place: Path) -> NDArray[Any]:
    """Return a plain array stored in the file itself, of exactly the declared size."""
    import h5py

    where = f"{place}: '{group.name}/{name}'"
    child = group.get(name) if isinstance(group.get(name, getlink=True), h5py.HardLink) else None
    if not isinstance(child, h5py.Dataset):
        raise LogError(f"{where} is missing or a link.\nAllowed: an array")
    if child.shape != shape or child.dtype != np.dtype(kind):
        raise LogError(
            f"{where} is {child.dtype} of the shape {child.shape}.\n"
            f"The metadata says: {kind} of the shape {shape}"
        )
    if child.is_virtual or child.external:
        raise LogError(f"{where} lies in another file.\nAllowed: arrays in the file itself")
    kept = child.id.get_create_plist()
    codes = {int(kept.get_filter(k)[0]) for k in range(kept.get_nfilters())}
    if codes - set(_FILTERS):
        raise LogError(
            f"{where} is packed by the filter {min(codes - set(_FILTERS))}.\n"
            f"Allowed: {', '.join(_FILTERS.values())}"
        )
    out: NDArray[Any] = np.asarray(child[()])
    return out


def _h5py() -> Any:
    with optional_import("HDF5 files need h5py", "Install it: pip install 'aam-seals[learn]'"):
        import h5py
    return h5py
