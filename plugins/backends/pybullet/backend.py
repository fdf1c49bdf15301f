"""PyBullet backend: opening of a scene, ground, stepping, snapshots."""

from __future__ import annotations

import errno
import os
import struct
import weakref
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seals.backend import RigidBody, checked_choice
from seals.coupling import CoupledBody
from seals.environment.ground import Solid, solids_of
from seals.environment.settings import EnvironmentSettings
from seals.errors import PhysicsError, optional_import
from seals.field_roles import roles
from seals.plugins.backends.pybullet.body import PybulletBody
from seals.plugins.backends.pybullet.trial import survived
from seals.robot.model import RobotModel
from seals.schema import count
from seals.terminal import silenced

_HEAD = 12
"""Mark, size of numbers and pointers, byte order, version."""
_LAST = b"DNA1"
"""Name of the last chunk: the description of all the others."""
_LONG = b"-"
"""Mark of 8-byte pointers; the other one, ``_``, stands for 4 bytes."""


@roles(data="second_order compiled")
@dataclass(kw_only=True)
class BackendPybullet:
    """Rigid bodies by PyBullet's multi-body solver, with second-order steps and added mass.

    Equation:
        Featherstone's articulated-body algorithm with semi-implicit Euler steps. Velocities are
        kept half a step back (leapfrog) while nothing touches, which makes the positions
        second-order accurate; a contact or a joint stop falls back to the plain first-order step.

    Args:
        solver_iterations: iterations of the contact solver.
        second_order: whether to use half-step velocities.
        compiled: whether to compile the laws of all robots to machine code, once for each robot and
            its effects, in seconds: ``true``, which needs llvmlite, ``false``, or ``auto`` for runs
            of 2,500 steps or more where llvmlite is installed and the laws can be compiled. Robots
            in a simulated fluid go without.

    Assumptions:
        Rigid links, Coulomb contacts with the default friction cone.

    Valid range:
        Speeds below 99 m/s and 99 rad/s: the engine clamps at 100, so faster motion is refused.

    Limitations:
        No automatic differentiation; one robot of eight links advances some thousand steps a
        second.

    References:
        Coumans and Bai 2016-2021, PyBullet; Featherstone 2008, Rigid Body Dynamics Algorithms.

    Example:
        >>> BackendPybullet().second_order
        True
    """

    solver_iterations: int = count(50, bounds=(1, 10_000))
    second_order: bool = True
    compiled: str = "auto"

    def __post_init__(self) -> None:
        """Keep the engine closed until `open`."""
        self.compiled = checked_choice(self.compiled)
        self._engine: Any = None
        self._client = -1
        self._bodies: list[CoupledBody] = []
        self._engines: list[PybulletBody] = []
        self._ground: list[int] = []
        self._scene = _Scene()
        self._close: weakref.finalize[..., Any] | None = None

    def open(self, environment: EnvironmentSettings, step: float) -> None:
        """Start an empty scene with ground or bottom."""
        self._engine = _engine()
        p = self._engine
        self._client = p.connect(p.DIRECT)
        if self._client < 0:
            raise PhysicsError(
                "PyBullet gave no physics client.\nClose other worlds of this process first."
            )
        # a world that is refused half-way, or forgotten, would keep 30 MB to the process's end
        self._scene = _Scene()
        self._close = weakref.finalize(self._scene, p.disconnect, physicsClientId=self._client)
        self._close.atexit = False
        p.setPhysicsEngineParameter(
            fixedTimeStep=step,
            numSolverIterations=self.solver_iterations,
            # it would leave stops and contacts that were passed by more than 0.04 as they are
            useSplitImpulse=0,
            enableFileCaching=0,
            deterministicOverlappingPairs=1,
            physicsClientId=self._client,
        )
        # gravity acts as an effect on the real mass, so that added mass inside the engine has no
        # weight
        p.setGravity(0.0, 0.0, 0.0, physicsClientId=self._client)
        self.step = step
        self._ground = [_put(p, self._client, solid) for solid in solids_of(environment)]
        self._scene.solids = tuple(self._ground)

    def add(self, robot: RobotModel) -> RigidBody:
        """Add a robot to the scene."""
        engine = PybulletBody(self._engine, self._client, robot, self._scene)
        body = CoupledBody(engine, robot, second_order=self.second_order)
        self._bodies.append(body)
        self._engines.append(engine)
        self._scene.robots += 1
        return body

    def advance(self) -> None:
        """Advance the scene by one step."""
        self._engine.stepSimulation(physicsClientId=self._client)
        for body in self._bodies:
            body.after_step(self.step)

    def snapshot(self) -> Any:
        """Return the state of the engine and the half-step velocities."""
        state = self._saved()
        return state, [body.snapshot() for body in self._bodies]

    def restore(self, snapshot: Any) -> None:
        """Restore the scene to a snapshot."""
        state, bodies = snapshot
        self._engine.restoreState(stateId=state.number, physicsClientId=self._client)
        for engine in self._engines:
            engine.forget()
        for body, kept in zip(self._bodies, bodies, strict=True):
            body.restore(kept)

    def store(self, path: Path) -> Any:
        """Write the engine's state to a file; return the state outside the engine.

        Raises:
            OSError: the disk is full.
        """
        self._engine.saveBullet(str(path), physicsClientId=self._client)
        if not whole(path):
            # the engine writes on without looking whether anything arrives
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        return [body.snapshot() for body in self._bodies]

    def recall(self, path: Path, bodies: Any) -> Any:
        """Return a snapshot from a file and the state outside the engine.

        Args:
            path: from `store`, of a scene with the same bodies.
            bodies: what it returned.

        Raises:
            ValueError: the file was cut short, or the engine crashes on it.
        """
        if not whole(path):
            raise ValueError(f"{path.name} is truncated")
        if not survived(lambda: self._tried(path)):
            raise ValueError(f"the engine crashes on {path.name}: it is damaged or forged")
        self._engine.restoreState(fileName=str(path), physicsClientId=self._client)
        return self._saved(), bodies

    def _tried(self, path: Path) -> None:
        """Load a stored scene and step it, as a trial: the engine checks no length or address."""
        self._engine.restoreState(fileName=str(path), physicsClientId=self._client)
        self._engine.stepSimulation(physicsClientId=self._client)

    def _saved(self) -> _State:
        """Save the engine's state inside the engine."""
        return _State(self._engine, self._client, self._scene)

    def close(self) -> None:
        """Disconnect; a second call does nothing."""
        if self._close is not None:
            self._close()
        self._scene.open = False
        self._client = -1
        self._bodies.clear()
        self._engines.clear()
        self._ground.clear()


class _Scene:
    """Handle of an open scene, which ends with the last body or backend that holds it.

    The engine gives numbers of clients and states out again.

    Attributes:
        open: whether it is.
        robots: how many are in it.
        solids: the engine's numbers of what stands still.
    """

    open = True
    robots = 0
    solids: tuple[int, ...] = ()


class _State:
    """State saved inside the engine, released with its last reference."""

    def __init__(self, engine: Any, client: int, scene: _Scene) -> None:
        self.number = engine.saveState(physicsClientId=client)
        weakref.finalize(self, _forget, engine, client, self.number, weakref.ref(scene))


def _forget(engine: Any, client: int, number: int, scene: weakref.ReferenceType[_Scene]) -> None:
    """Remove a saved state, unless its scene was closed."""
    place = scene()
    if place is not None and place.open and engine.isConnected(physicsClientId=client):
        engine.removeState(number, physicsClientId=client)


def _put(p: Any, client: int, solid: Solid) -> int:
    """Add a static solid."""
    place = solid.position.tolist()
    if solid.terrain is not None:
        heights = solid.terrain.heights
        rows, columns = heights.shape
        across, up = solid.terrain.size
        shape = {
            "shapeType": p.GEOM_HEIGHTFIELD,
            "meshScale": [across / (columns - 1), up / (rows - 1), 1.0],
            "heightfieldData": heights.ravel().tolist(),
            # x runs fastest
            "numHeightfieldRows": columns,
            "numHeightfieldColumns": rows,
        }
        # the engine puts the middle of the range at the origin of the body
        place[2] += 0.5 * float(heights.min() + heights.max())
    elif solid.kind == "plane":
        shape = {"shapeType": p.GEOM_PLANE, "planeNormal": [0, 0, 1]}
    elif solid.kind == "box":
        shape = {"shapeType": p.GEOM_BOX, "halfExtents": [0.5 * edge for edge in solid.size]}
    elif solid.kind == "sphere":
        shape = {"shapeType": p.GEOM_SPHERE, "radius": solid.size[0]}
    else:
        radius, length = solid.size
        shape = {"shapeType": p.GEOM_CYLINDER, "radius": radius, "height": length}
    body = p.createMultiBody(
        0.0,
        p.createCollisionShape(**shape, physicsClientId=client),
        basePosition=place,
        baseOrientation=solid.quaternion.tolist(),
        physicsClientId=client,
    )
    p.changeDynamics(
        body,
        -1,
        lateralFriction=solid.friction,
        restitution=solid.restitution,
        physicsClientId=client,
    )
    return int(body)


def _engine() -> Any:
    """Import the engine, without the line that its C code prints on the first import."""
    with (
        silenced(2),
        optional_import(
            "backend=pybullet needs the package pybullet",
            "Take backend=mujoco. PyBullet has wheels for Linux x86-64 with Python 3.10 and 3.11.",
        ),
    ):
        import pybullet
    return pybullet


def whole(path: Path) -> bool:
    """Return whether the file of a stored scene contains all its chunks in full.

    A file is a head and chunks of name, length, pointer, type and count, each followed by as many
    bytes as it says.

    References:
        Bullet 3.25, ``btSerializer.h`` and ``bFile.cpp``.
    """
    raw = path.read_bytes()
    if raw[:6] != b"BULLET" or raw[8:9] not in (b"v", b"V"):
        return False
    head = "4si" + ("8x" if raw[7:8] == _LONG else "4x") + "ii"
    order = "<" if raw[8:9] == b"v" else ">"
    place, name = _HEAD, b""
    while place + struct.calcsize(order + head) <= len(raw):
        name, length, *_ = struct.unpack_from(order + head, raw, place)
        if length < 0:
            return False
        place += struct.calcsize(order + head) + length
    return place == len(raw) and name == _LAST
