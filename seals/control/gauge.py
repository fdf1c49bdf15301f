"""Live mass properties, buoyancy and thrust of a robot, from the motion of its links."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control.plant import Plant
from seals.control.protocols import Buoyancy
from seals.dynamics.kinematics import Kinematics
from seals.dynamics.tree import forward
from seals.medium.sample import Sample
from seals.robot.model import RobotModel


class MassNow(NamedTuple):
    """Mass properties of the whole robot at one instant, body axes; see `Situation`."""

    mass: float
    centre: Floats
    inertia: Floats
    centre_map: Floats
    momentum_map: Floats


class MassGauge:
    """Centre of gravity, inertia, and what the joints' motion does to them.

    Equation:
        With the transforms T_l of the links in body axes and their pseudo-inertias P_l (4x4: second
        moments S, first moments p, mass m), the sum of T P T^T over links holds mass, centre and
        second moments; the sum over the links beyond a joint with axis a through s gives
        dc/dq = a x (p - m s) / M and the momentum about the centre for a unit rate,
        (tr S - S) a - p x (a x s) - c x (a x (p - m s)).

    Args:
        robot: the robot.
    """

    def __init__(self, robot: RobotModel) -> None:
        """Make the links' pseudo-inertias."""
        self._pseudo = np.array([_pseudo(robot, k) for k in range(len(robot.links))])
        self._place = np.zeros((len(robot.links), 4, 4))
        self._place[:, 3, 3] = 1.0
        tree = self._tree = robot.tree
        # rows: the whole robot, then what lies beyond every joint
        self._sums = np.concatenate((np.ones((1, tree.links)), tree.moves.T))
        self._child = list(tree.child)
        self._slides = tree.slides
        self._rigid = None if tree.joints else self.at(np.zeros(0))

    def at(self, joints: Floats) -> MassNow:
        """Return the mass properties with the joints at some place [rad or m]."""
        tree = self._tree
        origins, turns = forward(tree, np.zeros((1, 3)), np.eye(3)[None], joints[None])
        return self._of(
            origins[0], turns[0], (turns[0, self._child] @ tree.axis[:, :, None])[..., 0]
        )

    def now(self, kinematics: Kinematics) -> MassNow:
        """Return the mass properties at one instant of one robot."""
        if self._rigid is not None:
            return self._rigid
        turn = kinematics.rotations[0, 0]
        arm = kinematics.origins[0] - kinematics.origins[0, 0]
        return self._of(arm @ turn, turn.T @ kinematics.rotations[0], kinematics.axes[0] @ turn)

    def _of(self, origins: Floats, turns: Floats, axes: Floats) -> MassNow:
        place = self._place
        place[:, :3, 3], place[:, :3, :3] = origins, turns
        links = place @ self._pseudo @ place.transpose(0, 2, 1)
        sums = (self._sums @ links.reshape(len(links), 16)).reshape(-1, 4, 4)
        mass = float(sums[0, 3, 3])
        centre = sums[0, :3, 3] / mass
        second = sums[0, :3, :3] - mass * centre[:, None] * centre
        inertia = -second
        inertia[[0, 1, 2], [0, 1, 2]] += second[0, 0] + second[1, 1] + second[2, 2]
        if not len(axes):
            return MassNow(mass, centre, inertia, np.zeros((3, 0)), np.zeros((3, 0)))
        moved = self._moved(sums[1:], axes, origins[self._child], centre)
        return MassNow(mass, centre, inertia, moved[0].T / mass, moved[1].T)

    def _moved(
        self, beyond: Floats, axes: Floats, anchors: Floats, centre: Floats
    ) -> tuple[Floats, Floats]:
        """Return linear and angular momentum for a unit rate of every joint, shape (J, 3)."""
        first, mass = beyond[:, :3, 3], beyond[:, 3:, 3]
        turn = _skew(axes)
        push = (turn @ (first - mass * anchors)[:, :, None])[:, :, 0]
        swing = (turn @ anchors[:, :, None])[:, :, 0]
        trace = beyond[:, 0, 0] + beyond[:, 1, 1] + beyond[:, 2, 2]
        spin = trace[:, None] * axes - (beyond[:, :3, :3] @ axes[:, :, None])[:, :, 0]
        spin = spin - (_skew(first) @ swing[:, :, None])[:, :, 0]
        if self._slides.any():
            push = np.where(self._slides > 0.0, mass * axes, push)
            spin = np.where(self._slides > 0.0, _products(first, axes), spin)
        return push, spin - _products(np.broadcast_to(centre, push.shape), push)


class WaterGauge:
    """Submersion and buoyancy of all hulls together.

    Args:
        plant: the robot in its surroundings.
        volume: displaced by every link when submerged [m^3], shape (L, 1).
    """

    def __init__(self, plant: Plant, volume: Floats) -> None:
        """Sum the volumes."""
        self._gravity, self._volume = plant.gravity, np.asarray(volume)
        self._whole = float(self._volume.sum())
        self._dry = Buoyancy(0.0, np.zeros(3))

    def now(self, kinematics: Kinematics, sample: Sample) -> tuple[float, Buoyancy]:
        """Return submersion and buoyancy at one instant."""
        wet = self._volume * sample.submersion
        total = float(wet.sum())
        if total <= 0.0:
            return 0.0, self._dry
        weight = (wet * sample.water_density)[:, 0]
        force = float(weight.sum())
        turns, origins = kinematics.rotations[0], kinematics.origins[0]
        centres = (turns @ sample.buoyancy_centre[:, :, None])[:, :, 0] + origins - origins[0]
        centre = (weight @ centres / force) @ turns[0]
        return total / self._whole, Buoyancy(force * self._gravity, centre)


def _pseudo(robot: RobotModel, link: int) -> Floats:
    """Second moments about the link origin, first moments and mass, shape (4, 4)."""
    mass, centre, inertia = float(robot.mass[link]), robot.centre[link], robot.inertia[link]
    out = np.zeros((4, 4))
    second = 0.5 * float(np.trace(inertia)) * np.eye(3) - inertia
    out[:3, :3] = second + mass * np.outer(centre, centre)
    out[:3, 3] = out[3, :3] = mass * centre
    out[3, 3] = mass
    return out


def _products(a: Floats, b: Floats) -> Floats:
    """Products of rows, shape (J, 3)."""
    product: Floats = (_skew(a) @ b[:, :, None])[:, :, 0]
    return product


def _skew(v: Floats) -> Floats:
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return out
