"""Interface of one robot in a rigid-body engine, as the coupling uses it.

Order of calls in one step of the world, from t to t + h:

1. `CoupledBody.apply`: `EngineBody.set_inertia` of the links whose added inertia has changed,
   `mass_matrix` where joint drives need it, `apply_wrenches` once, then `set_motors` while motors
   act and once to switch them off, and `apply_joint_forces` at most once. Of an engine that solves
   added inertia and joint drives itself (`SolvingEngineBody`): `apply_wrenches`, `add_inertia`, and
   for robots with joints `apply_joint_forces` and `drive_joints`, once each.
2. The backend steps the engine once for all robots.
3. `CoupledBody.after_step`, called by the backend: `contacts`, `state`, then `motor_forces` if
   motors act or `drive_forces`; in free motion `shift_base` (not of a fixed base) and
   `set_velocity`. With compiled laws (`CompiledEngineBody`) in free motion `native` and `put`.

Poses may be read between any two steps. `place` and `set_velocity` start an episode.

What passes through it is here as well: joint drives, linear in the acceleration of a step
(`ImplicitDrive`), and the contacts of the last step, whose forces are summed on demand.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.backend import Dynamics, LinksAt
from seals.frames import cross
from seals.motion import JointDrive


class ImplicitDrive(NamedTuple):
    """Joint drive over a step as a function of the acceleration a: force - gain a.

    Args:
        drive: force with the motion that is known already, and limit.
        gain: [kg m^2 or kg], shape (1, J).
        armature: inertia of the drives [kg m^2 or kg], shape (J,).
    """

    drive: JointDrive
    gain: Floats
    armature: Floats


def drive_over(
    dynamics: Dynamics, step: float, last: Floats | None
) -> tuple[Dynamics, ImplicitDrive | None]:
    """Return the dynamics, and the joint drive over a step, linear in the acceleration, or None.

    Equation:
        Between contacts positions and velocities at the middle of the steps alternate (leapfrog):
        force - kp h^2 a / 2 - kd h (a - a_last), of second order and stable at any gain. After a
        start or a contact: the force at the end of the step, force - kp (h v + h^2 a) - kd h a.

        A resistance of the joints, -r v in the joint force, likewise and beside the limits of the
        drives: -r v - r h (a - a_last), or -r (v + h a). The part with a is an armature r h.

    Args:
        dynamics: of the robot at the current time.
        step: h [s].
        last: acceleration of the joints in the last step while nothing touched, shape (J,); None
            after a start or a contact.
    """
    drive, resistance = dynamics.joint_drive, dynamics.found.resistance
    joints = dynamics.joint_force.shape[1]
    if not joints or (drive is None and resistance is None and dynamics.armature is None):
        return dynamics, None
    if drive is None:
        none = dynamics.joint_force * 0.0
        drive = JointDrive(none, none, none, none)
    if last is None:
        rates = dynamics.moving.speed[:, dynamics.moving.speed.shape[1] - joints :]
        share, force = 1.0, drive.force - drive.stiffness * step * rates
    else:
        share, force = 0.5, drive.force + drive.damping * (step * last)
    gain = step * drive.damping + share * step * step * drive.stiffness + np.zeros(joints)
    armature = np.zeros(joints) if dynamics.armature is None else dynamics.armature
    if resistance is not None:
        armature = step * resistance[0] + armature
        if last is not None:
            resisted = dynamics.joint_force + resistance * (step * last)
            dynamics = dynamics._replace(joint_force=resisted)
    late = JointDrive(force, drive.stiffness, drive.damping, drive.limit)
    return dynamics, ImplicitDrive(late, gain, armature)


class ContactPoints(Protocol):
    """Contacts of one robot in one step of an engine; forces are computed on demand.

    They are read until the next call of `EngineBody.contacts`. The coupling takes the points about
    the link origins at the start of the step, where an engine detects contacts.

    Args:
        links: row of the touched link at every contact, M of them.
    """

    @property
    def links(self) -> list[int]:
        """Row of the touched link at every contact."""

    def forces(self) -> tuple[Floats, Floats, Floats]:
        """Return points [m], forces on the link [N], world axes, (M, 3); normal forces [N], (M,).

        A force is the sum of its normal and friction parts.
        """


class EngineMotion(Protocol):
    """Interface common to all engines: motion, forces and contacts of one robot.

    Links and joints are those of the robot model, in its order. The engine's velocity is that of
    one fixed point of the base in world axes [m/s], its angular velocity in world axes [rad/s],
    and the joint velocities [rad/s or m/s], shape (n,); a fixed base has the joint velocities
    alone. The engine itself applies no gravity, no damping and no joint friction.

    Wrenches and joint forces act over one step and are gone after it; masses and motors stay until
    they are set anew. A snapshot of the backend holds the engine's own state: poses, velocities and
    contacts. Masses and motors may be missing in it, for `CoupledBody` sets them anew.

    Args:
        reference: point of the base whose velocity the engine keeps, base axes [m], shape (3,):
            the centre of mass in PyBullet, zero for an engine that takes the link origin.
        top_speed: speed that the engine can follow [m/s, rad/s]; infinite for any.
    """

    reference: Floats
    top_speed: float

    def place(self, position: Floats, quaternion: Floats) -> None:
        """Set the pose of the base link: origin [m], shape (3,), and q_WB_xyzw, shape (4,)."""

    def base_pose(self) -> tuple[Floats, Floats]:
        """Return origin [m], shape (3,), and attitude q_WB_xyzw, shape (4,), of the base link."""

    def link_poses(self) -> tuple[Floats, Floats]:
        """Return origins [m], shape (L, 3), and rotations R_WL, shape (L, 3, 3), of all links."""

    def set_velocity(self, velocity: Floats, joints: Floats) -> None:
        """Set the velocity, shape (n,), and the joint positions [rad or m], shape (J,)."""

    def shift_base(self, displacement: Floats) -> None:
        """Move the base by a small displacement, world axes, shape (6,).

        Args:
            displacement: of ``reference`` [m], then the rotation vector about it [rad]. Velocities
                stay as they are; `set_velocity` follows.
        """

    def state(self) -> tuple[Floats, Floats]:
        """Return the velocity, shape (n,), and the joint positions [rad or m], shape (J,).

        Called at most once after each step of the engine, before `motor_forces`.
        """

    def apply_wrenches(self, wrenches: Floats, origins: Floats, rotations: Floats) -> None:
        """Apply wrenches over the next step; they are held in world axes.

        Args:
            wrenches: about the link origins, link axes [N, N m], shape (L, 6).
            origins: of the links now [m], shape (L, 3).
            rotations: R_WL now, shape (L, 3, 3).
        """

    def apply_joint_forces(self, forces: Floats) -> None:
        """Apply forces on the joints over the next step [N m or N], shape (J,).

        They add to those of the motors. A step without joint forces may go without the call; they
        are zero then.
        """

    def contacts(self) -> ContactPoints | None:
        """Return the contacts of the robot in the last step; None without any."""


class EngineBody(EngineMotion, Protocol):
    """Interface of an engine with scalar link masses and joint motors.

    Args:
        moments: principal moments of inertia of every link about its centre of mass, along the
            engine's own principal axes in its own order, as loaded [kg m^2], shape (L, 3).
        joint_speed_limit: of every joint [rad/s or m/s], shape (J,); infinite for none.
        contact_motors: whether the engine solves joint motors together with its contacts. Without
            them joint drives are predicted on standing robots as on all others.
        stops_taken_back: share of the way beyond a joint's limit that the engine takes back in a
            step [1]; the limit acts from the step on that finds the joint beyond it.
    """

    moments: Floats
    joint_speed_limit: Floats
    contact_motors: bool
    stops_taken_back: float

    def mass_matrix(self, joints: Floats) -> Floats:
        """Return the generalised inertia at joint positions, base first, shape (n, n).

        Only the inertia that the joints feel with the base free is used,
        M_jj - M_jb inv(M_bb) M_bj: any point and any axes of the base will do. Rows of joints are
        those of the model. The state is left as it is.
        """

    def set_inertia(self, link: int, mass: float, moments: Floats) -> None:
        """Set mass [kg] and principal moments [kg m^2], shape (3,), of a link.

        They replace those of the link, about its centre of mass and in the order of ``moments``:
        centre and principal axes stay. Never called for the base of a robot that is fixed.
        """

    def set_motors(self, speed: Floats, force: Floats) -> None:
        """Set joint motors: speeds [rad/s or m/s] and largest forces [N m or N], (J,) each.

        They act until they are set anew; a largest force of zero switches a motor off. Called only
        where ``contact_motors`` is true.
        """

    def motor_forces(self) -> Floats:
        """Return the forces of the joint motors over the last step [N m or N], shape (J,).

        Called after `state`, and only in steps with motors.
        """


@runtime_checkable
class SolvingEngineBody(EngineMotion, Protocol):
    """Interface of an engine that solves added inertia and joint drives with its contacts."""

    def add_inertia(self, inertia: Floats | None) -> None:
        """Add a generalised inertia to the robot's own over the next step; None for none.

        Args:
            inertia: symmetric, of the velocity as `set_velocity` takes it, shape (n, n).
        """

    def drive_joints(self, drive: ImplicitDrive | None) -> None:
        """Set the joint drives of the next step; None for none.

        A drive acts with ``drive.drive.force - drive.gain a`` within its limit, a the acceleration
        of its joint in that step; its armature is inertia of the joint.
        """

    def drive_forces(self) -> Floats:
        """Return the drive forces over the last step [N m or N], shape (J,).

        Their forces less what turns their own armature; zero without drives. Called after `state`.
        """


class CompiledEngineBody(EngineMotion, Protocol):
    """Interface of an engine whose backend offers ``compiled``, see `seals.backend.CompiledBody`.

    Args:
        base_turn: q_xyzw of the base link in the engine's axes of the base, shape (1, 4).
    """

    base_turn: Floats

    def native_pose(self) -> tuple[Floats, Floats]:
        """Return position of ``reference`` [m], (3,), and attitude of the engine's axes, (4,).

        With ``base_turn`` they make `base_pose`.
        """

    def native(self) -> tuple[Floats, ...]:
        """Return the state of the robot in the engine, after `EngineMotion.contacts`."""

    def read_law(self, *native: Array) -> tuple[Array, Array, Array, Array]:
        """Return place and attitude as of `native_pose`, velocity and joints, (1, ...); pure."""

    def write_law(self, place: Array, turn: Array, velocity: Array, joints: Array) -> list[Array]:
        """Return what `put` takes to set a state as of `read_law`; pure."""

    def put(self, *written: Floats) -> None:
        """Set the state of the robot, see `write_law`."""

    def native_places(self) -> list[int]:
        """Return the addresses of the numbers that `native` returns, each side by side."""
        ...

    def write_put(
        self, program: Any, written: Sequence[tuple[Any, int]], forces: tuple[Any, int]
    ) -> tuple[Any, int] | None:
        """Write `put`, see `seals.backend.CompiledBody.write_put`."""
        ...

    def begin_alone(self) -> None:
        """Prepare for steps by `write_step`."""
        ...

    def leave(self) -> None:
        """Take back a step by `write_step` that was refused."""
        ...

    def end_alone(self) -> Floats:
        """Note steps by `write_step`; return the forces on the joints in the last, shape (J,)."""
        ...


@runtime_checkable
class CompiledMasses(CompiledEngineBody, Protocol):
    """The same of an engine with scalar link masses and joint motors, see `EngineBody`."""

    def alone(self) -> bool:
        """Return whether the robot is the only one of the scene."""
        ...

    def write_step(
        self,
        program: Any,
        loads: tuple[tuple[Any, int], tuple[Any, int]],
        origin: Any,
        stays: Callable[[], bool],
    ) -> None:
        """Write a step of the engine, refused where something may touch; Python is called in it.

        Args:
            program: `seals.scalar_compiler.Program`.
            loads: places of the first two arguments of `apply_generalised`, with their lengths.
            origin: place of the third.
            stays: whether the engine's masses may stay as they are.
        """
        ...

    def apply_generalised(self, force: Floats, joint_forces: Floats, origin: Floats) -> None:
        """Apply a generalised force and forces on the joints over the next step.

        One call in place of `apply_wrenches` and `apply_joint_forces`.

        Args:
            force: of the velocity as `set_velocity` takes it, but about ``origin`` [N, N m], shape
                (n,).
            joint_forces: added to it on the joints [N m or N], shape (J,).
            origin: of the base [m], shape (3,).
        """


@runtime_checkable
class CompiledSolving(CompiledEngineBody, Protocol):
    """The same of an engine that solves added inertia and joint drives, see `SolvingEngineBody`."""

    def compiled_law(
        self,
        rotation: Array,
        force: Array,
        joint_forces: Array,
        inertia: Array | None,
        acting: ImplicitDrive | None,
    ) -> list[Array]:
        """Return what `give` takes; pure.

        Args:
            rotation: R_WB of the base, shape (3, 3).
            force: generalised, of the velocity as `set_velocity` takes it [N, N m], shape (n,).
            joint_forces: added to it on the joints [N m or N], shape (J,).
            inertia: added to the robot's own, shape (n, n); None for none.
            acting: joint drives of the step; None for none.
        """

    def give(self, results: list[Floats]) -> None:
        """Set the loads of the next step from the results of `compiled_law`."""

    def steps_alone(self) -> bool:
        """Return whether the scene can be stepped by `write_step`."""
        ...

    def write_step(
        self,
        program: Any,
        loads: Sequence[tuple[Any, int]],
        beside: Sequence[tuple[Any, Sequence[tuple[Any, int]]]],
        *,
        touching: bool,
    ) -> tuple[Any, int] | None:
        """Write a step of the engine under loads, for machine code that makes many of them.

        Refused where contacts are not as said, or drives at their limits ask for more solutions.

        Args:
            program: `seals.scalar_compiler.Program`.
            loads: places of the joint forces and of the results of `compiled_law`, with lengths.
            beside: the other robots of the scene, with theirs.
            touching: whether something touches in the step; False where there are several robots.

        Returns:
            Place and length of a record of the contacts, see `contacts_of`; None for no contacts.
        """
        ...

    def write_world(self, program: Any) -> list[Any]:
        """Write the state after a step; return the places of what `read_world` takes."""
        ...

    def read_world(self, *native: Array) -> tuple[Array, Array, Array, Array]:
        """Return what `read_law` does, of velocities in world axes; pure."""
        ...

    def contacts_of(self, record: Floats) -> ContactPoints | None:
        """Return the contacts in a step by its record, copies."""
        ...


def generalised(jacobian: Array, wrench: Array) -> Array:
    """Return the sum of J^T f over the links: J (L, 6, n), f (L, 6), result (n,)."""
    count, size = jacobian.shape[0] * jacobian.shape[1], jacobian.shape[2]
    return jacobian.reshape(count, size).T @ wrench.reshape(-1)


def generalised_inertia(matrices: Array, jacobian: Array) -> Array:
    """Return the sum of J^T A J over the links: A (L, 6, 6), J (L, 6, n), result (n, n)."""
    size = jacobian.shape[2]
    count = jacobian.shape[0] * jacobian.shape[1]
    rows = namespace(jacobian).matmul(matrices, jacobian).reshape(count, size)
    return jacobian.reshape(count, size).T @ rows


class Contacts:
    """Contacts on the links of a robot in the last step.

    Args:
        links: number of links.

    Attributes:
        any: whether there are any.
    """

    def __init__(self, links: int) -> None:
        self._none = np.zeros((links, 6)), np.zeros(links)
        for zeros in self._none:
            zeros.setflags(write=False)
        self.forget()

    def forget(self) -> None:
        """Clear all contacts."""
        self._points: ContactPoints | None = None
        self._began: LinksAt | None = None
        self._sums: tuple[Floats, Floats] | None = self._none
        self.any = False
        self._touched: frozenset[int] | None = frozenset()

    def note(self, points: ContactPoints | None, began: LinksAt | None) -> None:
        """Store the engine's contact points of a step.

        Args:
            points: as the engine gives them; None for nothing.
            began: the links where the step began: there the engine found the contacts.
        """
        if points is None:
            if self.any:
                self.forget()
            return
        self._points, self._began, self._sums, self.any = points, began, None, True
        self._touched = None

    @property
    def links(self) -> frozenset[int]:
        """The links that were touched."""
        if self._touched is None:
            assert self._points is not None
            self._touched = frozenset(self._points.links)
        return self._touched

    def wrenches(self) -> Floats:
        """Return the wrenches about the link origins, link axes [N, N m], shape (L, 6)."""
        return self._summed()[0]

    def normals(self) -> Floats:
        """Return the sum of the normal forces on every link [N], shape (L,)."""
        return self._summed()[1]

    def snapshot(self) -> Any:
        """Return the complete state."""
        return self._summed(), self.any, self.links

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        self._sums, self.any, self._touched = kept

    def _summed(self) -> tuple[Floats, Floats]:
        """Sum normal and friction forces per link, and the normal forces alone."""
        if self._sums is not None:
            return self._sums
        assert self._began is not None
        assert self._points is not None
        origins, rotations = self._began.kinematics.origins[0], self._began.kinematics.rotations[0]
        links = self._points.links
        points, force, normal = self._points.forces()
        parts = np.empty((len(links), 2, 3))
        parts[:, 0], parts[:, 1] = force, cross(points - origins.take(links, axis=0), force)
        own = np.matmul(parts, rotations.take(links, axis=0)).reshape(-1, 6).tolist()
        out, pressing = [[0.0] * 6 for _ in self._none[1]], [0.0] * len(self._none[1])
        # a few contacts, some on one link: faster one by one than as arrays
        for link, wrench, push in zip(links, own, normal.tolist(), strict=True):
            out[link] = [a + b for a, b in zip(out[link], wrench, strict=True)]
            pressing[link] += push
        self._sums = np.array(out), np.array(pressing)
        return self._sums
