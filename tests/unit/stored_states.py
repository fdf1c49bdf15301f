"""Forgeries of stored states for the tests: whole files, with the digest that belongs to them."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

HEAD = struct.Struct("<8sIQQ")
START = HEAD.size + 32


def opened(raw: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the JSON part and the arrays of a file."""
    text = HEAD.unpack_from(raw)[2]
    return json.loads(raw[START : START + text]), raw[START + text :]


def closed(text: str, arrays: bytes, *, version: int = 2, declared: int | None = None) -> bytes:
    """Return a file of any content, digest included."""
    size = len(arrays) if declared is None else declared
    head = HEAD.pack(b"SEALSTAT", version, len(text.encode()), size)
    rest = text.encode() + arrays
    return head + hashlib.blake2b(head + rest, digest_size=32).digest() + rest


def forged(file: Path, change: Callable[[dict[str, Any]], Any], **more: Any) -> None:
    """Change the JSON part of a file in place; text that is returned takes its place."""
    about, arrays = opened(file.read_bytes())
    text = change(about)
    file.write_bytes(closed(text if isinstance(text, str) else json.dumps(about), arrays, **more))


def parts(data: Any, *path: Any) -> Any:
    """Return a part of packed data by names and places, through the marks."""
    for step in path:
        data = entries(data)[step]
    return data


def entries(data: Any) -> Any:
    """Return the parts of packed data: a mapping by name, or a list."""
    if isinstance(data, list):
        return data
    return data["v"] if "r" in data else next(iter(data.values()))
