"""One robot of an engine, with added mass, implicit joint drives and second-order steps.

Half-step velocities make the positions second order (leapfrog); at a joint limit the robot is
corrected as if its joints were locked, for the limit changes no momentum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.backend import BodyOptions, Configuration, Dynamics, Follow, LinkPoses, LinksAt
from seals.coupling.engine import (
    CompiledEngineBody,
    Contacts,
    EngineBody,
    SolvingEngineBody,
    drive_over,
    generalised,
)
from seals.coupling.inertia_split import at_rest
from seals.coupling.predicted import PredictedForces
from seals.coupling.solved import SolvedForces
from seals.errors import PhysicsError
from seals.frames import carried, cross, exponential, matrix_of, multiply
from seals.multibody.equations import Assembly
from seals.multibody.kinematics import Kinematics
from seals.multibody.linear import solved
from seals.robot.model import RobotModel
from seals.state_records import state_record


@state_record
class HalfStep(NamedTuple):
    """Generalised velocity at two instants of the leapfrog method.

    Equation:
        v(t + h/2) = v(t - h/2) + h a(t), x(t + h) = x(t) + h v(t + h/2), and
        v(t + h) = v(t + h/2) + h a(t) / 2 where forces need it.

    Args:
        now: at the current time, shape (n,).
        middle: half a step earlier, shape (n,); None after a start, a stop or a contact, where the
            pose moves with ``now``.

    References:
        Hairer, Lubich and Wanner 2003, doi:10.1017/S0962492902000144.

    Example:
        >>> import numpy as np
        >>> HalfStep(np.array([0.0])).kicked(np.array([2.0]))
        HalfStep(now=array([2.]), middle=array([1.]))
    """

    now: Floats
    middle: Floats | None = None

    def kicked(self, kick: Floats) -> HalfStep:
        """Return the velocities one step later.

        Args:
            kick: change of velocity over the step, h a, shape (n,).
        """
        half = 0.5 * kick
        middle = self.now + half if self.middle is None else self.middle + kick
        return HalfStep(middle + half, middle)

    @property
    def way(self) -> Floats:
        """Return the velocity with which the pose moved over the last step, shape (n,)."""
        return self.now if self.middle is None else self.middle

    def acceleration(self, step: float) -> Floats | None:
        """Return the acceleration of the last step of h [s], shape (n,); None after a start."""
        return None if self.middle is None else 2.0 * (self.now - self.middle) / step


def base_inertia(assembly: Assembly, dynamics: Dynamics) -> Array:
    """Return the rows of the base of the generalised inertia, added inertia included, (6, n).

    Args:
        assembly: of the robot's own inertia.
        dynamics: of the robot; its base is free.
    """
    jacobian = dynamics.kinematics.jacobian[0]
    total = assembly.total_inertia(dynamics.found, 1)[0]
    size = jacobian.shape[2]
    rows = namespace(jacobian).matmul(total, jacobian).reshape(-1, size)
    return jacobian[:, :, :6].reshape(-1, 6).T @ rows


def locked_kick(inertia: Floats, kick: Floats) -> Floats:
    """Return the change of velocity of the base as if all joints were locked, shape (6,).

    A stop acts between links: it changes neither the linear nor the angular momentum of the robot.
    What is left of a change of velocity without it is that of the locked robot with the same change
    of momentum.

    Equation:
        M_bb s = M_b a, with M the generalised inertia, added inertia included, and b the rows of
        the base.

    Args:
        inertia: M_b where the step began, see `base_inertia`, shape (6, n).
        kick: change of the generalised velocity over the step, about the base origin, shape (n,).

    Raises:
        PhysicsError: the locked robot has no inertia about some axis.
    """
    try:
        found: Floats = solved(inertia[:, :6], inertia @ kick)
    except np.linalg.LinAlgError as cause:
        raise PhysicsError(
            "the robot has no inertia about an axis of its base, and a joint is at its limit.\n"
            "Give at least one link of its URDF an inertia about it: ixx, iyy, izz above zero."
        ) from cause
    return found


_RESTING = 1e-3
"""Rate up to which a joint at its limit rests there [rad/s or m/s]."""


class CoupledBody(BodyOptions):
    """Robot in the scene of an engine; joint drives are integrated implicitly.

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

    def __init__(
        self, engine: EngineBody | SolvingEngineBody, robot: RobotModel, *, second_order: bool
    ) -> None:
        self.engine, self.robot, self._second_order = engine, robot, second_order
        joints = robot.tree.joints
        self._base = 0 if robot.tree.fixed_base else 6
        self._forces: PredictedForces | SolvedForces
        if isinstance(engine, SolvingEngineBody):
            self._forces = SolvedForces(engine, robot)
        else:
            self._forces = PredictedForces(engine, robot)
        self._assembly = Assembly(robot.spatial_inertia[None])
        self._base_inertia: Callable[[], Floats] | None = None
        self._limits = np.isfinite(robot.lower).any() or np.isfinite(robot.upper).any()
        self._contacts = Contacts(len(robot.links))
        lower, upper = (robot.lower + 1e-6).tolist(), (robot.upper - 1e-6).tolist()
        self._stops = list(zip(lower, upper, strict=True))
        self._began: LinksAt | None = None
        self._speed = HalfStep(np.zeros(robot.degrees))
        self._joints = np.zeros(joints)
        self.reference = engine.reference
        self._reference = np.asarray(engine.reference, dtype=float).tolist()
        self._centred = not np.any(engine.reference)
        self._follow: Follow | None = None
        self._alone: bool | None = None
        self._step = 0.0
        self.followed: Floats | None = None

    def reset(self, configuration: Configuration) -> None:
        """Set the state of the robot."""
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
        self.followed = None
        self._contacts.forget()
        self._forces.forget()

    def read(self) -> Configuration:
        """Return pose, velocity and joint state of the robot."""
        position, quaternion = self.engine.base_pose()
        now, joints = self._speed.now, self._joints
        if self._base == 0:
            return Configuration(position, quaternion, np.zeros(3), np.zeros(3), joints, now)
        velocity = np.array(self._origin_velocity(quaternion.tolist(), now[:6].tolist()))
        return Configuration(position, quaternion, velocity, now[3:6], joints, now[6:])

    def read_rows(self, written: Sequence[Floats], joints: Floats, now: Floats) -> Configuration:
        """Return what `read` returned after steps by `write_step`, one row each.

        Args:
            written: what the engine's ``put`` would have taken, of `leapt`.
            joints: of `leapt`, shape (N, J).
            now: velocity of `leapt`, shape (N, n).
        """
        engine: Any = self.engine
        # what the engine was given, or how it tells it where that is another thing
        position, quaternion = engine.base_poses(*written)
        if self._base == 0:
            still = np.zeros_like(position)
            return Configuration(position, quaternion, still, still, joints, now)
        velocity = np.stack(self._origin_velocity(quaternion.T, now[:, :6].T), axis=1)
        return Configuration(position, quaternion, velocity, now[:, 3:6], joints, now[:, 6:])

    def _origin_velocity(self, quaternion: Any, native: Any) -> tuple[Any, Any, Any]:
        """Velocity of the base origin, of numbers or of columns: equal bits."""
        u, v, w, a, b, c = native
        i, j, k, real = quaternion
        x, y, z = carried(i, j, k, real, self._reference)
        return u - (b * z - c * y), v - (c * x - a * z), w - (a * y - b * x)

    def poses(self) -> LinkPoses:
        """Return the poses of all links and the generalised velocity."""
        origins, rotations = self.engine.link_poses()
        speed = self._at_origin(self._speed.now, rotations[0])
        return LinkPoses(origins[None], rotations[None], speed[None])

    def mean_speed(self) -> Floats:
        """Return the engine's velocity with which the pose moved in the last step, shape (n,)."""
        return self._speed.way

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
        """Convert the engine's generalised velocity to one about the base origin."""
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
        return self._forces.joint_forces()

    def contact_wrenches(self) -> Floats:
        """Return the contact wrenches of the last step, shape (L, 6).

        They act about the link origins and are given in link axes [N, N m].
        """
        return self._contacts.wrenches()

    def contact_normals(self) -> Floats:
        """Return the sum of the normal forces on every link in the last step [N], shape (L,)."""
        return self._contacts.normals()

    def snapshot(self) -> Any:
        """Return the state outside the engine, for the backend's snapshot."""
        motion = self._speed, self._joints, self.followed
        return motion, self._contacts.snapshot(), self._forces.snapshot()

    def restore(self, kept: Any) -> None:
        """Restore the state outside the engine, after the engine's own.

        It sets masses and motors of the engine where they differ.
        """
        (self._speed, self._joints, self.followed), contacts, forces = kept
        self._contacts.restore(contacts)
        self._forces.restore(forces)

    def apply(self, dynamics: Dynamics, step: float) -> None:
        """Set forces and joint torques for the next step; called once before each step."""
        smooth = self._speed.acceleration(step)
        last = None if smooth is None else smooth[self._base :]
        dynamics, acting = drive_over(dynamics, step, last)
        self._base_inertia = lambda: base_inertia(self._assembly, dynamics)
        self._began = dynamics
        self._forces.apply(
            self.engine, dynamics, step, acting=acting, contacts=self._contacts, joints=self._joints
        )

    def compile(self, *, inertial: bool, follow: Follow) -> None:
        """Prepare for `compiled_law`; see `seals.backend.CompiledBody.compile`."""
        self._follow = follow
        self._forces.compile(inertial=inertial)

    def interpret(self) -> None:
        """Continue without compiled laws."""
        self._follow = self.followed = None

    def leapt(
        self, native: Sequence[Array], own: Sequence[Array], step: float
    ) -> tuple[Sequence[Array], list[Array]]:
        """Return the state after a step of leapfrog, see `seals.backend.CompiledBody`; pure."""
        engine: Any = self.engine
        place, turn, raw, joints = engine.read_law(*native)
        now, before, *last = own
        base, xp = self._base, namespace(raw)
        half = 0.5 * (raw - now)
        middle = last[0] + 2.0 * half if last else now + half
        shift = step * (middle - raw)
        if base:
            place = place + shift[:, :3]
            turn = multiply(exponential(shift[:, 3:6]), turn)
        # written so that a motion that is not a number is refused as well
        wrong = ~(xp.sum(raw * raw) <= engine.top_speed**2)
        if self._limits:
            both = xp.concat((joints, before), axis=0)
            lower, upper = (np.array([column]) for column in zip(*self._stops, strict=True))
            wrong = wrong | xp.any((both <= lower) | (both >= upper))
        state = place, turn, joints + shift[:, base:], middle + half, middle
        written = engine.write_law(place, turn, state[3], state[2])
        return state, [*written, *(x.reshape(-1) for x in state[2:]), wrong]

    def pressing(self, records: Floats) -> Floats:
        """Return what `contact_normals` returned after steps by `write_step`, shape (N, L).

        Args:
            records: of the contacts in each.
        """
        engine: Any = self.engine
        found = np.zeros((len(records), len(self.robot.links)))
        for row, record in zip(found, records, strict=True):
            points = engine.contacts_of(record)
            if points is not None:
                np.add.at(row, points.links, points.forces()[2])
        return found

    def landed(self, native: Sequence[Array]) -> tuple[Sequence[Array], list[Array]]:
        """Return the state after a step in which something touched; pure."""
        engine: Any = self.engine
        place, turn, raw, joints = engine.read_world(*native)
        # written so that a motion that is not a number is refused as well
        wrong = ~(namespace(raw).sum(raw * raw) <= engine.top_speed**2)
        state, written = (place, turn, joints, raw, raw), native[-2:]
        return state, [*written, *(x.reshape(-1) for x in state[2:]), wrong]

    def coordinates(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return position, attitude, joints and velocity as the engine keeps them."""
        engine: Any = self.engine
        return *engine.native_pose(), self._joints, self._speed.now

    def at_origin(self, place: Array, turn: Array, native: Array) -> tuple[Array, Array, Array]:
        """Return place and rotation of the base link, and the generalised velocity; pure."""
        xp, engine = namespace(place), cast("CompiledEngineBody", self.engine)
        rotation = matrix_of(multiply(turn, xp.asarray(engine.base_turn)))
        arm = rotation @ engine.reference
        if self._base:
            moved = native[:, :3] - cross(native[:, 3:6], arm)
            native = xp.concat((moved, native[:, 3:]), axis=1)
        return place - arm, rotation, native

    def compiled_form(self, step: float, *, driven: bool) -> tuple[str, ...] | None:
        """Return how the next step is computed, for `compiled_law`; None if it is not compiled.

        Args:
            step: h [s].
            driven: whether drives act on the joints.
        """
        if self._limits and self._base and self._meets_stop(step):
            return None
        form = self._forces.compiled_form(step, driven=driven, contacts=self._contacts)
        if form is None:
            return None
        return form, "" if not driven else "late" if self._speed.middle is None else "smooth"

    def compiled_law(
        self, form: tuple[str, ...], dynamics: Dynamics, step: float, *own: Array
    ) -> list[Array]:
        """Return what `give` passes to the engine; pure.

        Args:
            form: from `compiled_form`.
            dynamics: of the robot at the current time.
            step: h [s].
            own: acceleration of the joints in the last step where it was smooth, shape (J,), and
                what comes from `compiled_arguments`.
        """
        last = own[0] if form[1] == "smooth" else None
        own = own[1:]
        dynamics, acting = drive_over(dynamics, step, last)
        rows = base_inertia(self._assembly, dynamics) if self._limits and self._base else None
        found = self._forces.compiled_law(form[0], dynamics, step, acting, *own)
        return found if rows is None else [*found, rows]

    def compiled_arguments(self) -> tuple[Floats, ...]:
        """Return more arguments of `compiled_law` for the next step."""
        return self._forces.compiled_arguments(self._contacts)

    def give(self, form: tuple[str, ...], results: list[Floats], links: LinksAt) -> bool:
        """Pass the results of `compiled_law` to the engine, in place of `apply`.

        Return false where the engine's inertia had to be set anew, and the law is to be asked
        again.
        """
        if self._limits and self._base:
            *results, rows = results
            self._base_inertia = lambda: rows
        self._began = links
        return self._forces.give(form[0], results, links)

    @property
    def velocity(self) -> Floats:
        """The engine's generalised velocity now, shape (n,)."""
        return self._speed.now

    @property
    def touching(self) -> bool:
        """Whether something touched in the last step."""
        return self._contacts.any

    def steps_alone(self) -> bool:
        """Return whether `write_step` can be used now, see `seals.backend.CompiledBody`."""
        # loads that are foretold from contacts are made one by one
        touches = self._contacts.any and isinstance(self._forces, SolvedForces)
        known = touches or (self._speed.middle is not None and not self._contacts.any)
        if not (self._second_order and known and self._follow is not None) or self._forces.running:
            return False
        if self._alone is None:
            self._alone = self._forces.steps_alone()
        return self._alone

    def native_state(self) -> tuple[tuple[Floats, ...], tuple[Floats, ...]]:
        """Return the engine's state, and velocity, joints and velocity half a step ago."""
        engine: Any = self.engine
        if self._contacts.any:
            return engine.native(), ()
        assert self._speed.middle is not None
        return engine.native(), (self._speed.now, self._joints, self._speed.middle)

    def native_places(self) -> list[int]:
        """Return the addresses of the engine's state, of which the last two are written."""
        engine: Any = self.engine
        found: list[int] = engine.native_places()
        return found

    def write_step(
        self,
        program: Any,
        loads: Sequence[tuple[Any, int]],
        origin: Any,
        beside: Sequence[tuple[CoupledBody, Sequence[tuple[Any, int]]]],
        *,
        touching: bool,
    ) -> tuple[Any, int] | None:
        """Write a step of the engine, see `seals.backend.CompiledBody`."""
        others = [(body.engine, body._own(given)) for body, given in beside]
        own = self._own(loads)
        return self._forces.write_step(program, own, origin, others, touching=touching)

    def _own(self, loads: Sequence[tuple[Any, int]]) -> Sequence[tuple[Any, int]]:
        """What of the results of `compiled_law` is the engine's: not the base's rows, the last."""
        return loads[:-1] if self._limits and self._base else loads

    def write_put(
        self, program: Any, written: Sequence[tuple[Any, int]], forces: tuple[Any, int]
    ) -> tuple[Any, int] | None:
        """Write that the engine takes a state of `leapt`, see `seals.backend.CompiledBody`."""
        engine: Any = self.engine
        found: tuple[Any, int] | None = engine.write_put(program, written, forces)
        return found

    def write_world(self, program: Any) -> list[Any]:
        """Write the state after a step; return the places of what `landed` takes."""
        engine: Any = self.engine
        found: list[Any] = engine.write_world(program)
        return found

    def reaches_stop(self, joints: Array, speed: Array, step: float) -> Array | None:
        """Return whether `compiled_form` would refuse the next step; pure.

        None where no joint has limits.

        Args:
            joints: shape (J,).
            speed: as the engine keeps it, shape (n,).
            step: h [s].
        """
        if not (self._limits and self._base):
            return None
        found: Array = False
        for k, bounds in enumerate(self._stops):
            place, rate = joints[k], speed[self._base + k]
            found = _reaches(place, rate, bounds, step, held=self._forces.foretells) | found
        return found

    def begin_alone(self, step: float) -> None:
        """Prepare for steps by `write_step`."""
        engine: Any = self.engine
        self._step = step
        engine.begin_alone()

    def leave(self) -> None:
        """End steps by `write_step`: the engine takes back one that was refused."""
        engine: Any = self.engine
        engine.leave()

    def end_alone(
        self, followed: Floats, joints: Floats, now: Floats, middle: Floats | None, kick: Floats
    ) -> None:
        """Note steps by `write_step`, see `seals.backend.CompiledBody`."""
        engine: Any = self.engine
        self._forces.note(engine.end_alone(), kick, self._step)
        self._contacts.note(None, None)
        self.followed, self._joints, self._speed = followed, joints, HalfStep(now, middle)

    def note_contacts(self, record: Floats, began: LinksAt) -> None:
        """Note the contacts of a step by `write_step`."""
        engine: Any = self.engine
        self._contacts.note(engine.contacts_of(record), began)

    def after_step(self, step: float) -> None:
        """Compute the velocity at the new time, and correct the pose by the half-step velocity.

        The backend calls it once for every robot after each step of the engine.

        The engine moved the pose with the velocity after the kick, a step of first order. The
        middle velocity, half a kick earlier, makes it one of second order (leapfrog); the velocity
        at the new time is the middle one and half of the last kick.

        Args:
            step: h [s].

        Raises:
            PhysicsError: the motion is faster than the engine can follow, or not finite.
        """
        self.followed = None
        self._contacts.note(self.engine.contacts(), self._began)
        smooth = self._second_order and not (self._contacts.any or self._forces.running)
        if smooth and self._follow is not None and self._followed(self._follow, step):
            return
        raw, joints = self.engine.state()
        self._forces.measure()
        # written so that a motion that is not a number is looked at as well
        if not raw @ raw <= self.engine.top_speed**2:
            # refuse a motion that the engine would clamp, or that is not a number
            fastest = float(np.abs(raw).max())
            if not fastest <= self.engine.top_speed:
                raise PhysicsError(
                    f"robot '{self.robot.name}' moves at {fastest:.0f} m/s or rad/s.\n"
                    f"Allowed: up to {self.engine.top_speed:g}; "
                    "take a smaller time.step or check forces and masses."
                )
        before = self._speed.now
        kick = raw - before
        self._forces.moved(kick, step)
        if not smooth:
            self._speed, self._joints = HalfStep(raw), joints
            return
        if self._at_stop(joints) or self._at_stop(self._joints):
            self._speed, self._joints = HalfStep(raw), joints
            if self._base and self._base_inertia is not None:
                assert self._began is not None
                turn = self._began.kinematics.rotations[0, 0]
                back = -0.5 * step * locked_kick(self._base_inertia(), self._at_origin(kick, turn))
                back[:3] += np.cross(back[3:], turn @ self.engine.reference)
                self.engine.shift_base(back)
                self.engine.set_velocity(self._speed.now, self._joints)
                self._keep_momentum(before, step)
            return
        self._speed = self._speed.kicked(kick)
        middle = self._speed.middle
        assert middle is not None
        shift = step * (middle - raw)
        self._joints = joints + shift[self._base :]
        if self._base:
            self.engine.shift_base(shift[:6])
        self.engine.set_velocity(self._speed.now, self._joints)

    def _followed(self, follow: Follow, step: float) -> bool:
        """Step by machine code; return false where it is to be done without."""
        engine: Any = self.engine
        now, middle = self._speed
        own = (now, self._joints) if middle is None else (now, self._joints, middle)
        found = follow(engine.native(), own, step)
        if found is None:
            return False
        self.followed, (*written, self._joints, fresh, later, _) = found
        self._speed = HalfStep(fresh, later)
        engine.put(*written)
        self._forces.measure()
        self._forces.moved(fresh - now, step)
        return True

    def _keep_momentum(self, before: Floats, step: float) -> None:
        """Correct the velocity of the base at a joint stop, which leaves the momentum as it is.

        The engine takes the Coriolis terms of a step from the velocities at its start. Where a stop
        changes them within the step, momentum of the order of h appears.

        Equation:
            M_bb s = M_b v + h F_b - M'_b v', with M_b the rows of the base of the generalised
            inertia before and after the step, and F_b the loads on the base, about its origin: the
            correction s of the velocity v'. Angular momentum is carried over to the new origin.

        Args:
            before: velocity at the start of the step, shape (n,).
            step: h [s].
        """
        began = self._began
        if not isinstance(began, Dynamics) or not at_rest(began.found):
            return
        then, arm = began.kinematics, self.engine.reference
        origins, rotations = self.engine.link_poses()
        now = Kinematics(self.robot.tree, origins[None], rotations[None])
        rows = base_inertia(self._assembly, began._replace(kinematics=now))
        momentum = base_inertia(self._assembly, began) @ self._at_origin(
            before, then.rotations[0, 0]
        )
        momentum += step * generalised(then.jacobian[0], began.wrench[0])[:6]
        momentum[3:] -= np.cross(origins[0] - then.origins[0, 0], momentum[:3])
        left = momentum - rows @ self._at_origin(self._speed.now, rotations[0])
        change = solved(rows[:, :6], left)
        change[:3] += np.cross(change[3:], rotations[0] @ arm)
        speed = self._speed.now.copy()
        speed[:6] += change
        self._speed = HalfStep(speed)
        self.engine.set_velocity(speed, self._joints)

    def _meets_stop(self, step: float) -> bool:
        """Return whether a joint reaches a limit in the next step, or stands at one under loads.

        Such steps are not compiled: the momentum is kept, or the limit's reaction is foretold, from
        the whole of the loads.
        """
        rates, held = self._speed.now[self._base :].tolist(), self._forces.foretells
        rows = zip(self._joints.tolist(), rates, self._stops, strict=True)
        return any(_reaches(x, v, bounds, step, held=held) for x, v, bounds in rows)

    def _at_stop(self, q: Floats) -> bool:
        """Return whether a joint stands at a limit."""
        if not self._limits:
            return False
        return any(x <= a or x >= b for x, (a, b) in zip(q.tolist(), self._stops, strict=True))


def _reaches(x: Any, v: Any, bounds: tuple[float, float], step: float, *, held: bool) -> Any:
    """Whether a joint reaches a limit in the next step, or stands at one and moves or is held.

    Pure, for numbers and for entries of arrays of any library.

    Args:
        x: position [rad or m].
        v: its rate [rad/s or m/s].
        bounds: lowest and highest position.
        step: h [s].
        held: whether it counts at a limit when it rests, too.
    """
    low, high = bounds
    ahead = x + 2.0 * step * v
    moving = (v > _RESTING) | (v < -_RESTING) | held
    outside, leaving = (x <= low) | (x >= high), (ahead <= low) | (ahead >= high)
    return (outside & moving) | ((low < x) & (x < high) & leaving)
