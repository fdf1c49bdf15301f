"""Fit of a local force: constant direction, Gaussian around a point in the world."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.place import bounded_fit
from seals.sysid.residual_force.regress import Table, gain
from seals.sysid.residual_force.residual import Residual
from seals.sysid.residual_force.terms import basis_of

_GRID = 9
_WIDTHS = (0.15, 0.3, 0.6)
_SEEN = 0.4
"""Share of its full force that the vehicle must have met."""
_LARGEST = 1.0
"""Widest spot as a share of the range of the log: wider ones are not spots."""


@dataclass(frozen=True, kw_only=True)
class Spot:
    """A force c exp(-r^2 / 2 w^2) around a point, one direction in the world.

    Args:
        place: of the point, world [m].
        place_sd: 1-sigma [m].
        spread: w [m].
        spread_sd: 1-sigma [m].
        force: c, world axes [N].
        force_sd: 1-sigma [N].
        share: of the excess that it explains on held-out windows.
        share_sd: its standard error.
    """

    place: tuple[float, ...]
    place_sd: tuple[float, ...]
    spread: float
    spread_sd: float
    force: tuple[float, ...]
    force_sd: tuple[float, ...]
    share: float
    share_sd: float

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the term ``spot``."""
        return {"place": self.place, "spread": self.spread}

    @property
    def sure(self) -> bool:
        """Return true if the spot is significant on held-out windows."""
        return self.share > 2.0 * self.share_sd and self.share > 0.1

    def to_dict(self) -> dict[str, Any]:
        """Return the figures."""
        return asdict(self) | {"sure": self.sure}


def spot(
    found: Evidence, around: Conditions, left: Residual, *, without: Floats | None = None
) -> Spot | None:
    """Fit a local force to the residual force less ``without`` (world axes, (n, 3)).

    Returns:
        The spot; None where the vehicle hardly moved or never came near it.
    """
    position, force = around.position, left.force_world
    force = force if without is None else force - without
    weight = 1.0 / np.sqrt(left.force_world_sd**2 + float(left.gust[0]) ** 2)
    span = np.ptp(position, axis=0)
    if float(span.max()) < 0.2:
        return None
    widest = _LARGEST * float(span.max())
    begin = _start(position, force, weight, span)
    low = np.array([*(position.min(axis=0) - 0.2), 0.03])
    high = np.array([*(position.max(axis=0) + 0.2), max(widest, 0.1)])

    def miss(x: Floats) -> Floats:
        shape = _shape(position, x)[:, None] * weight
        size = (shape * force * weight).sum(axis=0) / np.maximum((shape**2).sum(axis=0), 1e-300)
        out: Floats = (size * shape - force * weight).ravel()
        return out

    fit = bounded_fit(miss, [begin], low, high, scale=0.2)
    if fit is None or float(_shape(position, fit[0]).max()) < _SEEN:
        return None
    x, spread = fit
    place, size = tuple(map(float, x[:3])), float(x[3])
    settings = {"place": place, "spread": size}
    table = Table(found, basis_of("spot", settings, around))
    won = gain(found.before, table.held_out(range(3)), found)
    return Spot(
        place=place,
        place_sd=tuple(map(float, spread[:3])),
        spread=size,
        spread_sd=float(spread[3]),
        force=tuple(map(float, table.solve(range(3)))),
        force_sd=tuple(map(float, np.sqrt(np.diag(table.covariance(range(3)))))),
        share=won.share,
        share_sd=won.share_sd,
    )


def _shape(position: Floats, x: Floats) -> Floats:
    out: Floats = np.exp(-0.5 * ((position - x[:3]) ** 2).sum(axis=1) / x[3] ** 2)
    return out


def _start(position: Floats, force: Floats, weight: Floats, span: Floats) -> Floats:
    """Best point of a grid over the positions in the log."""
    line = np.linspace(0.0, 1.0, _GRID)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    places = position.min(axis=0) + grid * span
    thin = slice(None, None, max(1, len(position) // 150))
    seen, heavy = position[thin], weight[thin] ** 2
    target = force[thin] * heavy
    square = ((places[:, None, :] - seen) ** 2).sum(axis=2)
    best = (-1.0, np.zeros(4))
    for width in _WIDTHS:
        shape = np.exp(-0.5 * square / width**2)
        fall = ((shape @ target) ** 2 / np.maximum(shape**2 @ heavy, 1e-6 * heavy.max())).sum(
            axis=1
        )
        k = int(np.argmax(fall))
        if fall[k] > best[0]:
            best = float(fall[k]), np.array([*places[k], width])
    return best[1]
