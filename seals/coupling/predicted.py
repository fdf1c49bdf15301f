"""Loads for an engine that takes masses and motors only; other terms act as predicted wrenches."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, Floats
from seals.backend import Dynamics, LinksAt
from seals.coupling.contacts import Contacts
from seals.coupling.engine import EngineBody, generalised
from seals.coupling.implicit_drive import ImplicitDrive
from seals.coupling.inertia_split import InertiaSplit
from seals.coupling.joint_stops import JointStops
from seals.coupling.motors import StandingMotors
from seals.coupling.servo import JointResponse, JointServo
from seals.robot.model import RobotModel


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
        standing = self._stands(dynamics, step, contacts)
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

    def _stands(self, dynamics: Dynamics, step: float, contacts: Contacts) -> bool:
        """Return whether a leg of the robot is in contact, or was a moment ago."""
        if not self._feet or dynamics.joint_drive is None:
            return False
        return self._touch(step, contacts)

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
