"""What the laws of a falling hull leave out while it pierces the surface."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.diagnose.problem import Problem
from seals.diagnose.rough import Rough, submersion
from seals.diagnose.samples import Samples
from seals.diagnose.trajectory import Course
from seals.frames import matrix_of

_LIFT, _SUDDEN = 0.03, 0.1
"""Errors while the hull pierces the surface: of the lift as a share of the whole, and of all other
forces as a share of them."""
_ARM = 0.1
"""Lever of these errors in hull lengths."""


def pierced(problem: Problem, course: Course) -> Rough | None:
    """Errors of the laws where a hull pierces the surface.

    What the sensors feel beside the lift is the impact; a floating hull feels none.
    """
    vehicle, plant = problem.vehicle, problem.plant
    if not vehicle.has_water or vehicle.hull is None:
        return None
    share = submersion(plant, course)
    weight = float(vehicle.environment.water_density or 998.0)
    weight *= vehicle.environment.gravity * vehicle.hull.volume
    up = matrix_of(course.quaternion)[:, 2, :]
    felt = filled(problem.samples, "specific_force") @ vehicle.imu_turn
    sudden = np.linalg.norm(felt - up * (share * weight / vehicle.mass)[:, None], axis=1)
    level = _widest(4.0 * share * (1.0 - share)) * (
        _LIFT * weight + _SUDDEN * vehicle.mass * _widest(sudden)
    )
    push = np.repeat(level[:, None], 6, axis=1)
    push[:, 3:] *= _ARM * vehicle.hull.volume ** (1.0 / 3.0)
    return Rough(push=push, blur=level / vehicle.mass)


def _widest(values: Floats) -> Floats:
    """Largest of every value and its neighbours."""
    beside: Floats = np.maximum(np.roll(values, 1), np.roll(values, -1))
    return np.maximum(values, beside)


def filled(samples: Samples, name: str) -> Floats:
    """A channel with straight lines over lost samples."""
    values: Floats = samples.channels[name].copy()
    for first, last in samples.runs:
        for k in range(values.shape[1]):
            part = values[first:last, k]
            good = np.flatnonzero(np.isfinite(part))
            part[:] = np.interp(np.arange(last - first), good, part[good]) if good.size else 0.0
    return values
