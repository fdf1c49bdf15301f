"""Import of the kernel language: Taichi, or Quadrants where Taichi has no package.

``SEALS_TAICHI`` names another package with the same interface; kernels here keep to fields,
functions and kernels, which the descendants of Taichi share.
"""

from __future__ import annotations

import importlib
import os
import warnings
from importlib.util import find_spec
from typing import Any

from seals.errors import MissingExtra

LANGUAGES = ("taichi", "quadrants")
"""Packages that are looked for, in this order."""


def language() -> str:
    """Return the name of the package whose kernels are compiled.

    Raises:
        MissingExtra: none is installed.

    Example:
        >>> language() in LANGUAGES or "SEALS_TAICHI" in os.environ
        True
    """
    asked = os.environ.get("SEALS_TAICHI")
    found = asked or next((name for name in LANGUAGES if find_spec(name) is not None), None)
    if found is None:
        raise MissingExtra(
            "particle water needs the package taichi or quadrants; none is installed.\n"
            "Install one: pip install taichi (Python 3.10 to 3.13), pip install quadrants (3.10 "
            "and later). Or take water=fossen"
        )
    return found


os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")
# no kernel prints: behind a replaced sys.stdout each call would look for what one had printed
os.environ.setdefault("TI_ENABLE_PYBUF", "0")
os.environ.setdefault("QD_ENABLE_PYBUF", "0")
with warnings.catch_warnings():
    # Taichi 1.7 asks the locale in a way that Python will drop
    warnings.simplefilter("ignore", DeprecationWarning)
    ti: Any = importlib.import_module(language())
