"""Interfaces of guides and controllers, and the data that they exchange.

guide --Reference--> controller --ActuatorCommand--> drives and servos, at the controller's rate.
Guides and controllers keep nothing to themselves: their memory is handed in and handed back, so
that a snapshot of the world holds it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np

from seals.arrays import Array, Floats
from seals.control.plant import Plant
from seals.errors import ConfigError
from seals.state_records import state_record

NOTHING: Mapping[str, Any] = MappingProxyType({})
STILL = np.zeros(3)
STILL.setflags(write=False)
NO_LEGS = np.zeros(0)
NO_LEGS.setflags(write=False)


class Buoyancy(NamedTuple):
    """Buoyancy of all hulls together.

    Args:
        force: against gravity [N]; shape (B, 1) for a batch.
        centre: where it acts, body axes about the body origin [m], shape (3,) or (B, 3).
    """

    force: Any
    centre: Array


class RobotState(NamedTuple):
    """State of the robot and its surroundings at one instant, for guides and controllers.

    Body axes are those of the base link, vectors in them are about its origin. For a batch, see
    `BatchController`, all have a first axis of B or one, numbers the shape (B, 1).

    Args:
        time: [s].
        step: time until the next call [s].
        position: body origin, world [m], shape (3,).
        rotation: R_WB, shape (3, 3).
        velocity: of the body origin, world axes [m/s], shape (3,).
        angular_velocity: body axes [rad/s], shape (3,).
        joints: [rad or m], shape (J,).
        joint_velocity: [rad/s or m/s], shape (J,).
        mass: of the whole robot [kg].
        centre: live centre of gravity of the whole robot, body axes [m], shape (3,).
        inertia: about the centre of gravity, body axes [kg m^2], shape (3, 3).
        centre_map: rate of ``centre`` for a unit rate of every joint, body axes [m], shape (3, J).
        momentum_map: angular momentum about the centre of gravity for a unit rate of every joint,
            body axes [kg m^2], shape (3, J).
        submersion: submerged share of all hulls' volume [1].
        buoyancy: of the wet part of all hulls.
        depth: of the body origin below the water surface, negative in air [m]; minus infinity
            without water.
        gain: thrust of every drive against that of its own map at the same command, by the
            robot's model: larger under water than in air [1], shape (n,).
        limit: largest command of every drive at its present place [rad/s or N], shape (n,).
        low: lowest command of every drive, likewise.
        readings: last reading of every sensor, by sensor and channel.
        contacts: normal force on every gripper's tip, by link name [N].
        bodies: origins of the other bodies of the scene, by name, world [m]; those of the true
            world, for animals that see.
        phase: of the legs of a robot that walks, as its gait remembers it [cycles], shape (legs,);
            empty for others.

    Example:
        >>> from seals import make
        >>> with make(["robot=hexacopter", "guide=hover"]) as world:
        ...     plant = world.actors["robot"].pilot.plant
        >>> isinstance(plant.gravity, float), "submersion" in RobotState._fields
        (True, True)
    """

    time: float
    step: float
    position: Floats
    rotation: Floats
    velocity: Floats
    angular_velocity: Floats
    joints: Floats
    joint_velocity: Floats
    mass: float
    centre: Floats
    inertia: Floats
    centre_map: Floats
    momentum_map: Floats
    submersion: float
    buoyancy: Buoyancy
    depth: float
    gain: Floats
    limit: Floats
    low: Floats
    readings: Mapping[str, Mapping[str, Floats]] = NOTHING
    contacts: Mapping[str, float] = NOTHING
    bodies: Mapping[str, Floats] = NOTHING
    phase: Floats = NO_LEGS

    @property
    def yaw(self) -> float:
        """Heading of the body x axis, anticlockwise from world x [rad]."""
        return math.atan2(self.rotation.item(1, 0), self.rotation.item(0, 0))


@state_record
class Reference(NamedTuple):
    """Reference values of a guide: velocity of the robot, angles of the arms, grippers.

    Args:
        velocity: of the body origin, world axes [m/s], shape (3,).
        acceleration: fed forward, world axes [m/s^2], shape (3,).
        yaw: heading [rad].
        yaw_rate: fed forward [rad/s].
        joints: joint values by arm [rad or m]; arms left out keep their last ones, stowed at first.
        grip: by gripper, 0 for open and 1 for closed [1]; those left out keep theirs, open first.
        position: held against drift, world [m], shape (3,); None for velocity alone.
        manner: how a walking robot shall step, values by name over those of its gait.
        rates: thrust of all rotors together as a share of their largest in air [1], and body rates
            [rad/s], shape (4,): velocity, attitude and heading are not controlled then; None for
            those loops, see `ControllerOptions.inner`.
        thrusts: of every rotor as a share of its largest in air [1], shape (n,): nothing is
            controlled then; None likewise.

    Example:
        >>> Reference(velocity=np.array([1.0, 0.0, 0.0])).yaw
        0.0
    """

    velocity: Floats = STILL
    acceleration: Floats = STILL
    yaw: float = 0.0
    yaw_rate: float = 0.0
    joints: Mapping[str, Floats] = NOTHING
    grip: Mapping[str, float] = NOTHING
    position: Floats | None = None
    manner: Mapping[str, float] = NOTHING
    rates: Floats | None = None
    thrusts: Floats | None = None

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the optional numbers that it holds, of `AIM_OPTIONS`."""
        return tuple(name for name in AIM_OPTIONS if getattr(self, name) is not None)


STATE_ARRAYS = (
    *("position", "rotation", "velocity", "angular_velocity", "joints", "joint_velocity"),
    *("centre", "inertia", "centre_map", "momentum_map", "gain", "limit", "low", "submersion"),
)
"""Numbers of a `RobotState` that have a row for every robot of a batch."""
AIM_ARRAYS = ("velocity", "acceleration", "yaw", "yaw_rate")
"""The same of a `Reference`, beside `AIM_OPTIONS`."""
AIM_OPTIONS = ("position", "rates", "thrusts")
"""Numbers of a `Reference` that may be missing."""


def of_one(s: RobotState, aim: Reference) -> tuple[RobotState, Reference]:
    """Return state and reference of one robot as those of a batch of one."""
    buoyancy = Buoyancy(*(_row(x) for x in s.buoyancy))
    state = s._replace(buoyancy=buoyancy, **{name: _row(getattr(s, name)) for name in STATE_ARRAYS})
    names = (*AIM_ARRAYS, *aim.given)
    return state, aim._replace(**{name: _row(getattr(aim, name)) for name in names})


def _row(value: Any) -> Array:
    """Return a number or an array as the only row of an array of at least two axes."""
    return np.full((1, 1), value) if isinstance(value, int | float) else value[None]


@state_record
class ActuatorCommand(NamedTuple):
    """Commands of a controller to drives and servos.

    Args:
        drive: of all drives, rotor speed [rad/s] or thruster force [N], shape (n,).
        joints: values for the servos [rad or m], speeds of driven wheels [rad/s], shape (J,).

    Example:
        >>> ActuatorCommand(drive=np.array([350.0] * 4), joints=np.zeros(2)).drive.shape
        (4,)
    """

    drive: Floats
    joints: Floats


@runtime_checkable
class BatchController(Protocol):
    """Velocity controller over a batch of robots."""

    def start(self, batch: int) -> Any:
        """Return the initial controller state, arrays of B rows each."""

    def command(self, situation: RobotState, aim: Reference, memory: Any) -> tuple[Array, Any]:
        """Return the commands of all drives, shape (B, n), and the new controller state.

        Args:
            situation: of all robots, shapes with a first axis of B or one; of depth it holds
                nothing, nor of joints that are held and the arm's maps.
            aim: velocity (B, 3) and heading (B, 1) that are wanted; for joints that are not held
                the other numbers as well, targets of an arm of the shape (B, k).
            memory: of the last call.
        """


Compiler = Callable[[Callable[..., Sequence[Array]], Sequence[tuple[int, ...]]], Any]
"""Function from a law on arrays and their shapes to its machine code, a function of numbers."""


class SearchLaw(NamedTuple):
    """Search for a command of the drives within their bounds, as machine code.

    Args:
        done: result of the command's law that is zero where the command is to be searched for;
            three more results follow those of memory then, for the search.
        turn: machine code of a turn of the search, of what is fixed and of its state, the first two
            of the three; it finds shares, whether to go on, and the state.
        found: machine code of the law with the shares and with the third of the three besides; it
            finds the command and the memory's numbers.
        turns: of the search, at most.
    """

    done: int
    turn: Any
    found: Any
    turns: int


def _nothing(aim: Reference) -> Mapping[str, Floats]:
    return {}


class CommandLaw(NamedTuple):
    """Law of a controller as machine code, for steps without Python.

    Args:
        kernel: machine code, `seals.scalar_compiler.Kernel`.
        names: of its arguments, of these: `STATE_ARRAYS`; ``force`` and ``place`` of the buoyancy;
            of the aim ``velocity_wanted``, ``acceleration``, ``yaw``, ``yaw_rate``; ``targets`` of
            the joints before and ``memory``; what ``aimed`` gives.
        memory: result that is the memory's numbers.
        numbers: gives those of a memory.
        remembered: gives the memory of numbers and of the memory before.
        order: result that is the command of the drives; None where it stays.
        targets: result that is the targets of the joints; None where they stay.
        search: for a command within the drives' bounds; None for none.
        aimed: gives more arguments of an aim, by name.
    """

    kernel: Any
    names: tuple[str, ...]
    memory: int
    numbers: Callable[[Any], Floats]
    remembered: Callable[[Floats, Any], Any]
    order: int | None = None
    targets: int | None = None
    search: SearchLaw | None = None
    aimed: Callable[[Reference], Mapping[str, Floats]] = _nothing


class ControllerOptions:
    """Optional attributes of a controller and their defaults; see `options_of`.

    Example:
        >>> class Still(ControllerOptions):
        ...     pass
        >>> Still.needs_mass_properties, Still.inner
        (True, False)
    """

    needs_mass_properties: ClassVar[bool] = True
    """Whether it asks for mass properties, buoyancy and limits of drives; situations hold those of
    the start otherwise, as for gaits."""

    inner: ClassVar[bool] = False
    """Whether a reference may pass by its outer loops: body rates, or thrusts of the rotors."""

    def leg_phase(self, memory: Any) -> Floats:
        """Return the phase of every leg in its cycle, shape (N,), from the memory."""
        return NO_LEGS

    def compile(self, compiled: Compiler | None) -> None:
        """Set the compiler of laws, None for none; called after `Controller.bind`."""

    def command_law(self, period: float, memory: Any, aim: Reference) -> CommandLaw | None:
        """Return its law for an aim that stays, without a position; None where it has none.

        Args:
            period: between commands [s].
            memory: its present one.
            aim: of the form that stays.
        """
        return None

    def batched(self, plant: Plant, joints: Floats | None, like: Array) -> BatchController:
        """Return the controller over a batch of robots.

        Args:
            plant: the robot in its surroundings.
            joints: held joint values [rad or m], shape (J,); None for joints that follow the
                reference, on NumPy.
            like: array whose library, type and device to use.

        Raises:
            ConfigError: there is no such form.
        """
        raise ConfigError(
            f"controller {type(self).__name__} has no batched form.\n"
            "Implement batched(plant, joints, like), as in the cascade, or use backend=pybullet."
        )


@runtime_checkable
class Controller(Protocol):
    """Controller: references in, actuator commands out; a dataclass with explicit memory.

    What a controller may have beside these, and the defaults: `ControllerOptions`.

    Attributes:
        rate: calls a second [Hz].
        sense: sensor whose estimate of pose and velocity is used, or ``truth``.
    """

    rate: float
    sense: str

    def bind(self, plant: Plant) -> None:
        """Receive the model of the robot; called once, before `start`.

        Raises:
            SealsError: this controller cannot command that robot.
        """

    def start(self) -> Any:
        """Return the initial state at the start of a run."""

    def command(
        self, situation: RobotState, aim: Reference, memory: Any
    ) -> tuple[ActuatorCommand, Any]:
        """Return the command for the next period and the new state; ``memory`` is not modified."""


class Goal(NamedTuple):
    """Position to which a guide moves the robot, for the report of a run.

    Args:
        name: of the goal.
        position: of the body origin, world [m], shape (3,).
        tolerance: distance within which it counts as reached [m].
        held: whether the robot is to be there at the end, and not only to pass.

    Example:
        >>> Goal("place 1", np.array([1.0, 0.0, 2.0]), tolerance=0.1).held
        False
    """

    name: str
    position: Floats
    tolerance: float = 0.05
    held: bool = False


class Steady(NamedTuple):
    """Aim that stays as it is until somebody else changes it.

    Args:
        aim: the reference, but for the velocity where a place is led to.
        place: that the velocity leads to, see `seals.control.tracking.pursued` [m], shape (3,).
        gain: [1/s].
        speed: [m/s].
    """

    aim: Reference
    place: Floats | None = None
    gain: float = 0.0
    speed: float = 0.0


class GuideOptions:
    """Optional attributes and methods of a guide and their defaults; see `options_of`."""

    sensors: Sequence[str] = ()
    """Names of the sensors that it needs, beside what its controller takes."""

    def goals(self, memory: Any) -> tuple[Goal, ...]:
        """Return the places that it is to reach, in order, from its memory."""
        return ()

    def steady(self, memory: Any) -> Steady | None:
        """Return its aim where that stays as it is and the memory, too; None elsewhere."""
        return None


@runtime_checkable
class Guide(Protocol):
    """Guide: reference generator; a keyword-only dataclass with explicit memory.

    What a guide may have beside these, and the defaults: `GuideOptions`.

    Attributes:
        rate: calls a second [Hz].
    """

    rate: float

    def bind(self, plant: Plant) -> None:
        """Receive the model of the robot; called once, before `start`.

        Raises:
            SealsError: this guide cannot lead that robot.
        """

    def start(self, situation: RobotState) -> Any:
        """Return the initial state at the start of a run."""

    def aim(self, situation: RobotState, memory: Any) -> tuple[Reference, Any]:
        """Return the reference and the new state; ``memory`` is not modified."""

    def finished(self, memory: Any) -> bool | None:
        """Return whether the task is finished (True), aborted (False) or still running (None)."""

    def stage(self, memory: Any) -> str:
        """Return the name of the present stage, for the log and the screen."""
