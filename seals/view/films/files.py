"""Frames on disk, with a check for completeness and film settings, and films of them (H.264)."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, LogError, MissingExtra, optional_import
from seals.logs.atomic import atomic_path, write_bytes, write_json
from seals.picture_files import read_picture
from seals.rendering.optics import to_bytes
from seals.rendering.picture import png
from seals.schema import plain
from seals.untrusted_io import read_json
from seals.view.films.frame import Image

RATE_FACTOR = "20"
"""Constant rate factor of x264: 18 shows no loss, 28 is coarse."""


def refuse_missing() -> Any:
    """Return the module PyAV; raise a `MissingExtra` where it is missing.

    Raises:
        MissingExtra: it is not installed.
    """
    with optional_import(
        "film: an MP4, unlike frames, needs PyAV",
        "Install it: pip install 'aam-seals[render]'; or give film=false",
    ):
        import av
    return av


def write_film(path: Path, frames: Sequence[Path], fps: float) -> None:
    """Write frames as a film file, atomically.

    Args:
        path: of the film, ``.mp4``.
        frames: pictures of one size, in order.
        fps: frames in a second [Hz].

    Raises:
        MissingExtra: PyAV is not installed, or was built without a codec for MP4.
    """
    av = refuse_missing()
    name = next((c for c in ("libx264", "libopenh264", "mpeg4") if c in av.codecs_available), None)
    if name is None:
        raise MissingExtra(
            "film: this build of PyAV has no codec for MP4; the frames were written.\n"
            "Install the standard build: pip install 'aam-seals[render]'; or give film=false"
        )
    with atomic_path(path) as beside, av.open(str(beside), mode="w") as container:
        stream = container.add_stream(name, rate=Fraction(fps).limit_denominator(1000))
        # the codec halves the colours' resolution: sizes are even
        height, width = (2 * (side // 2) for side in read_picture(frames[0]).shape[:2])
        stream.width, stream.height = width, height
        stream.pix_fmt = "yuv420p"
        if name == "libx264":
            stream.options = {"crf": RATE_FACTOR, "preset": "slow"}
        for file in frames:
            even = np.zeros((height, width, 3), dtype=np.uint8)
            part = read_picture(file)[:height, :width]
            even[: part.shape[0], : part.shape[1]] = part
            for packet in stream.encode(av.VideoFrame.from_ndarray(even, format="rgb24")):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)


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
        place = folder / CARD
        try:
            known = read_json(place) if os.path.lexists(place) else None
        except LogError:
            known = {}
        if known is not None and known != wanted:
            if not replace:
                changed = [k for k in wanted if known.get(k) != wanted[k]] or ["another version"]
                raise ConfigError(
                    f"{folder} holds frames of another film: {', '.join(changed)} differ.\n"
                    "Choose another folder with out=FOLDER, or overwrite them with replace=true"
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
