"""Force arrows in the page, one set per effect."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.report.style import colours_of
from seals.view.forces import Arrows, Forces

LEAST, MOST = 0.01, 3.0
"""Shares of the usual length below which an arrow is left out, above which it is cut off [1]."""
SHAFT, HEAD, TIP = 0.018, 0.05, 0.13
"""Radius of the shaft, radius and length of the head over the usual length [1]."""


class Pushes:
    """Force arrows of a run.

    Args:
        server: viser's.
        forces: of the run.
        length: of the arrow of a usual force [m].

    Attributes:
        colours: of the effects, red, green and blue up to 255.
    """

    def __init__(self, server: Any, forces: Forces, length: float) -> None:
        self._scene, self._usual, self._length = server.scene, forces.usual, length
        self.colours = {
            name: (int(c[1:3], 16), int(c[3:5], 16), int(c[5:7], 16))
            for name, c in colours_of(list(forces.effects)).items()
        }
        self._handles: dict[str, Any] = {}

    def show(self, arrows: dict[str, Arrows], stretch: float) -> None:
        """Draw the arrows of some effects and remove those of the others.

        Args:
            arrows: by effect.
            stretch: of all arrows [1].
        """
        for effect in set(self._handles) - set(arrows):
            self._handles.pop(effect).remove()
        scale = stretch * self._length / max(self._usual, 1e-12)
        for effect, (origins, vectors) in arrows.items():
            points = _points(origins, vectors * scale, self._length)
            handle = self._handles.get(effect)
            if handle is not None and len(handle.points) == len(points) and len(points):
                handle.points = points
                continue
            if handle is not None:
                self._handles.pop(effect).remove()
            if len(points):
                long = self._length
                self._handles[effect] = self._scene.add_arrows(
                    f"/forces/{effect}",
                    points=points,
                    colors=self.colours[effect],
                    shaft_radius=SHAFT * long,
                    head_radius=HEAD * long,
                    head_length=TIP * long,
                )

    def remove(self) -> None:
        """Remove all arrows from the page."""
        self.show({}, 1.0)


def _points(origins: Floats, arrows: Floats, length: float) -> Floats:
    """Ends of the arrows that can be seen, shape (n, 2, 3)."""
    long = np.linalg.norm(arrows, axis=1, keepdims=True)
    cut = arrows * np.minimum(1.0, MOST * length / np.maximum(long, 1e-12))
    seen = long[:, 0] > LEAST * length
    found: Floats = np.stack([origins, origins + cut], axis=1)[seen].astype(np.float32)
    return found
