"""Added mass and radiation of a hull by boundary elements (capytaine)."""

from __future__ import annotations

import importlib.util
import logging
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, MissingExtra
from seals.scaffold.hydrodynamics.panels import Panels

BAND = (0.15, 6.0)
"""Wavenumbers that are computed, times half the length and half the breadth of the waterplane."""
PER_WAVE = 8.0
"""Panels of a wave's length from which on the wave is resolved [1]."""
_DOFS = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")


class Radiation(NamedTuple):
    """Radiation of a floating hull about the link origin, axes of the link.

    Args:
        frequency: w [rad/s], shape (W,).
        added_mass: A(w), order [linear, angular] [kg, kg m, kg m^2], shape (W, 6, 6).
        damping: B(w) [kg/s, kg m/s, kg m^2/s], shape (W, 6, 6).
        limit: A at infinite frequency, shape (6, 6).
        length: half the largest extent of the hull [m].
    """

    frequency: Floats
    added_mass: Floats
    damping: Floats
    limit: Floats
    length: float


def has_boundary_elements() -> bool:
    """Return whether the extra `hydro` is installed."""
    return importlib.util.find_spec("capytaine") is not None


def deep_added_mass(panels: Panels, density: float) -> Floats:
    """Return the added mass of a hull deep under water, about the link origin.

    Equation:
        A_ij = -rho int phi_i n_j dS, phi_i the potential of the motion i in unbounded water.

    Args:
        panels: closed surface, link axes.
        density: of the water [kg/m^3].

    Returns:
        Symmetric matrix, order [linear, angular], shape (6, 6) [kg, kg m, kg m^2]; positive
        semi-definite, what the panels leave below zero is cut.

    Raises:
        MissingExtra: capytaine is not installed.

    Assumptions: ideal flow without free surface, walls or bottom; constant sources on flat panels.

    References: Hess and Smith 1964, J. Ship Research 8; Ancellin and Dias 2019, J. Open Source
        Software 4(36).
    """
    with _library() as library:
        added_mass, _ = _problem(library, panels, density)(None)
    return positive(added_mass)


def radiation_of(
    panels: Panels,
    level: float,
    frequency: Floats,
    density: float,
    *,
    gravity: float = 9.81,
    tell: Callable[[int], object] = int,
) -> Radiation:
    """Return added mass and damping of a hull that floats upright in deep water.

    Args:
        panels: closed surface, link axes.
        level: height of the water surface above the link origin [m].
        frequency: w [rad/s], shape (W,).
        density: of the water [kg/m^3].
        gravity: [m/s^2].
        tell: called with the number of frequencies done.

    Raises:
        MissingExtra: capytaine is not installed.
        ConfigError: no part of the hull is under water.

    Assumptions: linear waves of small slope; irregular frequencies are removed by a lid.
    """
    with _library() as library:
        solved = _problem(library, panels, density, gravity, lid=level)
        limit, _ = solved(math.inf)
        masses, dampings = [], []
        for number, w in enumerate(frequency):
            mass, damping = solved(float(w))
            masses.append(mass)
            dampings.append(damping)
            tell(number + 1)
    both = np.array(masses), np.array([positive(one) for one in dampings])
    length = 0.5 * float(np.ptp(panels.vertices, axis=0).max())
    return Radiation(np.asarray(frequency, dtype=float), *both, positive(limit), length)


def extrapolated(coarse: Floats, fine: Floats, ratio: float) -> Floats:
    """Return a matrix extrapolated from two numbers of panels to infinitely many.

    Args:
        coarse: with fewer panels.
        fine: with more, same shape.
        ratio: of the numbers of panels, fine by coarse, above 1 [1].
    """
    return fine + (fine - coarse) / (ratio - 1.0)


def wave_frequencies(panels: Panels, level: float, count: int, *, gravity: float = 9.81) -> Floats:
    """Return frequencies over the band in which a floating hull makes waves [rad/s], (count,).

    They are equidistant in frequency. The highest one is such that its wave spans enough panels.

    Args:
        panels: closed surface, link axes.
        level: height of the water surface above the link origin [m].
        count: number of them.
        gravity: [m/s^2].
    """
    wet = panels.corners[panels.corners[:, :, 2].min(axis=1) < level].reshape(-1, 3)
    if not len(wet):
        raise ConfigError("no part of the hull is under water.\nGive a level above its bottom.")
    # of the rectangle around the part under water
    half = 0.5 * np.sort(np.ptp(wet[:, :2], axis=0))
    edge = math.sqrt(2.0 * panels.area / len(panels.faces))
    number = min(BAND[1] / half[0], 2.0 * math.pi / (PER_WAVE * edge))
    band = (math.sqrt(gravity * BAND[0] / half[1]), math.sqrt(gravity * number))
    return np.linspace(min(band[0], 0.2 * band[1]), band[1], count)


def positive(matrix: Floats) -> Floats:
    """Return the symmetric part of a matrix without its negative eigenvalues, shape (n, n)."""
    matrix = 0.5 * (matrix + matrix.T)
    # one unit for all motions: a turn that moves nothing must not be cut by the size of a mass
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-12 * np.abs(matrix).max() + 1e-300))
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    out: Floats = (vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(scale, scale)
    return out


@contextmanager
def _library() -> Iterator[Any]:
    """Import the library with its log messages silenced."""
    try:
        import capytaine
    except ImportError as cause:
        raise MissingExtra(
            "boundary elements need capytaine, which is not installed.\n"
            "Install it: pip install 'aam-seals[hydro]'; or use method=ellipsoid"
        ) from cause
    log = logging.getLogger("capytaine")
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        yield capytaine
    finally:
        log.setLevel(before)


def _body(library: Any, panels: Panels, *, lid: float | None) -> Any:
    """The hull as the library's body, its motions about the link origin."""
    # a triangle is a panel of four corners, two of them equal
    faces = np.concatenate((panels.faces, panels.faces[:, :1]), axis=1)
    vertices = panels.vertices - np.array([0.0, 0.0, lid or 0.0])
    mesh = library.Mesh(vertices=vertices, faces=faces, name="hull")
    origin = (0.0, 0.0, -(lid or 0.0))
    dofs = library.rigid_body_dofs(rotation_center=origin)
    if lid is None:
        return library.FloatingBody(mesh=mesh, dofs=dofs, name="hull")
    mesh = mesh.immersed_part()
    if mesh.nb_faces == 0:
        raise ConfigError("no part of the hull is under water.\nGive a level above its bottom.")
    below = -0.02 * float(np.ptp(np.asarray(mesh.vertices)[:, 2]))
    inside = mesh.generate_lid(z=below)
    extra = {"lid_mesh": inside} if inside.nb_faces else {}
    return library.FloatingBody(mesh=mesh, dofs=dofs, name="hull", **extra)


def _problem(
    library: Any, panels: Panels, density: float, gravity: float = 9.81, lid: float | None = None
) -> Callable[[float | None], tuple[Floats, Floats]]:
    """Radiation of a body as a function of the frequency [rad/s]; None is unbounded water.

    It returns added mass and damping, shape (6, 6) each.
    """
    body = _body(library, panels, lid=lid)
    # kept, for it reads a table when it is made
    solver = library.BEMSolver(method="direct")

    def solved(frequency: float | None) -> tuple[Floats, Floats]:
        surface = {"free_surface": np.inf} if frequency is None else {"omega": frequency}
        problems = [
            library.RadiationProblem(
                body=body, radiating_dof=dof, rho=density, g=gravity, **surface
            )
            for dof in _DOFS
        ]
        found = solver.solve_all(problems, progress_bar=False)
        by_dof = {one.radiating_dof: one for one in found}
        mass = np.array([[by_dof[a].added_masses[b] for b in _DOFS] for a in _DOFS])
        damping = np.array([[by_dof[a].radiation_dampings[b] for b in _DOFS] for a in _DOFS])
        return mass, damping

    return solved
