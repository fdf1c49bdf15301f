"""Response of actuators to commands: delay, zero-order hold, first-order lag."""

from __future__ import annotations

import numpy as np
from scipy.linalg.blas import dtbsv

from seals.arrays import Floats

JITTER = 0.5e-3
"""Mean time from the row of a command to its effect [s]: up to one millisecond, evenly spread."""


def respond(
    command: Floats,
    step: float,
    *,
    lag: Floats,
    delay: float,
    parts: int,
    fall: Floats | None = None,
) -> Floats:
    """Return the exact states of first-order actuators under commands held between rows.

    Equation:
        x' = (u(t - d) - x) / tau, u held from t_k to t_k+1; tau is ``fall`` where |u| < |x| at the
        start of a stretch of one command, ``lag`` elsewhere.

    Args:
        command: one row per step, shape (T, n).
        step: time between rows [s].
        lag: tau [s], shape (n,).
        delay: d [s], at least zero.
        parts: equal parts into which every step is divided.
        fall: tau while an actuator slows down [s], shape (n,); None for ``lag``.

    Returns:
        State at the start of every part, shape (T, parts, n); before the first row the first
        command is taken to have been held for ever.
    """
    rows, count = command.shape
    part = step / parts
    start = np.arange(rows * parts) * part
    # the command in force at a time, and the time at which it changes within the part
    index = np.floor((start - delay) / step + 1e-9)
    change = (index + 1.0) * step + delay - start
    held = command[np.clip(index.astype(int), 0, rows - 1)]
    following = command[np.clip(index.astype(int) + 1, 0, rows - 1)]
    before = np.minimum(change, part)[:, None]
    tau = np.maximum(lag, 1e-6)
    if fall is not None and np.any(fall != lag):
        taus = tau, np.maximum(fall, 1e-6)
        return _by_sign(held, following, before, part, taus).reshape(rows, parts, count)
    early, late = np.exp(-before / tau), np.exp(-(part - before) / tau)
    decay = np.exp(-part / tau)
    gained = held * (1.0 - early) * late + following * (1.0 - late)
    out = np.concatenate((command[:1], gained[:-1]))
    for k in range(count):
        # x(k + 1) = decay x(k) + gained(k) as a triangular system of one band
        band = np.full((2, len(out)), -decay[k])
        out[:, k] = dtbsv(1, band, out[:, k], lower=1, diag=1)
    return out.reshape(rows, parts, count)


def _by_sign(
    held: Floats, following: Floats, before: Floats, part: float, taus: tuple[Floats, Floats]
) -> Floats:
    """State at the start of every interval, where rise and fall have different time constants."""
    # what is kept over the two stretches of every part, rising and falling
    early, late = ([np.exp(-s / tau) for tau in taus] for s in (before, part - before))
    tables = [x[:-1].T.tolist() for x in (held, *early, following, *late)]
    columns = []
    # a few numbers: five times as fast one by one as as arrays
    for k in range(held.shape[1]):
        state = float(held[0, k])
        column = [state]
        for goal, rise, fall, then, up, down in zip(*(t[k] for t in tables), strict=True):
            state = goal + (state - goal) * (fall if abs(goal) < abs(state) else rise)
            state = then + (state - then) * (down if abs(then) < abs(state) else up)
            column.append(state)
        columns.append(column)
    found: Floats = np.array(columns).T
    return found
