"""Recorder of the particle water's surface as a mesh at intervals, for films."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import optional_import
from seals.fluid import Fluid
from seals.logs.atomic import atomic_path
from seals.run.particle_snapshots import InstantFiles
from seals.run.spray import Spray, drop_mesh

FOLDER = "surface"
"""Folder of a run that holds the meshes, one file an instant, named by its time."""
REACH, CUBE, THRESHOLD, ROUNDS = 3.0, 1.0, 0.6, 10
"""Smoothing length and edge of the marching cubes in particle radii, share of the rest density at
which the surface lies [1], rounds of smoothing."""
SPACING = "spacing [m]"
"""What a fluid calls the distance of its particles among its figures."""


class Mesh(NamedTuple):
    """Closed triangle mesh of a water surface.

    Args:
        vertices: [m], shape (n, 3).
        triangles: numbers of their corners, anticlockwise from outside, shape (m, 3).
    """

    vertices: Floats
    triangles: NDArray[np.int64]


def surface_of(places: Floats, spacing: float) -> Mesh:
    """Reconstruct the surface around particles.

    Marching cubes on the density of the particles, smoothed with weights (Loeschner et al. 2023,
    doi:10.1111/cgf.14836), by pysplashsurf.

    Args:
        places: of the particles [m], shape (n, 3).
        spacing: at rest [m].

    Raises:
        MissingExtra: pysplashsurf is not installed.
    """
    found, _ = refuse_missing().reconstruction_pipeline(
        np.ascontiguousarray(places, dtype=np.float64),
        particle_radius=0.5 * spacing,
        smoothing_length=REACH,
        cube_size=CUBE,
        iso_surface_threshold=THRESHOLD,
        multi_threading=True,
        mesh_cleanup=True,
        mesh_smoothing_iters=ROUNDS,
        mesh_smoothing_weights=True,
    )
    return Mesh(
        np.array(found.mesh.vertices, dtype=float), np.array(found.mesh.triangles, dtype=np.int64)
    )


def refuse_missing() -> Any:
    """Return the module pysplashsurf; raise a `MissingExtra` where it is missing.

    Raises:
        MissingExtra: it is not installed.
    """
    with optional_import(
        "surface: meshes of the water need pysplashsurf",
        "Install it: pip install 'aam-seals[render]'; or leave surface out",
    ):
        import pysplashsurf
    return pysplashsurf


def write_ply(path: Path, mesh: Mesh) -> None:
    """Write a mesh as a binary PLY file, which Blender, MeshLab and trimesh read."""
    corners = np.zeros(len(mesh.triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    corners["count"], corners["corners"] = 3, mesh.triangles
    head = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(mesh.vertices)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(mesh.triangles)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    with atomic_path(path) as beside:
        text = "\n".join(head).encode("ascii")
        beside.write_bytes(text + mesh.vertices.astype("<f4").tobytes() + corners.tobytes())


class Surfaces(InstantFiles):
    """Writer of surface meshes to a run folder as PLY files.

    Args:
        every: simulated time between two [s].
        fluid: of the run, or None.

    Raises:
        ConfigError: there is no fluid, or it has no particles.
        MissingExtra: pysplashsurf is not installed.
    """

    def __init__(self, every: float, fluid: Fluid | None) -> None:
        super().__init__(FOLDER, every, fluid)
        refuse_missing()
        self._spray = Spray()

    def write(self, path: Path, fluid: Fluid) -> None:
        """Write the surface and the spray over it, unless there are no particles."""
        (places, velocities), spacing = fluid.particles(), fluid.diagnostics().get(SPACING)
        if len(places) and spacing is not None:
            mesh = surface_of(places, spacing)
            drops = drop_mesh(self._spray.advance(places, velocities, spacing, self._every))
            corners = np.concatenate([mesh.vertices, drops[0]])
            faces = np.concatenate([mesh.triangles, len(mesh.vertices) + drops[1]])
            write_ply(path.with_name(path.name + ".ply"), Mesh(corners, faces))
