"""What the laws of a hull at the surface leave out: ripple, and the course of an impact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.diagnose.plant import Plant
from seals.diagnose.trajectory import Course
from seals.frames import matrix_of
from seals.motion import Motion

_LIFT = 0.03
"""Error of the lift while the hull is partly wet, as a share of the full lift."""
_FELT = 0.1
"""Error of a sudden force on the surface, as a share of the specific force felt."""
_ARM = 0.1
"""Lever of these errors in hull lengths."""


@dataclass(frozen=True, kw_only=True)
class Rough:
    """Errors at the surface, one row each.

    Args:
        push: standard deviation of short pushes [N, N m], shape (T, 6).
        blur: standard deviation of the specific force [m/s^2], shape (T,).
    """

    push: Floats
    blur: Floats


def surface(plant: Plant, course: Course) -> Rough | None:
    """Errors along a course; None when the hull never pierces the surface."""
    vehicle = plant.vehicle
    hull = vehicle.hull
    if hull is None or vehicle.environment.water_level is None:
        return None
    share = submersion(plant, course)
    crossing = 4.0 * share * (1.0 - share)
    if not crossing.max() > 1e-3:
        return None
    near = np.maximum(crossing, np.maximum(np.roll(crossing, 1), np.roll(crossing, -1)))
    density = float(vehicle.environment.water_density or 998.0)
    weight = density * vehicle.environment.gravity * hull.volume
    felt = np.zeros(plant.samples.rows)
    if "specific_force" in plant.samples.channels and not len(vehicle.lag):
        measured = np.nan_to_num(plant.samples.channels["specific_force"])
        felt = np.linalg.norm(measured, axis=1)
        felt = np.maximum(felt, np.maximum(np.roll(felt, 1), np.roll(felt, -1)))
    level = near * (_LIFT * weight + _FELT * felt * vehicle.mass)
    push = np.empty((plant.samples.rows, 6))
    push[:, :3] = level[:, None]
    push[:, 3:] = level[:, None] * _ARM * hull.volume ** (1.0 / 3.0)
    return Rough(push=push, blur=level / vehicle.mass)


def submersion(plant: Plant, course: Course) -> Floats:
    """Submerged share of the hull along a course, shape (T,)."""
    rows = plant.samples.rows
    twin = plant.twin({}, rows)
    state = course.state(np.arange(rows))
    rotation = matrix_of(state.quaternion)
    motion = Motion(
        time=plant.samples.time[:, None],
        position=state.position,
        rotation=rotation,
        up=rotation[:, 2, :],
        velocity=state.velocity,
        angular_velocity=state.spin,
        body=twin.body.bodies,
    )
    share: Floats = twin.evaluator.surroundings.sample(motion).submersion[:, 0] + np.zeros(rows)
    return share
