"""Where and when an effect shows: half seconds of a flight, and axes of the inertial sensors.

A region is a second of the flight and one of six axes (specific force and angular velocity, x, y, z
of the body), or a phase of the flight (medium; calm or lively) and an axis. An effect is in a
region where it moves the readings of the windows there by as much as the sensor's noise, in root
mean square; both readings of a window of half a second start in the same state.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.sysid.predictors.linear_screen import candidate_keys
from seals.sysid.predictors.problem import Problem

AXES = tuple(f"{name}_{a}" for name in ("specific_force", "angular_velocity") for a in "xyz")
LEAST = 1.0
"""Root mean square over the noise from which on an effect is in a region."""
BIN = 1.0
"""Length of a region in time [s]."""


class Shown(NamedTuple):
    """How far an effect moves the readings of every window, over their noise.

    Args:
        time: middle of the windows [s], shape (W,).
        size: root mean square by axis, shape (W, 6).
    """

    time: Floats
    size: Floats

    def regions(self, begin: float, names: Sequence[str]) -> Regions:
        """Return the regions in which an effect is.

        Args:
            begin: of the first second [s].
            names: phase of every second.
        """
        at = np.clip(((self.time - begin) / BIN).astype(int), 0, len(names) - 1)
        seconds, phases = np.array([f"{second} s" for second in at]), np.array(names)[at]
        found: list[set[str]] = [set(), set()]
        for said, given in zip(found, (seconds, phases), strict=True):
            for name in np.unique(given):
                level = np.sqrt((self.size[given == name] ** 2).mean(axis=0))
                said |= {f"{name} {a}" for a, x in zip(AXES, level, strict=True) if x >= LEAST}
        return Regions(*map(frozenset, found))


class Regions(NamedTuple):
    """Regions of an effect: names of a second or of a phase, each with an axis."""

    by_time: frozenset[str]
    by_phase: frozenset[str]


def true_regions(folder: Path) -> Shown:
    """Return what the simulator says of the hidden effect, from ``regions.csv``."""
    with (folder / "regions.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    time = np.array([float(row["t"]) for row in rows]) + 0.25
    return Shown(time, np.array([[float(row[axis]) for axis in AXES] for row in rows]))


def _declared(problem: Problem, names: Sequence[str]) -> Shown:
    """Return how far effects that a method names move the readings.

    Their sizes are those of a least-squares fit of them to the windows of the log, the same for
    every method: it is the names that are compared. Every variant of a name takes part. What the
    library of effects does not have, or what has no response at all, such as a tether that hangs
    slack, shows nowhere.

    Args:
        problem: the log made ready.
        names: effects.
    """
    fitter = problem.fitter
    windows = fitter.windows
    time = problem.samples.time[windows.rows].mean(axis=1)
    chosen = [c for c in problem.plant.candidate_set.candidates if c.name in names]
    keys = candidate_keys(chosen)
    if not keys:
        return Shown(time, np.zeros((windows.count, len(AXES))))
    columns, misfit = fitter.whitened(keys, {}), fitter.misfit({})
    # where the responses are taken: about zero, but for what has none there. The place of a
    # payload moves nothing while its mass is zero: its mass is then of usual size
    length = np.linalg.norm(columns.outputs, axis=(0, 1))
    alive = dict(zip(candidate_keys(chosen), length > 1e-9 * length.max(initial=0.0), strict=True))
    parameters = problem.plant.candidate_set.parameters
    about = {
        key: parameters[key].scale
        for one in chosen
        if not all(alive[k] for k in one.all_keys)
        for key in one.all_keys
        if alive[key]
    }
    if about:
        columns = fitter.whitened(keys, about)
    normal = columns.product(columns).sum(axis=0) + np.diag(fitter.precision(keys, keys))
    scale = 1.0 / np.sqrt(np.diag(normal))
    right = columns.product(misfit).sum(axis=0)[:, 0] * scale
    values = scale * np.linalg.lstsq(normal * scale[:, None] * scale, right, rcond=1e-10)[0]
    moved = np.matmul(columns.outputs, values)[:, : windows.length * len(windows.channel_of)]
    moved = moved.reshape(windows.count, windows.length, -1)
    size = np.zeros((windows.count, len(AXES)))
    for n, axis in enumerate(AXES):
        if axis[:-2] in windows.channel_of:
            at = windows.channel_of.index(axis[:-2]) + "xyz".index(axis[-1])
            seen = windows.weight[:, :, at] > 0.0
            square = (moved[:, :, at] ** 2 * seen).sum(axis=1)
            size[:, n] = np.sqrt(square / np.maximum(seen.sum(axis=1), 1))
    return Shown(time, size)


def _phases(problem: Problem, begin: float, count: int) -> list[str]:
    """Name the phase of every second: its medium, and calm or lively by the rate of turn.

    Args:
        problem: the log made ready.
        begin: of the first second [s].
        count: of the seconds.
    """
    trajectory, time = problem.fitter.trajectory, problem.samples.time
    level = problem.vehicle.environment.water_level
    at = np.clip(((time - begin) / BIN).astype(int), 0, count - 1)
    seconds = np.maximum(np.bincount(at, minlength=count), 1)
    turn = np.bincount(at, (trajectory.angular_velocity**2).sum(axis=1), count) / seconds
    height = np.bincount(at, trajectory.position[:, 2], count) / seconds
    medium = ["air" if level is None or h > level else "water" for h in height]
    lively = turn > np.median(turn)
    return [f"{m} {'lively' if fast else 'calm'}" for m, fast in zip(medium, lively, strict=True)]


def found_regions(problem: Problem, folder: Path, names: Sequence[str]) -> dict[str, Any]:
    """Return the true and the declared regions of a log as lists, for an answer's file."""
    truth = true_regions(folder)
    begin = float(truth.time[0]) - 0.25
    told = _phases(problem, begin, int(np.ceil((truth.time[-1] - begin) / BIN)))
    pair = truth.regions(begin, told), _declared(problem, names).regions(begin, told)
    return {
        "true": {kind: sorted(getattr(pair[0], kind)) for kind in Regions._fields},
        "declared": {kind: sorted(getattr(pair[1], kind)) for kind in Regions._fields},
    }
