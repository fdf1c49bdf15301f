"""Bounded reading of untrusted files: size, depth and clear errors."""

from __future__ import annotations

import itertools
import json
import math
import os
import re
import stat
import zlib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from seals.errors import ConfigError, LogError, SealsError
from seals.schema import read

MOST_BYTES = 1 << 28
"""Largest file, packed or unpacked, that is read whole [byte]."""
MOST_TEXT_BYTES = 1 << 24
"""Largest file of text or JSON that is read [byte]."""
_MOST_META_BYTES = 1 << 20
_MOST_NODES = 200_000
_MOST_JSON_NODES = 2_000_000
_DEEPEST = 40
_DEEPEST_XML = 100
_NUL = "a text contains the null character, which file names cannot contain"
_LONGEST_NUMBER = 250
"""Most signs of a number in YAML: with as many, a hexadecimal one, too, still fits a float."""
_MOST_DIGITS = 308
"""Most digits of a whole number in JSON, for the same reason."""
_NUMBER = re.compile(r"[-+0-9a-fA-FxoO_:.]+")
_LONG, _MOST_LONG = re.compile(r"[-+]?[0-9a-fA-FxoO_:]{19,}"), 1000
"""Whole numbers in YAML that may not fit 61 bits, and how many there may be: as keys, multiples of
2^61 - 1 have one hash, so that the time to read them grows with their square."""


def regular_file(path: str | Path, *, most: int = MOST_BYTES) -> Path:
    """Return the path when it is a regular, non-empty file within the size limit.

    Raises:
        LogError: it is absent, a folder, a pipe, a device, empty or too large.
    """
    file = Path(path)
    try:
        status = file.stat()
    except FileNotFoundError as error:
        raise LogError(
            f"'{file}' does not exist.\nGive the path of an existing file or folder."
        ) from error
    except (OSError, ValueError) as error:
        raise LogError(f"'{path}' cannot be opened: {error}") from error
    _refuse_strange(file, status, most)
    if status.st_size == 0:
        raise LogError(f"'{file}' is empty.\nGive a complete copy of the file.")
    return file


def unreadable(file: Path, error: OSError) -> LogError:
    """Return the refusal of a file that the system does not let us read.

    Example:
        >>> print(unreadable(Path("a.csv"), PermissionError(13, "Permission denied")))
        'a.csv' cannot be read: Permission denied.
        Change its permissions, or give a readable copy.
    """
    return LogError(
        f"'{file}' cannot be read: {error.strerror or error}.\n"
        "Change its permissions, or give a readable copy."
    )


def _refuse_strange(file: Path, status: os.stat_result, most: int) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise LogError(f"'{file}' is a folder, but a file is needed.")
    if not stat.S_ISREG(status.st_mode):
        raise LogError(
            f"'{file}' is not a regular file (pipes and devices, also behind links, are not read)."
        )
    if status.st_size > most:
        raise LogError(
            f"'{file}' has {status.st_size:,} bytes; the limit is {most:,}.\n"
            "Split it, or give another one."
        )


def _content(file: Path, most: int) -> bytes:
    """Return the bytes of a regular file, checked on the open file instead of its name."""
    # without O_NONBLOCK, opening a pipe that nobody writes into waits without end
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
    with open(os.open(file, flags | getattr(os, "O_BINARY", 0)), "rb") as stream:
        status = os.fstat(stream.fileno())
        _refuse_strange(file, status, most)
        # as much as there is: the memory for what is asked for is taken before anything is read
        raw = stream.read(status.st_size + 1)
        if len(raw) > status.st_size:
            raw += stream.read(most + 1 - len(raw))
    if len(raw) > most:
        raise LogError(f"'{file}' grows while it is read; the limit is {most:,} bytes.")
    return raw


def read_bytes(path: str | Path, *, most: int = MOST_BYTES, packed: bool = False) -> bytes:
    """Return the content of a file; a ``.gz`` file is unpacked up to ``most`` bytes.

    Args:
        path: the file.
        most: largest size [byte].
        packed: whether a ``.gz`` file stays as it is.

    Raises:
        LogError: the file cannot be read, or is larger than allowed.
    """
    file = regular_file(path, most=most)
    try:
        raw = _content(file, most)
    except OSError as error:
        raise unreadable(file, error) from error
    return _gunzip(file, raw, most) if file.suffix == ".gz" and not packed else raw


def read_text(path: str | Path, *, most: int = MOST_TEXT_BYTES) -> str:
    """Return the UTF-8 text of a file, without a byte-order mark.

    Raises:
        LogError: the file cannot be read, is larger than allowed, or is not UTF-8.
    """
    try:
        return read_bytes(path, most=most).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise LogError(f"'{path}' is not UTF-8 text ({error.reason}).") from error


def read_json(path: str | Path, *, most: int = MOST_TEXT_BYTES) -> Any:
    """Read a JSON file within limits.

    Args:
        path: the file.
        most: largest size that is read [byte].

    Raises:
        LogError: it cannot be read, is too large, or is not JSON as `plain_json` takes it.
    """
    raw = read_bytes(path, most=most)
    try:
        return plain_json(raw)
    except ValueError as error:
        reason = " ".join(str(error).split())[:200]
        raise LogError(
            f"'{path}' is damaged: it is not valid JSON: {reason}.\nRestore it, or remove it."
        ) from error


def plain_json(raw: bytes | str) -> Any:
    """Parse JSON within limits of depth, entries and length of numbers.

    Raises:
        ValueError: it is not JSON in UTF-8, too deep, too long, or holds text that no file can.

    Example:
        >>> plain_json('{"a": [1, 2]}')
        {'a': [1, 2]}
    """
    raw = raw.encode("utf-8", "surrogatepass") if isinstance(raw, str) else raw
    _measure_json(raw)
    try:
        content = json.loads(raw.decode("utf-8-sig"), parse_int=_whole)
    except RecursionError as error:
        raise ValueError("nested too deep") from error
    if b"\\u" in raw:
        # half of a surrogate pair can be read, and never be printed or written again
        text = json.dumps(content, ensure_ascii=False).encode("utf-8")
        if b"\\u0000" in text.replace(b"\\\\", b""):
            raise ValueError(_NUL)
    return content


def _measure_json(raw: bytes) -> None:
    # the reader recurses in C: marks are counted first, those inside of texts left out
    bare = raw.replace(b"\\\\", b"").replace(b'\\"', b"")
    many = bare.count(b'"') > 2 * _MOST_JSON_NODES
    marks = b"" if many else re.sub(rb'"[^"]*"?', b"", bare)
    marks = marks.translate(None, delete=bytes(set(range(256)) - set(b"[]{},")))
    if many or len(marks) > _MOST_JSON_NODES:
        raise ValueError(f"more than {_MOST_JSON_NODES:,} entries")
    steps = (1 if mark in b"[{" else -1 for mark in marks.translate(None, delete=b","))
    if max(itertools.accumulate(steps), default=0) > _DEEPEST:
        raise ValueError(f"nested deeper than {_DEEPEST} levels")


def _whole(text: str) -> int:
    if len(text) > _MOST_DIGITS:
        raise ValueError(f"a number of {len(text):,} digits; the limit is {_MOST_DIGITS}")
    return int(text)


def _gunzip(file: Path, raw: bytes, most: int) -> bytes:
    # zlib with a cap, not gzip.decompress: a few kilobytes can declare gigabytes
    unpacker = zlib.decompressobj(wbits=31)
    try:
        content = unpacker.decompress(raw, most)
    except zlib.error as error:
        raise LogError(f"'{file}' is not a valid gzip file ({error}).") from error
    if unpacker.unconsumed_tail:
        raise LogError(f"'{file}' decompresses to more than the allowed {most:,} bytes.")
    if not unpacker.eof:
        raise LogError(f"'{file}' is truncated: its gzip stream has no end.\nFetch it again.")
    return content


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Read the mapping in a YAML file; only plain data, no Python objects.

    Raises:
        LogError: it is not UTF-8, not YAML, too large, too deep, or not a mapping.
    """
    import yaml

    file = regular_file(path, most=_MOST_META_BYTES)
    try:
        content = plain_yaml(_content(file, _MOST_META_BYTES).decode("utf-8"))
    except OSError as error:
        raise unreadable(file, error) from error
    except UnicodeDecodeError as error:
        raise LogError(f"'{file}' is not UTF-8 text ({error.reason}).") from error
    except yaml.YAMLError as error:
        reason = " ".join(str(error).split())[:200]
        raise LogError(
            f"'{file}' is not plain YAML: {reason}\n"
            "Correct that line; it may contain numbers, text, lists and mappings."
        ) from error
    if not isinstance(content, dict):
        kind = type(content).__name__
        raise LogError(
            f"'{file}' must contain a mapping of names to values, but contains a {kind}.\n"
            "Write one entry per line, NAME: VALUE."
        )
    return content


def read_plain_yaml(path: Path) -> Any:
    """Read a YAML file within the size limit; errors are left to the caller.

    Raises:
        OSError: it cannot be read.
        UnicodeDecodeError: it is not UTF-8.
        yaml.YAMLError: see `plain_yaml`.
        LogError: it is not a regular file, or too large.
    """
    return plain_yaml(_content(path, _MOST_META_BYTES).decode("utf-8"))


def read_file(
    kind: Any,
    path: str | Path,
    *,
    remedy: str = "It must be YAML text in UTF-8.",
    error: type[SealsError] = ConfigError,
    extra: bool = False,
) -> Any:
    """Read a YAML or JSON file of ours within limits, as a typed value.

    Args:
        kind: annotation, error and extra: see `seals.schema.read`.
        path: the file; JSON by its suffix, else YAML.
        remedy: what to do about a file that cannot be read: the second line of that refusal.
        error: class of the refusals.
        extra: whether keys that a record does not know are passed over.

    Raises:
        SealsError: ``error``: it cannot be read, or holds something else.
    """
    import yaml

    try:
        raw = read_json(path) if Path(path).suffix == ".json" else read_plain_yaml(Path(path))
    except LogError as cause:
        raise error(str(cause).partition("\n")[0] + f"\n{remedy}") from cause
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as cause:
        text = " ".join(str(cause).split())
        raise error(f"{path} cannot be read: {text}.\n{remedy}") from cause
    return read(kind, raw, where=f"{path}:", error=error, extra=extra)


def plain_yaml(text: str) -> Any:
    """Parse YAML text within limits of depth and size, aliases expanded.

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
        if "<<" in text:
            _measure_merges(yaml.compose(text, Loader=loader))
        content = yaml.load(text, Loader=loader)  # a safe loader
        _unfold(content)
    except (ValueError, TypeError, RecursionError, AttributeError) as error:
        raise yaml.YAMLError(f"{error}") from error
    return content


def _measure(events: Any) -> None:
    depth = long = 0
    for count, event in enumerate(events):
        name = type(event).__name__
        depth += name.endswith("StartEvent") - name.endswith("EndEvent")
        if depth > _DEEPEST or count > _MOST_NODES:
            raise ValueError(
                f"nested deeper than {_DEEPEST} levels, or more than {_MOST_NODES:,} entries"
            )
        if name != "ScalarEvent":
            continue
        if "\0" in event.value:
            raise ValueError(_NUL)
        if len(event.value) > _LONGEST_NUMBER and (
            event.tag or (event.implicit[0] and _NUMBER.fullmatch(event.value))
        ):
            raise ValueError(
                f"a number of {len(event.value):,} digits; the limit is {_LONGEST_NUMBER}"
            )
        long += (event.implicit[0] or bool(event.tag)) and bool(_LONG.fullmatch(event.value))
        if long > _MOST_LONG:
            raise ValueError(f"more than {_MOST_LONG:,} whole numbers of more than 18 digits")


def _measure_merges(root: Any) -> None:
    """Refuse merge keys, ``<<``, that expand to too many entries.

    What they bring is copied before the names are compared: repeated, it doubles each time.
    """
    known: dict[int, int] = {}
    total = 0

    def size(node: Any) -> int:
        nonlocal total
        if id(node) not in known:
            known[id(node)], count = 1, 1
            value = getattr(node, "value", None)
            for item in value if isinstance(value, list) else ():
                parts = item if isinstance(item, tuple) else (item,)
                sizes = [size(part) for part in parts]
                merged = len(parts) == 1 or parts[0].tag == "tag:yaml.org,2002:merge"
                count += sizes[-1] if merged else 1
                total += sizes[-1] if merged else 1
                if total > _MOST_NODES:
                    raise ValueError(f"merged to more than {_MOST_NODES:,} entries")
            known[id(node)] = count
        return known[id(node)]

    size(root)


def _unfold(content: object) -> None:
    """Refuse repeated aliases that expand to too many entries."""
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


def plain_xml(text: str) -> ElementTree.Element:
    """Parse XML within limits of depth and elements, without document types and entities.

    Raises:
        ValueError: it is not XML, declares entities, or is nested too deep or too long.

    Example:
        >>> plain_xml("<a><b/></a>").tag
        'a'
    """
    if "\0" in text or re.search(r"<!\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise ValueError("it declares a DOCTYPE or an ENTITY; such files can expand without limit")
    parser: Any = ElementTree.XMLPullParser(("start", "end"))
    depth = count = 0
    root: ElementTree.Element | None = None
    try:
        # piece by piece: what is too deep is refused before it is built
        for first in range(0, len(text), 1 << 16):
            parser.feed(text[first : first + (1 << 16)].encode())
            for event, element in parser.read_events():
                root = element if root is None else root
                depth += 1 if event == "start" else -1
                count += 1
                if depth > _DEEPEST_XML or count > 2 * _MOST_NODES:
                    limits = f"{_DEEPEST_XML} levels, or more than {_MOST_NODES:,} elements"
                    raise ValueError(f"nested deeper than {limits}")
        parser.close()
    except (ElementTree.ParseError, LookupError, UnicodeError) as error:
        raise ValueError(f"{error} (perhaps not copied completely)") from error
    if root is None:
        raise ValueError("it is empty")
    return root


def entries(content: object) -> int:
    """Return how many values plain data hold, mappings and lists counted, too.

    Example:
        >>> entries({"a": [1, 2], "b": {}})
        5
    """
    if isinstance(content, dict):
        return 1 + sum(map(entries, content.values()))
    return 1 + (sum(map(entries, content)) if isinstance(content, list | tuple) else 0)


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
    """Refuse plain data with interpolations ``${...}``, which could read the environment.

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
