"""A box of particles for cases without a robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.experiments.water_validation.case import Grade
from seals.plugins.fluids.coupling import Method
from seals.plugins.fluids.coupling.bodies import add_samples, clear_of
from seals.plugins.fluids.sampling import Samples, Thin, box_walls, sample_pieces
from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_settings import DeviceSettings
from seals.plugins.fluids.solvers.device_solver import DeviceSolver
from seals.plugins.fluids.solvers.dfsph.settings import DfsphOptions, DfsphSettings
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.robot.pieces import Piece

HERE = Grade(quick=True)


def filled_box(
    size: Sequence[float] | Floats,
    spacing: float,
    inside: Callable[[Floats], Any] | None = None,
    *,
    grade: Grade = HERE,
    physics: DeviceSettings | None = None,
    body: Sequence[Piece] = (),
    without: Samples | None = None,
    above: float = 0.0,
) -> DeviceSolver:
    """Return a box with floor and four walls, filled with water at rest where ``inside`` says.

    Args:
        size: of the box; its low corner is the origin [m].
        spacing: of the particles [m].
        inside: takes places (n, 3) and returns which of them hold water; all for None.
        grade: where it runs, and by which solver.
        physics: options of the solver; as it comes for None.
        body: pieces of a body that moves in it, in its axes; boundary 1.
        without: samples of the body where it begins, in whose place there is no water.
        above: room above the box [m].
    """
    counts = np.round(np.array(size) / spacing).astype(int)
    high = counts * spacing
    axes = [spacing * (np.arange(n) + 0.5) for n in counts]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    if inside is not None:
        places = places[np.asarray(inside(places), dtype=bool)]
    if without is not None:
        places = clear_of(places, without, spacing)
    walls = box_walls(np.zeros(3), high, spacing)
    face = sample_pieces(body, spacing, thin=Thin.volume) if body else None
    margin = 3.0 * spacing
    water = solver_of(
        Domain(
            spacing=spacing,
            lower=np.full(3, -margin),
            upper=high + margin + np.array([0.0, 0.0, above]),
            capacity=len(places),
            boundary_capacity=len(walls.points) + (0 if face is None else len(face.points)),
            bodies=0 if face is None else 1,
        ),
        grade=grade,
        physics=physics,
    )
    water.add_boundary(body=0, points=walls.points)
    if face is not None:
        add_samples(water, 1, face)
    water.add_particles(places, trusted=face is not None)
    return water


def solver_of(
    domain: Domain, *, grade: Grade = HERE, physics: DeviceSettings | None = None
) -> DeviceSolver:
    """Return an empty solver of a grade.

    Args:
        domain: extent and capacities.
        grade: where it runs, and by which solver.
        physics: options of the solver; as it comes for None.
    """
    chosen = physics or PbfSettings()
    if grade.solver is Method.dfsph:
        chosen = DfsphSettings.of(chosen, DfsphOptions())
    return chosen.build(domain, device=grade.device.value, threads=grade.threads)


def advance(water: DeviceSolver, step: float) -> None:
    """Advance by a step, in as many substeps as the speed of sound asks for."""
    water.advance(step, substeps=water.substeps(step))
