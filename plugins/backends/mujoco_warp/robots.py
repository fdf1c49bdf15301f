"""One robot of every world: its loads, its drives, and its state beside the engine's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from seals.batch.loads import BatchLoads, LinkStates, Loads
from seals.frames import matrix_of
from seals.motion import Inputs, Joints
from seals.plugins.backends.mujoco_warp.engine import Engine
from seals.robot.model import RobotModel
from seals.world.drivetrain import response_of, speeds_of

if TYPE_CHECKING:
    from torch import Tensor

    from seals.plugins.backends.mujoco_warp.laws import LawKernel


OWN = ("command", "held", "order", "drive", "work", "slid", "stands", "submersion")
"""Tensors that make the state of a robot beside the engine's."""


class WarpRobot:
    """One robot in each of B worlds.

    Args:
        engine: of the worlds.
        number: of the robot in the scene.
        loads: effects on the robots.
        laws: what evaluates them.
        step: h [s].

    Attributes:
        command: positions that the servos are asked for, to be written [rad or m], shape (B, J).
        order: commands of rotors and thrusters, to be written [rad/s or N], shape (B, n).
        drive: states of rotors and thrusters [rad/s or N], shape (B, n).
        work: sum of |force x rate| h of all joints since it was cleared [J], shape (B, 1).
        slid: ways of the toes on the ground, their mean, since it was cleared [m], shape (B, 1).
        submersion: submerged share of the volume at the last step [1], shape (B, 1).
    """

    def __init__(
        self,
        engine: Engine,
        number: int,
        loads: BatchLoads,
        laws: BatchLoads | LawKernel,
        step: float,
    ) -> None:
        import torch

        self.laws, self.step, self.robot = laws, step, loads.robot
        self.effects = loads.effects
        self.views = v = _Views(engine, loads.robot, number)
        self.engine, self._loads = engine, loads
        self._chains = {link: v.chain(link) for link in loads.inertial_links()}
        joints, legs = self.robot.tree.joints, list(self.robot.legs.values())
        self._drives = response_of(loads.effects).over_batch(loads.like, loads.effects)
        drives = self._drives.lag.shape[1]

        def zeros(width: int) -> Tensor:
            return torch.zeros(engine.count, width, device=engine.device)

        self.work, self.slid, self.submersion = zeros(1), zeros(1), zeros(1)
        self.stands = zeros(len(legs))
        self.order, self.drive = zeros(drives), zeros(drives)
        self.command, self.held, self.none = zeros(joints), zeros(joints), zeros(joints)
        self._force, self._gain, self._rates = zeros(joints), zeros(joints), zeros(joints)
        none = torch.zeros(joints, device=engine.device)
        given = loads.armature
        self._armature = none if given is None else engine.numbers(given)
        speeds = speeds_of(loads.effects, joints)
        self._most = none + np.inf if speeds is None else engine.numbers(speeds[0] * step)
        self._feet = engine.index([leg.foot for leg in legs])
        self._toes = engine.numbers(np.array([leg.toe for leg in legs]).reshape(-1, 3))
        self.memory = loads.zero_memory()

    def load(self, time: Tensor) -> None:
        """Evaluate all effects, and write loads and inertia into the engine's memory."""
        import torch

        v, e = self.views, self.engine
        self.held += (self.command - self.held).clamp(-self._most, self._most)
        states = v.states()
        self._rates.copy_(e.velocity[:, v.dofs])
        joints = Joints(e.position[:, v.joints], self._rates)
        found = self.laws.evaluate(states, joints, time, self.inputs(), self.memory)
        force, torque = self._inertial(found, states)
        arm = states.origins - e.centres[:, v.rows]
        torque = torque + torch.linalg.cross(arm, force)
        e.pushes[:, v.rows] = torch.cat((force, torque), dim=2)
        self._hold(found)
        for name, kept in self.memory.items():
            kept.copy_(found.memory[name])
        self.submersion.copy_(found.submersion)
        self._slide(states)
        if self.drive.shape[1]:
            share = self._loads.voltage_share(self.memory)
            goal = self._drives.goal(self.order, share)
            self.drive.copy_(self._drives.followed(self.drive, goal, self.step))

    def inputs(self) -> Inputs:
        """Return the inputs of the effects: what the servos hold, and the states of the drives."""
        drive = self.drive if self.drive.shape[1] else None
        return Inputs(self.step, self.none, drive, joint_command=self.held)

    def _inertial(self, found: Loads, states: LinkStates) -> tuple[Tensor, Tensor]:
        """Add J^T A J to the engine's inertia; return the wrenches less A times the bias rates."""
        import torch

        v, e = self.views, self.engine
        force, torque = found.force.clone(), found.torque.clone()
        for link, matrix in found.added.items():
            moving, at, row, column = self._chains[link]
            back = states.rotations[:, link].mT
            arm = states.origins[:, link] - e.middle[:, v.root]
            axes = e.axes[:, moving]
            linear = axes[:, :, 3:] + torch.linalg.cross(axes[:, :, :3], arm[:, None])
            jacobian = torch.cat((back @ linear.mT, back @ axes[:, :, :3].mT), dim=1)
            added = jacobian.mT @ (matrix @ jacobian)
            e.inertia[:, at] += added[:, row, column]
            rise = e.rises[:, v.bodies[link]]
            bias = torch.stack((rise[:, 3:] + torch.linalg.cross(rise[:, :3], arm), rise[:, :3]), 2)
            felt = matrix @ (back @ bias).mT.reshape(-1, 6, 1)
            turned = states.rotations[:, link] @ felt.reshape(-1, 2, 3).mT
            force[:, link] -= turned[:, :, 0]
            torque[:, link] -= turned[:, :, 1]
        return force, torque

    def _hold(self, found: Loads) -> None:
        """Take the joint drives implicitly; those at their limit, by the last step, keep it."""
        import torch

        v, e, h = self.views, self.engine, self.step
        outer = found.joint_force + self.none
        self._force.zero_()
        self._gain.zero_()
        if found.drive is not None:
            d = found.drive
            gain = h * d.damping + h * h * d.stiffness + self.none
            late = d.force - h * d.stiffness * self._rates
            wanted = late - gain * e.guess[:, v.dofs]
            beyond = wanted.abs() > d.limit
            self._force.copy_(torch.where(beyond, torch.sign(wanted) * d.limit, late))
            self._gain.copy_(torch.where(beyond, gain * 0.0, gain))
        if found.resistance is not None:
            self._gain += h * found.resistance
        e.inertia[:, v.diagonal] += self._gain + self._armature
        e.forces[:, v.dofs] = outer + self._force

    def _slide(self, states: LinkStates) -> None:
        """Add the ways of the toes that stood on the ground after the last step."""
        import torch

        if not len(self._feet):
            return
        turns = states.rotations[:, self._feet]
        arms = (turns @ self._toes[:, :, None])[:, :, :, 0]
        speed = states.linear[:, self._feet] + torch.linalg.cross(
            states.angular[:, self._feet], arms
        )
        way = torch.hypot(speed[:, :, 0], speed[:, :, 1]) * self.stands
        feet = self.stands.sum(1, keepdim=True).clamp(min=1.0)
        self.slid += self.step * way.sum(1, keepdim=True) / feet

    def note(self) -> None:
        """Count the work of the joints, and the feet on the ground."""
        v, e = self.views, self.engine
        rates, rise = e.velocity[:, v.dofs], e.acceleration[:, v.dofs]
        force = e.forces[:, v.dofs] - (self._gain + self._armature) * rise
        # a force held over a step does its work at the mean rate
        work = (force * (0.5 * (self._rates + rates))).abs().sum(1, keepdim=True)
        self.work += self.step * work
        if len(self._feet):
            self.stands.copy_((v.normals()[:, self._feet] > 0.0).float())

    def place(
        self,
        rows: Tensor,
        position: Tensor,
        quaternion: Tensor,
        velocity: Tensor,
        joints: Tensor,
        *,
        drive: Tensor | None = None,
    ) -> None:
        """Set the robots of some worlds to a start.

        Args:
            rows: which, bool (B,).
            position: of the base origin, world [m], shape (B, 3).
            quaternion: x, y, z, w, shape (B, 4).
            velocity: of the base origin, world axes [m/s], shape (B, 3); without spin.
            joints: positions at rest [rad or m], shape (J,).
            drive: states of rotors and thrusters [rad/s or N], shape (1 or B, n); None for rest.
        """
        import torch

        v, e, where = self.views, self.engine, rows[:, None]
        centre = position + matrix_of(quaternion) @ v.reference
        start = joints.expand(e.count, -1)
        pose = torch.cat((centre, torch.roll(quaternion, 1, 1)), dim=1)
        e.position[:, v.pose] = torch.where(where, pose, e.position[:, v.pose])
        e.position[:, v.joints] = torch.where(where, start, e.position[:, v.joints])
        still = torch.zeros(e.count, 3 + len(joints), device=e.device)
        speed = torch.cat((velocity, still), dim=1)
        e.velocity[:, v.columns] = torch.where(where, speed, e.velocity[:, v.columns])
        spun = self.drive * 0.0 if drive is None else self.drive * 0.0 + drive
        fresh = ((self.held, start), (self.command, start), (self.order, spun), (self.drive, spun))
        for kept, value in fresh:
            kept.copy_(torch.where(where, value, kept))
        for kept in (self.work, self.slid, self.stands, self.submersion):
            kept.masked_fill_(where, 0.0)
        for kept in self.memory.values():
            kept.masked_fill_(rows.repeat(len(kept) // e.count)[:, None], 0.0)

    def base(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return origin, rotation, velocity of the origin (world) and spin (body axes) of the base.

        Shapes (B, 3), (B, 3, 3), (B, 3), (B, 3).
        """
        import torch

        v, e = self.views, self.engine
        pose, twist = e.position[:, v.pose], e.velocity[:, v.twist]
        turn = matrix_of(self.quaternion())
        arm = turn @ v.reference
        spin = twist[:, 3:].clone()
        around = torch.linalg.cross((turn @ spin[:, :, None])[:, :, 0], arm)
        return pose[:, :3] - arm, turn, twist[:, :3] - around, spin

    def quaternion(self) -> Tensor:
        """Return the orientation of the base, x, y, z, w, shape (B, 4)."""
        import torch

        return torch.roll(self.engine.position[:, self.views.pose][:, 3:], -1, 1)

    def joints(self) -> Tensor:
        """Return the joint positions [rad or m], shape (B, J)."""
        found: Tensor = self.engine.position[:, self.views.joints]
        return found

    def snapshot(self) -> dict[str, Any]:
        """Return the state beside the engine's, as tensors."""
        own = {name: getattr(self, name).clone() for name in OWN}
        return {**own, "memory": {k: x.clone() for k, x in self.memory.items()}}

    def restore(self, kept: dict[str, Any]) -> None:
        """Restore a snapshot."""
        for name in OWN:
            getattr(self, name).copy_(kept[name])
        for name, value in self.memory.items():
            value.copy_(kept["memory"][name])


class _Views:
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
