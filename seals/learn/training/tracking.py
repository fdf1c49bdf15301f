"""Optional event files for TensorBoard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.errors import optional_import

FOLDER = "tensorboard"


def tensorboard_writer(folder: Path) -> Any:
    """Return a writer of TensorBoard's files into a folder below the training's.

    Raises:
        MissingExtra: tensorboard is not installed.
    """
    with optional_import(
        "course.tensorboard=true needs tensorboard",
        "Install it: pip install 'aam-seals[learn]'; the CSV files say the same without it.",
    ):
        from torch.utils.tensorboard import SummaryWriter
    return SummaryWriter(str(folder / FOLDER))
