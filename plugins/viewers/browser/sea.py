"""Water in the page: moving surface, water body, particles."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.view.water import Patch, Water

COLOUR = (0.01, 0.24, 0.36)
"""Displayed colour of the water."""
DROPS = (0.30, 0.62, 0.85)
"""Displayed colour of its particles."""
CELLS = 64
"""Cells along an edge of the patch of waves."""


class Sea:
    """Water of a run in the page.

    Args:
        server: viser's.
        water: of the run.
        middle: of the piece that is shown, x and y [m].
        half: of its edge [m].
        opacity: of the surface [1].
    """

    def __init__(
        self, server: Any, water: Water, middle: Floats, half: float, opacity: float
    ) -> None:
        self._scene, self._water, self._opacity = server.scene, water, opacity
        self._middle, self._half = middle, half
        self._surface: Any = None
        self._drops: Any = None
        self._drawn: Patch | None = None

    def show(self, time: float, particles: Floats | None) -> None:
        """Draw the water at a time [s].

        Args:
            time: [s].
            particles: places of the water that is simulated [m], or None.
        """
        if particles is not None and not self._water.meshes:
            if self._drops is None:
                # distance of neighbours as if the particles filled the box around them [m]
                span = np.maximum(np.ptp(particles, axis=0), 1e-3)
                self._drops = self._scene.add_point_cloud(
                    "/water/particles",
                    points=particles,
                    colors=tuple(round(255 * c) for c in DROPS),
                    point_size=0.4 * float((np.prod(span) / max(len(particles), 1)) ** (1.0 / 3.0)),
                    point_shape="circle",
                )
            else:
                self._drops.points = particles.astype(np.float32)
            return
        if self._drawn is not None and not self._water.moves:
            return
        mesh = self._water.mesh(time)
        cells = CELLS if self._water.moves else 2
        patch = mesh or self._water.patch(time, self._middle, self._half, cells)
        if patch is None:
            return
        same = self._drawn is not None and patch.faces is self._drawn.faces
        if same:
            self._surface.vertices = patch.vertices.astype(np.float32)
        else:
            if self._surface is not None:
                self._surface.remove()
            self._surface = self._scene.add_mesh_simple(
                "/water/surface",
                vertices=patch.vertices,
                faces=patch.faces,
                color=COLOUR,
                opacity=self._opacity,
                # facets: without them waves hardly show
                flat_shading=True,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
        self._drawn = patch

    def remove(self) -> None:
        """Remove the water from the page."""
        for handle in (self._surface, self._drops):
            if handle is not None:
                handle.remove()
        self._surface = self._drops = self._drawn = None
