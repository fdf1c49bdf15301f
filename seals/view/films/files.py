"""Frames on disk, with a check for completeness and film settings."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, LogError
from seals.logs.atomic import write_bytes, write_json
from seals.rendering.files import png
from seals.rendering.optics import to_bytes
from seals.schema import plain
from seals.untrusted_io import read_json
from seals.view.films.frame import Image

CARD = "render.json"
"""What the frames of a folder show; frames of another film are not mixed with them."""
_END = b"IEND\xaeB`\x82"


class Frames:
    """The frames of one film in a folder.

    Args:
        folder: of the frames.
        card: what the film shows, as plain data.
        replace: whether frames of another film may be removed.

    Raises:
        ConfigError: the folder holds another film, or cannot be written.
    """

    def __init__(self, folder: Path, card: Mapping[str, Any], *, replace: bool = False) -> None:
        self.folder = folder
        wanted = plain(card)
        known = _card(folder / CARD)
        if known is not None and known != wanted:
            if not replace:
                changed = [k for k in wanted if known.get(k) != wanted[k]] or ["another version"]
                raise ConfigError(
                    f"{folder} holds frames of another film: {', '.join(changed)} differ.\n"
                    "Write elsewhere with out=FOLDER, or over them with replace=true"
                )
            for path in folder.glob("frame_*.png"):
                path.unlink()
        try:
            write_json(folder / CARD, wanted)
        except OSError as cause:
            raise ConfigError(
                f"{folder} cannot be written: {cause}.\nGive another folder: out=FOLDER"
            ) from cause

    def path(self, number: int) -> Path:
        """Return the file of a frame."""
        return self.folder / f"frame_{number:05d}.png"

    def done(self, number: int) -> bool:
        """Return whether a complete frame exists."""
        path = self.path(number)
        if not path.is_file() or path.stat().st_size < len(_END):
            return False
        with path.open("rb") as file:
            file.seek(-len(_END), 2)
            return file.read() == _END

    def write(self, number: int, image: Image) -> None:
        """Write a frame atomically."""
        write_bytes(self.path(number), png(to_bytes(np.clip(image, 0.0, 1.0))))


def _card(path: Path) -> Any:
    if not os.path.lexists(path):
        return None
    try:
        return read_json(path)
    except LogError:
        return {}


def times_of(start: float, end: float, *, fps: float, speed: float) -> Floats:
    """Return the times of a film's frames [s], the last one not after the end.

    Raises:
        ConfigError: the film would have no frame.

    Example:
        >>> times_of(0.0, 0.1, fps=25.0, speed=1.0).round(3).tolist()
        [0.0, 0.04, 0.08]
    """
    if start > end:
        raise ConfigError(
            f"start={start:g} s is after the end at {end:g} s.\nAllowed: up to {end:g} s."
        )
    count = math.floor((end - start) * fps / speed + 1e-6) + 1
    return start + np.arange(count, dtype=np.float64) * (speed / fps)
