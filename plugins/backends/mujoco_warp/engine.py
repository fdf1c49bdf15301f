"""Scene in MuJoCo Warp: model and data of all worlds, as PyTorch tensors on the same memory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.environment.ground import solids_of
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
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


class Engine:
    """Worlds of the same robots: the engine's arrays as tensors.

    Args:
        robots: of every world, with free bases.
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
        names: of the parts of every robot in the model.
        plain: the model on the processor.
        position: generalised positions (B, nq); of a robot centre of mass, quaternion w x y z,
            joints.
        velocity: of the centre of mass (world), spin (body axes), joint rates, shape (B, nv).
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
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

        if environment.terrain.file:
            raise ConfigError(
                "backend=mujoco_warp knows no height map: environment.terrain.file is given.\n"
                "Use backend=mujoco or backend=pybullet, or ground_level and shore."
            )
        mujoco = engine()
        self.count, self.device = count, device
        scene = Scene(mujoco, step, solids_of(environment), iterations)
        bodies = [MujocoBody(scene, robot, k) for k, robot in enumerate(robots)]
        scene.compile()
        m = scene.model
        m.opt.enableflags = 0
        m.opt.disableflags = sum(int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{x}")) for x in OFF)
        self.names, self.plain = [body.description for body in bodies], m
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
        self.slots = self.index(np.arange(len(self.contact_world)))

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

    def index(self, values: Any) -> Tensor:
        """Return whole numbers on the device."""
        import torch

        return torch.as_tensor(np.asarray(values, dtype=np.int64), device=self.device)

    def numbers(self, values: Any) -> Tensor:
        """Return numbers on the device."""
        import torch

        return torch.as_tensor(np.asarray(values), dtype=torch.float32, device=self.device)

    def tilt(self, turns: Tensor) -> None:
        """Turn the ground planes of every world about their origins, R shape (B, 3, 3)."""
        plane = int(engine().mjtGeom.mjGEOM_PLANE)
        for shape in np.flatnonzero(self.plain.geom_type == plane).tolist():
            self.grounds[:, shape] = turns
