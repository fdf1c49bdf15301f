"""Model of one robot in MuJoCo Warp: indices, and the data of all worlds as PyTorch tensors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from seals.batch.loads import LinkStates
from seals.environment.ground import solids_of
from seals.environment.settings import EnvironmentSettings
from seals.plugins.backends.mujoco.backend import engine
from seals.plugins.backends.mujoco.body import MujocoBody
from seals.plugins.backends.mujoco.scene import Scene
from seals.robot.model import RobotModel

if TYPE_CHECKING:
    from torch import Tensor

OFF = ("ISLAND", "SENSOR", "EULERDAMP", "DAMPER", "SPRING", "GRAVITY", "ACTUATION", "CLAMPCTRL")
"""Parts of the engine's step that SEALS does itself, or does without."""
CONTACT_ROWS = 3
"""Rows of a contact with friction in the engine's problem."""


class Views:
    """Worlds of one robot: the engine's arrays as tensors on the same memory.

    Args:
        robot: with a free base.
        environment: what stands still.
        step: h [s].
        count: number of worlds B.
        touching: contact points of one world.
        iterations: of the contact solver.
        repeatable: whether sums are taken in one order.
        device: ``cuda`` or ``cpu``.

    Attributes:
        model: of MuJoCo Warp.
        data: of MuJoCo Warp.
        position: generalised positions (B, nq): centre of mass, quaternion w x y z, joints.
        velocity: of the centre of mass (world), spin (body axes), joint rates, shape (B, nv).
    """

    def __init__(
        self,
        robot: RobotModel,
        environment: EnvironmentSettings,
        *,
        step: float,
        count: int,
        touching: int,
        iterations: int,
        repeatable: bool,
        device: str,
    ) -> None:
        import warp

        wp: Any = warp
        wp.config.log_level = wp.LOG_WARNING
        import mujoco_warp as mjw

        mujoco = engine()
        self.robot, self.count, self.device = robot, count, device
        scene = Scene(mujoco, step, solids_of(environment), iterations)
        body = MujocoBody(scene, robot, 0)
        scene.compile()
        m = scene.model
        m.opt.enableflags = 0
        m.opt.disableflags = sum(int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{x}")) for x in OFF)
        self.names, self.plain = body.description, m
        stops = int(np.count_nonzero(m.jnt_limited))
        with wp.ScopedDevice(device):
            self.model = mjw.put_model(m)
            if repeatable:
                self.model.opt.deterministic = int(mjw.DeterminismType.ALL)
            late = int(mjw.OverflowType.ITERATIONS | mjw.OverflowType.LS_ITERATIONS)
            # in float32 a search may end at its limit; only what found no room is an overflow
            self.room = int(mjw.OverflowType.ALL) & ~late
            self.model.opt.warn_overflow &= ~late
            rows = CONTACT_ROWS * touching + stops
            self.data = mjw.make_data(m, nworld=count, nconmax=touching, njmax=rows)
        self._tensors()
        self._indices(m)

    def _tensors(self) -> None:
        import warp as wp

        d = self.data
        self.position, self.velocity = wp.to_torch(d.qpos), wp.to_torch(d.qvel)
        self.acceleration, self.guess = wp.to_torch(d.qacc), wp.to_torch(d.qacc_warmstart)
        self.places, self.turns = wp.to_torch(d.xpos), wp.to_torch(d.xmat)
        self.centres, self.middle = wp.to_torch(d.xipos), wp.to_torch(d.subtree_com)
        self.twists, self.rises = wp.to_torch(d.cvel), wp.to_torch(d.cacc)
        self.axes, self.inertia = wp.to_torch(d.cdof), wp.to_torch(d.M)
        self.pushes, self.forces = wp.to_torch(d.xfrc_applied), wp.to_torch(d.qfrc_applied)
        self.contact_count = wp.to_torch(d.nacon)
        self.contact_world = wp.to_torch(d.contact.worldid)
        self.contact_shapes = wp.to_torch(d.contact.geom)
        self.contact_row = wp.to_torch(d.contact.efc_address)
        self.contact_force = wp.to_torch(d.efc.force)
        self.grounds, self.left_out = wp.to_torch(d.geom_xmat), wp.to_torch(d.overflow)

    def _indices(self, m: Any) -> None:
        """Look up where the robot's parts are."""
        robot, names = self.robot, self.names
        self.bodies = bodies = [int(m.body(name).id) for name in names.bodies]
        joints = [m.joint(name).id for name in names.joints]
        self.rows = self.index(bodies)
        self.root = bodies[0]
        self.dofs = self.index([int(m.jnt_dofadr[j]) for j in joints])
        self.joints = self.index([int(m.jnt_qposadr[j]) for j in joints])
        self.diagonal = self.index(
            [int(m.M_rowadr[k] + m.M_rownnz[k] - 1) for k in m.jnt_dofadr[joints]]
        )
        links = len(robot.links)
        link = np.full(m.ngeom, links)
        for name, k in names.shapes:
            link[m.geom(name).id] = k
        self.link_of_shape = self.index(link)
        self.reference = self.numbers(robot.centre[0])
        self.slots = self.index(np.arange(len(self.contact_world)))

    def index(self, values: Any) -> Tensor:
        """Return whole numbers on the device."""
        import torch

        return torch.as_tensor(np.asarray(values, dtype=np.int64), device=self.device)

    def numbers(self, values: Any) -> Tensor:
        """Return numbers on the device."""
        import torch

        return torch.as_tensor(np.asarray(values), dtype=torch.float32, device=self.device)

    def chain(self, link: int) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return coordinates that move a link, and where their products lie in the inertia.

        Returns:
            Coordinates (n,); place in the engine's inertia, row and column among the n, each (m,).
        """
        m = self.plain
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
        return tuple(self.index(x) for x in (moving, at, i, j))  # type: ignore[return-value]

    def tilt(self, turns: Tensor) -> None:
        """Turn the ground planes of every world about their origins, R shape (B, 3, 3)."""
        plane = int(engine().mjtGeom.mjGEOM_PLANE)
        for shape in np.flatnonzero(self.plain.geom_type == plane).tolist():
            self.grounds[:, shape] = turns

    def states(self) -> LinkStates:
        """Return poses and velocities of all links, of the instant that the engine looked at."""
        import torch

        rotations = self.turns[:, self.rows]
        origins = self.places[:, self.rows].clone()
        origins[:, 0] -= rotations[:, 0] @ self.reference
        twists = self.twists[:, self.rows]
        angular = twists[:, :, :3]
        arm = origins - self.middle[:, self.root][:, None]
        linear = twists[:, :, 3:] + torch.linalg.cross(angular, arm)
        return LinkStates(origins, rotations, linear, angular)

    def normals(self) -> Tensor:
        """Return the sum of the normal forces on every link in the last step [N], shape (B, L)."""
        import torch

        row = self.contact_row[:, 0].long()
        real = (self.slots < self.contact_count) & (row >= 0)
        world = self.contact_world.long().clamp(0, self.count - 1)
        force = self.contact_force[world, row.clamp(min=0)]
        links = len(self.robot.links) + 1
        size = self.count * links
        total = torch.zeros(size + len(self.slots), device=self.device)
        for side in (0, 1):
            shape = self.contact_shapes[:, side].long().clamp(0, len(self.link_of_shape) - 1)
            # what is no contact has a place of its own: many sums at one would wait for each other
            place = torch.where(real, world * links + self.link_of_shape[shape], size + self.slots)
            total.index_add_(0, place, force)
        return total[:size].reshape(self.count, links)[:, :-1]
