"""Import of the kernel language: Taichi, or another package with its interface.

``SEALS_TAICHI`` names the package; kernels here keep to fields, functions and kernels, which its
descendants share.
"""

from __future__ import annotations

import importlib
import os
import warnings
from typing import Any

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
# no kernel prints: behind a replaced sys.stdout each call would look for what one had printed
os.environ.setdefault("TI_ENABLE_PYBUF", "0")
with warnings.catch_warnings():
    # Taichi 1.7 asks the locale in a way that Python will drop
    warnings.simplefilter("ignore", DeprecationWarning)
    ti: Any = importlib.import_module(os.environ.get("SEALS_TAICHI", "taichi"))
