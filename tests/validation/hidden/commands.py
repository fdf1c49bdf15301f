"""The path of a command: row by row, late by a delay and a jitter, held, and perhaps sticking."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.validation.hidden.rotation import Array

PAD = 16


class Commands:
    """Rows of commands of several logs and what of them reaches the actuators.

    Args:
        rows: Number of rows of a log.
        count: Number of commands per row.
        logs: Number of logs.
        step: Time between rows [s].
        jitter: Lateness of every row, (rows + PAD, logs) [s].
    """

    def __init__(self, rows: int, count: int, logs: int, step: float, jitter: Array) -> None:
        self.values = np.zeros((rows + PAD, logs, count))
        self.logged = np.zeros((rows + PAD, logs, count))
        self.jitter = jitter
        self.step = step

    def begin(self, first: Array) -> None:
        """Hold a command (count, logs) before the first row."""
        self.values[:PAD] = first.T
        self.logged[:PAD] = first.T

    def send(self, row: int, command: Array, band: Array) -> None:
        """Write a row (count, logs); a sticking actuator ignores changes inside its band."""
        self.logged[row + PAD] = command.T
        held = self.values[row + PAD - 1].T
        stuck = np.abs(command - held) < band
        self.values[row + PAD] = np.where(stuck, held, command).T

    def obeyed(self) -> Commands:
        """The same commands with every actuator following what was sent."""
        rows, logs, count = self.logged.shape
        out = Commands(rows - PAD, count, logs, self.step, self.jitter)
        out.values = self.logged
        return out

    def arriving(
        self, row: NDArray[np.intp], log: NDArray[np.intp], start: float, end: float, delay: Array
    ) -> Array:
        """Mean command (count, n) over an inner step from start to end after the given rows [s]."""
        behind = np.floor((end - delay) / self.step).astype(np.intp)
        index = row + behind + PAD
        came = behind * self.step + delay + self.jitter[index, log]
        share = np.clip((end - came) / (end - start), 0.0, 1.0)
        now, before = self.values[index, log], self.values[index - 1, log]
        return (before + share[:, None] * (now - before)).T
