"""Conversion of nested tuples and mappings to plain data and tensors, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """Return tuples as lists and mappings as dicts; tensors and numbers stay.

    Example:
        >>> plain((1, {"a": (2.0, None)}))
        [1, {'a': [2.0, None]}]
    """
    if isinstance(value, Mapping):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, tuple | list):
        return [plain(part) for part in value]
    if isinstance(value, np.ndarray):
        import torch

        return torch.from_numpy(value.copy())
    return value


def rebuilt(kept: Any, like: Any) -> Any:
    """Convert plain data to the structure of another value, on the device of its tensors.

    Example:
        >>> rebuilt([1, {"a": [2.0, None]}], (0, {"a": (0.0, None)}))
        (1, {'a': (2.0, None)})
    """
    if isinstance(like, Mapping):
        return {key: rebuilt(kept[key], part) for key, part in like.items()}
    if isinstance(like, tuple):
        parts = [rebuilt(a, b) for a, b in zip(kept, like, strict=True)]
        return type(like)(*parts) if hasattr(like, "_fields") else tuple(parts)
    if isinstance(like, np.ndarray):
        return kept.cpu().numpy().copy()
    if hasattr(like, "device") and hasattr(kept, "to"):
        return kept.to(like.device)
    return kept
