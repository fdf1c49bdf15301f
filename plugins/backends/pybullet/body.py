"""One robot in PyBullet: loading, reading, half-step velocities, forces."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Configuration, Dynamics, LinkPoses
from seals.errors import PhysicsError
from seals.frames import conjugate, matrix_of, multiply
from seals.plugins.backends.pybullet.inertia import InertiaSplit
from seals.plugins.backends.pybullet.loading import load_robot
from seals.plugins.backends.pybullet.motors import StandingMotors
from seals.plugins.backends.pybullet.posing import Posing, turned
from seals.plugins.backends.pybullet.servo import Felt, JointServo
from seals.plugins.backends.pybullet.touches import Touches
from seals.robot.model import RobotModel

FASTEST = 99.0
"""Speed above which motion is refused [m/s, rad/s]; the engine clamps silently at 100."""

_NOTHING = [0.0, 0.0, 0.0]


class _Step(NamedTuple):
    """Native generalised velocities: of the base's centre of mass, world axes, and of the joints.

    Args:
        now: at the current time, as the engine holds it, shape (n,).
        middle: half a step earlier, shape (n,); None after a start or a contact.
        joints: positions of the joints, shape (J,).
    """

    now: Floats
    middle: Floats | None
    joints: Floats


class PybulletBody:
    """A robot in the scene; it takes joint drives implicitly.

    Args:
        engine: the pybullet module.
        client: physics client.
        robot: what to load.
        second_order: whether to move the pose with the velocity at the middle of a step.
    """

    implicit = True

    def __init__(self, engine: Any, client: int, robot: RobotModel, *, second_order: bool) -> None:
        """Load the robot."""
        self._p, self._client, self.robot = engine, client, robot
        self._second_order = second_order
        loaded = load_robot(engine, client, robot)
        self.body, self._index = loaded.body, loaded.index
        self._joints = loaded.joints
        self._posing = Posing(engine, client, robot.tree, loaded)
        self._order, self._back = loaded.order.tolist(), np.argsort(loaded.order).tolist()
        self._com, self._com_turn = loaded.base_centre, loaded.base_turn
        self._split = InertiaSplit(engine, client, robot, loaded)
        self._servo = JointServo(engine, client, robot, loaded)
        self._motors = StandingMotors(engine, client, loaded, self._engine_order)
        self._feet = frozenset(leg.foot for leg in robot.legs.values())
        self._given = np.zeros(robot.tree.joints)
        self._base = 0 if robot.tree.fixed_base else 6
        self._limits = np.isfinite(robot.lower).any() or np.isfinite(robot.upper).any()
        self._touches = Touches(loaded.index)
        lower, upper = (robot.lower + 1e-6).tolist(), (robot.upper - 1e-6).tolist()
        self._stops = list(zip(lower, upper, strict=True))
        self._began = np.zeros((len(robot.links), 3)), np.tile(np.eye(3), (len(robot.links), 1, 1))
        still = np.zeros(robot.degrees)
        self._step = _Step(still, None, np.zeros(robot.tree.joints))
        self._turned = bool(np.any(self._com_turn[0, :3]))
        self._centred = not np.any(self._com)

    def reset(self, configuration: Configuration) -> None:
        """Place the robot."""
        c = configuration._replace(joints=np.asarray(configuration.joints, dtype=float))
        turn = matrix_of(np.asarray(c.quaternion, dtype=float)[None])[0]
        native = np.concatenate([c.velocity + np.cross(c.spin, turn @ self._com), c.spin, c.rates])
        if self._base == 0:
            native = np.asarray(c.rates, dtype=float)
        self._set_pose(
            np.asarray(c.position, dtype=float), np.asarray(c.quaternion, dtype=float), c.joints
        )
        self._set_velocity(native, c.joints)
        self._step = _Step(native, None, c.joints)
        self._touches.forget()
        self._motors.rest()
        self._servo.restore(None)

    def read(self) -> Configuration:
        """Return where the robot is and how it moves."""
        position, quaternion = self._com_pose()
        turn = matrix_of(quaternion[None])[0]
        position = position - turn @ self._com
        now, joints = self._step.now, self._step.joints
        if self._base == 0:
            return Configuration(position, quaternion, np.zeros(3), np.zeros(3), joints, now)
        return Configuration(
            position, quaternion, self._speed(now, turn)[:3], now[3:6], joints, now[6:]
        )

    def poses(self) -> LinkPoses:
        """Return the poses of all links and the generalised velocity."""
        origins, rotations = self._posing.read()
        return LinkPoses(
            origins[None], rotations[None], self._speed(self._step.now, rotations[0])[None]
        )

    def middle_speed(self) -> Floats | None:
        """Return the generalised velocity at the middle of the last step, shape (1, n).

        None after a start or a contact: the velocity is then the same at both instants.
        """
        if self._step.middle is None:
            return None
        if self._base == 0 or self._centred:
            return self._step.middle[None]
        return self._speed(self._step.middle, self._posing.read()[1][0])[None]

    def _speed(self, native: Floats, turn: Floats) -> Floats:
        """Generalised velocity about the base origin from native velocities."""
        if self._base == 0 or self._centred:
            return native
        speed: Floats = native.copy()
        (a, b, c), (x, y, z) = native[3:6].tolist(), (turn @ self._com).tolist()
        speed[:3] -= (b * z - c * y, c * x - a * z, a * y - b * x)
        return speed

    def joint_positions(self) -> Floats:
        """Return the joint coordinates [rad or m], shape (J,)."""
        return self._step.joints

    def joint_forces(self) -> Floats:
        """Return the forces on the joints over the last step [N m or N], shape (J,)."""
        return self._given + self._motors.forces

    def snapshot(self) -> Any:
        """Return what the engine does not keep."""
        kept = self._split.snapshot(), self._servo.snapshot(), self._motors.snapshot()
        return self._step, self._touches.snapshot(), self._given, kept

    def restore(self, kept: Any) -> None:
        """Put back what the engine does not keep."""
        self._step, touches, self._given, (inertia, servo, motors) = kept
        self._servo.restore(servo)
        self._motors.restore(motors)
        self._touches.restore(touches)
        self._split.restore(inertia)

    def apply(self, dynamics: Dynamics, step: float) -> None:
        """Set forces and joint torques for the next step."""
        standing = self._stands(dynamics, step)
        wrench, joint_force = (self._pushed if standing else self._effort)(dynamics, step)
        rotations, origins = dynamics.kinematics.rotations[0], dynamics.kinematics.origins[0]
        self._began = origins, rotations
        # rows force and torque of every link, turned into the world at once
        both = np.matmul(wrench.reshape(-1, 2, 3), rotations.transpose(0, 2, 1)).tolist()
        points = origins.tolist()
        p, frame, client = self._p, self._p.WORLD_FRAME, self._client
        push, twist = p.applyExternalForce, p.applyExternalTorque
        for k, link in enumerate(self._index):
            if k == 0 and self._base == 0:
                continue
            force, torque = both[k]
            # a frame of sensors weighs nothing: a call costs more than looking
            if force != _NOTHING:
                push(self.body, link, force, points[k], frame, physicsClientId=client)
            if torque != _NOTHING:
                twist(self.body, link, torque, frame, physicsClientId=client)
        if standing:
            self._motors.drive(dynamics, step)
        elif self._feet:
            self._motors.rest()
        if self._joints and (not standing or joint_force.any()):
            p.setJointMotorControlArray(
                self.body,
                self._joints,
                p.TORQUE_CONTROL,
                forces=self._engine_order(joint_force),
                physicsClientId=client,
            )

    def _effort(self, dynamics: Dynamics, step: float) -> tuple[Floats, Floats]:
        """Wrenches on the links and forces on the joints that the engine's step needs."""
        last = self._step
        smooth = (
            None if last.middle is None else 2.0 * (last.now - last.middle)[self._base :] / step
        )
        acting = self._servo.taken(dynamics, step, smooth)
        if dynamics.found.inertias or dynamics.sudden:
            contact = self._touches.wrenches() if self._touches.any else None
            wrench, joint_force = self._split.act(dynamics, contact, acting)
        else:
            wrench, joint_force = dynamics.wrench[0], dynamics.joint_force[0]
            if acting is not None:
                found = self._servo.forces(dynamics, acting, last.joints)
                joint_force = self._split.joint_forces(dynamics, acting) if found is None else found
        self._given = joint_force
        return wrench, joint_force

    def _stands(self, dynamics: Dynamics, step: float) -> bool:
        """Whether a leg of the robot touches something, or did so a moment ago."""
        if not self._feet or dynamics.joint_drive is None:
            return False
        return self._motors.wanted(not self._feet.isdisjoint(self._touches.links), step)

    def _pushed(self, dynamics: Dynamics, step: float) -> tuple[Floats, Floats]:
        """Wrenches on the links and forces on the joints beside those of the motors."""
        # what the motors did is not what the joints feel when they are off
        self._servo.felt = None
        outer: Floats = dynamics.joint_force[0]
        self._given = outer
        if self._split.idle(dynamics):
            return dynamics.wrench[0], outer
        known = dynamics._replace(joint_force=(outer + self._motors.forces)[None])
        return self._split.act(known, self._touches.wrenches(), None)[0], outer

    def after_step(self, step: float) -> None:
        """Find the velocity at the new time and move the pose as the middle velocity does.

        The engine moved the pose with the velocity after the kick, a step of first order. The
        middle velocity, half a kick earlier, makes it one of second order (leapfrog); the velocity
        at the new time is the middle one and half of the last kick.
        """
        raw, joints = self._raw()
        # written so that a motion that is not a number is looked at as well
        if not raw @ raw <= FASTEST**2:
            self._refuse_speed(float(np.abs(raw).max()))
        before, kick = self._step, raw - self._step.now
        if self._joints and not self._motors.running:
            self._servo.felt = Felt(kick[self._base :] / step, self._given)
        points = self._p.getContactPoints(bodyA=self.body, physicsClientId=self._client)
        self._touches.note(points, self._began)
        plain = self._touches.any or self._motors.running
        if not self._second_order or plain or self._at_stop(joints):
            self._step = _Step(raw, None, joints)
            return
        half = 0.5 * kick
        middle = before.now + half if before.middle is None else before.middle + kick
        shift = step * (middle - raw)
        joints = joints + shift[self._base :]
        now = middle + half
        self._place(shift.tolist(), now, joints)
        self._step = _Step(now, middle, joints)

    def _refuse_speed(self, fastest: float) -> None:
        """Refuse a motion that the engine would clamp, or that is not a number."""
        if not fastest <= FASTEST:
            raise PhysicsError(
                f"robot '{self.robot.name}' moves at {fastest:.0f} m/s or rad/s.\n"
                f"Allowed: up to {FASTEST:g}; take a smaller time.step or check forces and masses."
            )

    def _place(self, shift: list[float], now: Floats, joints: Floats) -> None:
        """Move the base by a small displacement [m, rad] and set velocities and joints."""
        p, client = self._p, self._client
        if self._base:
            position, turn = p.getBasePositionAndOrientation(self.body, physicsClientId=client)
            place = [x + d for x, d in zip(position, shift[:3], strict=True)]
            p.resetBasePositionAndOrientation(
                self.body, place, turned(turn, shift[3:6]), physicsClientId=client
            )
        self._set_velocity(now, joints)

    def _at_stop(self, q: Floats) -> bool:
        """Whether a joint stands at a limit."""
        if not self._limits:
            return False
        return any(x <= a or x >= b for x, (a, b) in zip(q.tolist(), self._stops, strict=True))

    def _com_pose(self) -> tuple[Floats, Floats]:
        """Centre of mass of the base, and attitude of the base link's own frame.

        The engine reports the attitude of the principal axes.
        """
        position, turn = self._p.getBasePositionAndOrientation(
            self.body, physicsClientId=self._client
        )
        quaternion = np.array(turn)
        if self._turned:
            quaternion = multiply(quaternion[None], self._com_turn)[0]
        return np.array(position), quaternion

    def _set_pose(self, position: Floats, quaternion: Floats, joints: Floats) -> None:
        rotation = matrix_of(quaternion[None])[0]
        turn = multiply(quaternion[None], conjugate(self._com_turn))[0]
        self._p.resetBasePositionAndOrientation(
            self.body,
            (position + rotation @ self._com).tolist(),
            turn.tolist(),
            physicsClientId=self._client,
        )

    def _set_velocity(self, native: Floats, joints: Floats) -> None:
        if self._base:
            self._p.resetBaseVelocity(
                self.body, native[:3].tolist(), native[3:6].tolist(), physicsClientId=self._client
            )
        if self._joints:
            self._p.resetJointStatesMultiDof(
                self.body,
                self._joints,
                [[q] for q in self._engine_order(joints)],
                [[v] for v in self._engine_order(native[self._base :])],
                physicsClientId=self._client,
            )

    def _engine_order(self, values: Floats) -> list[float]:
        """Values of the joints in the engine's order."""
        given = values.tolist()
        return [given[k] for k in self._order]

    def _raw(self) -> tuple[Floats, Floats]:
        """Native velocities that the engine holds, and joint positions."""
        velocity: list[float] = []
        joints: list[float] = []
        if self._base:
            linear, spin = self._p.getBaseVelocity(self.body, physicsClientId=self._client)
            velocity += linear + spin
        if self._joints:
            states = self._p.getJointStates(self.body, self._joints, physicsClientId=self._client)
            joints += [states[k][0] for k in self._back]
            velocity += [states[k][1] for k in self._back]
            self._motors.hear(states)
        return np.array(velocity), np.array(joints)

    def contact_wrenches(self) -> Floats:
        """Return the contact wrenches of the last step, shape (L, 6).

        They act about the link origins and are given in link axes [N, N m].
        """
        return self._touches.wrenches()

    def contact_normals(self) -> Floats:
        """Return the sum of the normal forces on every link in the last step [N], shape (L,)."""
        return self._touches.normals()
