"""Demonstrations as a folder: metadata, and a TensorDict in memory-mapped files.

The files can be opened by ``TensorDict.load_memmap`` as they are. :func:`read` does not: that call
would run what a stranger's folder tells it to. It takes only the files that the metadata
promises, of exactly the sizes that it promises, as plain numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import LogError, optional_import
from seals.learn.demonstrations.episode import Demonstrations
from seals.learn.demonstrations.layout import arrays_of, episodes_of, expected
from seals.learn.demonstrations.metadata import FORM, declared, metadata_of
from seals.learn.demonstrations.packed import PACKED, read_packed
from seals.learn.metadata import CARD, read_metadata
from seals.logs.atomic import atomic_folder, write_json
from seals.logs.room import reserve
from seals.untrusted_io import plain_json

_META = "meta.json"
_PLAIN = "<class 'tensordict._td.TensorDict'>"
_NEWER = {"_class": ("tensordict:TensorDict",), "_format_version": (1,)}
"""Entries that tensordict 0.15 adds, and what they may be."""
"""The only class that a folder may name."""
_MOST_META = 100_000
_BLOCK = 4096
"""By how much a file may take more than its bytes."""


def write(demonstrations: Demonstrations, folder: str | Path, *, replace: bool = False) -> Path:
    """Write demonstrations as a folder, atomically.

    Args:
        demonstrations: to be kept.
        folder: to be made.
        replace: whether a folder of that name is replaced.

    Raises:
        MissingExtra: tensordict is not installed.
        SealsError: the folder exists and must stay.
        DiskFull: there is no room for it.
    """
    tensordict = tensordict_of()
    import torch

    arrays = arrays_of(demonstrations)
    tensors = {
        tuple(name.split("/")): torch.from_numpy(np.ascontiguousarray(values))
        for name, values in arrays.items()
    }
    count = [demonstrations.steps]
    data = tensordict.TensorDict({}, batch_size=count)
    data["next"] = tensordict.TensorDict({}, batch_size=count)
    for path, tensor in tensors.items():
        data[path] = tensor
    with atomic_folder(folder, replace=replace) as beside:
        reserve(beside, sum(values.nbytes + _BLOCK for values in arrays.values()) + _MOST_META)
        data.memmap(str(beside))
        write_json(beside / CARD, metadata_of(demonstrations))
    return Path(folder)


def read(folder: str | Path) -> Demonstrations:
    """Read demonstrations from a folder; nothing in it is executed, and no pickle is opened.

    Args:
        folder: that :func:`write` made, or one that holds them packed.

    Raises:
        ConfigError: the metadata is missing, broken, or declares too much.
        LogError: a file is missing, strange, or not of the size that the metadata declares.

    Example:
        >>> read("no/such/folder")
        Traceback (most recent call last):
            ...
        seals.errors.ConfigError: demonstrations=no/such/folder: there is no card.json.
        Give a folder that holds one.
    """
    root = Path(folder)
    found = declared(read_metadata(root, form=FORM, key="demonstrations"), where=str(root / CARD))
    wanted = expected(found)
    if found.pixels is None and (root / PACKED).is_file():
        return Demonstrations(origin=found.origin, episodes=read_packed(root, found))
    _refuse_strange(root, wanted)
    for place in ("", "next"):
        _check_meta(root / place, wanted, prefix=f"{place}/" if place else "")
    arrays = {
        name: _array(root / f"{name}.memmap", shape, kind) for name, (shape, kind) in wanted.items()
    }
    episodes = episodes_of(arrays, found, where=str(root))
    return Demonstrations(origin=found.origin, episodes=episodes)


def tensordict_of() -> Any:
    """Return the module ``tensordict``.

    Raises:
        MissingExtra: it is not installed.
    """
    with optional_import(
        "demonstrations are written with tensordict", "Install it: pip install 'aam-seals[learn]'"
    ):
        import tensordict
    return tensordict


def _refuse_strange(root: Path, wanted: Mapping[str, Any]) -> None:
    """Refuse links, and files that the metadata does not declare."""
    promised = {f"{name}.memmap" for name in wanted} | {CARD, _META, f"next/{_META}", "next"}
    for path in _walk(root):
        name = path.relative_to(root).as_posix()
        if path.is_symlink() or name not in promised:
            what = "is a link" if path.is_symlink() else "does not belong to demonstrations"
            raise LogError(f"{path} {what}.\nTake the folder as it was recorded.")


def _walk(root: Path) -> Iterator[Path]:
    """Yield the entries of the folder and of its subfolder ``next``."""
    for path in sorted(root.iterdir()):
        yield path
        if path.name == "next" and path.is_dir() and not path.is_symlink():
            yield from sorted(path.iterdir())


def _check_meta(folder: Path, wanted: Mapping[str, Any], *, prefix: str) -> None:
    """Refuse a description by tensordict that names other tensors or sizes than declared."""
    path = folder / _META
    meta = _read_meta(path)
    here = {n.removeprefix(prefix): w for n, w in wanted.items() if n.startswith(prefix)}
    inner = {name: there for name, there in here.items() if "/" not in name}
    for name, (shape, kind) in inner.items():
        given = meta.get(name)
        stated = (
            (given.get("shape"), given.get("dtype")) if isinstance(given, dict) else (None, None)
        )
        if stated != (list(shape), f"torch.{kind}"):
            raise LogError(
                f"{path} says that '{name}' is {stated[1]} of the shape {stated[0]}.\n"
                f"The metadata says: {kind} of the shape {list(shape)}"
            )
    below = {} if prefix else {"next": {"type": "TensorDict"}}
    more = {k: v for k, v in meta.items() if k not in inner and k not in ("shape", "device")}
    if more != below:
        raise LogError(f"{path} names {more}.\nAllowed beside the arrays: {below}")


def _read_meta(path: Path) -> dict[str, Any]:
    if not path.is_file() or path.stat().st_size > _MOST_META:
        raise LogError(f"{path} is missing or too large.\nTake the folder as it was recorded.")
    try:
        meta = plain_json(path.read_bytes())
    except (OSError, ValueError) as cause:
        raise LogError(f"{path} cannot be read: {cause}.\nIt must be JSON.") from cause
    if not isinstance(meta, dict) or meta.pop("_type", None) != _PLAIN:
        raise LogError(f"{path} names another class.\nAllowed: {_PLAIN}")
    for key, allowed in _NEWER.items():
        if meta.pop(key, allowed[0]) not in allowed:
            raise LogError(f"{path} names another {key}.\nAllowed: {allowed[0]}")
    return meta


def _array(path: Path, shape: tuple[int, ...], kind: str) -> NDArray[Any]:
    """Return the numbers of one file."""
    size = math.prod(shape) * np.dtype(kind).itemsize
    if not path.is_file() or path.stat().st_size != size:
        given = f"{path.stat().st_size} bytes" if path.is_file() else "missing"
        raise LogError(f"{path} is {given}.\nThe metadata promises {size} bytes.")
    # raw bytes: a truth value other than 0 and 1 would be no truth value to NumPy
    raw = np.fromfile(path, dtype=np.uint8 if kind == "bool" else kind)
    if kind == "bool":
        if raw.max(initial=0) > 1:
            raise LogError(f"{path} holds bytes that are no truth values.\nAllowed: 0 and 1")
        raw = raw.astype(bool)
    return raw.reshape(shape)
