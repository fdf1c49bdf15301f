"""Protocols of rigid-body backends: `Backend` for a scene, `RigidBody` for a robot in it.

`Backend` states the order of calls; docs/own_backend_and_fluid.md leads through a new one.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np

from seals.arrays import Array, Floats
from seals.effects.evaluation import Evaluation
from seals.environment.settings import EnvironmentSettings
from seals.errors import refuse_unlisted
from seals.motion import JointDrive, Motion
from seals.multibody.kinematics import Kinematics, LinkVelocities
from seals.robot.model import RobotModel


class Configuration(NamedTuple):
    """Pose and velocity of a robot: base and joints.

    Args:
        position: base origin, world [m], shape (3,).
        quaternion: q_WB_xyzw, shape (4,).
        velocity: of the base origin, world axes [m/s], shape (3,).
        angular_velocity: world axes [rad/s], shape (3,).
        joints: [rad or m], shape (J,).
        joint_velocity: [rad/s or m/s], shape (J,).
    """

    position: Floats
    quaternion: Floats
    velocity: Floats
    angular_velocity: Floats
    joints: Floats
    joint_velocity: Floats


class LinkPoses(NamedTuple):
    """Poses of all links of a robot and its generalised velocity.

    Args:
        origins: of the links, world [m], shape (1, L, 3).
        rotations: R_WL, shape (1, L, 3, 3).
        speed: generalised velocity, shape (1, n).
    """

    origins: Array
    rotations: Array
    speed: Array


class Dynamics(NamedTuple):
    """Everything a backend needs to advance one robot.

    Args:
        kinematics: of the links.
        moving: velocities of the links.
        motion: of the links.
        found: outputs of the effects.
        wrench: sum of the effects' wrenches about the link origins, link axes, shape (1, L, 6).
        joint_force: [N m or N], shape (1, J).
        joint_drive: what drives the joints beside ``joint_force``, for a body that takes it
            implicitly; None for nothing.
        armature: inertia of the drives on the joints [kg m^2 or kg], shape (J,); None for none.
        discontinuous: whether the wrench may be unlike that of the last step, as a fluid's is: what
            the joints felt then does not foretell what they feel now.
    """

    kinematics: Kinematics
    moving: LinkVelocities
    motion: Motion
    found: Evaluation
    wrench: Array
    joint_force: Array
    joint_drive: JointDrive | None = None
    armature: Floats | None = None
    discontinuous: bool = False


class BodyOptions:
    """Optional attributes of a body and their defaults; a base class, or read by `options_of`."""

    implicit: ClassVar[bool] = False
    """Whether it takes joint drives implicitly; to others they are part of ``joint_force``."""

    reference: Floats = np.zeros(3)
    """Point of the base whose velocity `mean_speed` states, base axes [m], shape (3,)."""

    def mean_speed(self) -> Floats | None:
        """Return the mean generalised velocity over the last step, shape (n,), or None.

        That of ``reference``, angular and of the joints: the pose moved by h times it. None where
        the body does not keep it: sensors then take the change of the velocity at the step's end.
        """
        return None

    def middle_speed(self) -> Floats | None:
        """Return the generalised velocity at the middle of the last step, shape (1, n), or None.

        None where it is not known: after a start or a contact, and in first-order steps.
        """
        return None

    def joint_forces(self) -> Floats | None:
        """Return the forces on the joints over the last step [N m or N], shape (J,), or None.

        Those of drives and effects; contacts and stops are not among them. None where the body does
        not keep them: what needs the power of the joints is refused then.
        """
        return None


class RigidBody(Protocol):
    """One robot in a backend's scene.

    What a body may have beside these, and the defaults: `BodyOptions`.
    """

    robot: RobotModel

    def reset(self, configuration: Configuration) -> None:
        """Set the state of the robot and clear the memory of earlier steps."""

    def read(self) -> Configuration:
        """Return pose, velocity and joint state of the robot."""

    def poses(self) -> LinkPoses:
        """Return the poses of all links and the generalised velocity."""

    def joint_positions(self) -> Floats:
        """Return the joint coordinates [rad or m], shape (J,)."""

    def apply(self, dynamics: Dynamics, step: float) -> None:
        """Set the loads on the robot for the next step [s]."""

    def contact_wrenches(self) -> Floats:
        """Return the contact wrenches of the last step, shape (L, 6).

        They act about the link origins and are given in link axes [N, N m].
        """

    def contact_normals(self) -> Floats:
        """Return the sum of the normal forces on every link in the last step [N], shape (L,)."""


class LinksAt(Protocol):
    """Links of a robot at one instant."""

    @property
    def kinematics(self) -> Kinematics:
        """Their poses."""


Follow = Callable[
    [tuple[Floats, ...], tuple[Floats, ...], float], "tuple[Floats, list[Floats]] | None"
]
"""Function from what `CompiledEngineBody.native` gives, the other arguments of
`CompiledBody.leapt` and the step [s] to the links (`CompiledBody.followed`) and the results of
`CompiledBody.leapt`; None where it says that there are none."""


class CompiledBody(RigidBody, Protocol):
    """Body whose steps can be computed by machine code, see `seals.world.compiled`.

    Args:
        followed: the links at the new time, which the last step found; None for not yet.
        reference: see `BodyOptions.reference`.
    """

    followed: Floats | None
    reference: Floats

    def mean_speed(self) -> Floats:
        """Return the mean velocity over the last step, see `BodyOptions.mean_speed`."""

    def middle_speed(self) -> Floats | None:
        """Return the velocity at the middle of the last step, see `BodyOptions.middle_speed`."""

    def interpret(self) -> None:
        """Continue without compiled laws."""

    def compile(self, *, inertial: bool, follow: Follow) -> None:
        """Prepare.

        Args:
            inertial: whether effects add inertia.
            follow: finds the new state after a step without contacts, by `leapt`.
        """

    def leapt(
        self, native: Sequence[Array], own: Sequence[Array], step: float
    ) -> tuple[Sequence[Array], list[Array]]:
        """Return the state after a step without contacts, and the requested quantities; pure.

        The state is place, attitude, joints, velocity now and half a step ago; of the second the
        last is not zero where the step met a stop or is to be refused.

        Args:
            native: state of the engine after its step.
            own: velocity and joints before the step, and the velocity half a step earlier, if any.
            step: h [s].
        """

    def coordinates(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return position, attitude, joints and velocity, for `at_origin` and the tree.

        Shapes (3,), (4,), (J,) and (n,), as the engine keeps them.
        """

    def at_origin(self, place: Array, turn: Array, native: Array) -> tuple[Array, Array, Array]:
        """Return place and rotation of the base link, and the generalised velocity; pure.

        Args:
            place: position of `coordinates`, shape (1, 3).
            turn: attitude of `coordinates`, shape (1, 4).
            native: velocity of `coordinates`, shape (1, n).
        """

    def compiled_form(self, step: float, *, driven: bool) -> tuple[str, ...] | None:
        """Return how the next step [s] is computed; None where that is not compiled."""

    def compiled_arguments(self) -> tuple[Floats, ...]:
        """Return what `compiled_law` needs besides the dynamics and the joints' acceleration."""

    def compiled_law(
        self, form: tuple[str, ...], dynamics: Dynamics, step: float, *own: Array
    ) -> list[Array]:
        """Return what `give` takes; pure, on any array library."""

    def give(self, form: tuple[str, ...], results: list[Floats], links: LinksAt) -> bool:
        """Set the loads for the next step; false where the law is to be evaluated again."""

    def steps_alone(self) -> bool:
        """Return whether the next steps can be made by a program of `write_step`."""
        ...

    @property
    def touching(self) -> bool:
        """Whether something touched in the last step: `landed` follows then, not `leapt`."""
        ...

    def landed(self, native: Sequence[Array]) -> tuple[Sequence[Array], list[Array]]:
        """Return what `leapt` does, after a step in which something touched; pure.

        The mean velocity of the step stands for that half a step ago.

        Args:
            native: state of the engine after its step, velocities in world axes.
        """
        ...

    def native_state(self) -> tuple[tuple[Floats, ...], tuple[Floats, ...]]:
        """Return the two arguments of `leapt`, the second with all three parts.

        Where something touched that of `landed`, and nothing.
        """
        ...

    def native_places(self) -> list[int]:
        """Return the addresses of the engine's state, whose last two the results of `leapt` set."""
        ...

    def write_world(self, program: Any) -> list[Any]:
        """Write the state after a step; return the places of what `landed` takes.

        Args:
            program: `seals.scalar_compiler.Program`.
        """
        ...

    def write_put(
        self, program: Any, written: Sequence[tuple[Any, int]], forces: tuple[Any, int]
    ) -> tuple[Any, int] | None:
        """Write that the engine takes a state of `leapt`, in a step that is not refused.

        Args:
            program: `seals.scalar_compiler.Program`.
            written: places of the results of `leapt` that the engine takes, with lengths.
            forces: the first result of `compiled_law` but one: those on the joints.

        Returns:
            Place and length of the pose as the engine tells it, for `read_rows`; None where that is
            what it was given.
        """
        ...

    def write_step(
        self,
        program: Any,
        loads: Sequence[tuple[Any, int]],
        origin: Any,
        beside: Sequence[tuple[Any, Sequence[tuple[Any, int]]]],
        *,
        touching: bool,
    ) -> tuple[Any, int] | None:
        """Write a step of the engine, refused where it asks for more than `leapt` and `give` do.

        Args:
            program: `seals.scalar_compiler.Program`.
            loads: places of the results of `compiled_law`, with their lengths.
            origin: place of that of the base at its start, world.
            beside: the bodies of the other robots of the scene, with their loads.
            touching: whether something touches in it; refused where that is not so.

        Returns:
            Place and length of a record of the contacts, for `note_contacts`; None for none.
        """
        ...

    def note_contacts(self, record: Floats, began: LinksAt) -> None:
        """Note the contacts of a step.

        Args:
            record: of them.
            began: the links where the step began.
        """
        ...

    def reaches_stop(self, joints: Array, speed: Array, step: float) -> Array | None:
        """Return whether the step after a state of `leapt` meets a stop; None for never; pure.

        Args:
            joints: shape (J,).
            speed: velocity now, shape (n,).
            step: h [s].
        """
        ...

    def begin_alone(self, step: float) -> None:
        """Prepare for steps of h [s] by a program."""
        ...

    def leave(self) -> None:
        """End steps by a program: the engine takes back one that was refused."""
        ...

    @property
    def velocity(self) -> Floats:
        """The engine's generalised velocity now, shape (n,)."""
        ...

    def end_alone(
        self, followed: Floats, joints: Floats, now: Floats, middle: Floats | None, kick: Floats
    ) -> None:
        """Note the steps that a program has made: `followed` and what `leapt` found at the end.

        ``middle`` is None where something touched; `note_contacts` follows. ``kick``: the change of
        the velocity in the last one.
        """
        ...


LONG = 2500
"""Steps from which it pays to compile laws: it takes as long as some thousand steps without."""


class BackendOptions:
    """Optional attributes of a backend and their defaults."""

    compiled: str = "false"
    """Whether the laws of its robots are compiled, see `compiles`: bodies are `CompiledBody`."""


def checked_choice(compiled: str | bool) -> str:
    """Return the choice ``backend.compiled`` as a word.

    Raises:
        ConfigError: it is none of ``auto``, ``true`` and ``false``.

    Example:
        >>> checked_choice(True), checked_choice("auto")
        ('true', 'auto')
    """
    word = str(compiled).lower()
    refuse_unlisted(word, ["auto", "true", "false"], f"backend.compiled={compiled} is not allowed")
    return word


def compiles(choice: str, steps: int) -> bool:
    """Return whether the laws of a world are compiled.

    Args:
        choice: ``auto`` for where llvmlite is installed and a run has `LONG` steps or more; or
            ``true`` or ``false``.
        steps: of the run.

    Example:
        >>> compiles("auto", 10), compiles("true", 10)
        (False, True)
    """
    if choice != "auto":
        return choice == "true"
    return steps >= LONG and importlib.util.find_spec("llvmlite") is not None


class Backend(Protocol):
    """A rigid-body engine: contacts, joints, many robots in one scene.

    Order of calls: `open` once, `add` for every robot, `RigidBody.reset` of every robot; then in
    every step `RigidBody.apply` of every robot and one `advance`. Snapshots are taken and put back
    between steps. An engine whose robots are `seals.coupling.CoupledBody` implements
    `seals.coupling.EngineBody` instead of `RigidBody`.
    """

    def open(self, environment: EnvironmentSettings, step: float) -> None:
        """Start an empty scene with ground or bottom and the given step [s].

        What stands still, with friction and restitution, comes from
        `seals.environment.ground.solids_of`. The engine applies no gravity: it acts as an effect.
        """

    def add(self, robot: RobotModel) -> RigidBody:
        """Add a robot to the scene.

        Links, masses, inertias and joints are those of the model; its masses may differ from those
        of the URDF, and ``robot.surface``, if given, replaces the URDF's contact coefficients.
        Engines with contacts stop joints at ``robot.lower`` and ``robot.upper``. The engine adds
        no damping, no joint friction and no joint motors of its own.
        """

    def advance(self) -> None:
        """Advance the scene by one step under the loads last applied to every robot.

        Forces and wrenches act over this step alone.
        """

    def snapshot(self) -> Any:
        """Return an opaque copy of the state of the scene."""

    def restore(self, snapshot: Any) -> None:
        """Restore the scene to a snapshot."""

    def close(self) -> None:
        """Release the engine."""


@runtime_checkable
class Storing(Protocol):
    """Protocol of a backend whose state can be stored on disk, for checkpoints."""

    def store(self, path: Path) -> Any:
        """Write the scene to a file; return the rest of the state as arrays, numbers, records."""

    def recall(self, path: Path, bodies: Any) -> Any:
        """Return a snapshot from the file and the result of `store`."""
