"""The one reader of pictures: PNG of bounded size, whatever its name says.

`PIL.Image.open` chooses the decoder by content, and one of its decoders starts Ghostscript.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import LogError
from seals.untrusted_io import read_bytes

FORMATS = ("PNG",)
"""What pictures of a run are written as."""
MOST_BYTES = 1 << 26
"""Largest file of a picture [byte]."""
MOST_PIXELS = 1 << 25
"""Most pixels of a picture: 8192 by 4096."""


def read_picture(path: str | Path) -> NDArray[np.uint8]:
    """Return the colours of a picture, (height, width, 3) from 0 to 255; row 0 is the upper one.

    Raises:
        LogError: it is absent, no ordinary file, too large, no PNG, or damaged.
    """
    return _read(path, lambda image: np.asarray(image.convert("RGB")))


def read_grey(path: str | Path) -> NDArray[np.float64]:
    """Return the brightness of a picture from 0 to 1, (height, width); row 0 is the upper one.

    A grey picture of 16 bits keeps its 65,536 levels.

    Raises:
        LogError: see `read_picture`.
    """

    def grey(image: Any) -> NDArray[np.float64]:
        if image.mode.startswith("I"):
            return np.asarray(image, dtype=float) / 65535.0
        return np.asarray(image.convert("L"), dtype=float) / 255.0

    return _read(path, grey)


def _read(path: str | Path, take: Callable[[Any], NDArray[Any]]) -> NDArray[Any]:
    """Open a picture of bounded size, and take from it what is wanted."""
    from PIL import Image

    raw = read_bytes(path, most=MOST_BYTES)
    try:
        with Image.open(io.BytesIO(raw), formats=FORMATS) as image:
            width, height = image.size
            if width * height > MOST_PIXELS:
                raise LogError(
                    f"'{path}' declares {width} by {height} pixels; the limit is {MOST_PIXELS:,}.\n"
                    "Remove it, and render or run again."
                )
            return take(image)
    except (OSError, ValueError, SyntaxError, EOFError, Image.DecompressionBombError) as cause:
        reason = " ".join(str(cause).split())[:120]
        raise LogError(
            f"'{path}' is not a valid PNG ({reason}).\nRemove it, and render or run again."
        ) from cause
