"""Noise floor: errors of a perfect model from noise, gusts and unknown start states."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.sysid.predictors.problem import LOOSE, rewindowed, stated_starts
from seals.sysid.predictors.windows import Windows
from seals.sysid.validation.misfit import Misfit, Yardstick, plain_errors
from seals.sysid.validation.replay import Track

DRAWS = 6
"""Replicates of the noise."""
_SEED = 20


def noise_floor(last: Misfit, ruler: Yardstick) -> dict[str, dict[float, float]]:
    """Return the errors of a perfect model by channel and horizon.

    A perfect model starts every window at a trajectory found from noisy sensors, meets gusts that
    it does not know, and is compared with noisy readings. All three are drawn, seeded, and
    carried through the windows to first order.

    Args:
        last: the best model, about which the windows are linear.
        ruler: windows of the log.
    """
    rng = np.random.default_rng(_SEED)
    fitter = ruler.problem.fitter
    loose = rewindowed(fitter, gusts=LOOSE).windows
    squares: dict[str, dict[float, list[float]]] = {}
    for _ in range(DRAWS):
        track = _drawn(last.windows, loose, ruler, rng)
        for name, table in plain_errors(track, ruler, blank=True).items():
            for horizon, value in table.items():
                noise = ruler.problem.vehicle.sigma[name]
                squares.setdefault(name, {}).setdefault(horizon, []).append(value**2 + noise**2)
    return {
        name: {h: float(np.sqrt(np.mean(v))) for h, v in table.items()}
        for name, table in squares.items()
    }


def _drawn(windows: Windows, loose: Windows, ruler: Yardstick, rng: np.random.Generator) -> Track:
    """Errors of a perfect model in one replicate."""
    problem, rows = ruler.problem, ruler.rows
    start = _starts(loose, ruler, rng)
    gust = _gusts(ruler, rng)
    error = np.zeros((*rows.shape, windows.size))
    reading = np.zeros((*rows.shape, 6))
    dynamics, state = windows.dynamics, start
    for k in range(rows.shape[1]):
        at = rows[:, k]
        error[:, k] = state
        reading[:, k, :3] = state[:, 9:12]
        felt = np.einsum("wij,wj->wi", dynamics.output_matrix[at], state)
        reading[:, k, 3:] = felt + np.einsum("wij,wj->wi", dynamics.feedthrough[at], gust[:, k])
        pushed = np.einsum("wij,wj->wi", dynamics.input_matrix[at], gust[:, k])
        state = np.einsum("wij,wj->wi", dynamics.transition[at], state) + pushed
    turn = problem.vehicle.imu_turn.T
    reading = np.concatenate([reading[..., :3] @ turn, reading[..., 3:] @ turn], axis=2)
    return Track(rows=rows, error=error, reading=reading)


def _starts(loose: Windows, ruler: Yardstick, rng: np.random.Generator) -> Floats:
    """Errors of the trajectory at the starts of the windows, shape (W, n).

    With a pose they are what sensor noise alone makes of the trajectory under a free force.
    """
    problem, count = ruler.problem, len(ruler.rows)
    size = problem.fitter.trajectory.size
    if not problem.samples.posed:
        spread = stated_starts(problem.plant, problem.fitter.trajectory)[1]
        drawn: Floats = spread * rng.standard_normal((count, size))
        return drawn
    noise = rng.standard_normal(loose.weight.shape) * (loose.weight > 0.0)
    found, _ = loose.explained(noise.reshape(loose.count, -1))
    nearest = np.argmin(np.abs(loose.rows[:, :1] - ruler.rows[None, :, 0]), axis=0)
    starts: Floats = found[nearest]
    return starts


def _gusts(ruler: Yardstick, rng: np.random.Generator) -> Floats:
    """Unmodelled force and torque at the stated level, shape (W, K, 6)."""
    vehicle, step = ruler.problem.vehicle, ruler.problem.samples.step
    count, length = ruler.rows.shape
    level = np.repeat(vehicle.gust, 3)
    keep = float(np.exp(-step / vehicle.gust_time))
    out = np.empty((count, length, 6))
    out[:, 0] = rng.standard_normal((count, 6))
    for k in range(1, length):
        fresh = rng.standard_normal((count, 6))
        out[:, k] = keep * out[:, k - 1] + np.sqrt(1.0 - keep**2) * fresh
    return out * level
