"""One robot of an engine, with added mass, implicit joint drives and second-order steps."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.backend import BodyOptions, Configuration, Dynamics, LinkPoses
from seals.coupling.contacts import Contacts
from seals.coupling.engine import EngineBody
from seals.coupling.implicit_drive import ImplicitDrives
from seals.coupling.inertia_split import InertiaSplit
from seals.coupling.leapfrog import HalfStep
from seals.coupling.motors import StandingMotors
from seals.coupling.servo import JointResponse, JointServo
from seals.errors import PhysicsError
from seals.frames import matrix_of
from seals.robot.model import RobotModel


class CoupledBody(BodyOptions):
    """A robot in an engine's scene; it takes joint drives implicitly.

    Its backend makes one for every robot that is added, and has three duties: after every step of
    the engine it calls `after_step` of every body, without which velocities and joint positions
    stay those of `reset`; its snapshot holds `snapshot` of every body beside the engine's state;
    and restoring puts back the engine's state first, then calls `restore` of every body. The order
    of the engine's calls is in `seals.coupling.engine`.

    Args:
        engine: the robot in the engine.
        robot: its model.
        second_order: whether to move the pose with the velocity at the middle of a step.
    """

    implicit: ClassVar[bool] = True

    def __init__(self, engine: EngineBody, robot: RobotModel, *, second_order: bool) -> None:
        """Start at rest."""
        self.engine, self.robot, self._second_order = engine, robot, second_order
        joints = robot.tree.joints
        self._base = 0 if robot.tree.fixed_base else 6
        self._split = InertiaSplit(engine, robot)
        self._drives = ImplicitDrives(self._base)
        self._servo = JointServo(engine, self._base)
        self._motors = StandingMotors(engine, joints)
        self._feet = frozenset(leg.foot for leg in robot.legs.values())
        if not engine.contact_motors:
            self._feet = frozenset()
        self._given = np.zeros(joints)
        self._limits = np.isfinite(robot.lower).any() or np.isfinite(robot.upper).any()
        self._contacts = Contacts(len(robot.links))
        lower, upper = (robot.lower + 1e-6).tolist(), (robot.upper - 1e-6).tolist()
        self._stops = list(zip(lower, upper, strict=True))
        self._began = np.zeros((len(robot.links), 3)), np.tile(np.eye(3), (len(robot.links), 1, 1))
        self._speed = HalfStep(np.zeros(robot.degrees))
        self._joints = np.zeros(joints)
        self._centred = not np.any(engine.reference)

    def reset(self, configuration: Configuration) -> None:
        """Place the robot."""
        c = configuration._replace(joints=np.asarray(configuration.joints, dtype=float))
        quaternion = np.asarray(c.quaternion, dtype=float)
        arm = matrix_of(quaternion[None])[0] @ self.engine.reference
        native = np.concatenate(
            [c.velocity + np.cross(c.angular_velocity, arm), c.angular_velocity, c.joint_velocity]
        )
        if self._base == 0:
            native = np.asarray(c.joint_velocity, dtype=float)
        self.engine.place(np.asarray(c.position, dtype=float), quaternion)
        self.engine.set_velocity(native, c.joints)
        self._speed, self._joints = HalfStep(native), c.joints
        self._contacts.forget()
        self._motors.rest()
        self._servo.restore(None)

    def read(self) -> Configuration:
        """Return where the robot is and how it moves."""
        position, quaternion = self.engine.base_pose()
        now, joints = self._speed.now, self._joints
        if self._base == 0:
            return Configuration(position, quaternion, np.zeros(3), np.zeros(3), joints, now)
        turn = matrix_of(quaternion[None])[0]
        return Configuration(
            position, quaternion, self._at_origin(now, turn)[:3], now[3:6], joints, now[6:]
        )

    def poses(self) -> LinkPoses:
        """Return the poses of all links and the generalised velocity."""
        origins, rotations = self.engine.link_poses()
        speed = self._at_origin(self._speed.now, rotations[0])
        return LinkPoses(origins[None], rotations[None], speed[None])

    def middle_speed(self) -> Floats | None:
        """Return the generalised velocity at the middle of the last step, shape (1, n).

        None after a start or a contact: the velocity is then the same at both instants.
        """
        middle = self._speed.middle
        if middle is None:
            return None
        if self._base == 0 or self._centred:
            return middle[None]
        return self._at_origin(middle, self.engine.link_poses()[1][0])[None]

    def _at_origin(self, native: Floats, turn: Floats) -> Floats:
        """Generalised velocity about the base origin from the engine's."""
        if self._base == 0 or self._centred:
            return native
        speed: Floats = native.copy()
        (a, b, c), (x, y, z) = native[3:6].tolist(), (turn @ self.engine.reference).tolist()
        speed[:3] -= (b * z - c * y, c * x - a * z, a * y - b * x)
        return speed

    def joint_positions(self) -> Floats:
        """Return the joint coordinates [rad or m], shape (J,)."""
        return self._joints

    def joint_forces(self) -> Floats:
        """Return the forces on the joints over the last step [N m or N], shape (J,)."""
        return self._given + self._motors.forces

    def contact_wrenches(self) -> Floats:
        """Return the contact wrenches of the last step, shape (L, 6).

        They act about the link origins and are given in link axes [N, N m].
        """
        return self._contacts.wrenches()

    def contact_normals(self) -> Floats:
        """Return the sum of the normal forces on every link in the last step [N], shape (L,)."""
        return self._contacts.normals()

    def snapshot(self) -> Any:
        """Return what the engine does not keep: a part of the backend's snapshot."""
        kept = self._split.snapshot(), self._servo.snapshot(), self._motors.snapshot()
        return (self._speed, self._joints), self._contacts.snapshot(), self._given, kept

    def restore(self, kept: Any) -> None:
        """Put back what the engine does not keep, after the engine's own state.

        It sets masses and motors of the engine where they differ.
        """
        (self._speed, self._joints), contacts, self._given, (inertia, servo, motors) = kept
        self._servo.restore(servo)
        self._motors.restore(motors)
        self._contacts.restore(contacts)
        self._split.restore(inertia)

    def apply(self, dynamics: Dynamics, step: float) -> None:
        """Set forces and joint torques for the next step; called once before each step."""
        standing = self._stands(dynamics, step)
        wrench, joint_force = (self._pushed if standing else self._effort)(dynamics, step)
        rotations, origins = dynamics.kinematics.rotations[0], dynamics.kinematics.origins[0]
        self._began = origins, rotations
        self.engine.apply_wrenches(wrench, origins, rotations)
        if standing:
            self._motors.drive(dynamics, step)
        elif self._feet:
            self._motors.rest()
        if self._joints.size and (not standing or joint_force.any()):
            self.engine.apply_joint_forces(joint_force)

    def _effort(self, dynamics: Dynamics, step: float) -> tuple[Floats, Floats]:
        """Wrenches on the links and forces on the joints that the engine's step needs."""
        smooth = self._speed.acceleration(step)
        last = None if smooth is None else smooth[self._base :]
        acting = self._drives.over_step(dynamics, step, last)
        if dynamics.found.inertias or dynamics.discontinuous:
            contact = self._contacts.wrenches() if self._contacts.any else None
            wrench, joint_force = self._split.act(dynamics, contact, acting)
        else:
            wrench, joint_force = dynamics.wrench[0], dynamics.joint_force[0]
            if acting is not None:
                found = self._servo.forces(dynamics, acting, self._joints)
                joint_force = self._split.joint_forces(dynamics, acting) if found is None else found
        self._given = joint_force
        return wrench, joint_force

    def _stands(self, dynamics: Dynamics, step: float) -> bool:
        """Return whether a leg of the robot touches something, or did so a moment ago."""
        if not self._feet or dynamics.joint_drive is None:
            return False
        return self._motors.wanted(not self._feet.isdisjoint(self._contacts.links), step)

    def _pushed(self, dynamics: Dynamics, step: float) -> tuple[Floats, Floats]:
        """Wrenches on the links and forces on the joints beside those of the motors."""
        # what the motors did is not what the joints feel when they are off
        self._servo.response = None
        outer: Floats = dynamics.joint_force[0]
        self._given = outer
        if self._split.idle(dynamics):
            return dynamics.wrench[0], outer
        known = dynamics._replace(joint_force=(outer + self._motors.forces)[None])
        return self._split.act(known, self._contacts.wrenches(), None)[0], outer

    def after_step(self, step: float) -> None:
        """Find the velocity at the new time and move the pose as the middle velocity does.

        The backend calls it once for every robot after each step of the engine.

        The engine moved the pose with the velocity after the kick, a step of first order. The
        middle velocity, half a kick earlier, makes it one of second order (leapfrog); the velocity
        at the new time is the middle one and half of the last kick.

        Args:
            step: h [s].

        Raises:
            PhysicsError: the motion is faster than the engine can follow, or not finite.
        """
        raw, joints = self.engine.state()
        self._motors.measure()
        # written so that a motion that is not a number is looked at as well
        if not raw @ raw <= self.engine.top_speed**2:
            self._refuse_speed(float(np.abs(raw).max()))
        kick = raw - self._speed.now
        if joints.size and not self._motors.running:
            self._servo.response = JointResponse(kick[self._base :] / step, self._given)
        self._contacts.note(self.engine.contacts(), self._began)
        plain = self._contacts.any or self._motors.running
        if not self._second_order or plain or self._at_stop(joints):
            self._speed, self._joints = HalfStep(raw), joints
            return
        self._speed = self._speed.kicked(kick)
        middle = self._speed.middle
        assert middle is not None
        shift = step * (middle - raw)
        self._joints = joints + shift[self._base :]
        if self._base:
            self.engine.shift_base(shift[:6])
        self.engine.set_velocity(self._speed.now, self._joints)

    def _refuse_speed(self, fastest: float) -> None:
        """Refuse a motion that the engine would clamp, or that is not a number."""
        if not fastest <= self.engine.top_speed:
            raise PhysicsError(
                f"robot '{self.robot.name}' moves at {fastest:.0f} m/s or rad/s.\n"
                f"Allowed: up to {self.engine.top_speed:g}; "
                "take a smaller time.step or check forces and masses."
            )

    def _at_stop(self, q: Floats) -> bool:
        """Return whether a joint stands at a limit."""
        if not self._limits:
            return False
        return any(x <= a or x >= b for x, (a, b) in zip(q.tolist(), self._stops, strict=True))
