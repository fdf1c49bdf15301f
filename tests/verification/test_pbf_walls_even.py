"""Pressure along walls is that across them: a column at rest is not driven along its walls."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.pbf.device.isotropy import Isotropy
from seals.plugins.fluids.solvers.pbf.engine import Engine
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.solvers.pbf.solver import SolverPbf

pytestmark = pytest.mark.filterwarnings("ignore:.*getdefaultlocale:DeprecationWarning")

SPACING = 0.025
COUNTS = np.array([8, 8, 20])
SETTLING, LOOKS, BETWEEN = 1.2, 40, 0.03
"""Time before the first look [s], number of looks, time between two [s]."""
STEP = 0.003


class Streams(NamedTuple):
    """Vertical velocity at every look, between three spacings from the floor and the surface [m/s].

    Args:
        wall: mean of the layer of particles on the walls.
        core: mean of what is farther than two spacings from them.
    """

    wall: np.ndarray[Any, Any]
    core: np.ndarray[Any, Any]


def lattice(counts: np.ndarray[Any, Any], first: float) -> np.ndarray[Any, Any]:
    """Places one spacing apart that begin ``first`` spacings from the origin."""
    axes = [SPACING * (np.arange(n) + first) for n in counts]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def column() -> SolverPbf:
    """A column 8 x 8 x 20 spacings large between walls of one layer of samples, shaken a little."""
    inside = COUNTS * [1, 1, 2]
    layer = lattice(inside + 2, -0.5)
    steps = np.round(layer / SPACING + 0.5)
    layer = layer[((steps == 0) | (steps == inside + 1)).any(axis=1)]
    water = SolverPbf(
        Domain(
            spacing=SPACING,
            lower=np.full(3, -SPACING),
            upper=SPACING * (inside + 1.0),
            capacity=int(np.prod(COUNTS)),
            boundary_capacity=len(layer),
            bodies=0,
        ),
        settings=PbfSettings(),
        engine=Engine(),
    )
    water.add_boundary(body=0, points=layer)
    points = lattice(COUNTS, 0.5)
    rng = np.random.default_rng(0)
    water.add_particles(points + rng.uniform(-0.1, 0.1, points.shape) * SPACING)
    return water


def watched() -> Streams:
    """Let the column settle, then look at it."""
    water = column()
    water.advance(SETTLING, substeps=round(SETTLING / STEP))
    wall, core = np.zeros(LOOKS), np.zeros(LOOKS)
    for k in range(LOOKS):
        water.advance(BETWEEN, substeps=round(BETWEEN / STEP))
        places, rise = water.positions(), water.velocities()[:, 2]
        across = np.minimum(places[:, :2], COUNTS[:2] * SPACING - places[:, :2]).min(axis=1)
        along = np.abs(places[:, 2] - 10.0 * SPACING) < 7.0 * SPACING
        wall[k] = rise[along & (across < SPACING)].mean()
        core[k] = rise[along & (across > 2.0 * SPACING)].mean()
    water.close()
    return Streams(wall, core)


def drift(found: Streams) -> float:
    """Mean velocity of the layer on the walls, over its own scatter from look to look."""
    return float(abs(found.wall.mean()) / found.wall.std())


def test_water_on_a_wall_goes_neither_up_nor_down() -> None:
    """Its mean is zero within twice its scatter, and no stream rises within by half a spacing a s.

    A layer whose pressure along the wall is wrong by a share s of that across is driven by s g for
    as long as the column stands, and walls are smooth: what drives it shows as a lasting mean.
    """
    found = watched()
    print(f"wall {found.wall.mean():.5f} +- {found.wall.std():.5f}, core {found.core.mean():.5f}")
    assert drift(found) < 2.0
    assert abs(found.core.mean() - found.wall.mean()) < 0.5 * SPACING / 1.0


@pytest.mark.slow
def test_an_uneven_wall_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the moments of the samples alone, not of the water behind them, both bounds break."""
    begin = Isotropy.__init__

    def uneven(self: Isotropy, *parts: Any, **options: Any) -> None:
        begin(self, *parts, **options)
        self.across, self.along = 1.0, 0.0

    monkeypatch.setattr(Isotropy, "__init__", uneven)
    found = watched()
    print(f"wall {found.wall.mean():.5f} +- {found.wall.std():.5f}, core {found.core.mean():.5f}")
    assert drift(found) > 2.0
    assert abs(found.core.mean() - found.wall.mean()) > 0.5 * SPACING / 1.0
