"""Random simulations with plausible effects, as starting points of whole-run fits."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import has_hook
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.data.samples import IMU
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.parallel import spread
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.rollout import start_sigma, start_states

COUNT = 140
"""Simulations of all runs in one generation."""
_GENERATIONS, _PARENTS = 2, 7
"""Further generations, and how many of the nearest trials they lie about."""
_NEARBY, _GROWN = 0.5, (0.6, 1.5)
"""How far from them: in tolerances, and factors on an effect."""
_SEED = 1
SIZES = (-0.6, 0.5, 1.0)
"""Shares of the plausible size of an effect with which runs are simulated."""
_BROAD = 4.0
"""Noise of the readings against which a simulation is weighed, in units of the stated one."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Values and start states of one simulation of all runs.

    Args:
        values: changes by parameter key.
        start: state errors of the stated starts, shape (runs, 12).
        kind: number of the effect and its size.
    """

    values: Mapping[str, float]
    start: Floats
    kind: int


def trials(plant: ExtendedModel, *, leave: Sequence[str]) -> list[Trial]:
    """Draw random parameter values and start states, with one effect or none.

    When a hull comes up again hangs on all of them.

    Args:
        plant: extended model.
        leave: names of effects that are left out.
    """
    candidate_set, spread = plant.candidate_set, start_sigma(plant.vehicle)
    rng = np.random.default_rng(_SEED)
    # no effect, and each effect on the motion in several sizes
    sizes: list[dict[str, float]] = [{}]
    for candidate in candidate_set.candidates:
        parameters = [candidate_set.parameters[k] for k in candidate.keys]
        if candidate.name not in leave and not _silent(candidate_set, candidate.keys[0]):
            sizes += [{f.key: size * f.scale for f in parameters} for size in SIZES]
    acting = [k for k in candidate_set.tolerances if not _silent(candidate_set, k)]
    out = []
    for k in range(COUNT):
        values = {
            key: candidate_set.parameters[key].tolerance * float(rng.standard_normal())
            for key in acting
        }
        for key, size in sizes[k % len(sizes)].items():
            values[key] = values.get(key, 0.0) + size
        start = spread * rng.standard_normal((len(plant.samples.runs), 12))
        out.append(
            Trial(
                values={
                    key: _inside(v, candidate_set.parameters[key].bounds)
                    for key, v in values.items()
                },
                start=start if k else 0.0 * start,
                kind=k % len(sizes),
            )
        )
    return out


def _silent(candidate_set: CandidateSet, key: str) -> bool:
    """Return true if a parameter changes the readings but not the motion."""
    effect = candidate_set.effects.get(candidate_set.parameters[key].instance)
    return effect is None or any(has_hook(effect, h) for h in ("measure", "pose_turn", "timing"))


def _mutated(plant: ExtendedModel, about: Sequence[Trial]) -> list[Trial]:
    """Draw trials in the neighbourhood of others.

    Args:
        plant: extended model.
        about: trials near which they lie.
    """
    parameters, spread = plant.candidate_set.parameters, start_sigma(plant.vehicle)
    rng = np.random.default_rng(_SEED + 1)
    out = []
    for k in range(COUNT):
        parent, values = about[k % len(about)], {}
        for key, value in parent.values.items():
            tolerance = parameters[key].tolerance
            # beyond a tolerance it is an effect
            grown = float(rng.uniform(*_GROWN)) if abs(value) > 2.5 * tolerance else 1.0
            drawn = grown * value + _NEARBY * tolerance * float(rng.standard_normal())
            values[key] = _inside(drawn, parameters[key].bounds)
        start = parent.start + _NEARBY * spread * rng.standard_normal(parent.start.shape)
        out.append(Trial(values=values, start=start, kind=parent.kind))
    return out


def nearest_trajectories(
    plant: ExtendedModel, *, leave: Sequence[str], ranks: Sequence[int] = (0,), processes: int = 1
) -> list[Trajectory]:
    """Simulate many trials of all runs; keep for each run the trajectories near its readings.

    Args:
        plant: extended model of a log without actuators; its parts say how finely.
        leave: names of effects that are left out.
        ranks: of the trajectories to keep: 0 takes the nearest of every run, 1 the second one.
        processes: that share the simulations.
    """

    def run(some: Sequence[Trial]) -> tuple[Floats, list[Floats]]:
        """Simulate trials, every process its part."""
        edges = np.linspace(0, len(some), processes + 1).astype(int)
        parts = [some[a:b] for a, b in itertools.pairwise(edges)]
        found = spread(lambda part: simulated(plant, part), parts, processes)
        joined = [np.concatenate(x) for x in zip(*(f[1] for f in found), strict=True)]
        return np.concatenate([f[0] for f in found]), joined

    chosen = trials(plant, leave=leave)
    misfit, tracks = run(chosen)
    for _ in range(_GENERATIONS):
        best: dict[int, Trial] = {}
        for k in np.argsort(misfit.sum(axis=1)):
            best.setdefault(chosen[k].kind, chosen[k])
        more = _mutated(plant, list(best.values())[:_PARENTS])
        found = run(more)
        chosen = [*chosen, *more]
        misfit = np.concatenate([misfit, found[0]])
        tracks = [np.concatenate(pair) for pair in zip(tracks, found[1], strict=True)]
    order = np.argsort(misfit, axis=0)
    return [_course(plant, tracks, order[rank]) for rank in ranks]


def _course(plant: ExtendedModel, tracks: Sequence[Floats], taken: Any) -> Trajectory:
    """Join one trajectory from the trial chosen for each run."""
    runs = enumerate(plant.samples.runs)
    rows = [(taken[r], r, slice(b - a)) for r, (a, b) in runs]
    return Trajectory(*(np.concatenate([track[part] for part in rows]) for track in tracks))


def simulated(plant: ExtendedModel, chosen: Sequence[Trial]) -> tuple[Floats, list[Floats]]:
    """Simulate trials; return distances to the readings (trials, runs) and all states."""
    samples, runs, count = plant.samples, plant.samples.runs, len(chosen)
    keys = dict.fromkeys(k for trial in chosen for k in trial.values)
    # run by run within each trial
    table = {k: np.repeat([t.values.get(k, 0.0) for t in chosen], len(runs)) for k in keys}
    first = np.tile([a for a, _ in runs], count)
    stated = start_states(plant.vehicle.initial_state[: len(plant.samples.runs)])
    tiled = (np.tile(x, (len(chosen), 1)) for x in stated)
    state = Trajectory(*tiled).moved(np.concatenate([t.start for t in chosen])).state(slice(None))
    twin = plant.twin(table, len(first))
    states, readings = [], []
    for k in range(max(b - a for a, b in runs)):
        states.append(state)
        rows = np.minimum(first + k, samples.rows - 1)
        state, rates = plant.advance(twin, state, rows, None)
        seen = plant.reading(states[-1], rates, {})
        readings.append(np.concatenate([seen.angular_velocity, seen.specific_force], axis=1))
    joined = (np.stack([s[i] for s in states], axis=1) for i in range(6))
    tracks = [x.reshape(count, len(runs), *x.shape[1:]) for x in joined]
    return _misfit(plant, np.stack(readings, axis=1), count), tracks


def _misfit(plant: ExtendedModel, readings: Floats, count: int) -> Floats:
    """Distance of simulated readings from the measured ones, shape (choices, runs).

    Logarithms of the distance: an impact a little early must not outweigh all the rest.
    """
    samples, sigma = plant.samples, plant.vehicle.sigma
    measured = np.concatenate([samples.channels[n] for n in IMU], axis=1)
    noise = _BROAD * np.repeat([sigma[n] for n in IMU], 3)
    out = np.zeros((count, len(samples.runs)))
    for r, (a, b) in enumerate(samples.runs):
        some = readings[r :: len(samples.runs), : b - a]
        away = np.nan_to_num((some - measured[a:b]) / noise, nan=0.0, posinf=1e6, neginf=-1e6)
        out[:, r] = np.log1p(away**2).sum(axis=(1, 2))
    return out


def _inside(value: float, bounds: tuple[float, float]) -> float:
    low, high = bounds
    return float(min(max(value, 0.9 * low), 0.9 * high))
