"""Trajectory of a vehicle: pose from the sensors, velocities by smoothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.batch import TwinState
from seals.frames import matrix_of, multiply, rotation_vector
from seals.sysid.data.samples import Samples
from seals.sysid.data.smoothing import adaptive_polynomial, local_polynomial
from seals.sysid.data.vehicle import Vehicle


class Trajectory(TwinState):
    """States of the vehicle at every row of a log; T rows, J joints."""

    __slots__ = ()

    @property
    def size(self) -> int:
        """Dimension of the state error: pose, twist, joint positions and rates."""
        return 12 + 2 * int(self.joints.shape[1])

    def state(self, rows: NDArray[np.integer[Any]] | slice) -> TwinState:
        """Return the states at some rows."""
        return TwinState(*(np.asfortranarray(x[rows]) for x in self))

    @classmethod
    def joined(cls, states: Sequence[TwinState], lengths: Sequence[int]) -> Trajectory:
        """Join simulated runs, one behind another.

        Args:
            states: of all runs at one row after another, each (runs, ...).
            lengths: rows of each run.
        """
        kept = np.arange(len(states)) < np.asarray(lengths)[:, None]
        return cls(*(np.stack([s[i] for s in states], axis=1)[kept] for i in range(6)))


def posture_readings(state: TwinState, level: float | None) -> dict[str, Floats]:
    """Return what exact sensors of pose, velocity, depth and joints read, by channel.

    Args:
        state: of N instants.
        level: of the water [m]; None for none.
    """
    return {
        "position": state.position,
        "orientation": state.quaternion,
        "velocity": state.velocity,
        "depth": (level or 0.0) - state.position[:, 2:3],
        "joint_position": state.joints,
    }


def difference(above: TwinState, below: TwinState) -> Floats:
    """State errors of ``above`` against ``below``, shape (N, 12 + 2 J)."""
    back = below.quaternion * np.array([-1.0, -1.0, -1.0, 1.0])
    turn = rotation_vector(multiply(back, above.quaternion))
    parts = [above.position - below.position, turn, above.velocity - below.velocity]
    parts += [
        above.angular_velocity - below.angular_velocity,
        above.joints - below.joints,
        above.joint_velocity - below.joint_velocity,
    ]
    return np.concatenate(parts, axis=1)


def measured_trajectory(samples: Samples, vehicle: Vehicle) -> Trajectory:
    """Estimate the trajectory from measured position and orientation."""
    pieces = [_piece(samples, vehicle, *run) for run in samples.runs]
    return Trajectory(*map(np.concatenate, zip(*pieces, strict=True)))


def _piece(samples: Samples, vehicle: Vehicle, first: int, last: int) -> Trajectory:
    step = samples.step
    seen = {name: values[first:last] for name, values in samples.channels.items()}
    # a height that was not measured is that of the depth
    place = seen["position"]
    if "depth" in seen and not _sampled(place)[2]:
        level = vehicle.environment.water_level or 0.0
        place = np.column_stack([place[:, :2], level - seen["depth"][:, 0]])
    given = float(np.isfinite(place).mean(axis=0).min())
    wide = max(0.06, 2.5 * step) if given > 0.5 else 0.15
    sigma = vehicle.sigma
    position, ground = adaptive_polynomial(place, step, bandwidth=wide, sigma=sigma["position"])
    # a component of the quaternion is half an angle
    turn, slope = adaptive_polynomial(
        seen["orientation"], step, bandwidth=max(0.03, 1.5 * step), sigma=0.5 * sigma["orientation"]
    )
    turn = turn / np.linalg.norm(turn, axis=1, keepdims=True)
    rotation = matrix_of(turn)
    if "angular_velocity" in seen and _sampled(seen["angular_velocity"]).all():
        spin = local_polynomial(seen["angular_velocity"], step, bandwidth=max(0.02, 1.2 * step))[0]
        spin = spin @ vehicle.imu_turn
    else:
        spin = 2.0 * multiply(turn * np.array([-1.0, -1.0, -1.0, 1.0]), slope)[:, :3]
    velocity = np.einsum("tji,tj->ti", rotation, ground)
    if "velocity" in seen and (there := _sampled(seen["velocity"])).any():
        velocity[:, there] = local_polynomial(seen["velocity"][:, there], step, bandwidth=0.15)[0]
    joints = vehicle.robot.tree.joints
    angle, rate = np.zeros((last - first, joints)), np.zeros((last - first, joints))
    if joints:
        angle, rate = local_polynomial(seen["joint_position"], step, bandwidth=0.02)
    return Trajectory(
        position=position,
        quaternion=turn,
        velocity=velocity,
        angular_velocity=spin,
        joints=angle,
        joint_velocity=rate,
    )


def _sampled(values: Floats) -> NDArray[np.bool_]:
    """Return which columns hold any sample, shape (k,)."""
    return np.asarray(np.isfinite(values).any(axis=0))
