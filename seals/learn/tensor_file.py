"""Arrays by name in one file of the format safetensors, read within a bound."""

from __future__ import annotations

import importlib
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, optional_import


def library(framework: str = "numpy") -> Any:
    """Return the part of safetensors for ``numpy`` or ``torch``.

    Raises:
        MissingExtra: it is not installed.
    """
    with optional_import(
        "policies and demonstrations need safetensors",
        "Install it: pip install 'aam-seals[learn]'",
    ):
        import safetensors  # noqa: F401

        return importlib.import_module(f"safetensors.{framework}")


def write_tensors(path: Path, tensors: Mapping[str, Any], *, framework: str = "numpy") -> None:
    """Write arrays, or tensors of PyTorch, as one file.

    Args:
        path: of the file.
        tensors: contiguous, by name.
        framework: ``numpy`` or ``torch``.

    Raises:
        OSError: it cannot be written.
    """
    place = library(framework)
    from safetensors import SafetensorError

    try:
        place.save_file(dict(tensors), str(path))
    except SafetensorError as cause:
        # the library tells of a full disk or a failed write in a class of its own
        number = re.search(r"\(os error (\d+)\)", str(cause))
        if number:
            raise OSError(int(number[1]), os.strerror(int(number[1])), str(path)) from cause
        raise OSError(f"{path} cannot be written: {cause}") from cause


def read_tensors(path: Path, *, most: int, framework: str = "numpy") -> dict[str, Any]:
    """Read all arrays of a file; nothing in it is executed.

    Args:
        path: of the file.
        most: bytes that it may have.
        framework: ``numpy`` or ``torch``.

    Raises:
        ConfigError: it is missing, a link, too large, or not of the format.
        MissingExtra: safetensors is not installed.
    """
    place = library(framework)
    from safetensors import SafetensorError

    if not path.is_file() or path.is_symlink():
        raise ConfigError(f"{path} is missing.\nGive an unmodified folder.")
    if path.stat().st_size > most:
        raise ConfigError(f"{path} has {path.stat().st_size} bytes.\nAllowed: {most}")
    try:
        return dict(place.load_file(str(path)))
    except (SafetensorError, OSError, ValueError, KeyError, TypeError, AttributeError) as cause:
        # AttributeError: of a type that numpy does not have
        raise ConfigError(
            f"{path} cannot be read: {cause}.\nIt must be of the format safetensors."
        ) from cause
