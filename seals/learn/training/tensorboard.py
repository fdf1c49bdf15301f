"""Optional event files for TensorBoard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.errors import MissingExtra

FOLDER = "tensorboard"


def tensorboard_writer(folder: Path) -> Any:
    """Return a writer of TensorBoard's files into a folder below the training's.

    Raises:
        MissingExtra: tensorboard is not installed.
    """
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError as cause:
        raise MissingExtra(
            "course.tensorboard=true needs tensorboard, which is not installed.\n"
            "Install it: pip install 'aam-seals[learn]'; the CSV files say the same without it."
        ) from cause
    return SummaryWriter(str(folder / FOLDER))
