"""Windows with a free force at knots, and their information about it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.sysid.predictors.problem import LOOSE, WINDOW, stated_starts, transient_rows
from seals.sysid.predictors.surface_model_error import enters, surface_model_error
from seals.sysid.predictors.windows import Windows
from seals.sysid.predictors.windows_fit import Fitter

KNOT = 0.06
"""Spacing of the knots of the free force [s]."""
_IMPACT = 1.0
"""Free force in weights that an impact may show at least."""


class FreeWindows(Windows):
    """Windows of a log with a free force; start states are projected out.

    Args:
        fitter: linearisation that they belong to.
    """

    def __init__(self, fitter: Fitter) -> None:
        plant, trajectory = fitter.plant, fitter.trajectory
        vehicle, samples = plant.vehicle, plant.samples
        surface_error = surface_model_error(plant, trajectory)
        extra = None if surface_error is None else surface_error.push
        level = LOOSE * fitter.windows.gusts
        if enters(plant, trajectory):
            weight = vehicle.mass * vehicle.environment.gravity
            level = max(level, _IMPACT * weight / max(float(vehicle.gust[0]), 1e-9))
        super().__init__(
            samples,
            vehicle,
            trajectory,
            fitter.dynamics,
            length=WINDOW if samples.posed else 1e6,
            gusts=level,
            extra=extra,
            blur=None if surface_error is None else surface_error.blur,
            knot=max(KNOT, 1.5 * samples.step),
            stated=None if samples.posed else stated_starts(plant, trajectory),
            skip=transient_rows(plant),
            delay=fitter.windows.delay,
        )
        # weights of the free force, found before the stated gusts take its place
        self.loose, self._weights = self._gust_precision, self._weights
        self._gusts(fitter.windows.gusts * vehicle.gust, extra)
        self.tight = self._gust_precision
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

    def gram(self, outputs: Floats) -> Floats:
        """Inner products of the knots of the free force and other outputs, without start states.

        Args:
            outputs: whitened, shape (W, K * ny, c).

        Returns:
            Shape (W, 6 K + c, 6 K + c); the knots run axis by axis.
        """
        size = self.size
        loose = self._marginal.outputs
        start = loose[:, :, :size]
        both = np.concatenate([loose[:, :, size:], outputs], axis=2)
        held = np.matmul(start.transpose(0, 2, 1), start)
        scale = 1.0 / np.sqrt(np.maximum(np.einsum("wii->wi", held), 1e-300))
        held = held * scale[:, :, None] * scale[:, None, :] + 1e-11 * np.eye(size)
        cross = np.matmul(start.transpose(0, 2, 1), both) * scale[:, :, None]
        absorbed = np.linalg.solve(np.linalg.cholesky(held), cross)
        full = np.matmul(both.transpose(0, 2, 1), both)
        table: Floats = full - np.matmul(absorbed.transpose(0, 2, 1), absorbed)
        return table
