"""Model error of a hull at the water surface, from ripple and impact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.environment.seawater import FRESH_WATER
from seals.frames import matrix_of
from seals.sysid.data.samples import Samples
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.predictors.extended_model import ExtendedModel

_LIFT = 0.03
"""Error of the lift while the hull is partly wet, as a share of the full lift."""
_SUDDEN = 0.1
"""Error of all other forces while the hull pierces the surface, as a share of them."""
_DRY = 1e-4
"""Submerged share below which a hull has not touched the water."""
_QUICK, _CALM = 0.05, 0.1
"""Spacing of the knots of the gusts where a hull strikes the surface, and where it floats [s]."""
_RIPPLE, _RIPPLE_LENGTH = 1.5e-3, 0.1
"""Height and length of the ripple that any open surface has [m]."""
_ARM = 0.1
"""Lever of these errors in hull lengths."""


@dataclass(frozen=True, kw_only=True)
class SurfaceModelError:
    """Standard deviations of the model error at the surface, one row each.

    Args:
        push: standard deviation of short pushes [N, N m], shape (T, 6).
        blur: standard deviation of the specific force [m/s^2], shape (T,).
        floats: whether the hull pierces the surface throughout.
    """

    push: Floats
    blur: Floats
    floats: bool = False

    @property
    def knot(self) -> float:
        """Spacing of the knots of the gusts that follow these errors [s]."""
        return _CALM if self.floats else _QUICK


def surface_model_error(plant: ExtendedModel, trajectory: Trajectory) -> SurfaceModelError | None:
    """Estimate the model error along a trajectory; None when the hull never pierces the surface."""
    vehicle = plant.vehicle
    hull = vehicle.hull
    if hull is None or vehicle.environment.water_level is None:
        return None
    share = submersion(plant, trajectory)
    # a first corner in the water is a small share and a loud slap
    touching = _widest(((share > _DRY) & (share < 1.0 - _DRY)).astype(float))
    if not touching.any():
        return None
    weight = float(vehicle.environment.water_density or FRESH_WATER)
    weight *= vehicle.environment.gravity * hull.volume
    level = _LIFT * weight * _widest(_uncertain(share, floats=bool(touching.all())))
    level += _SUDDEN * touching * _widest(_sudden(plant, trajectory, share * weight))
    push = np.repeat(level[:, None], 6, axis=1)
    push[:, 3:] *= _ARM * hull.volume ** (1.0 / 3.0)
    floats = bool(touching.all())
    if floats:
        # force and torque of ripple on a hull with a waterplane, 1-sigma
        density = float(vehicle.environment.water_density or FRESH_WATER)
        side = float(np.sqrt(float(hull.plan_area)))
        force = density * vehicle.environment.gravity * _RIPPLE * _RIPPLE_LENGTH * side
        force /= np.sqrt(2.0) * np.pi
        push = np.hypot(push, touching[:, None] * np.repeat([force, 0.5 * force * side], 3))
    return SurfaceModelError(push=push, blur=level / vehicle.mass, floats=floats)


def _uncertain(share: Floats, *, floats: bool) -> Floats:
    """Fraction of the full lift that depends on the hull's shape at the surface, shape (T,).

    Of a hull that floats throughout only the changes count: an error of its mean lift is constant,
    and one of mass and volume.
    """
    if floats:
        change: Floats = np.abs(share - np.mean(share))
        return change
    crossing: Floats = 4.0 * share * (1.0 - share)
    return crossing


def _sudden(plant: ExtendedModel, trajectory: Trajectory, lift: Floats) -> Floats:
    """Measured specific force without the lift, as a force [N], shape (T,).

    On a vehicle that drives itself the thrust hides an impact, and is known: nothing. Nothing
    either on one that floats.
    """
    vehicle, samples = plant.vehicle, plant.samples
    if "specific_force" not in samples.channels or not enters(plant, trajectory):
        return np.zeros(samples.rows)
    up = matrix_of(trajectory.quaternion)[:, 2, :]
    felt = _filled(samples, "specific_force") @ vehicle.imu_turn * vehicle.mass
    beside: Floats = np.linalg.norm(felt - up * lift[:, None], axis=1)
    return beside


def _widest(values: Floats) -> Floats:
    """Largest of each value and its neighbours."""
    beside: Floats = np.maximum(np.roll(values, 1), np.roll(values, -1))
    return np.maximum(values, beside)


def _filled(samples: Samples, name: str) -> Floats:
    """Return a channel with lost samples interpolated linearly."""
    values: Floats = samples.channels[name].copy()
    for first, last in samples.runs:
        for k in range(values.shape[1]):
            part = values[first:last, k]
            good = np.flatnonzero(np.isfinite(part))
            part[:] = np.interp(np.arange(last - first), good, part[good]) if good.size else 0.0
    return values


def enters(plant: ExtendedModel, trajectory: Trajectory) -> bool:
    """Return true if a vehicle without actuators falls into water rather than floats."""
    if not plant.vehicle.has_water or len(plant.vehicle.lag):
        return False
    share = submersion(plant, trajectory)
    return bool((share < _DRY).any() and (share > _DRY).any())


def submersion(plant: ExtendedModel, trajectory: Trajectory) -> Floats:
    """Submerged share of the hull along a trajectory, shape (T,)."""
    rows = plant.samples.rows
    state, time = trajectory.state(np.arange(rows)), plant.samples.clock[:, None]
    sample = plant.twin({}, rows).posture(state, time).sample
    assert sample is not None
    # rows link by link, the base first
    share: Floats = sample.submersion[:rows, 0] + np.zeros(rows)
    return share
