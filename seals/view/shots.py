"""Camera images of a run, by camera and time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from seals.logs.table import read_parquet
from seals.run.pictures import FOLDER, INDEX


class Shots:
    """Colour images in a run folder.

    Args:
        folder: of the run; it may hold none.

    Attributes:
        cameras: names of the cameras that left colour pictures, sorted.
    """

    def __init__(self, folder: Path | None) -> None:
        """Read the index of every camera."""
        self._taken: dict[str, list[tuple[float, Path]]] = {}
        root = None if folder is None else folder / FOLDER
        for index in sorted(root.glob(f"*/{INDEX}")) if root is not None else ():
            table = read_parquet(index)
            files = (index.parent / f"{int(n):06d}.png" for n in table["number"])
            taken = [(float(t), f) for t, f in zip(table["t"], files, strict=True) if f.is_file()]
            if taken:
                self._taken[index.parent.name] = taken
        self.cameras = tuple(self._taken)

    def last(self, camera: str, time: float) -> Path | None:
        """Return the last image of a camera up to a time [s]; None before the first.

        Raises:
            KeyError: there is no such camera.
        """
        taken = self._taken[camera]
        k = int(np.searchsorted([t for t, _ in taken], time + 1e-9, side="right")) - 1
        return taken[k][1] if k >= 0 else None
