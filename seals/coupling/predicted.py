"""Loads for an engine that takes masses and motors only; other terms act as predicted wrenches.

An engine knows a joint drive as a torque that it holds over a step. A servo on a light link is
stiffer than that: its torque must be the one that belongs to the motion of the step itself
(`JointServo`). The motion is predicted with the inertia that the joints feel (the base free) and
with every other force, contacts and stops included, as it was in the last step.

Contact forces of the last step lag behind, on a leg of a gram by many steps, and a body on lagging
springs swings up. The drives of standing legs are therefore motors of the engine
(`StandingMotors`), which it solves together with the contacts of the step itself. Their largest
force is the drive's, their speed the one at which the drive's force would vanish: under load a
motor gives the drive's force, and a light leg that nothing holds moves as the drive lets it, at any
gain.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.backend import Dynamics, LinksAt
from seals.coupling.engine import (
    CompiledMasses,
    Contacts,
    EngineBody,
    ImplicitDrive,
    generalised,
)
from seals.coupling.inertia_split import InertiaSplit, JointStops
from seals.multibody.linear import solved
from seals.multibody.servo import driven, heavier
from seals.robot.model import RobotModel
from seals.state_records import state_record

STALE = 0.03
"""Motion of a joint after which the inertia is found anew [rad or m].

The inertia shapes the difference to the last step alone: a share of it does not matter.
"""


@state_record
class JointResponse(NamedTuple):
    """Motion of the joints in the last step.

    Args:
        change: their acceleration [rad/s^2 or m/s^2], shape (J,).
        given: force handed to the engine [N m or N], shape (J,).
    """

    change: Floats
    given: Floats


class JointServo:
    """Conversion of joint drives to torques that are constant over a step.

    Args:
        engine: the robot in the engine.
        lead: coordinates before those of the joints: 6, or 0 for a fixed base.

    Attributes:
        response: of the joints in the last step; None when it is not known.
    """

    def __init__(self, engine: EngineBody, lead: int) -> None:
        self._engine, self._lead = engine, lead
        self.response: JointResponse | None = None
        self._known: tuple[Floats, Floats] | None = None

    def snapshot(self) -> Any:
        """Return the joints' response and the inertia in use, both immutable."""
        return self.response, self._known

    def restore(self, kept: Any) -> None:
        """Restore a snapshot; None clears the state."""
        self.response, self._known = (None, None) if kept is None else kept

    def inertia(self, joints: Floats) -> Floats:
        """Return the joint-space inertia with a free base, shape (J, J).

        It is kept until a joint has moved by `STALE`.

        Args:
            joints: positions [rad or m], shape (J,).
        """
        if self._known is not None:
            pairs = zip(joints.tolist(), self._known[0].tolist(), strict=True)
            if max(abs(now - then) for now, then in pairs) <= STALE:
                return self._known[1]
        whole, lead = self._engine.mass_matrix(joints), self._lead
        found = whole[lead:, lead:]
        if lead:
            across = whole[:lead, lead:]
            found = found - across.T @ solved(whole[:lead, :lead], across)
        self._known = joints, found
        return found

    def forces(self, dynamics: Dynamics, acting: ImplicitDrive, joints: Floats) -> Floats | None:
        """Return the forces to hand to the engine, shape (J,); None when the last step is unknown.

        Args:
            dynamics: of the robot at the current time.
            acting: the drives.
            joints: positions [rad or m], shape (J,).
        """
        if self.response is None:
            return None
        inertia, drive, outer = self.inertia(joints), acting.drive, dynamics.joint_force[0]
        right = inertia @ self.response.change - self.response.given + outer
        whole = inertia + np.diag(acting.armature + acting.gain[0])
        change = solved(whole, right + drive.force[0])
        pull = drive.force[0] - acting.gain[0] * change
        if np.count_nonzero(np.abs(pull) > drive.limit):
            matrix = heavier(inertia[None], acting.armature[None])
            both = driven(matrix, right[None], drive, acting.gain)
            change, pull = both[0][0], both[1][0]
        given: Floats = outer + pull - acting.armature * change
        return given


LEAP = 0.2
"""Time in the air for which the motors go on [s]: a leap, no free flight."""


class StandingMotors:
    """Velocity motors of all joints of one robot, active while its feet are in contact.

    Args:
        engine: the robot in the engine.
        joints: number of joints.

    Attributes:
        running: whether the motors are on.
        forces: of the motors over the last step [N m or N], shape (J,).
    """

    def __init__(self, engine: EngineBody, joints: int) -> None:
        self._engine = engine
        self._none = np.zeros(joints)
        self.running, self.forces = False, self._none
        self._idle = 0.0

    def wanted(self, touching: bool, step: float) -> bool:
        """Return whether the motors are active: with feet in contact, and in short flight phases.

        Args:
            touching: whether a foot touched something in the last step.
            step: h [s].
        """
        self._idle = 0.0 if touching else self._idle + step
        return touching or (self.running and self._idle < LEAP)

    def drive(self, dynamics: Dynamics, step: float) -> None:
        """Set the motors of the next step from the joint drive.

        Equation:
            f the drive's force; largest force of the motor min(|f|, limit), its speed
            v + f / (kd + h kp), not beyond the largest speed of the joint.

        Args:
            dynamics: of the robot at the current time; with a joint drive.
            step: h [s].
        """
        self.set(*self.targets(dynamics, step))

    def targets(self, dynamics: Dynamics, step: float) -> tuple[Array, Array]:
        """Return speeds [rad/s or m/s] and largest forces [N m or N], shape (J,); pure."""
        drive = dynamics.joint_drive
        assert drive is not None
        xp = namespace(drive.force)
        rates = dynamics.moving.speed[0, -drive.force.shape[1] :]
        force, fastest = drive.force[0], self._engine.joint_speed_limit
        slope = xp.maximum(drive.damping + step * drive.stiffness, 1e-12)
        speed = (rates + force / slope).reshape(-1)
        speed = xp.minimum(xp.maximum(speed, -fastest), fastest)
        return speed, xp.minimum(xp.abs(force), drive.limit).reshape(-1)

    def set(self, speed: Floats, force: Floats) -> None:
        """Set the motors of the next step, see `targets`."""
        self._engine.set_motors(speed, force)
        self.running = True

    def measure(self) -> None:
        """Record the motor forces after a step."""
        if self.running:
            self.forces = self._engine.motor_forces()

    def rest(self) -> None:
        """Switch the motors off."""
        if self.running:
            self._engine.set_motors(self._none, self._none)
            self.running, self.forces = False, self._none

    def snapshot(self) -> Any:
        """Return whether the motors are active, and their forces."""
        return self.running, self.forces, self._idle

    def restore(self, kept: Any) -> None:
        """Restore a snapshot; the engine's motors are set before the next step."""
        # the engine may hold motors that ran when the snapshot was put back
        ran, (self.running, self.forces, self._idle) = self.running, kept
        if ran and not self.running:
            self._engine.set_motors(self._none, self._none)


class PredictedForces:
    """Loads of one robot: added inertia as masses and wrenches, joint drives as torques or motors.

    Args:
        engine: the robot in the engine.
        robot: its model.
    """

    def __init__(self, engine: EngineBody, robot: RobotModel) -> None:
        self._engine: Any = engine
        self._inertial = False
        joints = robot.tree.joints
        self._lead = 0 if robot.tree.fixed_base else 6
        self._split = InertiaSplit(engine, robot)
        self._servo = JointServo(engine, self._lead)
        self._stops = JointStops(robot.lower, robot.upper, engine.stops_taken_back)
        self._motors = StandingMotors(engine, joints)
        self._feet = frozenset(leg.foot for leg in robot.legs.values())
        if not engine.contact_motors:
            self._feet = frozenset()
        self._given = np.zeros(joints)

    def compile(self, *, inertial: bool) -> None:
        """Prepare for `compiled_law`.

        Args:
            inertial: whether effects add inertia.
        """
        self._inertial = inertial

    @property
    def foretells(self) -> bool:
        """Whether loads are made from accelerations, which limits of joints then must be in."""
        return self._inertial

    @property
    def running(self) -> bool:
        """Return whether motors of the engine are active."""
        return self._motors.running

    def forget(self) -> None:
        """Forget the last step."""
        self._motors.rest()
        self._servo.restore(None)

    def joint_forces(self) -> Floats:
        """Return the forces on the joints over the last step [N m or N], shape (J,)."""
        return self._given + self._motors.forces

    def apply(
        self,
        engine: Any,
        dynamics: Dynamics,
        step: float,
        *,
        acting: ImplicitDrive | None,
        contacts: Contacts,
        joints: Floats,
    ) -> None:
        """Pass wrenches, motors and joint forces of the next step to the engine.

        Args:
            engine: the robot in the engine.
            dynamics: of the robot at the current time.
            step: h [s].
            acting: the joint drives over the step; None for none.
            contacts: of the last step.
            joints: positions [rad or m], shape (J,).
        """
        driven = bool(self._feet) and dynamics.joint_drive is not None
        # whether a leg of the robot is in contact, or was a moment ago
        standing = driven and self._touch(step, contacts)
        if standing:
            wrench, joint_force = self._pushed(dynamics, contacts)
        else:
            wrench, joint_force = self._effort(dynamics, acting, contacts, joints, step)
        kinematics = dynamics.kinematics
        engine.apply_wrenches(wrench, kinematics.origins[0], kinematics.rotations[0])
        if standing:
            self._motors.drive(dynamics, step)
        elif self._feet:
            self._motors.rest()
        if joints.size and (not standing or joint_force.any()):
            engine.apply_joint_forces(joint_force)

    def compiled_form(self, step: float, *, driven: bool, contacts: Contacts) -> str | None:
        """Return how the loads of the next step are computed: ``stand``, ``full`` or ``plain``.

        None for a robot without added inertia whose drives are predicted from the last step.
        """
        if self._feet and driven and self._touch(step, contacts):
            return "stand"
        if self._inertial:
            return "full"
        return None if driven else "plain"

    def compiled_arguments(self, contacts: Contacts) -> tuple[Floats, ...]:
        """Return contact wrenches, motor forces and the isotropic part in the engine's inertia."""
        return contacts.wrenches(), self._motors.forces, self._split.isotropic

    def compiled_law(  # noqa: PLR0917  in the order of `compiled_arguments`
        self,
        form: str,
        dynamics: Dynamics,
        step: float,
        acting: ImplicitDrive | None,
        contact: Array,
        motors: Array,
        isotropic: Array,
    ) -> list[Array]:
        """Return generalised force (n,), joint forces (J,), isotropic part, motors; pure."""
        d = dynamics
        wrench, joint_force = d.wrench[0], d.joint_force[0]
        engine, wanted = self._split.traced(d.found, isotropic)
        if form == "stand" and self._inertial:
            known = d._replace(joint_force=(joint_force + motors)[None])
            wrench = self._split.law(known, contact, None, engine)[0]
        elif form == "full":
            wrench, joint_force, _ = self._split.law(d, contact, acting, engine)
        found = [generalised(d.kinematics.jacobian[0], wrench), joint_force, wanted]
        return [*found, *self._motors.targets(d, step)] if form == "stand" else found

    def give(self, form: str, results: list[Floats], links: LinksAt) -> bool:
        """Pass results of `compiled_law` on; false where the engine's inertia was set anew."""
        force, joint_force, wanted, *motors = results
        if self._inertial and self._split.update(wanted):
            return False
        if form == "stand":
            self._servo.response = None
            self._motors.set(*motors)
        elif self._feet:
            self._motors.rest()
        self._given = joint_force
        self._engine.apply_generalised(force, joint_force, links.kinematics.origins[0, 0])
        return True

    def steps_alone(self) -> bool:
        """Return whether the engine can be stepped by a program now: no motors act."""
        engine = self._engine
        return not self.running and isinstance(engine, CompiledMasses) and engine.alone()

    def write_step(
        self,
        program: Any,
        loads: Sequence[tuple[Any, int]],
        origin: Any,
        beside: Sequence[Any],
        *,
        touching: bool,
    ) -> None:
        """Write a step of the engine, refused where its masses are to be set anew.

        Args:
            program: to write to.
            loads: places of the results of `compiled_law`, with their lengths.
            origin: place of that of the base.
            beside: no other robots: `steps_alone` is False with them.
            touching: False.
        """
        force, joint_force, (place, size) = loads
        wanted = np.zeros_like(self._split.isotropic)
        program.copy(program.memory(wanted), place, size)
        split = self._split if self._inertial else None
        self._engine.write_step(
            program,
            (force, joint_force),
            origin,
            lambda: split is None or not split.changes(wanted),
        )

    def note(self, forces: Floats, kick: Floats, step: float) -> None:
        """Note a step by `write_step`: the forces on the joints, and the change of velocity."""
        self._given = forces
        self.moved(kick, step)

    def measure(self) -> None:
        """Record the motor forces after a step."""
        self._motors.measure()

    def moved(self, kick: Floats, step: float) -> None:
        """Record the joint acceleration of a step [s] with a change of velocity, shape (n,)."""
        if len(kick) > self._lead and not self._motors.running:
            self._servo.response = JointResponse(kick[self._lead :] / step, self._given)

    def snapshot(self) -> Any:
        """Return the state outside the engine."""
        kept = self._split.snapshot(), self._servo.snapshot(), self._motors.snapshot()
        return self._given, kept

    def restore(self, kept: Any) -> None:
        """Restore a snapshot, with the masses and motors of the engine."""
        self._given, (inertia, servo, motors) = kept
        self._servo.restore(servo)
        self._motors.restore(motors)
        self._split.restore(inertia)

    def _effort(
        self,
        dynamics: Dynamics,
        acting: ImplicitDrive | None,
        contacts: Contacts,
        joints: Floats,
        step: float,
    ) -> tuple[Floats, Floats]:
        """Wrenches on the links and forces on the joints for the engine's next step."""
        if dynamics.found.inertias or dynamics.discontinuous:
            contact = contacts.wrenches() if contacts.any else None
            stops = self._stops.near(joints, dynamics.moving.speed[0, self._lead :], step)
            wrench, joint_force = self._split.act(dynamics, contact, acting, stops)
        else:
            wrench, joint_force = dynamics.wrench[0], dynamics.joint_force[0]
            if acting is not None:
                found = self._servo.forces(dynamics, acting, joints)
                joint_force = self._split.joint_forces(dynamics, acting) if found is None else found
        self._given = joint_force
        return wrench, joint_force

    def _touch(self, step: float, contacts: Contacts) -> bool:
        return self._motors.wanted(not self._feet.isdisjoint(contacts.links), step)

    def _pushed(self, dynamics: Dynamics, contacts: Contacts) -> tuple[Floats, Floats]:
        """Wrenches on the links and forces on the joints, without those of the motors."""
        # what the motors did is not what the joints feel when they are off
        self._servo.response = None
        outer: Floats = dynamics.joint_force[0]
        self._given = outer
        if self._split.idle(dynamics):
            return dynamics.wrench[0], outer
        known = dynamics._replace(joint_force=(outer + self._motors.forces)[None])
        return self._split.act(known, contacts.wrenches(), None)[0], outer
