"""One robot in PyBullet: pose, velocity, loads and contacts in the engine."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from seals.arrays import Array, Floats
from seals.frames import carried, conjugate, matrix_of, multiply
from seals.multibody.tree import Tree
from seals.plugins.backends.pybullet.loading import Loaded, load_robot
from seals.robot.model import RobotModel
from seals.scalar_compiler import Place, Program

TOP_SPEED = 99.0
"""Speed above which motion is refused [m/s, rad/s]; the engine clamps silently at 100."""

NEAR = 0.2
"""Distance from what stands still below which steps are made one by one [m].

The engine keeps contacts of a few centimetres."""
Given: TypeAlias = tuple[Place, int]
"""Place of some numbers, and how many."""
_NOTHING = [0.0, 0.0, 0.0]
_MOTOR_FORCE, _VELOCITY_LIMIT = 3, 11
"""Places of the motor's force in the engine's state of a joint, and of its limit in the joint's
data."""


class PybulletBody:
    """A robot in the scene, see `seals.coupling.EngineBody`.

    Its velocity is that of the centre of mass of the base.

    Args:
        engine: the pybullet module.
        client: physics client.
        robot: model to load.
        scene: stays open as long as the body holds it.

    Attributes:
        body: PyBullet's number of the robot.
    """

    top_speed = TOP_SPEED
    contact_motors = True
    stops_taken_back = 0.2
    """Error reduction of joint limits (``m_erp``, Bullet 3.25)."""

    def __init__(self, engine: Any, client: int, robot: RobotModel, scene: Any) -> None:
        self._p, self._client, self._scene = engine, client, scene
        loaded = load_robot(engine, client, robot)
        self.body, self._index, self._joints = loaded.body, loaded.index, loaded.joints
        self.reference, self.moments = loaded.base_centre, loaded.moments
        self._posing = _Posing(engine, client, robot.tree, loaded)
        back = np.argsort(loaded.order)
        self._order, self._back = loaded.order.tolist(), back.tolist()
        self.base_turn = loaded.base_turn
        self._turned = bool(np.any(loaded.base_turn[0, :3]))
        self._base_turn = np.asarray(loaded.base_turn)[0].tolist()
        self._reference = np.asarray(loaded.base_centre).tolist()
        self._base = 0 if robot.tree.fixed_base else 6
        self._straight = self._order == list(range(len(self._order)))
        self._sorted = np.concatenate([np.arange(self._base), self._base + back])
        self._row = {number: k for k, number in enumerate(loaded.index)}
        # where the URDF gives no velocity there is no limit
        table = [engine.getJointInfo(loaded.body, k, physicsClientId=client) for k in loaded.joints]
        stated = np.array([table[k][_VELOCITY_LIMIT] for k in self._back])
        self.joint_speed_limit = np.where(stated > 0.0, stated, np.inf)
        self._states: Any = ()
        degrees, joints = robot.degrees, robot.tree.joints
        self._now, ends = np.zeros(7 + degrees + joints), (3, 7, 7 + degrees)
        self._arrays = np.split(self._now, ends)
        self._felt, self._made = np.zeros(joints), False
        self._problem: BaseException | None = None
        # what `put` was given last; None where the engine stands elsewhere
        self._stands: Sequence[Any] | None = None

    def place(self, position: Floats, quaternion: Floats) -> None:
        """Set the pose of the base link."""
        self._stands = None
        rotation = matrix_of(quaternion[None])[0]
        turn = multiply(quaternion[None], conjugate(self.base_turn))[0]
        self._p.resetBasePositionAndOrientation(
            self.body,
            (position + rotation @ self.reference).tolist(),
            turn.tolist(),
            physicsClientId=self._client,
        )

    def base_pose(self) -> tuple[Floats, Floats]:
        """Return origin and attitude of the base link.

        The engine reports the centre of mass and the attitude of the principal axes.
        """
        place, turn = self._of_base(*self.native_pose())
        return np.array(place), np.array(turn)

    def base_poses(self, poses: Floats) -> tuple[Floats, Floats]:
        """Return the same for rows of `native_pose`, shape (N, 7)."""
        place, turn = self._of_base(poses[:, :3].T, poses[:, 3:].T)
        return np.stack(place, axis=1), np.stack(turn, axis=1)

    def _of_base(self, position: Any, turn: Any) -> tuple[list[Any], Sequence[Any]]:
        """Origin and attitude of the base link, of numbers or of columns: equal bits."""
        # a few numbers: faster one by one than as arrays
        if self._turned:
            (x, y, z, w), (a, b, c, d) = turn, self._base_turn
            turn = (
                *(w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a),
                *(w * c + x * b - y * a + z * d, w * d - x * a - y * b - z * c),
            )
        x, y, z, w = turn
        arm = carried(x, y, z, w, self._reference)
        return [p - q for p, q in zip(position, arm, strict=True)], tuple(turn)

    def native_pose(self) -> tuple[Floats, Floats]:
        """Return centre of mass and principal axes of the base."""
        found: tuple[Floats, Floats] = self._p.getBasePositionAndOrientation(
            self.body, physicsClientId=self._client
        )
        return found

    def link_poses(self) -> tuple[Floats, Floats]:
        """Return origins and rotations of all links."""
        return self._posing.read()

    def set_velocity(self, velocity: Floats, joints: Floats) -> None:
        """Set the velocity and the joint positions."""
        self._stands = None
        self._move(velocity.tolist(), joints.tolist())

    def _move(self, velocity: list[float], joints: list[float]) -> None:
        p, client, base = self._p, self._client, self._base
        if base:
            linear, spin = velocity[:3], velocity[3:6]
            p.resetBaseVelocity(self.body, linear, spin, physicsClientId=client)
        if self._joints:
            order = self._order
            p.resetJointStatesMultiDof(
                self.body,
                self._joints,
                [[joints[k]] for k in order],
                [[velocity[base + k]] for k in order],
                physicsClientId=client,
            )

    def native(self) -> tuple[Floats, ...]:
        """Return place, attitude, velocity and joints."""
        return *self.native_pose(), *self.state()

    def read_law(self, *native: Array) -> tuple[Array, Array, Array, Array]:
        """Return the same with a batch of one."""
        place, turn, velocity, joints = native
        return place[None], turn[None], velocity[None], joints[None]

    def write_law(self, place: Array, turn: Array, velocity: Array, joints: Array) -> list[Array]:
        """Return place, attitude, velocity and joints."""
        return [place[0], turn[0], velocity[0], joints[0]]

    def put(self, *written: Floats) -> None:
        """Set place, attitude, velocity and joints."""
        self._put(written, *(values.tolist() for values in written))

    def _put(
        self, written: Any, place: Any, turn: Any, velocity: list[float], joints: list[float]
    ) -> None:
        if self._base:
            self._p.resetBasePositionAndOrientation(
                self.body, place, turn, physicsClientId=self._client
            )
        self._move(velocity, joints)
        self._stands = written

    def forget(self) -> None:
        """Forget what `put` was given: the engine stands elsewhere."""
        self._stands = None

    def shift_base(self, displacement: Floats) -> None:
        """Move the base by a small displacement, world axes [m, rad], shape (6,)."""
        p, client, given = self._p, self._client, displacement.tolist()
        position, turn = p.getBasePositionAndOrientation(self.body, physicsClientId=client)
        place = [x + d for x, d in zip(position, given[:3], strict=True)]
        p.resetBasePositionAndOrientation(
            self.body, place, turned(turn, given[3:]), physicsClientId=client
        )

    def state(self) -> tuple[Floats, Floats]:
        """Return the velocity and the joint positions."""
        velocity, joints = self._motion()
        return np.array(velocity), np.array(joints)

    def _motion(self) -> tuple[list[float], list[float]]:
        velocity: list[float] = []
        joints: list[float] = []
        if self._base:
            linear, spin = self._p.getBaseVelocity(self.body, physicsClientId=self._client)
            velocity += linear + spin
        if self._joints:
            states = self._p.getJointStates(self.body, self._joints, physicsClientId=self._client)
            joints += [states[k][0] for k in self._back]
            velocity += [states[k][1] for k in self._back]
            self._states = states
        return velocity, joints

    def mass_matrix(self, joints: Floats) -> Floats:
        """Return the generalised inertia at joint positions."""
        table: Floats = np.array(
            self._p.calculateMassMatrix(
                self.body, self._engine_order(joints), physicsClientId=self._client
            )
        )
        return table if self._straight else table[self._sorted[:, None], self._sorted]

    def set_inertia(self, link: int, mass: float, moments: Floats) -> None:
        """Set mass and principal moments of a link."""
        self._p.changeDynamics(
            self.body,
            self._index[link],
            mass=mass,
            localInertiaDiagonal=moments.tolist(),
            physicsClientId=self._client,
        )

    def apply_wrenches(self, wrenches: Floats, origins: Floats, rotations: Floats) -> None:
        """Apply wrenches over the next step."""
        # rows force and torque of every link, turned into the world at once
        both = np.matmul(wrenches.reshape(-1, 2, 3), rotations.transpose(0, 2, 1)).tolist()
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

    def apply_generalised(self, force: Floats, joint_forces: Floats, origin: Floats) -> None:
        """Apply a generalised force over the next step."""
        p, client, given = self._p, self._client, force.tolist()
        if self._base:
            place, frame = origin.tolist(), p.WORLD_FRAME
            p.applyExternalForce(self.body, -1, given[:3], place, frame, physicsClientId=client)
            p.applyExternalTorque(self.body, -1, given[3:6], frame, physicsClientId=client)
        if self._joints:
            self.apply_joint_forces(force[self._base :] + joint_forces)

    def alone(self) -> bool:
        """Return whether the robot is the only one of the scene."""
        return bool(self._scene.robots == 1)

    def native_places(self) -> list[int]:
        """Return the addresses of what `native` returns, after a step by `write_step`."""
        return [x.ctypes.data for x in self._arrays]

    def write_step(
        self, program: Program, loads: tuple[Given, Given], origin: Place, stays: Callable[[], bool]
    ) -> None:
        """Write a step of the engine, refused where something may touch; Python is called in it.

        Args:
            program: to write to.
            loads: places of the first two arguments of `apply_generalised`, with their lengths.
            origin: place of the third.
            stays: whether the engine's masses may stay as they are.
        """
        given = [np.zeros(size) for size in (*(size for _, size in loads), 3)]
        for array, (place, size) in zip(given, (*loads, (origin, 3)), strict=True):
            program.copy(program.memory(array), place, size)
        refused = np.zeros(1)

        def step() -> None:
            if stays() and self._clear():
                self.apply_generalised(*given)
                self._p.stepSimulation(physicsClientId=self._client)
                self._made = True
                (place, turn), (velocity, joints) = self.native_pose(), self._motion()
                self._now[:] = [*place, *turn, *velocity, *joints]
                # the engine's contacts of large bodies begin farther away
                refused[0] = float(self.contacts() is not None)

        program.copy(program.memory(refused), program.memory(np.ones(1)), 1)
        self._write_call(program, step)
        program.refuse_if(program.memory(refused))

    def write_put(self, program: Program, written: Sequence[Given], forces: Given) -> Given:
        """Write `put`, and that the forces on the joints are kept; return the place of the pose."""
        *ends, whole = np.cumsum([size for _, size in written]).tolist()
        kept, pose = np.zeros(whole), np.zeros(7)
        for array, given in zip(np.split(kept, ends), written, strict=True):
            program.copy(program.memory(array), *given)
        program.copy(program.memory(self._felt), *forces)

        def put() -> None:
            self._made = False
            values = kept.tolist()
            parts = [values[a:b] for a, b in zip((0, *ends), (*ends, whole), strict=True)]
            self._put(parts, *parts)
            place, turn = self.native_pose()
            pose[:] = place + turn

        self._write_call(program, put)
        return program.memory(pose), 7

    def _write_call(self, program: Program, function: Callable[[], None]) -> None:
        """Write a call of Python; once one has failed there are no more, see `leave`."""

        def called() -> None:
            if self._problem is not None:
                return
            try:
                function()
            except BaseException as problem:  # it cannot pass through machine code
                self._problem = problem

        entry = ctypes.CFUNCTYPE(None)(called)
        address = ctypes.cast(entry, ctypes.c_void_p).value
        assert address is not None
        program.address(address, entry)
        program.call(address)

    def _clear(self) -> bool:
        """Return whether nothing is so near that it may touch in the next step."""
        near = self._p.getClosestPoints
        return not any(
            near(self.body, solid, NEAR, physicsClientId=self._client)
            for solid in self._scene.solids
        )

    def begin_alone(self) -> None:
        """Prepare for steps by `write_step`."""
        if self._stands is None:
            self._stands = self.native()
        self._problem, self._made = None, False

    def leave(self) -> None:
        """Take back a step by `write_step` that was refused.

        Raises:
            BaseException: what was raised in it, by the engine or in Python.
        """
        problem, self._problem = self._problem, None
        if self._made:
            self._made = False
            assert self._stands is not None
            self.put(*(np.asarray(x) for x in self._stands))
        if problem is not None:
            raise problem

    def end_alone(self) -> Floats:
        """Return the forces on the joints in the last step by `write_step`."""
        forces: Floats = self._felt.copy()
        return forces

    def apply_joint_forces(self, forces: Floats) -> None:
        """Apply forces on the joints over the next step."""
        self._p.setJointMotorControlArray(
            self.body,
            self._joints,
            self._p.TORQUE_CONTROL,
            forces=self._engine_order(forces),
            physicsClientId=self._client,
        )

    def set_motors(self, speed: Floats, force: Floats) -> None:
        """Set velocity motors on the joints, with their largest forces."""
        self._p.setJointMotorControlArray(
            self.body,
            self._joints,
            self._p.VELOCITY_CONTROL,
            targetVelocities=self._engine_order(speed),
            forces=self._engine_order(force),
            physicsClientId=self._client,
        )

    def motor_forces(self) -> Floats:
        """Return the forces of the motors over the last step."""
        return np.array([self._states[k][_MOTOR_FORCE] for k in self._back])

    def contacts(self) -> PybulletContacts | None:
        """Return the contacts of the robot in the last step."""
        points = self._p.getContactPoints(bodyA=self.body, physicsClientId=self._client)
        return PybulletContacts(points, self._row) if points else None

    def _engine_order(self, values: Floats) -> list[float]:
        """Values of the joints in the engine's order."""
        given = values.tolist()
        return [given[k] for k in self._order]


class PybulletContacts:
    """Contacts of one step, see `seals.coupling.ContactPoints`.

    Args:
        points: as the engine gives them.
        row: link of the robot model by the engine's number.
    """

    def __init__(self, points: Any, row: Mapping[int, int]) -> None:
        self._points = points
        self.links = [row[point[3]] for point in points]

    def forces(self) -> tuple[Floats, Floats, Floats]:
        """Return points, forces and normal forces."""
        # positions, normal, its force, and two directions of friction with theirs
        table = np.array([(*q[5], *q[7], q[9], *q[11], q[10], *q[13], q[12]) for q in self._points])
        parts = table[:, 3:].reshape(-1, 3, 4)
        force: Floats = np.matmul(parts[:, None, :, 3], parts[:, :, :3])[:, 0]
        return table[:, :3], force, table[:, 6]


class _Posing:
    """Reads the poses of all links.

    The engine tells the pose of a link's centre of mass in double precision and that of its frame
    in single precision, so frames are composed here. Asking the engine for a link costs more than
    that: links that are fixed to others (cameras, finger-tips) are not asked for.

    Args:
        engine: the pybullet module.
        client: physics client.
        tree: of the robot.
        loaded: the robot in the engine.
    """

    def __init__(self, engine: Any, client: int, tree: Tree, loaded: Loaded) -> None:
        self._p, self._client, self._body = engine, client, loaded.body
        moving = [k for k in range(1, tree.links) if tree.joint[k] >= 0]
        self._asked = [loaded.index[k] for k in moving]
        frames = [(loaded.base_centre, matrix_of(loaded.base_turn)[0].T)]
        for s in self._states():
            frames.append((np.array(s[2]), matrix_of(np.array([s[3]]))[0]))
        rows = {k: (row, *_seen(*frames[row])) for row, k in enumerate((0, *moving))}
        for k in range(1, tree.links):
            if k not in rows:
                row, offset, turn = rows[tree.parent[k]]
                rows[k] = (row, offset + turn @ tree.origin[k], turn @ tree.rotation[k])
        table = [rows[k] for k in range(tree.links)]
        self._row = np.array([row for row, _, _ in table])
        # attitude and place in the engine's axes as one matrix of four columns
        self._on = np.array([np.column_stack((turn, offset)) for _, offset, turn in table])

    def _states(self) -> Any:
        if not self._asked:
            return ()
        return self._p.getLinkStates(
            self._body, self._asked, computeForwardKinematics=1, physicsClientId=self._client
        )

    def read(self) -> tuple[Floats, Floats]:
        """Return origins (L, 3) [m] and rotations (L, 3, 3) of all links."""
        position, quaternion = self._p.getBasePositionAndOrientation(
            self._body, physicsClientId=self._client
        )
        table = np.array([position + quaternion, *(s[0] + s[1] for s in self._states())])
        both = matrix_of(table[:, 3:]).take(self._row, axis=0) @ self._on
        return table[:, :3].take(self._row, axis=0) + both[:, :, 3], both[:, :, :3]


def _seen(centre: Floats, turn: Floats) -> tuple[Floats, Floats]:
    """Place and attitude of a link in its principal axes about its centre of mass.

    Args:
        centre: of mass, in the link [m], shape (3,).
        turn: rotation of the principal axes in the link, shape (3, 3).
    """
    return -turn.T @ centre, turn.T


def turned(quaternion: tuple[float, ...], vector: list[float]) -> list[float]:
    """Return a quaternion (x y z w) rotated by a small rotation vector in world axes [rad]."""
    x, y, z, w = quaternion
    a, b, c = (0.5 * v for v in vector)
    # cos and sin(h)/h of the half angle h to fourth order: h is about 1e-5
    square = a * a + b * b + c * c
    d, scale = 1.0 - 0.5 * square, 1.0 - square / 6.0
    a, b, c = scale * a, scale * b, scale * c
    return [
        d * x + a * w + b * z - c * y,
        d * y + b * w + c * x - a * z,
        d * z + c * w + a * y - b * x,
        d * w - a * x - b * y - c * z,
    ]
