"""Response of actuators to commands: delay, zero-order hold, first-order lag."""

from __future__ import annotations

import numpy as np
from scipy.linalg.blas import dtbsv

from seals.arrays import Floats

JITTER = 0.5e-3
"""Mean time from the row of a command to its effect [s]: up to one millisecond, evenly spread."""
_SAME = 1e-13
"""Change of the states below which two rounds agree, as a share of the largest command."""


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
        goal, span = _in_turn(held, following), _in_turn(before, part - before)
        kept = (np.exp(-span / np.maximum(t, 1e-6)[:, None]) for t in (lag, fall))
        states: Floats = _by_sign(goal, *kept)[:, ::2].T.reshape(rows, parts, count)
        return states
    early, late = np.exp(-before / tau), np.exp(-(part - before) / tau)
    decay = np.exp(-part / tau)
    gained = held * (1.0 - early) * late + following * (1.0 - late)
    out = np.concatenate((command[:1], gained[:-1]))
    for k in range(count):
        # x(k + 1) = decay x(k) + gained(k) as a triangular system of one band
        band = np.full((2, len(out)), -decay[k])
        out[:, k] = dtbsv(1, band, out[:, k], lower=1, diag=1)
    return out.reshape(rows, parts, count)


def _in_turn(first: Floats, second: Floats) -> Floats:
    """Rows of two arrays in turn, each column a row, shape (n, 2 T)."""
    return np.stack((first.T, second.T), axis=2).reshape(first.shape[1], -1)


def _by_sign(goal: Floats, rise: Floats, fall: Floats) -> Floats:
    """States at the start of stretches, where rise and fall have different time constants.

    Which of the two rules a stretch depends on the state: it is guessed, and the linear recursion
    solved, until the states agree. A wrong guess is forgotten within a few time constants, so that
    five rounds are usual.

    Args:
        goal: of every stretch, shape (n, 2 T).
        rise: share of the distance to the goal that is kept over a stretch, shape (n, 2 T).
        fall: the same where the actuator slows down, shape (n, 2 T).
    """
    size, states = np.abs(goal), np.full_like(goal, np.inf)
    # the state stays behind its goals: it is mostly above one that is less than the last
    falls = np.zeros(goal.shape, dtype=bool)
    np.less(size[:, 1:], size[:, :-1], out=falls[:, 1:])
    same = _SAME * size.max(initial=0.0)
    # every round is right for at least one more stretch
    for _ in range(goal.shape[1]):
        # states at the start of stretches that keep a share of the distance to their goals
        decay = np.where(falls, fall, rise)
        out, band = np.empty_like(goal), np.empty((2, goal.shape[1]), order="F")
        out[:, 0], out[:, 1:] = goal[:, 0], ((1.0 - decay) * goal)[:, :-1]
        for k, kept in enumerate(decay):
            band[1] = -kept
            out[k] = dtbsv(1, band, out[k], lower=1, diag=1)
        before, states = states, out
        guess, falls = falls, size < np.abs(states)
        if np.array_equal(guess, falls) or not (np.abs(states - before) > same).any():
            break
    return states
