"""Starting values for effects that are not linear about zero: a tether, waves."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from seals.arrays import Floats
from seals.frames import matrix_of, rotate
from seals.sysid.hypothesis import Hypothesis
from seals.sysid.problem import LOOSE, Problem, rewindowed

_EVERY = 5
"""Rows between the points at which the free force is looked at."""
_KEEP = 2
"""Starting values that are kept."""


def special_starts(problem: Problem, base: Hypothesis) -> dict[str, list[dict[str, float]]]:
    """Starting values of tether and waves from the force that a model leaves over."""
    if not problem.samples.posed:
        return {}
    names = {c.name for c in problem.plant.library.candidates}
    position, force, time = free_force(problem, base)
    given = {k: base.fit.values[k] for k in base.fit.freed}
    out: dict[str, list[dict[str, float]]] = {}
    if "tether" in names:
        out["tether"] = [given | s for s in _tether(position, force)]
    if "waves" in names:
        out["waves"] = [given | s for s in _waves(problem, position, force, time)]
    return out


def free_force(problem: Problem, base: Hypothesis) -> tuple[Floats, Floats, Floats]:
    """Where, which and when: the force that best explains what a model leaves over, world axes."""
    fitter = rewindowed(base.fitter, gusts=LOOSE)
    misfit = fitter.misfit(base.fit.values)
    _, wrench = fitter.windows.explained(misfit.outputs[:, :, 0])
    rows = fitter.windows.rows[:, ::_EVERY].ravel()
    course = fitter.course
    force = rotate(matrix_of(course.quaternion[rows]), wrench[:, ::_EVERY, :3].reshape(-1, 3))
    return course.position[rows], force, problem.samples.time[rows]


def _tether(position: Floats, force: Floats) -> list[dict[str, float]]:
    """Cables that fit the force best, from several guesses of the anchor."""
    middle = position.mean(axis=0)
    size = np.sqrt(np.mean(np.sum(force**2, axis=1)))
    spread = max(float(np.sqrt(((position - middle) ** 2).sum(axis=1).mean())), 0.1)
    pull = force[np.argmax(np.sum(force**2, axis=1))]
    toward = pull / max(float(np.linalg.norm(pull)), 1e-9)
    lowest = np.array([middle[0], middle[1], 0.0])
    anchors = [middle + toward * s * spread for s in (1.0, 3.0)] + [lowest, middle]
    found = []
    for anchor in anchors:
        reach = np.linalg.norm(position - anchor, axis=1)
        first = np.array([*anchor, np.quantile(reach, 0.5), size / (0.3 * spread + 1e-3)])

        def miss(x: Floats) -> Floats:
            gap = position - x[:3]
            length = np.maximum(np.linalg.norm(gap, axis=1, keepdims=True), 1e-6)
            model = -x[4] * np.maximum(length - x[3], 0.0) * gap / length
            out: Floats = (force - model).ravel()
            return out

        bounds = ([-50, -50, -50, 0.0, 0.0], [50, 50, 50, 50.0, 1e3])
        start = np.clip(first, np.array(bounds[0]) + 1e-6, np.array(bounds[1]) - 1e-6)
        fit = least_squares(miss, start, bounds=bounds, loss="soft_l1", max_nfev=60)
        found.append((float(fit.cost), fit.x))
    found.sort(key=lambda f: f[0])
    keys = [f"tether.{n}" for n in ("anchor_x", "anchor_y", "anchor_z", "length", "stiffness")]
    return [dict(zip(keys, map(float, x), strict=True)) for _, x in found[:_KEEP]]


def _waves(
    problem: Problem, position: Floats, force: Floats, time: Floats
) -> list[dict[str, float]]:
    """Waves whose pressure force fits best, over a grid of periods and directions."""
    vehicle = problem.vehicle
    gravity = vehicle.environment.gravity
    level = vehicle.environment.water_level or 0.0
    hull = vehicle.hull
    displaced = 998.0 * (hull.volume if hull is not None else 0.0)
    added = vehicle.effects.get("added_mass_water")
    mass = displaced + float(getattr(added, "mass_z", 0.0))
    found = []
    for period in np.geomspace(0.5, 6.0, 60):
        omega = 2.0 * np.pi / period
        k = omega**2 / gravity
        decay = np.exp(k * np.minimum(position[:, 2] - level, 0.0))
        for direction in np.arange(0.0, 2.0 * np.pi, np.pi / 8.0):
            east, north = np.cos(direction), np.sin(direction)
            theta = k * (east * position[:, 0] + north * position[:, 1]) - omega * time
            # push = s (rho V + M_A) a_water, a_water from the two phases of the wave
            sine, cosine = (
                mass * omega**2 * decay * np.sin(theta),
                mass * omega**2 * decay * np.cos(theta),
            )
            first = np.stack([east * sine, north * sine, -cosine], axis=1).ravel()
            second = np.stack([east * cosine, north * cosine, sine], axis=1).ravel()
            basis = np.stack([first, second], axis=1)
            solved, rest, *_ = np.linalg.lstsq(basis, force.ravel(), rcond=None)
            left = float(rest[0]) if rest.size else np.inf
            found.append((left, period, direction, solved))
    found.sort(key=lambda f: f[0])
    out = []
    for _, period, direction, solved in found[:_KEEP]:
        amplitude = float(np.hypot(*solved))
        phase = float(np.arctan2(solved[1], solved[0]))
        out.append(
            {
                "waves.amplitude": amplitude,
                "waves.period": float(period),
                "waves.direction": float(direction),
                "waves.phase": phase,
            }
        )
    return out
