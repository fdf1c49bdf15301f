"""Many worlds of one robot on one device: the engine's step, and SEALS's laws on its memory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from seals.batch.loads import BatchLoads, LinkStates, Loads
from seals.environment.ground import ground_height
from seals.environment.settings import EnvironmentSettings
from seals.frames import matrix_of, multiply
from seals.motion import Inputs, Joints
from seals.plugins.backends.mujoco_warp.graphs import Work, recorded
from seals.plugins.backends.mujoco_warp.views import Views
from seals.world.drivetrain import speeds_of

if TYPE_CHECKING:
    from torch import Tensor

    from seals.plugins.backends.mujoco_warp.laws import LawKernel

KEPT = ("position", "velocity", "guess")
"""Tensors of the engine that make its state."""
OWN = ("time", "command", "held", "work", "slid", "stands", "submersion")
"""Tensors beside the engine's that make the state of the worlds."""


class WarpWorlds:
    """B worlds with one robot each, stepped together.

    Args:
        backend: settings of the engine.
        loads: effects on the robots.
        laws: what evaluates them.
        environment: what stands still.
        step: h [s].

    Attributes:
        time: since the start of each world [s], shape (B, 1).
        advance: advances all worlds by one step under the present command, as one graph on a GPU.
        command: positions that the servos are asked for, to be written [rad or m], shape (B, J).
        work: sum of |force x rate| h of all joints since it was cleared [J], shape (B, 1).
        slid: ways of the toes on the ground, their mean, since it was cleared [m], shape (B, 1).
        submersion: submerged share of the volume at the last step [1], shape (B, 1).
    """

    def __init__(
        self,
        backend: Any,
        loads: BatchLoads,
        laws: BatchLoads | LawKernel,
        environment: EnvironmentSettings,
        *,
        step: float,
    ) -> None:
        import torch

        self.laws, self.step, self.robot = laws, step, loads.robot
        self.count, self.device = loads.batch, loads.like.device.type
        self._views = v = Views(
            loads.robot,
            environment,
            step=step,
            count=self.count,
            touching=backend.touching,
            iterations=backend.solver_iterations,
            repeatable=backend.repeatable,
            device=self.device,
        )
        self._chains = {link: v.chain(link) for link in loads.inertial_links()}
        joints, legs = self.robot.tree.joints, list(self.robot.legs.values())

        def zeros(width: int) -> Tensor:
            return torch.zeros(self.count, width, device=self.device)

        self.time, self.work, self.slid = zeros(1), zeros(1), zeros(1)
        self.submersion, self.stands = zeros(1), zeros(len(legs))
        self.command, self.held, self._none = zeros(joints), zeros(joints), zeros(joints)
        self._force, self._gain, self._rates = zeros(joints), zeros(joints), zeros(joints)
        none = torch.zeros(joints, device=self.device)
        given = loads.armature
        self._armature = none if given is None else v.numbers(given)
        speeds = speeds_of(loads.effects, joints)
        self._most = none + np.inf if speeds is None else v.numbers(speeds[0] * step)
        self._feet = v.index([leg.foot for leg in legs])
        self._toes = v.numbers(np.array([leg.toe for leg in legs]).reshape(-1, 3))
        self._memory = loads.zero_memory()
        self._tilt(backend.slope, environment)
        self._parts = {
            "look": self._begin,
            "laws": self._loaded,
            "solve": self._end,
            "note": self._noted,
        }
        self.advance = self.record(self.step_once)

    def _tilt(self, slope: float, environment: EnvironmentSettings) -> None:
        """Draw the slopes of all worlds, and turn their grounds."""
        rng = np.random.default_rng(0)
        angle, way = rng.uniform(0.0, slope, self.count), rng.uniform(-np.pi, np.pi, self.count)
        half = 0.5 * angle
        axis = np.stack((-np.sin(way), np.cos(way), 0.0 * way), axis=1)
        turns = np.concatenate((np.sin(half)[:, None] * axis, np.cos(half)[:, None]), axis=1)
        self._slopes = self._views.numbers(turns)
        self._middle = self._views.numbers([0.0, 0.0, ground_height(environment, 0.0, 0.0) or 0.0])
        if slope > 0.0:
            self._views.tilt(matrix_of(self._slopes))

    def step_once(self) -> None:
        """Advance all worlds by one step under the present command, launch by launch."""
        for part in self._parts.values():
            part()

    def parts(self) -> dict[str, Work]:
        """Return the parts of a step by name, in order, each recorded, for those who time them."""
        return {name: self.record(part) for name, part in self._parts.items()}

    def record(self, work: Work) -> Work:
        """Return work on tensors, in place, recorded where there is a GPU; it is called before."""
        return recorded(work, self.device)

    def _begin(self) -> None:
        """Find poses, inertia, contacts and bias forces."""
        import mujoco_warp as mjw

        m, d = self._views.model, self._views.data
        mjw.fwd_position(m, d, factorize=False)
        mjw.fwd_velocity(m, d)

    def _end(self) -> None:
        """Factor the inertia, solve for accelerations and contact forces, and move on."""
        import mujoco_warp as mjw

        m, d = self._views.model, self._views.data
        mjw.fwd_acceleration(m, d, factorize=True)
        mjw.solve(m, d)
        mjw.euler(m, d)

    def _loaded(self) -> None:
        """Evaluate all effects, and write loads and inertia into the engine's memory."""
        import torch

        v = self._views
        with torch.no_grad():
            self.held += (self.command - self.held).clamp(-self._most, self._most)
            states = v.states()
            self._rates.copy_(v.velocity[:, v.dofs])
            joints = Joints(v.position[:, v.joints], self._rates)
            inputs = Inputs(self.step, self._none, joint_command=self.held)
            found = self.laws.evaluate(states, joints, self.time, inputs, self._memory)
            force, torque = self._inertial(found, states)
            arm = states.origins - v.centres[:, v.rows]
            torque = torque + torch.linalg.cross(arm, force)
            v.pushes[:, v.rows] = torch.cat((force, torque), dim=2)
            self._drive(found)
            for name, kept in self._memory.items():
                kept.copy_(found.memory[name])
            self.submersion.copy_(found.submersion)
            self._slide(states)

    def _inertial(self, found: Loads, states: LinkStates) -> tuple[Tensor, Tensor]:
        """Add J^T A J to the engine's inertia; return the wrenches less A times the bias rates."""
        import torch

        v = self._views
        force, torque = found.force.clone(), found.torque.clone()
        for link, matrix in found.added.items():
            moving, at, row, column = self._chains[link]
            back = states.rotations[:, link].mT
            arm = states.origins[:, link] - v.middle[:, v.root]
            axes = v.axes[:, moving]
            linear = axes[:, :, 3:] + torch.linalg.cross(axes[:, :, :3], arm[:, None])
            jacobian = torch.cat((back @ linear.mT, back @ axes[:, :, :3].mT), dim=1)
            added = jacobian.mT @ (matrix @ jacobian)
            v.inertia[:, at] += added[:, row, column]
            rise = v.rises[:, v.bodies[link]]
            bias = torch.stack((rise[:, 3:] + torch.linalg.cross(rise[:, :3], arm), rise[:, :3]), 2)
            felt = matrix @ (back @ bias).mT.reshape(-1, 6, 1)
            turned = states.rotations[:, link] @ felt.reshape(-1, 2, 3).mT
            force[:, link] -= turned[:, :, 0]
            torque[:, link] -= turned[:, :, 1]
        return force, torque

    def _drive(self, found: Loads) -> None:
        """Take the joint drives implicitly; those at their limit, by the last step, keep it."""
        import torch

        v, h = self._views, self.step
        outer = found.joint_force + self._none
        self._force.zero_()
        self._gain.zero_()
        if found.drive is not None:
            d = found.drive
            gain = h * d.damping + h * h * d.stiffness + self._none
            late = d.force - h * d.stiffness * self._rates
            wanted = late - gain * v.guess[:, v.dofs]
            beyond = wanted.abs() > d.limit
            self._force.copy_(torch.where(beyond, torch.sign(wanted) * d.limit, late))
            self._gain.copy_(torch.where(beyond, gain * 0.0, gain))
        v.inertia[:, v.diagonal] += self._gain + self._armature
        v.forces[:, v.dofs] = outer + self._force

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

    def _noted(self) -> None:
        """Count the work of the joints, and the feet on the ground."""
        import torch

        v = self._views
        with torch.no_grad():
            rates, rise = v.velocity[:, v.dofs], v.acceleration[:, v.dofs]
            force = v.forces[:, v.dofs] - (self._gain + self._armature) * rise
            # a force held over a step does its work at the mean rate
            work = (force * (0.5 * (self._rates + rates))).abs().sum(1, keepdim=True)
            self.work += self.step * work
            self.stands.copy_((v.normals()[:, self._feet] > 0.0).float())
            self.time += self.step

    def place(
        self, rows: Tensor, position: Tensor, quaternion: Tensor, velocity: Tensor, joints: Tensor
    ) -> None:
        """Set some worlds to a start, turned with their slope.

        Args:
            rows: which, bool (B,).
            position: of the base origin, world [m], shape (B, 3).
            quaternion: x, y, z, w, shape (B, 4).
            velocity: of the base origin, world axes [m/s], shape (B, 3); without spin.
            joints: positions at rest [rad or m], shape (J,).
        """
        import torch

        v, where = self._views, rows[:, None]
        turn = matrix_of(self._slopes)
        position = self._middle + (turn @ (position - self._middle)[:, :, None])[:, :, 0]
        quaternion = multiply(self._slopes, quaternion)
        centre = position + matrix_of(quaternion) @ v.reference
        turn = torch.roll(quaternion, 1, 1)
        whole = torch.cat((centre, turn, joints.expand(self.count, -1)), dim=1)
        speed = torch.cat((velocity, torch.zeros_like(v.velocity[:, 3:])), dim=1)
        v.position.copy_(torch.where(where, whole, v.position))
        v.velocity.copy_(torch.where(where, speed, v.velocity))
        start = joints.expand(self.count, -1)
        for kept, value in ((self.held, start), (self.command, start)):
            kept.copy_(torch.where(where, value, kept))
        for kept in (v.guess, self.time, self.work, self.slid, self.stands, self.submersion):
            kept.masked_fill_(where, 0.0)
        for kept in self._memory.values():
            kept.masked_fill_(rows.repeat(len(kept) // self.count)[:, None], 0.0)

    def base(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return origin, rotation, velocity of the origin (world) and spin (body axes) of the base.

        Shapes (B, 3), (B, 3, 3), (B, 3), (B, 3).
        """
        import torch

        v = self._views
        turn = matrix_of(torch.roll(v.position[:, 3:7], -1, 1))
        arm = turn @ v.reference
        spin = v.velocity[:, 3:6].clone()
        around = torch.linalg.cross((turn @ spin[:, :, None])[:, :, 0], arm)
        return v.position[:, :3] - arm, turn, v.velocity[:, :3] - around, spin

    def joints(self) -> Tensor:
        """Return the joint positions [rad or m], shape (B, J)."""
        found: Tensor = self._views.position[:, self._views.joints]
        return found

    def normals(self) -> Tensor:
        """Return the normal forces on all links in the last step [N], shape (B, L)."""
        return self._views.normals()

    def overflowing(self) -> bool:
        """Return whether contacts or constraints were left out for want of room in any world."""
        return bool((self._views.left_out & self._views.room).any())

    def snapshot(self) -> dict[str, Any]:
        """Return the complete state, as tensors."""
        engine = {name: getattr(self._views, name).clone() for name in KEPT}
        own = {name: getattr(self, name).clone() for name in OWN}
        return {**engine, **own, "memory": {k: x.clone() for k, x in self._memory.items()}}

    def restore(self, kept: dict[str, Any]) -> None:
        """Restore a snapshot."""
        for name in KEPT:
            getattr(self._views, name).copy_(kept[name])
        for name in OWN:
            getattr(self, name).copy_(kept[name])
        for name, value in self._memory.items():
            value.copy_(kept["memory"][name])
