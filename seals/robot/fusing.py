"""Merge of the links of held joints into fewer rigid bodies."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.hydrostatics import Hull
from seals.hydrostatics.fused import HullFused, Part
from seals.multibody.tree import Tree, poses_in_base
from seals.robot.model import RobotModel


def fused(
    robot: RobotModel,
    joints: Sequence[float],
    keep: Collection[str] = (),
    *,
    moving: Collection[str] = (),
) -> RobotModel:
    """Return the robot with joints held, links merged rigidly into those that remain.

    Mass, inertia and displaced water are those of the whole robot in that posture; contact
    geometry, arms, grippers and legs are left out.

    Args:
        robot: with a free base.
        joints: held joint values [rad or m], J of them; zero for one that moves.
        keep: links that stay links, for effects that act on them; the base and the links below
            joints that move always stay. All others become part of the nearest link above them
            that is kept.
        moving: names of the joints that are not held; they keep their order.

    Raises:
        ConfigError: the number of joint values is wrong, or a kept link does not exist.
    """
    # refuse a wrong number of joint values, and links that the robot lacks
    unknown = sorted(set(keep) - set(robot.links))
    if unknown or len(joints) != robot.tree.joints:
        raise ConfigError(
            f"robot '{robot.name}' cannot have its joints held: {unknown or list(joints)} do "
            "not fit.\n"
            f"Allowed: {robot.tree.joints} joint values and links of {list(robot.links)}."
        )
    held = np.array(joints, dtype=float)
    free = [j for j, name in enumerate(robot.joints) if name in moving]
    held[free] = 0.0
    origins, turns = poses_in_base(robot.tree, held)
    above = robot.tree.joint
    kept = [k for k, name in enumerate(robot.links) if k == 0 or name in keep or above[k] in free]
    owner = _owners(robot.tree, kept)
    members = [[k for k, its in enumerate(owner) if its == top] for top in kept]
    groups = [
        _Group(robot, top, own, origins, turns) for top, own in zip(kept, members, strict=True)
    ]
    return RobotModel(
        name=robot.name,
        urdf=robot.urdf,
        links=tuple(robot.links[k] for k in kept),
        joints=tuple(robot.joints[j] for j in free),
        tree=_tree_of(robot.tree, kept, free, origins, turns),
        mass=np.array([g.mass for g in groups]),
        centre=np.array([g.centre for g in groups]),
        inertia=np.array([g.inertia for g in groups]),
        lower=robot.lower[free],
        upper=robot.upper[free],
        hulls=tuple(g.hull for g in groups),
        has_collision=(False,) * len(kept),
        held=not free,
    )


def _tree_of(tree: Tree, kept: list[int], free: list[int], origins: Floats, turns: Floats) -> Tree:
    """Return the tree of the links that are kept and the joints that move.

    Args:
        tree: of the whole robot.
        kept: links that stay links, the base first.
        free: joints that are not held.
        origins: of the links in the held posture [m], shape (L, 3).
        turns: link to base, shape (L, 3, 3).
    """
    owner = _owners(tree, kept)
    parents = [-1] + [kept.index(owner[tree.parent[k]]) for k in kept[1:]]
    hangs = [(k, kept[p]) for k, p in zip(kept, parents, strict=True)]
    places = [turns[a].T @ (origins[k] - origins[a]) for k, a in hangs]
    drives = tree.drive_inertia
    return Tree(
        parent=tuple(parents),
        joint=tuple(free.index(tree.joint[k]) if tree.joint[k] in free else -1 for k in kept),
        prismatic=tuple(tree.prismatic[j] for j in free),
        axis=tree.axis[free].reshape(-1, 3),
        origin=np.array([np.zeros(3), *places[1:]]),
        rotation=np.array([turns[a].T @ turns[k] for k, a in hangs]),
        fixed_base=tree.fixed_base,
        drive_inertia=tuple(drives[j] for j in free) if drives else (),
    )


def _owners(tree: Tree, kept: list[int]) -> list[int]:
    """The kept link that each link becomes part of."""
    owner = list(range(tree.links))
    for k in range(tree.links):
        if k not in kept:
            owner[k] = owner[tree.parent[k]]
    return owner


class _Group:
    """Mass, centre, inertia and hull of links that have become one, in the axes of the first."""

    def __init__(
        self, robot: RobotModel, top: int, members: list[int], origins: Floats, turns: Floats
    ) -> None:
        turn = turns[top].T
        self._places = {k: (turn @ (origins[k] - origins[top]), turn @ turns[k]) for k in members}
        self.mass = float(robot.mass[members].sum())
        moments = [robot.mass[k] * (p + r @ robot.centre[k]) for k, (p, r) in self._places.items()]
        self.centre: Floats = np.zeros(3)
        if self.mass > 0.0:
            self.centre = np.sum(moments, axis=0) / self.mass
        self.inertia: Floats = np.zeros((3, 3))
        for k, (p, r) in self._places.items():
            arm = p + r @ robot.centre[k] - self.centre
            steiner = robot.mass[k] * ((arm @ arm) * np.eye(3) - np.outer(arm, arm))
            self.inertia += r @ robot.inertia[k] @ r.T + steiner
        self.hull = self._hull(robot)

    def _hull(self, robot: RobotModel) -> Hull | None:
        hulls = [(k, robot.hulls[k], place) for k, place in self._places.items()]
        parts = [Part(hull, *place) for _, hull, place in hulls if hull is not None]
        own = [hull for k, hull, _ in hulls if hull is not None and k == next(iter(self._places))]
        if len(parts) == 1 and own:
            return own[0]
        return HullFused(parts) if parts else None
