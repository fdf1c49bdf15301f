"""Limit of linear algebra to one thread, faster for the many small matrices of a diagnosis.

Several threads only get into each other's way there; on a busy machine they cost a factor of five.
The command line says so to the library before it is loaded, a Python program cannot.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

_MAPS = Path("/proc/self/maps")
_NAMES = [
    f"{vendor}openblas_{{}}_num_threads{ending}"
    for vendor in ("scipy_", "")
    for ending in ("64_", "")
]


@contextmanager
def one_thread() -> Iterator[int]:
    """Limit OpenBLAS to one thread; yield the number of libraries found, 0 without OpenBLAS.

    Example:
        >>> with one_thread() as libraries:
        ...     libraries >= 0
        True
    """
    held = [(put, count()) for count, put in _libraries()]
    for put, _ in held:
        put(1)
    try:
        yield len(held)
    finally:
        for put, before in held:
            put(before)


def _libraries() -> list[tuple[Callable[[], int], Callable[[int], None]]]:
    """Functions that read and set the number of threads, of every OpenBLAS that is loaded."""
    if not _MAPS.exists():
        return []
    lines = _MAPS.read_text(encoding="utf-8", errors="replace").splitlines()
    paths = {line.split(maxsplit=5)[-1] for line in lines if "openblas" in line}
    found = []
    for path in sorted(paths):
        library = ctypes.CDLL(path)
        for name in _NAMES:
            if hasattr(library, name.format("set")):
                count = getattr(library, name.format("get"))
                found.append((count, getattr(library, name.format("set"))))
                break
    return found
