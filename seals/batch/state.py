"""State of a batch of robots, and its time derivative."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np

from seals.arrays import Array, as_like
from seals.environment.sample import Sample
from seals.frames import exponential, multiply, normalised, quaternion_of_rpy
from seals.motion import Motion
from seals.multibody.kinematics import Kinematics, LinkVelocities

S = TypeVar("S", bound="TwinState")


class TwinState(NamedTuple):
    """State of a batch of B robots with J joints.

    Args:
        position: p_WB, base origin in the world [m], shape (B, 3).
        quaternion: q_WB_xyzw, shape (B, 4).
        velocity: of the base origin, base axes [m/s], shape (B, 3).
        angular_velocity: w_WB_B, angular velocity in base axes [rad/s], shape (B, 3).
        joints: joint coordinates [rad or m], shape (B, J).
        joint_velocity: joint rates [rad/s or m/s], shape (B, J).
    """

    position: Array
    quaternion: Array
    velocity: Array
    angular_velocity: Array
    joints: Array
    joint_velocity: Array

    def normal(self) -> TwinState:
        """Return the state with the quaternion scaled to unit length."""
        return self._replace(quaternion=normalised(self.quaternion))

    def moved(self: S, error: Array) -> S:
        """Return the states moved by errors.

        Args:
            error: position, rotation vector in base axes, velocities, joints and joint rates, shape
                (B, 12 + 2 J) or (1, 12 + 2 J).
        """
        j = self.joints.shape[1]
        return self._replace(
            position=self.position + error[:, :3],
            quaternion=multiply(self.quaternion, exponential(error[:, 3:6])),
            velocity=self.velocity + error[:, 6:9],
            angular_velocity=self.angular_velocity + error[:, 9:12],
            joints=self.joints + error[:, 12 : 12 + j],
            joint_velocity=self.joint_velocity + error[:, 12 + j :],
        )

    @staticmethod
    def at_rest(batch: int, joint_count: int, like: Array, **values: Any) -> TwinState:
        """Build a state from zeros and the given fields; ``rpy`` may stand for the quaternion.

        Args:
            batch: B.
            joint_count: J.
            like: array whose library, type and device to use.
            **values: fields as anything that broadcasts to their shape.
        """
        widths = {
            "position": 3,
            "quaternion": 4,
            "velocity": 3,
            "angular_velocity": 3,
            "joints": joint_count,
            "joint_velocity": joint_count,
        }
        if "rpy" in values:
            values["quaternion"] = quaternion_of_rpy(
                np.atleast_2d(np.asarray(values.pop("rpy"), dtype=float))
            )
        values.setdefault("quaternion", [0.0, 0.0, 0.0, 1.0])
        full = {
            name: np.array(
                np.broadcast_to(np.asarray(values.get(name, 0.0), dtype=float), (batch, width))
            )
            for name, width in widths.items()
        }
        return TwinState(**{name: as_like(np.asfortranarray(x), like) for name, x in full.items()})


class Rates(NamedTuple):
    """Time derivative of a state, and the specific force at the base origin.

    Args:
        position: [m/s], shape (B, 3).
        quaternion: [1/s], shape (B, 4).
        velocity: base-axes derivative [m/s^2], shape (B, 3).
        angular_velocity: [rad/s^2], shape (B, 3).
        joints: [rad/s or m/s], shape (B, J).
        joint_velocity: [rad/s^2 or m/s^2], shape (B, J).
        specific_force: acceleration of the base origin minus gravity, base axes [m/s^2], shape (B,
            3).
    """

    position: Array
    quaternion: Array
    velocity: Array
    angular_velocity: Array
    joints: Array
    joint_velocity: Array
    specific_force: Array


def advance(state: TwinState, rates: Rates, step: Any) -> TwinState:
    """Return state + step * rates."""
    return TwinState(*(x + step * dx for x, dx in zip(state, rates[:6], strict=True)))


GAMMA = 1.0 - 0.5**0.5
"""Implicit share of a stage of `rosenbrock` that damps the stiffest motion at once."""


def rosenbrock(state: TwinState, k: tuple[Rates, Rates], step: Any) -> TwinState:
    """Return the combination of the second-order Rosenbrock method with two stages.

    Equation:
        (1 - g h A) k1 = F(y), (1 - g h A) k2 = F(y + h k1) - 2 k1, y + h (3 k1 + k2) / 2; of second
        order with any A (Verwer, Spee, Blom, Hundsdorfer 1999, SIAM J. Sci. Comput. 20).
    """
    half = 0.5 * step
    parts = zip(state, *(r[:6] for r in k), strict=True)
    return TwinState(*(x + half * (3.0 * a + b) for x, a, b in parts)).normal()


def runge_kutta(state: TwinState, k: tuple[Rates, Rates, Rates, Rates], step: Any) -> TwinState:
    """Return the classic fourth-order combination, with the quaternion scaled to unit length."""
    sixth = step / 6.0
    parts = zip(state, *(r[:6] for r in k), strict=True)
    moved = TwinState(*(x + sixth * (a + 2.0 * (b + c) + d) for x, a, b, c, d in parts))
    return moved.normal()


class Posture(NamedTuple):
    """Poses, velocities and surroundings at a state, independent of the parameters.

    Args:
        base: R_WB, shape (B, 3, 3).
        motion: of the links, rows link by link.
        sample: surroundings without the flow effects; None to sample them afresh.
        kinematics: of the links; None for a single body.
        moving: velocities of the links; None for a single body.
    """

    base: Array
    motion: Motion
    sample: Sample | None = None
    kinematics: Kinematics | None = None
    moving: LinkVelocities | None = None
