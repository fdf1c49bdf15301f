"""One robot of every world of MuJoCo Warp: where its numbers are among the engine's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from seals.batch.loads import LinkStates
from seals.plugins.backends.mujoco_warp.engine import Engine
from seals.robot.model import RobotModel

if TYPE_CHECKING:
    from torch import Tensor


class Views:
    """Indices of one robot in the engine's arrays.

    Args:
        engine: with the tensors of all worlds.
        robot: with a free base.
        number: of the robot in the scene.

    Attributes:
        pose: columns of the position of its free base: centre of mass, quaternion.
        twist: columns of the velocity of its free base.
        joints: columns of its joint positions, shape (J,).
        dofs: columns of its joint rates, shape (J,).
        bodies: rows of its links.
    """

    def __init__(self, engine: Engine, robot: RobotModel, number: int) -> None:
        """Look up where the robot's parts are."""
        self.engine, self.robot = engine, robot
        m, self.names = engine.plain, engine.names[number]
        self.bodies = bodies = [int(m.body(name).id) for name in self.names.bodies]
        joints = [m.joint(name).id for name in self.names.joints]
        self.rows, self.root = engine.index(bodies), bodies[0]
        free = int(m.body_jntadr[bodies[0]])
        first, rate = int(m.jnt_qposadr[free]), int(m.jnt_dofadr[free])
        self.pose, self.twist = slice(first, first + 7), slice(rate, rate + 6)
        self.dofs = engine.index([int(m.jnt_dofadr[j]) for j in joints])
        self.joints = engine.index([int(m.jnt_qposadr[j]) for j in joints])
        self.diagonal = engine.index(
            [
                int(m.M_rowadr[k] + m.M_rownnz[k] - 1)
                for k in m.jnt_dofadr[np.asarray(joints, dtype=int)]
            ]
        )
        self.columns = engine.index([*range(rate, rate + 6), *self.dofs.tolist()])
        links = len(robot.links)
        link = np.full(m.ngeom, links)
        for name, k in self.names.shapes:
            link[m.geom(name).id] = k
        self.link_of_shape = engine.index(link)
        self.reference = engine.numbers(robot.centre[0])

    def chain(self, link: int) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return coordinates that move a link, and where their products lie in the inertia.

        Returns:
            Coordinates (n,); place in the engine's inertia, row and column among the n, each (m,).
        """
        m = self.engine.plain
        body: int = m.body(self.names.bodies[link]).id
        moving: list[int] = []
        while body > 0:
            first, size = int(m.body_dofadr[body]), int(m.body_dofnum[body])
            moving = [*range(first, first + size), *moving] if size else moving
            body = int(m.body_parentid[body])
        where = {dof: k for k, dof in enumerate(moving)}
        table = []
        for row in moving:
            start = int(m.M_rowadr[row])
            columns = m.M_colind[start : start + int(m.M_rownnz[row])].tolist()
            table += [(start + k, where[row], where[c]) for k, c in enumerate(columns)]
        at, i, j = zip(*table, strict=True)
        return tuple(self.engine.index(x) for x in (moving, at, i, j))  # type: ignore[return-value]

    def states(self) -> LinkStates:
        """Return poses and velocities of all links, of the instant that the engine looked at."""
        import torch

        e = self.engine
        rotations = e.turns[:, self.rows]
        origins = e.places[:, self.rows].clone()
        origins[:, 0] -= rotations[:, 0] @ self.reference
        twists = e.twists[:, self.rows]
        angular = twists[:, :, :3]
        arm = origins - e.middle[:, self.root][:, None]
        linear = twists[:, :, 3:] + torch.linalg.cross(angular, arm)
        return LinkStates(origins, rotations, linear, angular)

    def normals(self) -> Tensor:
        """Return the sum of the normal forces on every link in the last step [N], shape (B, L)."""
        import torch

        e = self.engine
        row = e.contact_row[:, 0].long()
        real = (e.slots < e.contact_count) & (row >= 0)
        world = e.contact_world.long().clamp(0, e.count - 1)
        force = e.contact_force[world, row.clamp(min=0)]
        links = len(self.robot.links) + 1
        size = e.count * links
        total = torch.zeros(size + len(e.slots), device=e.device)
        for side in (0, 1):
            shape = e.contact_shapes[:, side].long().clamp(0, len(self.link_of_shape) - 1)
            # what is no contact has a place of its own: many sums at one would wait for each other
            place = torch.where(real, world * links + self.link_of_shape[shape], size + e.slots)
            total.index_add_(0, place, force)
        return total[:size].reshape(e.count, links)[:, :-1]
