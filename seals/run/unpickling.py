"""The names that a checkpoint may speak of: data of SEALS and of NumPy, and no function else.

A pickle may name any callable and have it called. This list leaves classes of SEALS and of
installed plug-ins, arrays and plain containers; there is no switch that lifts it.
"""

from __future__ import annotations

import pickle
from typing import Any

from seals import registry

_CORES = ("core", "_core")
_ARRAYS = (
    *((f"numpy.{core}.multiarray", "_reconstruct") for core in _CORES),
    *((f"numpy.{core}.multiarray", "scalar") for core in _CORES),
    *((f"numpy.{core}.numeric", "_frombuffer") for core in _CORES),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy.random._pickle", "__generator_ctor"),
    ("numpy.random._pickle", "__bit_generator_ctor"),
    ("numpy.random._pcg64", "PCG64"),
    ("numpy.random.bit_generator", "SeedSequence"),
    ("numpy.random.bit_generator", "__pyx_unpickle_SeedSequence"),
)  # fmt: skip
_PLAIN = (
    *(("builtins", name) for name in ("set", "frozenset", "complex", "bytearray", "slice")),
    ("collections", "OrderedDict"),
    ("collections", "deque"),
    ("collections", "defaultdict"),
    *(("pathlib", name) for name in ("Path", "PosixPath", "PurePosixPath", "WindowsPath")),
    ("pathlib._local", "PosixPath"),
)  # fmt: skip
_OWN = (("seals.run.checkpoint", "_view"),)
ALLOWED = frozenset((*_ARRAYS, *_PLAIN, *_OWN))
"""Module and name of everything beside classes of plug-ins that may be named."""


class DataUnpickler(pickle.Unpickler):
    """Reads data; whatever else a file asks for is refused by name."""

    def find_class(self, module: str, name: str) -> Any:
        """Return what a file names, when it may name it.

        Raises:
            pickle.UnpicklingError: it may not.
        """
        if (module, name) == ("builtins", "bytearray"):
            return _bytes
        if (module, name) in ALLOWED:
            return super().find_class(module, name)
        # "a.b" would reach through a class to any module that it imports
        if "." not in name and module.partition(".")[0] in _homes():
            found = super().find_class(module, name)
            if isinstance(found, type) and found.__module__ == module:
                return found
        raise pickle.UnpicklingError(
            f"it asks for {module}.{name}, which is no data of a run and could do anything"
        )


def _bytes(content: bytes = b"") -> bytearray:
    """Make a bytearray of bytes; of a number it would be as long as a file likes."""
    if not isinstance(content, bytes | bytearray):
        raise pickle.UnpicklingError("it makes bytes of something that is none")
    return bytearray(content)


def _homes() -> set[str]:
    """Return the packages of SEALS and of installed plug-ins: they run already."""
    values = (
        plugin.value for kind in registry.GROUPS for plugin in registry.plugins(kind).values()
    )
    return {"seals", *(value.partition(":")[0].partition(".")[0] for value in values)}
