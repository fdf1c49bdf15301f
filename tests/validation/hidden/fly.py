"""Runs of a batch: closed loop along a reference, and open loop over windows of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.validation.hidden.commands import PAD, Commands
from tests.validation.hidden.control import Controller
from tests.validation.hidden.onsets import entered
from tests.validation.hidden.plant import Plant
from tests.validation.hidden.rotation import Array

Index = NDArray[np.intp]


@dataclass
class Track:
    """What a run leaves: states at the rows, attitude and velocity at the inner steps.

    Attributes:
        rows: States at the start of each row, (rows, k, n).
        fine: Quaternion, velocity and spin at every inner step, (inner + 1, 10, n).
        volts: Terminal voltage at the rows, (rows, n).
        inner: Length of an inner step [s].
        per_row: Inner steps per row.
    """

    rows: Array
    fine: Array
    volts: Array
    inner: float
    per_row: int


class Gusts:
    """Coloured force (world axes) and torque (body axes): an Ornstein-Uhlenbeck process."""

    def __init__(self, plant: Plant, step: float, rng: np.random.Generator) -> None:
        self._keep = np.exp(-step / plant["gust_time"])
        self._kick = np.sqrt(1.0 - self._keep**2)
        self._size = np.concatenate(
            (np.tile(plant["gust_force"], (3, 1)), np.tile(plant["gust_torque"], (3, 1)))
        )
        self._rng = rng
        self.value = self._size * rng.standard_normal(self._size.shape)

    def advance(self) -> Array:
        """Next value, (6, n)."""
        fresh = self._size * self._rng.standard_normal(self._size.shape)
        self.value = self._keep * self.value + self._kick * fresh
        return self.value


def stepped(body: Any, state: Array, command: Array, t: Array, dt: float, seen: Array) -> Array:
    """One midpoint step, with quaternion, velocity and spin at its start written into (10, n)."""
    middle = state + 0.5 * dt * body.derivative(state, command, t)
    seen[:4], seen[4:7], seen[7:] = state[3:7], body.seen.velocity, body.seen.spin
    out: Array = state + dt * body.derivative(middle, command, t + 0.5 * dt)
    out[3:7] /= np.sqrt((out[3:7] ** 2).sum(0))
    return out


def closed_loop(
    body: Any,
    control: Controller | None,
    state: Array,
    *,
    seconds: float,
    step: float,
    per_row: int,
    rng: np.random.Generator,
    gusts: bool = True,
    changes: Sequence[tuple[float, Any]] = (),
) -> tuple[Track, Commands]:
    """Fly a batch; rows are `step` apart, with `per_row` inner steps each.

    Bodies with other parameters take over at the times of the changes.
    """
    waiting = list(changes)
    rows = round(seconds / step)
    n, inner = body.size, step / per_row
    count = body.commands
    jitter = rng.uniform(0.0, 0.001, (rows + PAD, n))
    sent = Commands(rows, count, n, step, jitter)
    sent.begin(body.hold(state))
    wind = Gusts(body.plant, inner, rng)
    track = _blank(rows, state.shape, body, inner, per_row)
    here, every = np.arange(n, dtype=np.intp), np.zeros(n, dtype=np.intp)
    delay = body.plant["act_delay"]
    for k in range(rows):
        t = k * step
        _note(track, k, body, state)
        if control is not None:
            m = body.motion(state, np.full(n, t))[0]
            wanted = control(t, m.place, state[3:7], m.world_velocity, m.spin, step)
            sent.send(k, wanted, body.band)
        for j in range(per_row):
            now = t + j * inner
            while waiting and now >= waiting[0][0]:
                after = waiting.pop(0)[1]
                body, state = after, entered(body, after, state, np.full(n, now))
            if gusts:
                body.gust = wind.advance()
            command = sent.arriving(every + k, here, j * inner, (j + 1) * inner, delay)
            seen = track.fine[k * per_row + j]
            state = stepped(body, state, command, np.full(n, now), inner, seen)
    body.watch(state, track.fine[rows * per_row], np.full(n, rows * step))
    return track, sent


def windows(
    body: Any,
    state: Array,
    sent: Commands,
    *,
    log: Index,
    first: Index,
    rows: int,
    inner: float,
    per_row: int,
) -> Track:
    """Replay windows from given states under the commands that were sent, without gusts.

    Args:
        body: Equations of the windows (one batch member per window).
        state: States at the first rows, (k, n).
        sent: Commands of the logs.
        log: Log of each window, (n,).
        first: First row of each window, (n,).
        rows: Length of a window in rows.
        inner: Inner step [s].
        per_row: Inner steps per row.
    """
    track = _blank(rows + 1, state.shape, body, inner, per_row)
    track.fine = track.fine[: rows * per_row + 1]
    body.gust = np.zeros((6, body.size))
    delay = body.plant["act_delay"]
    start: Array = np.asarray(first * sent.step, dtype=np.float64)
    for k in range(rows + 1):
        t = start + k * sent.step
        _note(track, k, body, state)
        if k == rows:
            body.watch(state, track.fine[k * per_row], t)
            break
        for j in range(per_row):
            now = t + j * inner
            command = sent.arriving(first + k, log, j * inner, (j + 1) * inner, delay)
            seen = track.fine[k * per_row + j]
            state = stepped(body, state, command, now, inner, seen)
    return track


def _blank(rows: int, shape: tuple[int, ...], body: Any, inner: float, per_row: int) -> Track:
    return Track(
        rows=np.zeros((rows, *shape)),
        fine=np.zeros((rows * per_row + 1, 10, shape[1])),
        volts=np.zeros((rows, shape[1])),
        inner=inner,
        per_row=per_row,
    )


def _note(track: Track, row: int, body: Any, state: Array) -> None:
    track.rows[row] = state
    track.volts[row] = body.voltage(state)
