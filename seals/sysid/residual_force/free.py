"""Windows with a free force at knots, and their information about it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.least_squares import factors_scaled
from seals.sysid.predictors.problem import LOOSE, WINDOW, stated_starts, transient_rows
from seals.sysid.predictors.surface_model_error import enters, surface_model_error
from seals.sysid.predictors.windows import WHOLE, Windows
from seals.sysid.predictors.windows_fit import Fitter

KNOT = 0.06
"""Spacing of the knots of the free force [s]."""
_IMPACT = 1.0
"""Free force in weights that an impact may show at least."""


class _Products(NamedTuple):
    """Products that stay while the misfit changes.

    Args:
        columns: responses that they belong to, shape (W, K * ny, c).
        both: outputs of the knots and these responses, shape (W, K * ny, 6 K + c).
        scale: that makes the diagonal of the start states' products one, shape (W, n).
        factor: Cholesky factor of their scaled products, shape (W, n, n).
        absorbed: projection of ``both`` on the start states, shape (W, n, 6 K + c).
        table: of their inner products, shape (W, 6 K + c, 6 K + c).
    """

    columns: Floats
    both: Floats
    scale: Floats
    factor: Floats
    absorbed: Floats
    table: Floats


class FreeWindows(Windows):
    """Windows of a log with a free force; start states are projected out.

    Args:
        fitter: linearisation that they belong to.
    """

    loosened = True

    def __init__(self, fitter: Fitter) -> None:
        plant, trajectory = fitter.plant, fitter.trajectory
        vehicle, samples = plant.vehicle, plant.samples
        surface_error = surface_model_error(plant, trajectory)
        level = LOOSE * fitter.windows.gusts
        if enters(plant, trajectory):
            weight = vehicle.mass * vehicle.environment.gravity
            level = max(level, _IMPACT * weight / max(float(vehicle.gust[0]), 1e-9))
        super().__init__(
            samples,
            vehicle,
            trajectory,
            fitter.dynamics,
            length=WINDOW if samples.posed else WHOLE,
            gusts=level,
            surface_error=surface_error,
            knot=max(KNOT, 1.5 * samples.step),
            stated=None if samples.posed else stated_starts(plant, trajectory),
            skip=transient_rows(plant),
            delay=fitter.windows.delay,
        )
        # weights of the free force, found before the stated gusts take its place
        self.loose, self._weights = self._gust_precision, self._weights
        self._gusts(fitter.windows.gusts * vehicle.gust, self._extra)
        self.tight = self._gust_precision
        self._products: _Products | None = None
        self.stated_gust: Floats = fitter.windows.gusts * vehicle.gust

    @property
    def knots(self) -> int:
        """Number of knots in a window."""
        return int(self._knots)

    @property
    def knot_rows(self) -> NDArray[np.integer[Any]]:
        """Rows of the log nearest to the knots, shape (W, K)."""
        place = np.round(np.linspace(0.0, self.length - 1.0, self._knots)).astype(int)
        return self.rows[:, place]

    def gram(self, columns: Floats, misfit: Floats) -> Floats:
        """Inner products of the knots of the free force and other outputs, without start states.

        Args:
            columns: whitened responses of parameters, shape (W, K * ny, c).
            misfit: whitened, shape (W, K * ny, 1).

        Returns:
            Shape (W, 6 K + c + 1, 6 K + c + 1); the knots run axis by axis.
        """
        if self._products is None or self._products.columns is not columns:
            self._products = self._products_with(columns)
        known = self._products
        absorbed = self._absorbed_by_start(known.factor, known.scale, misfit)
        full = np.matmul(known.both.transpose(0, 2, 1), misfit)
        size = known.table.shape[1]
        table = np.empty((self.count, size + 1, size + 1))
        table[:, :size, :size] = known.table
        table[:, :size, size:] = full - np.matmul(known.absorbed.transpose(0, 2, 1), absorbed)
        table[:, size:, :size] = table[:, :size, size:].transpose(0, 2, 1)
        table[:, size:, size:] = np.matmul(misfit.transpose(0, 2, 1), misfit)
        table[:, size:, size:] -= np.matmul(absorbed.transpose(0, 2, 1), absorbed)
        return table

    def _products_with(self, columns: Floats) -> _Products:
        """Products of the knots and of the responses, which stay while the misfit changes."""
        loose, size = self._marginal.outputs, self.size
        start, both = loose[:, :, :size], np.concatenate([loose[:, :, size:], columns], axis=2)
        scale, factor = factors_scaled(np.matmul(start.transpose(0, 2, 1), start))
        absorbed = self._absorbed_by_start(factor, scale, both)
        table = np.matmul(both.transpose(0, 2, 1), both)
        table -= np.matmul(absorbed.transpose(0, 2, 1), absorbed)
        return _Products(columns, both, scale, factor, absorbed, table)

    def _absorbed_by_start(self, factor: Floats, scale: Floats, outputs: Floats) -> Floats:
        """Projection of outputs on the start states."""
        start = self._marginal.outputs[:, :, : self.size]
        cross = np.matmul(start.transpose(0, 2, 1), outputs) * scale[:, :, None]
        return np.linalg.solve(factor, cross)
