"""Coupling of robots to a simulated fluid: bodies, motion, and the fluid's wrenches.

Links that no joint moves apart are one body. The fluid wants to know how easily a body moves when
it is pushed, because it moves it along while it looks for the pressure. It is told the body's own
mass and inertia, as if no joint held it: joints only take ease away, for all bodies and at all
points together, so nothing is harder to move for the fluid than it is. A body that seems easier
than it is takes its impulse over a few substeps instead of one; one that seems harder would be
thrown. The ease of a link to turn about its length is limited, see `ROUND`: its joint holds it, and
a finger that spins between two steps of the robot stirs. What is bolted down does not move.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Dynamics, LinkPoses
from seals.fluid import BodyStates, FluidBody
from seals.frames import cross_last
from seals.multibody.equations import Assembly
from seals.multibody.servo import driven, resisted
from seals.robot.model import RobotModel
from seals.robot.pieces import pieces_of

ROUND = 0.25
"""Least moment of inertia of a link against its largest one, as the fluid sees it [1]."""


class Group(NamedTuple):
    """Rigidly connected links.

    Args:
        root: the first of them, whose axes are those of the body.
        centre: reference point, the centre of their mass, in these axes [m], shape (3,).
        body: as the fluid sees it.
        mass: [kg].
        inertia: about the centre, axes of the root [kg m^2], shape (3, 3).
    """

    root: int
    centre: Floats
    body: FluidBody
    mass: float
    inertia: Floats


class Immersion:
    """Coupling of one robot to a fluid.

    Args:
        robot: the robot.

    Attributes:
        groups: the bodies that the fluid sees.
    """

    def __init__(self, robot: RobotModel) -> None:
        self.robot = robot
        self.groups = _groups(robot)
        held = bool(robot.tree.joints)
        bolted = [robot.tree.fixed_base and group.root == 0 for group in self.groups]
        ease = [
            (0.0, np.zeros((3, 3))) if still else _ease(group, held=held)
            for group, still in zip(self.groups, bolted, strict=True)
        ]
        self._roots = np.array([group.root for group in self.groups], dtype=np.int64)
        self._centres = _rows([group.centre for group in self.groups], 3)
        self._inverse_mass = np.array([mass for mass, _ in ease])
        self._inverse_inertia = _rows([inertia for _, inertia in ease], 3, 3)

    def placed(self, poses: LinkPoses) -> BodyStates:
        """Return the initial poses of the bodies, at rest."""
        turns = poses.rotations[0, self._roots]
        places = poses.origins[0, self._roots] + _turned(turns, self._centres)
        still = np.zeros_like(places)
        return BodyStates(
            *(places, turns, still, still),
            *(np.zeros(len(places)), np.zeros_like(turns), still),
        )

    def states(
        self,
        dynamics: Dynamics,
        middle: Floats | None,
        contact: Floats,
        assembly: Assembly,
        step: float,
    ) -> BodyStates:
        """Return the bodies at the start of a step.

        Args:
            dynamics: of the robot, the fluid left out.
            middle: generalised velocity at the middle of the last step, shape (1, n), where the
                backend keeps it.
            contact: wrenches of the last step on the links, link axes, shape (L, 6); a body that
                lies on the ground does not fall into the fluid under it.
            assembly: of the robot's equations.
            step: [s].
        """
        change = _response(dynamics, contact, assembly, step)
        kinematics, moving = dynamics.kinematics, dynamics.moving
        rates = kinematics.jacobian[0] @ change + kinematics.bias(moving)[0]
        if middle is not None:
            moving = kinematics.move(middle)
        roots, turns = self._roots, kinematics.rotations[0, self._roots]
        linear, spin = moving.linear[0, roots], moving.angular[0, roots]
        arms = _turned(turns, self._centres)
        # the rate of the twist in link axes leaves out the turning of these axes
        rise = _turned(turns, rates[roots, :3]) + cross_last(spin, linear)
        bent = cross_last(_turned(turns, rates[roots, 3:]), arms)
        bent += cross_last(spin, cross_last(spin, arms))
        return BodyStates(
            kinematics.origins[0, roots] + arms,
            turns,
            linear + cross_last(spin, arms),
            spin,
            self._inverse_mass.copy(),
            turns @ self._inverse_inertia @ turns.transpose(0, 2, 1),
            rise + bent,
        )

    def wrenches(self, impulses: Floats, dynamics: Dynamics, step: float) -> Floats:
        """Return the fluid's impulses as constant wrenches over a step.

        Args:
            impulses: about the reference points, world axes [N s, N m s], shape (K, 6).
            dynamics: of the robot at the start of the step.
            step: [s].

        Returns:
            About the link origins, link axes [N, N m], shape (L, 6).
        """
        out = np.zeros((len(self.robot.links), 6))
        turns = dynamics.kinematics.rotations[0, self._roots].transpose(0, 2, 1)
        forces = _turned(turns, impulses[:, :3]) / step
        out[self._roots, :3] = forces
        out[self._roots, 3:] = _turned(turns, impulses[:, 3:]) / step
        out[self._roots, 3:] += cross_last(self._centres, forces)
        return out


def joined(parts: Sequence[BodyStates]) -> BodyStates:
    """Concatenate the body states of several robots."""
    parts = [part for part in parts if len(part.inverse_mass)]
    if not parts:
        return BodyStates(
            *(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3))),
            *(np.zeros(0), np.zeros((0, 3, 3)), np.zeros((0, 3))),
        )
    return BodyStates(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _rows(parts: Sequence[Floats], *shape: int) -> Floats:
    """Return arrays as the rows of one; none make one of no rows."""
    return np.array(parts).reshape(-1, *shape)


def _turned(turns: Floats, vectors: Floats) -> Floats:
    """Return vectors (K, 3) turned by matrices (K, 3, 3)."""
    found: Floats = (turns @ vectors[:, :, None])[:, :, 0]
    return found


def _groups(robot: RobotModel) -> tuple[Group, ...]:
    """Bodies with pieces, in the order of their root links."""
    places = _places(robot)
    members: dict[int, list[int]] = {}
    for link, (root, _, _) in enumerate(places):
        members.setdefault(root, []).append(link)
    found = []
    for root, links in members.items():
        pieces = [
            piece.placed(places[k][1], places[k][2]) for k in links for piece in pieces_of(robot, k)
        ]
        if not pieces:
            continue
        mass = np.array([robot.mass[k] for k in links])
        points = np.array([places[k][1] + places[k][2] @ robot.centre[k] for k in links])
        centre = mass @ points / mass.sum() if mass.sum() > 0.0 else points[0]
        centred = tuple(p._replace(position=p.position - centre) for p in pieces)
        inertia = np.zeros((3, 3))
        for k, m, point in zip(links, mass, points - centre, strict=True):
            turn = places[k][2]
            inertia += turn @ robot.inertia[k] @ turn.T
            inertia += m * (point @ point * np.eye(3) - np.outer(point, point))
        body = FluidBody(f"{robot.name}/{robot.links[root]}", centred)
        found.append(Group(root, centre, body, float(mass.sum()), inertia))
    return tuple(found)


def _places(robot: RobotModel) -> list[tuple[int, Floats, Floats]]:
    """Root of every link's group, and the link's place and attitude in the root's axes."""
    tree = robot.tree
    out: list[tuple[int, Floats, Floats]] = [(0, np.zeros(3), np.eye(3))]
    for link in range(1, tree.links):
        if tree.joint[link] >= 0:
            out.append((link, np.zeros(3), np.eye(3)))
            continue
        root, place, turn = out[tree.parent[link]]
        out.append((root, place + turn @ tree.origin[link], turn @ tree.rotation[link]))
    return out


def _response(dynamics: Dynamics, contact: Floats, assembly: Assembly, step: float) -> Floats:
    """Generalised acceleration by all known loads, contacts of the last step among them."""
    d = dynamics
    matrix, right = assembly.equations(d.kinematics, d.moving, d.motion, d.found, d.joint_force)
    right = right + np.einsum("lij,li->j", d.kinematics.jacobian[0], contact)[None]
    if d.found.resistance is not None:
        matrix, right = resisted(matrix, right, d.found.resistance, step)
    if d.joint_drive is None:
        found: Floats = np.linalg.solve(matrix[0], right[0])
        return found
    drive, joints = d.joint_drive, d.joint_drive.force.shape[1]
    rates = d.moving.speed[:, -joints:]
    late = drive._replace(force=drive.force - drive.stiffness * step * rates)
    gain = step * drive.damping + step * step * drive.stiffness + np.zeros((1, joints))
    change: Floats = driven(matrix, right, late, gain)[0][0]
    return change


def _ease(group: Group, *, held: bool) -> tuple[float, Floats]:
    """Inverse mass and inverse inertia, in the root's axes.

    Args:
        group: the body.
        held: whether it is one of several that joints hold together.
    """
    if group.mass <= 0.0:
        return 0.0, np.zeros((3, 3))
    moments, axes = np.linalg.eigh(group.inertia)
    # a point mass turns at any push: the fluid need not know
    least = max(ROUND * moments[-1] if held else 0.0, 1e-9 * moments[-1], 1e-30)
    return 1.0 / group.mass, (axes / np.maximum(moments, least)) @ axes.T
