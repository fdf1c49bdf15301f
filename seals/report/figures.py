"""Data of a chart, independent of the drawing library."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from seals.arrays import Floats
from seals.errors import SealsError
from seals.report.style import colour_of

MOST_POINTS = 2400
"""Points of a series in a page: more than a screen has pixels across."""


ROUNDING = 1e-9
"""Motions and loads of a run below it, in SI units, are rounding."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """One line of a chart.

    Args:
        name: as in the legend.
        x: shape (points,).
        y: shape (points,); NaN leaves a gap.
        colour: hexadecimal, chosen by the name when left out.
        dashed: whether the line is dashed, as a reference or a model beside a measurement.
        points: whether points are drawn instead of a line.
        band: half width of a shaded band around the line, shape (points,); or its reach below and
            above the line, shape (2, points).
    """

    name: str
    x: Floats
    y: Floats
    colour: str | None = None
    dashed: bool = False
    points: bool = False
    band: Floats | None = None

    def edges(self) -> tuple[Floats, Floats]:
        """Return the lower and upper edge of the band of a line, each of shape (points,).

        Example:
            >>> x = np.arange(2.0)
            >>> band = np.array([[0.5, 0.5], [1.0, 2.0]])
            >>> low, high = Series(name="a", x=x, y=x, band=band).edges()
            >>> low.tolist(), high.tolist()
            ([-0.5, 0.5], [1.0, 3.0])
        """
        band = np.zeros_like(self.y) if self.band is None else self.band
        below, above = np.broadcast_to(band, (2, self.y.size))
        return self.y - below, self.y + above

    def downsampled(self) -> Series:
        """Return a series of at most about `MOST_POINTS` points that keeps every peak.

        Of each bin the lowest and the highest sample survive: a spike of one sample stays visible.

        Example:
            >>> spike = np.zeros(100_000)
            >>> spike[77_777] = 1.0
            >>> small = Series(name="a", x=np.arange(100_000.0), y=spike).downsampled()
            >>> small.y.size <= MOST_POINTS, float(small.y.max())
            (True, 1.0)
        """
        count = self.x.size
        if count <= MOST_POINTS:
            return self
        kept = extremes(self.y, MOST_POINTS // 2 - 1)
        return dataclasses.replace(
            self,
            x=self.x[kept],
            y=self.y[kept],
            band=None if self.band is None else self.band[..., kept],
        )

    def even(self, most: int = MOST_POINTS) -> Series:
        """Return a series on evenly picked samples: stacked areas need a common abscissa."""
        if self.x.size <= most:
            return self
        kept = np.unique(np.linspace(0, self.x.size - 1, most).astype(np.intp))
        return dataclasses.replace(self, x=self.x[kept], y=self.y[kept], band=None)


@dataclass(frozen=True, kw_only=True)
class Mark:
    """Labelled line at a time (on x) or a level (on y)."""

    at: float
    label: str
    level: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """One chart.

    Args:
        title: what is shown, a few words.
        y_label: quantity and unit of the ordinate.
        x_label: of the abscissa; charts over time zoom together.
        series: the lines.
        stacked: whether the series add up to areas, positive and negative ones apart.
        marks: instants and levels.
        equal: whether both axes have one scale, as in a view from above.
        note: one line below the chart.

    Raises:
        SealsError: a series has coordinates of different shapes.

    Example:
        >>> import numpy as np
        >>> t = np.linspace(0.0, 1.0, 5)
        >>> Chart(title="Height", y_label="z [m]", series=(Series(name="z", x=t, y=-t),)).series[
        ...     0
        ... ].name
        'z'
    """

    title: str
    y_label: str
    x_label: str = "time [s]"
    series: tuple[Series, ...] = ()
    stacked: bool = False
    marks: tuple[Mark, ...] = field(default=())
    equal: bool = False
    note: str = ""

    def __post_init__(self) -> None:
        for line in self.series:
            if np.shape(line.x) != np.shape(line.y) or np.ndim(line.x) != 1:
                raise SealsError(
                    f"chart '{self.title}': series '{line.name}' has x of shape {np.shape(line.x)} "
                    f"and y of shape {np.shape(line.y)}.\nAllowed: one shape (points,) for both."
                )

    def coloured(self) -> Chart:
        """Return the chart with a colour for every series."""
        lines = (
            line if line.colour else dataclasses.replace(line, colour=colour_of(line.name, k))
            for k, line in enumerate(self.series)
        )
        return dataclasses.replace(self, series=tuple(lines))


def lines(
    title: str,
    y_label: str,
    x: ArrayLike,
    values: Mapping[str, ArrayLike],
    *,
    marks: tuple[Mark, ...] = (),
    note: str = "",
) -> Chart:
    """Return a chart with one line for each named column over a common abscissa.

    Args:
        title: of the chart.
        y_label: quantity and unit.
        x: abscissa, shape (points,).
        values: columns by name, each of shape (points,).
        marks: instants and levels.
        note: one line below the chart.
    """
    across = np.asarray(x, dtype=float)
    made = tuple(
        Series(name=name, x=across, y=np.asarray(y, dtype=float)) for name, y in values.items()
    )
    return Chart(title=title, y_label=y_label, series=made, marks=marks, note=note)


def without_rounding(values: Floats) -> Floats:
    """Return zeros in place of values of a run that are all `ROUNDING` or less.

    A chart of them alone would be one of rounding errors, on an axis of its own.

    Example:
        >>> without_rounding(np.array([2e-16, -1e-15])).tolist()
        [0.0, 0.0]
    """
    small = np.nanmax(np.abs(values), initial=0.0) <= ROUNDING
    return np.where(np.isnan(values), values, 0.0) if small else values


def extremes(y: Floats, bins: int) -> np.ndarray[tuple[int, ...], np.dtype[np.intp]]:
    """Return the indices of the smallest and largest sample of each bin, and both ends."""
    edges = np.linspace(0, y.size, bins + 1).astype(np.intp)
    width = int(np.diff(edges).max())
    index = np.minimum(edges[:-1, None] + np.arange(width), edges[1:, None] - 1)
    table = y[index]
    rows = np.arange(bins)
    # a bin of nothing but gaps keeps its first gap
    low = np.argmin(np.where(np.isnan(table), np.inf, table), axis=1)
    high = np.argmax(np.where(np.isnan(table), -np.inf, table), axis=1)
    return np.unique(np.concatenate([[0], index[rows, low], index[rows, high], [y.size - 1]]))
