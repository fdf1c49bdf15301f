"""Writing of films: MP4 with H.264."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import MissingExtra, optional_import
from seals.logs.atomic import atomic_path
from seals.picture_files import read_picture

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
            "film: this build of PyAV has no codec for MP4; the frames are there.\n"
            "Install the usual one: pip install 'aam-seals[render]'; or give film=false"
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
