"""Reading files that nobody vouches for: bounded size, bounded depth, refusals in words."""

from __future__ import annotations

import math
import zlib
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, LogError

MOST_BYTES = 1 << 28
"""Largest file, packed or unpacked, that is read whole [byte]."""
_MOST_META_BYTES = 1 << 20
_MOST_NODES = 200_000
_DEEPEST = 40


def regular_file(path: str | Path, *, most: int = MOST_BYTES) -> Path:
    """Return the path when it is an ordinary, non-empty file of bearable size.

    Raises:
        LogError: it is absent, a folder, a pipe, empty or too large.
    """
    file = Path(path)
    try:
        if not file.exists():
            raise LogError(f"'{file}' does not exist.\nGive the path of a log file or folder.")
        if file.is_dir():
            raise LogError(f"'{file}' is a folder, a file is needed here.")
        if not file.is_file():
            raise LogError(
                f"'{file}' is not an ordinary file (a pipe or a device cannot be a log)."
            )
        size = file.stat().st_size
    except (OSError, ValueError) as error:
        raise LogError(f"'{path}' cannot be opened: {error}") from error
    if size == 0:
        raise LogError(f"'{file}' is empty.")
    if size > most:
        raise LogError(f"'{file}' has {size:,} bytes, allowed are {most:,}.\nSplit the log first.")
    return file


def read_bytes(path: str | Path, *, most: int = MOST_BYTES) -> bytes:
    """Return the content of a file; a ``.gz`` file is unpacked, also within ``most`` bytes.

    Raises:
        LogError: the file cannot be read, or is larger than allowed.
    """
    file = regular_file(path, most=most)
    try:
        raw = file.read_bytes()
    except OSError as error:
        raise LogError(f"'{file}' cannot be read: {error}") from error
    return _gunzip(file, raw, most) if file.suffix == ".gz" else raw


def _gunzip(file: Path, raw: bytes, most: int) -> bytes:
    # zlib with a cap, not gzip.decompress: a few kilobytes can declare gigabytes
    unpacker = zlib.decompressobj(wbits=31)
    try:
        content = unpacker.decompress(raw, most)
    except zlib.error as error:
        raise LogError(f"'{file}' is not a sound gzip file ({error}).") from error
    if unpacker.unconsumed_tail:
        raise LogError(f"'{file}' unpacks to more than the allowed {most:,} bytes.")
    if not unpacker.eof:
        raise LogError(f"'{file}' is cut short: its gzip stream has no end.\nFetch it again.")
    return content


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Return the mapping that a YAML file holds; only plain data, no Python objects.

    Raises:
        LogError: it is not UTF-8, not YAML, too large, too deep, or not a mapping.
    """
    import yaml

    file = regular_file(path, most=_MOST_META_BYTES)
    try:
        content = plain_yaml(file.read_bytes().decode("utf-8"))
    except UnicodeDecodeError as error:
        raise LogError(f"'{file}' is not UTF-8 text ({error.reason}).") from error
    except yaml.YAMLError as error:
        reason = " ".join(str(error).split())[:200]
        raise LogError(
            f"'{file}' is not plain YAML: {reason}\nOnly numbers, text, lists and mappings count."
        ) from error
    if not isinstance(content, dict):
        kind = type(content).__name__
        raise LogError(f"'{file}' must hold a mapping of names to values, it holds a {kind}.")
    return content


def read_plain_yaml(path: Path) -> Any:
    """Return what a YAML file of bearable size holds, for those who say themselves what is wrong.

    Raises:
        OSError: it cannot be read.
        UnicodeDecodeError: it is not UTF-8.
        yaml.YAMLError: see `plain_yaml`.
        LogError: it is not an ordinary file, or too large.
    """
    if path.exists() and (not path.is_file() or path.stat().st_size > _MOST_META_BYTES):
        regular_file(path, most=_MOST_META_BYTES)
    return plain_yaml(path.read_text(encoding="utf-8"))


def plain_yaml(text: str) -> Any:
    """Return what YAML text holds: plain data of bearable depth and size, also when unfolded.

    Raises:
        yaml.YAMLError: it is not YAML, holds Python objects, or is nested or repeated too often.

    Example:
        >>> plain_yaml("{a: [1, 2]}")
        {'a': [1, 2]}
    """
    import yaml

    # the C loader is 10 times faster, and crashes on deep nesting: _measure goes first
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        _measure(yaml.parse(text, Loader=loader))
        content = yaml.load(text, Loader=loader)  # a safe loader
        _unfold(content)
    except (ValueError, TypeError, RecursionError, AttributeError) as error:
        raise yaml.YAMLError(f"{error}") from error
    return content


def _measure(events: Any) -> None:
    depth = 0
    for count, event in enumerate(events):
        name = type(event).__name__
        depth += name.endswith("StartEvent") - name.endswith("EndEvent")
        if depth > _DEEPEST or count > _MOST_NODES:
            raise ValueError(
                f"nested deeper than {_DEEPEST} levels, or more than {_MOST_NODES:,} entries"
            )


def _unfold(content: object) -> None:
    """Refuse what repeated aliases unfold to more than may be written out."""
    level, count = [content], 0
    for _ in range(_DEEPEST):
        children: list[object] = []
        for value in level:
            if isinstance(value, dict):
                children += [*value.keys(), *value.values()]
            elif isinstance(value, list | tuple | set):
                children += value
            if count + len(children) > _MOST_NODES:
                raise ValueError(f"repeated to more than {_MOST_NODES:,} entries")
        level, count = children, count + len(children)
    if level:
        raise ValueError(f"nested deeper than {_DEEPEST} levels")


def first_bad_number(tree: object) -> str | None:
    """Return the path of the first float that is not finite, or None.

    Example:
        >>> first_bad_number({"vehicle": {"mass": float("nan")}})
        'vehicle.mass'
    """
    waiting: list[tuple[str, int, object]] = [("", 0, tree)]
    for _ in range(_MOST_NODES):
        if not waiting:
            return None
        # repeated YAML aliases can unfold a small file into billions of entries
        path, depth, value = waiting.pop()
        if len(waiting) > _MOST_NODES or depth > _DEEPEST:
            break
        if isinstance(value, float) and not math.isfinite(value):
            return path
        if isinstance(value, dict):
            named = [(f"{path}.{key}".lstrip("."), child) for key, child in value.items()]
        elif isinstance(value, list | tuple):
            named = [(f"{path}[{k}]", child) for k, child in enumerate(value)]
        else:
            continue
        waiting += [(name, depth + 1, child) for name, child in named]
    raise LogError(
        f"it has more than {_MOST_NODES:,} entries, more than {_DEEPEST} levels, "
        "or contains itself."
    )


def refuse_references(content: Any, *, where: str) -> None:
    """Refuse plain data from a file that holds ``${...}``: it may look up the user's surroundings.

    Args:
        content: what the file holds.
        where: what brought it, for the message.

    Raises:
        ConfigError: a text in it holds a reference.

    Example:
        >>> refuse_references({"name": "a"}, where="robot.yaml")
        >>> refuse_references({"name": "${oc.env:HOME}"}, where="robot.yaml")
        Traceback (most recent call last):
        seals.errors.ConfigError: robot.yaml holds a reference, ${...}.
        Write the value itself.
    """
    if "${" in repr(content):
        raise ConfigError(f"{where} holds a reference, ${{...}}.\nWrite the value itself.")
