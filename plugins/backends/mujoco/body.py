"""One robot in MuJoCo: pose, velocity, loads and contacts in the engine."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.coupling import ImplicitDrive
from seals.frames import cross
from seals.plugins.backends.mujoco.contacts import MujocoContacts
from seals.plugins.backends.mujoco.scene import Scene
from seals.robot.model import RobotModel

_XYZW = np.array([1, 2, 3, 0])
"""Order of a quaternion's parts in SEALS, by their places in the engine."""


class MujocoBody:
    """A robot in the scene, see `seals.coupling.SolvingEngineBody`.

    Its velocity is that of the centre of mass of a free base. The engine keeps the angular velocity
    in axes of the base, and quaternions as w, x, y, z.

    Args:
        scene: to add it to.
        robot: model to add.
        number: of the robot in the scene.
    """

    top_speed = np.inf
    base_turn = np.array([[0.0, 0.0, 0.0, 1.0]])

    def __init__(self, scene: Scene, robot: RobotModel, number: int) -> None:
        """Describe the robot to the engine."""
        self._scene, self._robot, self._number = scene, robot, number
        self._engine, self._free = scene.engine, not robot.tree.fixed_base
        self._lead = 6 if self._free else 0
        self.reference = robot.centre[0] if self._free else np.zeros(3)
        self._description = scene.add(robot, self)
        self._inertia: Floats | None = None
        self._force = np.zeros(robot.tree.joints)
        self._drive: ImplicitDrive | None = None
        self._held, self._bound = np.zeros(robot.tree.joints, dtype=bool), False
        self._pull = np.zeros(robot.tree.joints)
        self._push, self._wrenched = np.zeros(6), True

    def bind(self) -> None:
        """Look up indices in the compiled model, and views of its arrays."""
        m, d, names = self._scene.model, self._scene.data, self._description
        self._rows = np.array([m.body(name).id for name in names.bodies])
        joints = [m.joint(name).id for name in names.joints]
        self._q = np.array([m.jnt_qposadr[j] for j in joints], dtype=int)
        turning = [m.jnt_dofadr[j] for j in joints]
        self._dofs = np.array(turning, dtype=int)
        every = turning
        if self._free:
            base = m.joint(f"{self._number}/").id
            at, first = int(m.jnt_qposadr[base]), int(m.jnt_dofadr[base])
            self._place, self._turn = d.qpos[at : at + 3], d.qpos[at + 3 : at + 7]
            self._linear, self._spin = d.qvel[first : first + 3], d.qvel[first + 3 : first + 6]
            self._push = d.qfrc_applied[first : first + 6]
            every = [*range(first, first + 6), *turning]
        else:
            row = m.body_mocapid[self._rows[0]]
            self._place, self._turn = d.mocap_pos[row], d.mocap_quat[row]
        self._entries(m, every)
        self._qpos, self._qvel, self._qacc = d.qpos, d.qvel, d.qacc
        self._pushed, self._applied, self._mass = d.xfrc_applied, d.qfrc_applied, d.M
        self._origins, self._rotations, self._centres = d.xpos, d.xmat, d.xipos
        self._out = np.zeros(3)
        self._back = np.zeros(4)
        number, link = np.full(m.ngeom, -1), np.zeros(m.ngeom, dtype=int)
        for name, k in names.shapes:
            shape = m.geom(name).id
            number[shape], link[shape] = self._number, k
        self._mine, self._link = number == self._number, link

    def _entries(self, m: Any, every: list[int]) -> None:
        """Indices of the robot's entries in the engine's sparse inertia, with their coordinates."""
        coordinate = {dof: k for k, dof in enumerate(every)}
        table = [
            (int(m.M_rowadr[dof]) + k, coordinate[dof], coordinate[int(column)])
            for dof in every
            for k, column in enumerate(
                m.M_colind[m.M_rowadr[dof] : m.M_rowadr[dof] + m.M_rownnz[dof]]
            )
        ]
        self._at, self._row, self._column = np.array(table, dtype=int).reshape(-1, 3).T
        diagonal = {row: at for at, row, column in table if row == column}
        lead = self._lead
        self._diagonal = np.array([diagonal[lead + j] for j in range(len(every) - lead)], dtype=int)

    def place(self, position: Floats, quaternion: Floats) -> None:
        """Set the pose of the base link."""
        self._scene.compile()
        x, y, z, w = quaternion
        self._turn[:] = w, x, y, z
        self._place[:] = position + self._arm()
        # nothing of an earlier episode starts the solver
        self._scene.data.qacc_warmstart[:] = 0.0
        self._scene.stale = True

    def _arm(self) -> Floats:
        """Vector from the origin of the base to the engine's reference point, world axes [m]."""
        self._engine.mju_rotVecQuat(self._out, self.reference, self._turn)
        return self._out

    def base_pose(self) -> tuple[Floats, Floats]:
        """Return origin and attitude of the base link."""
        w, x, y, z = self._turn
        return self._place - self._arm(), np.array([x, y, z, w])

    def native_pose(self) -> tuple[Floats, Floats]:
        """Return the reference point of the base, and its attitude."""
        return self._place, self._turn.take(_XYZW)

    def link_poses(self) -> tuple[Floats, Floats]:
        """Return origins and rotations of all links."""
        self._scene.posed()
        origins: Floats = self._origins.take(self._rows, axis=0)
        origins[0] -= self._arm()
        return origins, self._rotations.take(self._rows, axis=0).reshape(-1, 3, 3)

    def set_velocity(self, velocity: Floats, joints: Floats) -> None:
        """Set the velocity and the joint positions."""
        if self._free:
            self._linear[:] = velocity[:3]
            self._spin[:] = self._in_base(velocity[3:6])
        if self._dofs.size:
            self._qvel[self._dofs] = velocity[self._lead :]
            self._qpos[self._q] = joints
        self._scene.stale = True

    def _in_base(self, vector: Floats) -> Floats:
        """World vector in axes of the base."""
        self._engine.mju_negQuat(self._back, self._turn)
        self._engine.mju_rotVecQuat(self._out, vector, self._back)
        return self._out

    def shift_base(self, displacement: Floats) -> None:
        """Move the base by a small displacement, world axes."""
        self._place += displacement[:3]
        self._engine.mju_quatIntegrate(self._turn, self._in_base(displacement[3:]), 1.0)
        self._scene.stale = True

    def state(self) -> tuple[Floats, Floats]:
        """Return the velocity and the joint positions."""
        joints = self._qpos.take(self._q)
        if not self._free:
            return self._qvel.take(self._dofs), joints
        velocity = np.empty(6 + self._dofs.size)
        velocity[:3] = self._linear
        self._engine.mju_rotVecQuat(self._out, self._spin, self._turn)
        velocity[3:6] = self._out
        velocity[6:] = self._qvel.take(self._dofs)
        return velocity, joints

    def apply_wrenches(self, wrenches: Floats, origins: Floats, rotations: Floats) -> None:
        """Apply wrenches over the next step."""
        self._scene.posed()
        # rows force and torque of every link, turned into the world at once
        both = np.matmul(wrenches.reshape(-1, 2, 3), rotations.transpose(0, 2, 1))
        both[:, 1] += cross(origins - self._centres.take(self._rows, axis=0), both[:, 0])
        self._pushed[self._rows] = both.reshape(-1, 6)
        if not self._wrenched:
            self._push[:] = 0.0
            self._wrenched = True

    def apply_generalised(self, force: Floats, joint_forces: Floats, origin: Floats) -> None:
        """Apply a generalised force over the next step."""
        if self._wrenched:
            self._pushed[self._rows] = 0.0
            self._wrenched = False
        if self._free:
            self._push[:3] = force[:3]
            self._push[3:] = self._in_base(force[3:6])
        self._force = joint_forces + force[self._lead :]

    def apply_joint_forces(self, forces: Floats) -> None:
        """Apply forces on the joints over the next step."""
        self._force = forces

    def add_inertia(self, inertia: Floats | None) -> None:
        """Add a generalised inertia to the engine's own over the next step."""
        self._inertia = inertia

    def drive_joints(self, drive: ImplicitDrive | None) -> None:
        """Set the joint drives that act over the next step."""
        self._drive = drive

    def drive_forces(self) -> Floats:
        """Return the drive forces on the joints over the last step, less those on the armature."""
        if self._drive is None:
            return np.zeros_like(self._pull)
        forces: Floats = self._pull - self._drive.armature * self._qacc.take(self._dofs)
        return forces

    def load(self) -> None:
        """Write added inertia and generalised forces into the engine's data."""
        if self._inertia is not None:
            added = self._in_coordinates(self._inertia) if self._free else self._inertia
            self._mass[self._at] += added[self._row, self._column]
        force = self._force
        if self._drive is not None:
            self._mass[self._diagonal] += self._drive.armature + self._drive.gain[0]
            force = force + self._drive.drive.force[0]
            self._held[:] = self._bound = False
        self._applied[self._dofs] = force

    def _in_coordinates(self, inertia: Floats) -> Floats:
        """Generalised inertia in the engine's coordinates: angular velocity in axes of the base."""
        turn = self._rotations[self._rows[0]].reshape(3, 3)
        added: Floats = inertia.copy()
        added[:, 3:6] = added[:, 3:6] @ turn
        added[3:6] = turn.T @ added[3:6]
        return added

    def saturate(self) -> bool:
        """Limit drives that exceed their largest force; return whether any did."""
        if self._drive is None:
            return False
        drive, gain = self._drive.drive, self._drive.gain[0]
        change = self._qacc.take(self._dofs)
        wanted = drive.force[0] - gain * change
        if self._bound:
            wanted = np.where(self._held, self._pull, wanted)
        limit = drive.limit[0] + np.zeros_like(wanted)
        beyond = (np.abs(wanted) > limit) & ~self._held
        if not np.count_nonzero(beyond):
            self._pull = wanted
            return False
        wanted[beyond] = np.copysign(limit[beyond], wanted[beyond])
        self._mass[self._diagonal[beyond]] -= gain[beyond]
        self._applied[self._dofs[beyond]] = (self._force + wanted)[beyond]
        self._held |= beyond
        self._bound = True
        self._pull = wanted
        return True

    def contacts(self) -> MujocoContacts | None:
        """Return the contacts of the robot in the last step."""
        d = self._scene.data
        if d.ncon == 0:
            return None
        touched = self._mine[d.contact.geom]
        return MujocoContacts(d, touched, self._link) if touched.any() else None
