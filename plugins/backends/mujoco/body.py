"""One robot in MuJoCo: pose, velocity, loads and contacts in the engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, Floats, namespace
from seals.coupling import ImplicitDrive
from seals.frames import carried, cross, matrix_of
from seals.plugins.backends.mujoco.contact_law import MujocoContacts, Points, points_of
from seals.plugins.backends.mujoco.contact_loop import RECORD, ContactLoop, recorded
from seals.plugins.backends.mujoco.library import Library, library
from seals.plugins.backends.mujoco.scene import PASSES, Scene
from seals.robot.model import RobotModel
from seals.scalar_compiler import Place, Program, compiled

Given: TypeAlias = tuple[Place, int]
_BEFORE = (
    *("mj_makeConstraint", "mj_projectConstraint", "mj_fwdVelocity"),
    "mj_fwdAcceleration",
)
"""Stages between the collisions of a step and its first solution."""
"""Place of some numbers, and how many."""


class _Drive(NamedTuple):
    """Joint drives over a step: force less gain times acceleration, limited; shape (J,) each."""

    force: Floats
    limit: Floats
    gain: Floats
    armature: Floats


class MujocoBody:
    """A robot in the scene, see `seals.coupling.SolvingEngineBody`.

    Its velocity is that of the centre of mass of a free base. The engine keeps the angular velocity
    in axes of the base, and quaternions as w, x, y, z.

    Args:
        scene: to add it to.
        robot: model to add.
        number: of the robot in the scene.

    Attributes:
        description: names of its parts in the engine's model.
    """

    top_speed = np.inf
    base_turn = np.array([[0.0, 0.0, 0.0, 1.0]])

    def __init__(self, scene: Scene, robot: RobotModel, number: int) -> None:
        self._scene, self._robot, self._number = scene, robot, number
        self._engine, self._free = scene.engine, not robot.tree.fixed_base
        self._lead = 6 if self._free else 0
        self.reference = robot.centre[0] if self._free else np.zeros(3)
        self.description = scene.add(robot, self)
        self._inertia: Floats | None = None
        self._force = np.zeros(robot.tree.joints)
        self._drive: _Drive | None = None
        self._loads: tuple[Floats, Floats] | None = None
        self._held, self._bound = np.zeros(robot.tree.joints, dtype=bool), False
        self._pull = self._none = np.zeros(robot.tree.joints)
        # forces on the joints in the last step of a program, of whichever of them
        self._felt = np.zeros(robot.tree.joints)
        self._push, self._wrenched = np.zeros(6), True

    def bind(self) -> None:
        """Look up indices in the compiled model, and views of its arrays."""
        m, d, names = self._scene.model, self._scene.data, self.description
        self._rows = np.array([m.body(name).id for name in names.bodies])
        joints = [m.joint(name).id for name in names.joints]
        turning = [int(m.jnt_dofadr[j]) for j in joints]
        self._joints = len(joints)
        self._q = _span([int(m.jnt_qposadr[j]) for j in joints])
        self._dofs = _span(turning)
        every, every_q = turning, [int(m.jnt_qposadr[j]) for j in joints]
        if self._free:
            base = m.joint(f"{self._number}/").id
            at, first = int(m.jnt_qposadr[base]), int(m.jnt_dofadr[base])
            self._place, self._turn = d.qpos[at : at + 3], d.qpos[at + 3 : at + 7]
            self._linear, self._spin = d.qvel[first : first + 3], d.qvel[first + 3 : first + 6]
            self._push = d.qfrc_applied[first : first + 6]
            every, every_q = [*range(first, first + 6), *turning], [*range(at, at + 7), *every_q]
        else:
            row = m.body_mocapid[self._rows[0]]
            self._place, self._turn = d.mocap_pos[row], d.mocap_quat[row]
        self._entries(m, every)
        self._every, self._every_q = _span(every), _span(every_q)
        self._qpos, self._qvel, self._qacc = d.qpos, d.qvel, d.qacc
        self._pushed, self._applied, self._mass = d.xfrc_applied, d.qfrc_applied, d.M
        self._origins, self._rotations, self._centres = d.xpos, d.xmat, d.xipos
        self._out = np.zeros(3)
        self._back = np.zeros(4)
        self._link = np.full(m.ngeom, -1)
        for name, k in names.shapes:
            self._link[m.geom(name).id] = k

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
        at, self._row, self._column = np.array(table, dtype=int).reshape(-1, 3).T
        self._at = _span(at.tolist())
        diagonal = {row: k for k, (_, row, column) in enumerate(table) if row == column}
        lead = self._lead
        self._entry = np.array([diagonal[lead + j] for j in range(len(every) - lead)], dtype=int)
        self._diagonal = at[self._entry]

    def place(self, position: Floats, quaternion: Floats) -> None:
        """Set the pose of the base link."""
        self._scene.compile()
        x, y, z, w = quaternion
        self._turn[:] = w, x, y, z
        self._place[:] = position + self._arm()
        self._scene.forget()

    def _arm(self) -> Floats:
        """Vector from the origin of the base to the engine's reference point, world axes [m]."""
        w, x, y, z = self._turn.tolist()
        return np.array(carried(x, y, z, w, self.reference.tolist()))

    def base_pose(self) -> tuple[Floats, Floats]:
        """Return origin and attitude of the base link."""
        w, x, y, z = self._turn
        return self._place - self._arm(), np.array([x, y, z, w])

    def base_poses(self, *written: Floats) -> tuple[Floats, Floats]:
        """Return the same for rows of what `put` takes."""
        if not self._free:
            rows = len(written[0])
            return tuple(np.repeat(x[None], rows, axis=0) for x in self.base_pose())  # type: ignore[return-value]
        place, turn = written[0][:, :3], written[0][:, 3:7]
        w, x, y, z = turn.T
        arm = np.stack(carried(x, y, z, w, self.reference.tolist()), axis=1)
        return place - arm, turn[:, [1, 2, 3, 0]]

    def native_pose(self) -> tuple[Floats, Floats]:
        """Return the reference point of the base, and its attitude."""
        w, x, y, z = self._turn.tolist()
        return self._place, np.array((x, y, z, w))

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
        if self._joints:
            self._qvel[self._dofs] = velocity[self._lead :]
            self._qpos[self._q] = joints
        self._scene.stale = True

    def native(self) -> tuple[Floats, ...]:
        """Return positions and velocities; of a fixed base also where it stands."""
        own = self._qpos[self._every_q], self._qvel[self._every]
        return own if self._free else (self._place, self._turn, *own)

    def read_law(self, *native: Array) -> tuple[Array, Array, Array, Array]:
        """Return place, attitude, velocity and joints."""
        place, turn, v, joints = self.read_world(*native)
        if not self._free:
            return place, turn, v, joints
        spin = matrix_of(turn) @ v[0, 3:6]
        return place, turn, namespace(v).concat((v[:, :3], spin, v[:, 6:]), axis=1), joints

    def read_world(self, *native: Array) -> tuple[Array, Array, Array, Array]:
        """Return the same of positions and of velocities in world axes."""
        if not self._free:
            place, turn, joints, velocity = native
            return place[None], _shifted(turn, -1)[None], velocity[None], joints[None]
        q, v = native
        return q[None, :3], _shifted(q[3:7], -1)[None], v[None], q[None, 7:]

    def write_law(self, place: Array, turn: Array, velocity: Array, joints: Array) -> list[Array]:
        """Return positions and velocities as the engine keeps them."""
        if not self._free:
            return [joints[0], velocity[0]]
        xp = namespace(place)
        spin = velocity[0, 3:6] @ matrix_of(turn)[0]
        q = xp.concat((place[0], _shifted(turn[0], 1), joints[0]), axis=0)
        return [q, xp.concat((velocity[0, :3], spin, velocity[0, 6:]), axis=0)]

    def put(self, *written: Floats) -> None:
        """Set positions and velocities."""
        self._qpos[self._every_q], self._qvel[self._every] = written
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
        joints = self._qpos[self._q].copy()
        if not self._free:
            return self._qvel[self._dofs].copy(), joints
        velocity = np.empty(6 + self._joints)
        velocity[:3] = self._linear
        self._engine.mju_rotVecQuat(velocity[3:6], self._spin, self._turn)
        velocity[6:] = self._qvel[self._dofs]
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

    def apply_joint_forces(self, forces: Floats) -> None:
        """Apply forces on the joints over the next step."""
        self._force = forces

    def add_inertia(self, inertia: Floats | None) -> None:
        """Add a generalised inertia to the engine's own over the next step."""
        self._inertia, self._loads = inertia, None

    def drive_joints(self, drive: ImplicitDrive | None) -> None:
        """Set the joint drives that act over the next step."""
        self._drive = None
        if drive is not None:
            force, gain = drive.drive.force[0], drive.gain[0]
            limit = np.broadcast_to(drive.drive.limit, drive.drive.force.shape)[0]
            self._drive = _Drive(force, limit, gain, drive.armature)

    def compiled_law(
        self,
        rotation: Array,
        force: Array,
        joint_forces: Array,
        inertia: Array | None,
        acting: ImplicitDrive | None,
    ) -> list[Array]:
        """Return force on the base, forces on the joints without and with drives, inertia, drives.

        The inertia as what is added to the robot's entries of the engine's.
        """
        xp, lead = namespace(force), self._lead
        push, outer = force[:lead], force[lead:] + joint_forces
        added = xp.zeros((len(self._row),))
        if lead:
            push = xp.concat((force[:3], force[3:6] @ rotation), axis=0)
        if inertia is not None:
            if lead:
                inertia = _turned(_turned(inertia, rotation).T, rotation).T
            added = added + inertia[self._row, self._column]
        if acting is None:
            return [push, outer, outer, added]
        pull, gain = acting.drive.force[0], acting.gain[0]
        limit = xp.broadcast_to(acting.drive.limit, acting.drive.force.shape)[0]
        where = np.zeros((len(self._row), self._joints))
        where[self._entry, np.arange(self._joints)] = 1.0
        added = added + xp.asarray(where) @ (gain + acting.armature)
        return [push, outer, outer + pull, added, pull, limit, gain, acting.armature + pull * 0.0]

    def give(self, results: list[Floats]) -> None:
        """Set the loads of the next step from the results of `compiled_law`."""
        push, self._force, force, added, *drive = results
        if self._wrenched:
            self._pushed[self._rows] = 0.0
            self._wrenched = False
        if self._free:
            self._push[:] = push
        self._loads = force, added
        self._drive = _Drive(*drive) if drive else None

    def steps_alone(self) -> bool:
        """Return whether `write_step` can: the robot's numbers lie side by side."""
        scene, spans = self._scene, (self._q, self._dofs, self._every, self._every_q)
        found = library(self._engine)
        return (
            found is not None
            and found.fits(scene.data)
            and all(isinstance(span, slice) or not len(span) for span in spans)
        )

    def native_places(self) -> list[int]:
        """Return the addresses of what `native` returns."""
        free = self._qpos[self._every_q], self._qvel[self._every]
        parts = free if self._free else (self._place, self._turn, *free)
        return [x.ctypes.data for x in parts]

    def write_step(
        self,
        program: Program,
        loads: Sequence[Given],
        beside: Sequence[tuple[MujocoBody, Sequence[Given]]],
        *,
        touching: bool,
    ) -> Given | None:
        """Write a step of the engine, refused where a drive is at its limit.

        Refused as well where something touches, or where nothing does.

        Args:
            program: to write to.
            loads: places of the results of `compiled_law`, with their lengths.
            beside: the other robots of the scene, with theirs.
            touching: whether something touches in it; False where there are several robots.

        Returns:
            The contacts, see `contacts_of`; None where nothing touches.
        """
        d, robots = self._scene.data, [(self, loads), *beside]
        for array in (d.qpos, d.qvel, d.qacc, d.qacc_warmstart):
            program.keep(program.address(array.ctypes.data), array.size)
        program.keep(program.address(self._library.place(d, "time")), 1)
        self._write_stages(program, "mj_kinematics", "mj_comPos", "mj_makeM")
        for body, own in robots:
            program.keep(program.memory(body._felt), body._joints)
            body._write_loads(program, own)
        self._write_stages(program, "mj_factorM")
        self._scene.write_bounds(program)
        self._write_stages(program, "mj_collision")
        if touching:
            record = self._write_contacts(program, [*loads[5:], loads[0]])
            self._write_stages(program, "mj_Euler")
            return record, RECORD
        program.refuse_if(program.address(self._library.place(d, "ncon")), integer=True)
        self._write_stages(program, *_BEFORE, "mj_fwdConstraint")
        for body, own in robots:
            body._write_felt(program, [*own[5:], own[0]])
        self._write_stages(program, "mj_Euler")
        return None

    @property
    def _library(self) -> Library:
        found = library(self._engine)
        assert found is not None
        return found

    def _write_stages(self, program: Program, *names: str) -> None:
        """Write stages of a step of the engine."""
        parts = self._scene.model, self._scene.data
        places = [program.address(x._address, x) for x in parts]
        for name in names:
            program.call(self._library.stages[name], *places)

    def _write_loads(self, program: Program, loads: Sequence[Given]) -> None:
        """Write added inertia and forces."""
        _, push, _, force, (added, _), *_ = loads
        program.copy(program.address(self._push.ctypes.data), *push)
        if self._joints:
            program.copy(program.address(self._applied[self._dofs].ctypes.data), *force)
        places = range(self._at.start, self._at.stop) if isinstance(self._at, slice) else self._at
        mass = program.address(self._mass.ctypes.data)
        program.add(mass, added, [int(k) for k in places])

    def _write_felt(self, program: Program, given: Sequence[Given]) -> None:
        """Write the forces on the joints in a solution for the accelerations.

        Args:
            program: to write to.
            given: places of what `_write_drives` takes, or of the forces on the joints alone.
        """
        forces = self._write_drives(program, given) if len(given) > 1 else given[0]
        program.copy(program.memory(self._felt), *forces)

    def _write_contacts(self, program: Program, given: Sequence[Given]) -> Place:
        """Write the solutions of a step in which something touches, as `Scene.advance` makes them.

        Args:
            program: to write to.
            given: see `_write_felt`.

        Returns:
            The record of the contacts.
        """
        d, contacts = self._scene.data, ContactLoop(program, self._library, self._scene)
        change = program.address(d.qacc.ctypes.data)
        contacts.write_count()
        self._write_stages(program, *_BEFORE)
        contacts.write_begin()
        again, settled = contacts.places
        with program.repeated(PASSES, again):
            self._write_stages(program, "mj_fwdConstraint")
            self._write_felt(program, given)
            contacts.write_correction(change)
            with program.unless(settled):
                contacts.write_references()
                program.copy(program.address(d.qacc_warmstart.ctypes.data), change, d.qacc.size)
        return contacts.write_record()

    def write_put(self, program: Program, written: Sequence[Given], forces: Given) -> None:
        """Write what `put` does; ``forces`` on the joints are known from the step."""
        for address, given in zip(self.native_places()[-2:], written, strict=True):
            program.copy(program.address(address), *given)

    def write_world(self, program: Program) -> list[Place]:
        """Write what `state` does; return the places of what `read_world` takes."""
        places = [program.address(x) for x in self.native_places()]
        if self._free:
            *_, speeds = places
            size = 6 + self._joints
            world = program.memory(np.zeros(size))
            program.copy(world, speeds, size)
            turn = program.address(self._turn.ctypes.data)
            spin = world._replace(start=3), speeds._replace(start=3)
            program.call(self._library.stages["mju_rotVecQuat"], *spin, turn)
            places[-1] = world
        return places

    def _write_drives(self, program: Program, given: Sequence[Given]) -> Given:
        """Write the forces of the drives, refused where one is beyond its limit.

        Args:
            program: to write to.
            given: places of force, limit, gain, armature and of the other forces on the joints.

        Returns:
            Place of the forces on the joints.
        """
        kernel, joints = compiled(_driving, [(self._joints,)] * 6), self._joints
        change = program.address(self._qacc[self._dofs].ctypes.data)
        for k, place in enumerate((*(place for place, _ in given), change)):
            program.copy(program.given(kernel, k * joints), place, joints)
        program.run(kernel)
        program.refuse_if(program.out(kernel, joints))
        return program.out(kernel), joints

    def begin_alone(self) -> None:
        """Prepare for steps by `write_step`: no wrenches act on single bodies."""
        if not self._number:
            self._scene.begin_loop()
        if self._wrenched:
            self._pushed[self._rows] = 0.0
            self._wrenched = False

    def leave(self) -> None:
        """Do nothing: what a refused step changed has been put back."""

    def end_alone(self) -> Floats:
        """Note steps by `write_step`; return the forces on the joints in the last one."""
        self._bound, self._scene.stale = False, True
        felt: Floats = self._felt.copy()
        return felt

    def drive_forces(self) -> Floats:
        """Return the drive forces on the joints over the last step, less those on the armature."""
        if self._drive is None:
            return self._none
        forces: Floats = self._pull - self._drive.armature * self._qacc[self._dofs]
        return forces

    def load(self) -> None:
        """Write added inertia and generalised forces into the engine's data."""
        self._bound = False
        if self._loads is not None:
            self._applied[self._dofs], added = self._loads
            self._mass[self._at] += added
            return
        if self._inertia is not None:
            added = self._in_coordinates(self._inertia) if self._free else self._inertia
            self._mass[self._at] += added[self._row, self._column]
        force = self._force
        if self._drive is not None:
            self._mass[self._diagonal] += self._drive.armature + self._drive.gain
            force = force + self._drive.force
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
        drive = self._drive
        wanted = drive.force - drive.gain * self._qacc[self._dofs]
        beyond = np.abs(wanted) > drive.limit
        if self._bound:
            wanted = np.where(self._held, self._pull, wanted)
            beyond &= ~self._held
        self._pull = wanted
        if not np.count_nonzero(beyond):
            return False
        wanted[beyond] = np.copysign(drive.limit[beyond], wanted[beyond])
        self._mass[self._diagonal[beyond]] -= drive.gain[beyond]
        self._held = beyond | self._held if self._bound else beyond
        force = self._force + np.where(self._held, wanted, drive.force)
        self._applied[self._dofs] = force
        self._bound = True
        return True

    def contacts(self) -> MujocoContacts | None:
        """Return the contacts of the robot in the last step."""
        d = self._scene.data
        return self._told(d.contact.geom, lambda: points_of(d)) if d.ncon else None

    def contacts_of(self, record: Floats) -> MujocoContacts | None:
        """Return those of a step by `write_step`, by what it recorded."""
        points = recorded(record)
        return self._told(points.geom, lambda: points)

    def _told(self, geom: NDArray[np.int32], points: Callable[[], Points]) -> MujocoContacts | None:
        touched = self._link[geom]
        return MujocoContacts(points, touched) if (touched >= 0).any() else None


def _driving(*given: Array) -> list[Array]:
    """Forces on the joints by drives and all else, and whether a drive is beyond its limit; pure.

    Args:
        given: force, limit, gain and armature of the drives, other forces, acceleration.
    """
    force, limit, gain, armature, outer, change = given
    wanted = force - gain * change
    xp = namespace(wanted)
    return [outer + (wanted - armature * change), xp.any(xp.abs(wanted) > limit)]


def _span(places: list[int]) -> Any:
    """Places as a slice where they follow each other: views in place of copies."""
    if places and places == list(range(places[0], places[0] + len(places))):
        return slice(places[0], places[0] + len(places))
    return np.array(places, dtype=int)


def _shifted(quaternion: Array, places: int) -> Array:
    """Quaternion with its parts moved on: w x y z to x y z w by -1, back by 1."""
    parts = quaternion[-places:], quaternion[:-places]
    return namespace(quaternion).concat(parts, axis=0)


def _turned(columns: Array, rotation: Array) -> Array:
    """Columns 3 to 6 times a rotation, the others as they are."""
    parts = (columns[:, :3], columns[:, 3:6] @ rotation, columns[:, 6:])
    return namespace(columns).concat(parts, axis=1)
