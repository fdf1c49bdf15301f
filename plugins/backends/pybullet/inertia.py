"""Added mass in an engine that knows only a scalar mass and principal moments.

The largest isotropic part of the added inertia goes into the engine, where contacts see it. The rest acts as a wrench
made from the acceleration that the full equations predict; contact forces of the last step enter the prediction, so that
a body at rest on the ground feels exactly the applied force.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.backend import Dynamics
from seals.dynamics.equations import Assembly
from seals.dynamics.spatial import kirchhoff, rigid_inertia
from seals.dynamics.tree import Kinematics
from seals.frames import cross
from seals.plugins.backends.pybullet.loading import Loaded
from seals.robot.model import RobotModel

REFRESH = 0.02
"""Relative change of the isotropic part at which the engine's mass is set anew."""


class InertiaSplit:
    """Splits the inertia of a robot between the engine and explicit wrenches.

    Args:
        engine: the pybullet module.
        client: physics client.
        robot: the robot.
        loaded: the robot in the engine.
    """

    def __init__(self, engine: Any, client: int, robot: RobotModel, loaded: Loaded) -> None:
        """Start with the robot's own inertia."""
        self._p, self._client, self._loaded, self._robot = engine, client, loaded, robot
        self._assembly = Assembly(robot.spatial_inertia)
        self._iso = np.zeros((len(robot.links), 2))
        self._engine_inertia = robot.spatial_inertia.copy()

    def snapshot(self) -> Any:
        """Return the isotropic parts held by the engine."""
        return self._iso.copy()

    def restore(self, kept: Any) -> None:
        """Put the isotropic parts back."""
        for link, (mass, moment) in enumerate(kept):
            if (mass, moment) != tuple(self._iso[link]):
                self._set(link, float(mass), float(moment))

    def wrenches(self, dynamics: Dynamics, held: Floats | None, contact: Floats | None) -> Floats:
        """Wrenches to apply so that the engine's step follows the full equations at the current velocity.

        Args:
            dynamics: of the robot at the current time.
            held: generalised velocity in the engine, None when it is the current one, shape (1, n).
            contact: contact wrenches of the last step, None without contact, shape (L, 6).

        Returns:
            Wrenches about the link origins, link axes [N, N m], shape (L, 6).
        """
        if not dynamics.found.inertias:
            return (dynamics.wrench + self._velocity_shift(dynamics, held))[0]
        self._update(dynamics)
        total = self._assembly.total_inertia(dynamics.found, 1)
        kinematics, twists, speed = dynamics.kinematics, dynamics.twists, dynamics.speed
        bias = kinematics.bias(speed, twists)
        terms = self._assembly.velocity_terms(dynamics.motion, dynamics.found)
        load = dynamics.wrench - terms - _times(total, bias)
        seen = load if contact is None else load + contact[None]
        acceleration = self._assembly.solve(kinematics, total, seen, dynamics.joint_force)
        change = kinematics.twists(acceleration)
        load = load - _times(total, change)
        if held is not None:
            turning = self._centripetal(kinematics, speed) - self._centripetal(kinematics, held)
            change = change + kinematics.twists(turning)
            twists = kinematics.twists(held)
            bias = kinematics.bias(held, twists)
        return (load + _times(self._engine_inertia[None], change + bias) + self._gyroscopic(twists))[0]

    def _velocity_shift(self, dynamics: Dynamics, held: Floats | None) -> Floats | float:
        """Difference of the velocity terms between the engine's velocity and the current one."""
        if held is None:
            return 0.0
        both = np.concatenate([held, dynamics.speed])
        twists = np.concatenate([dynamics.kinematics.twists(held), dynamics.twists])
        bias = dynamics.kinematics.bias(both, twists)
        bias = bias - dynamics.kinematics.twists(self._centripetal(dynamics.kinematics, both))
        terms = _times(self._engine_inertia[None], bias) + self._gyroscopic(twists)
        return terms[:1] - terms[1:]

    def _centripetal(self, kinematics: Kinematics, speed: Floats) -> Floats:
        """Acceleration w x (w x c) of the base's centre of mass, as a generalised one, shape (B, n).

        The engine integrates the velocity of the centre of mass; everything here is about the link origin.
        """
        out = np.zeros_like(speed)
        if not self._robot.tree.fixed_base:
            arm = np.broadcast_to(kinematics.rotations[0, 0] @ self._robot.centre[0], (len(speed), 3))
            out[:, :3] = cross(speed[:, 3:6], cross(speed[:, 3:6], arm))
        return out

    def _gyroscopic(self, twists: Floats) -> Floats:
        """Velocity terms of the engine's inertia at the given twists (B, L, 6)."""
        batch, links = twists.shape[:2]
        rows = twists.reshape(-1, 6)
        inertia = self._engine_inertia if batch == 1 else np.concatenate([self._engine_inertia] * batch)
        force, torque = kirchhoff(inertia, rows[:, :3], rows[:, 3:])
        return np.concatenate((force, torque), axis=1).reshape(batch, links, 6)

    def _update(self, dynamics: Dynamics) -> None:
        """Set the engine's masses when the isotropic part of the added inertia has changed."""
        added = (self._assembly.total_inertia(dynamics.found, 1) - self._robot.spatial_inertia[None])[0]
        for link in range(len(self._robot.links)):
            mass, moment = self._isotropic(link, added[link])
            scale_mass, scale_moment = self._robot.mass[link], float(self._loaded.moments[link].min())
            old_mass, old_moment = self._iso[link]
            far = abs(mass - old_mass) > REFRESH * (scale_mass + old_mass)
            far = far or abs(moment - old_moment) > REFRESH * (scale_moment + old_moment)
            if far:
                self._set(link, mass, moment)

    def _isotropic(self, link: int, added: Floats) -> tuple[float, float]:
        """Largest isotropic mass and moment inside the added inertia about the centre of mass."""
        if not added.any():
            return 0.0, 0.0
        centre = self._robot.centre[link]
        mass = float(np.linalg.eigvalsh(added[:3, :3])[0])
        about = added[3:, 3:] - rigid_inertia(mass, centre, np.zeros((3, 3)))[3:, 3:]
        moment = float(np.linalg.eigvalsh(about)[0])
        return max(mass, 0.0), max(moment, 0.0)

    def _set(self, link: int, mass: float, moment: float) -> None:
        """Put an isotropic part into the engine."""
        robot = self._robot
        self._iso[link] = mass, moment
        self._p.changeDynamics(
            self._loaded.body,
            self._loaded.index[link],
            mass=float(robot.mass[link]) + mass,
            localInertiaDiagonal=(self._loaded.moments[link] + moment).tolist(),
            physicsClientId=self._client,
        )
        inertia = robot.inertia[link] + moment * np.eye(3)
        self._engine_inertia[link] = rigid_inertia(float(robot.mass[link]) + mass, robot.centre[link], inertia)


def _times(matrix: Floats, vectors: Floats) -> Floats:
    """Matrices (1, L, 6, 6) times vectors (B, L, 6)."""
    product: Floats = np.matmul(matrix, vectors[:, :, :, None])[:, :, :, 0]
    return product


