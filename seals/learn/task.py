"""Protocol of a learning task: initial states, observations, actions and rewards.

Tasks are batch-first laws on any array library, as effects are: one robot in PyBullet is a batch of
one, thousands of twins on a GPU a batch of thousands.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.contract import call_twice, require
from seals.control import Reference
from seals.robot.model import RobotModel

if TYPE_CHECKING:
    from seals.rendering.camera_view import CameraView


class ActionMode(enum.Enum):
    """What the actions of a vehicle with rotors command, from -1 to 1 each.

    ``velocity``: of the body; the controller closes all loops. ``body_rates``: thrust of all rotors
    together, from none to their largest in air, and the rates of turn about the body axes, up to
    the task's ``rates``; the controller closes their loop alone. ``rotor_thrust``: thrust
    of every rotor, from none to its largest in air; the controller closes no loop.
    """

    velocity = "velocity"
    body_rates = "body_rates"
    rotor_thrust = "rotor_thrust"


class Instant(NamedTuple):
    """States of N robots at one control step; world axes unless stated otherwise.

    Args:
        time: since the start of the episode [s], shape (N, 1).
        position: of the body origin [m], shape (N, 3).
        rotation: R_WB, shape (N, 3, 3).
        velocity: of the body origin [m/s], shape (N, 3).
        angular_velocity: body axes [rad/s], shape (N, 3).
        tool: place of the hand, or of the body origin without one [m], shape (N, 3).
        target: place of the target [m], shape (N, 3).
        target_velocity: [m/s], shape (N, 3).
        submersion: submerged share of the robot's volume [1], shape (N, 1).
        action: of the last step, shape (N, a); zeros at the start.
        start: distance of the tool from the target at the start of the episode [m], shape (N, 1).
        facts: what only some worlds know, by name, shape (N, k).
    """

    time: Array
    position: Array
    rotation: Array
    velocity: Array
    angular_velocity: Array
    tool: Array
    target: Array
    target_velocity: Array
    submersion: Array
    action: Array
    start: Array
    facts: Mapping[str, Array]


class Draw(NamedTuple):
    """Initial states and goals of K episodes, NumPy arrays.

    Args:
        position: of the body origin [m], shape (K, 3).
        yaw: heading [rad], shape (K, 1).
        velocity: world axes [m/s], shape (K, 3).
        goal: numbers from which the task knows the target over time, shape (K, g).
    """

    position: Floats
    yaw: Floats
    velocity: Floats
    goal: Floats


@runtime_checkable
class Task(Protocol):
    """A task: a keyword-only dataclass, bound to a robot before use.

    Subclass it for the defaults of the optional fields.

    Attributes:
        rate: control steps a second [Hz].
        duration: longest episode [s].
        success_distance: within which the target counts as reached [m].
        hold: for how long [s].
        object: name of the run's object that is the target; empty for a target of the task's own.
        actions: what actions command, see `wanted_of`.
        rates: largest body rates of the actions of `ActionMode.body_rates` [rad/s], three of them.
    """

    rate: float
    duration: float
    success_distance: float
    hold: float
    object: str = ""
    actions: ActionMode = ActionMode.velocity
    rates: Sequence[float] = ()

    def equip(self, drives: int) -> None:
        """Receive the number of the robot's rotors; called only where actions command these."""

    def bind(self, robot: RobotModel) -> None:
        """Receive the model of the robot.

        Raises:
            SealsError: it cannot do this task.
        """

    @property
    def posture(self) -> Floats:
        """Held joint positions of the robot [rad or m], shape (J,)."""

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the components of an action."""

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the components of an observation."""

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return the starts of some episodes."""

    def target(self, goal: Array, time: Array) -> tuple[Array, Array]:
        """Return position [m] and velocity [m/s] of the target, world axes, shape (N, 3) each.

        Args:
            goal: of the draw, shape (N, g).
            time: since the start [s], shape (N, 1).
        """

    def command(self, action: Array, now: Instant) -> tuple[Array, Array]:
        """Return wanted velocity, world axes [m/s] (N, 3), and heading [rad] (N, 1)."""

    def observation(self, now: Instant) -> Array:
        """Return observations, shape (N, d)."""

    def reward(self, now: Instant, before: Instant, memory: Array) -> tuple[Array, Array]:
        """Return the rewards of a step (N,) and the new state, which starts as zeros (N, 2)."""

    def distance(self, now: Instant) -> Array:
        """Return the distance that decides success [m], shape (N,)."""

    def ended(self, now: Instant, memory: Array) -> Array:
        """Return True for episodes that the task itself ends, bool (N,)."""

    @property
    def over_with_success(self) -> bool:
        """True if success ends the episode."""
        return False

    def effort(self, now: Instant) -> Array | None:
        """Return the work of the last step over the robot's weight [m], shape (N,).

        Episodes then report the cost of transport up to the first success; None leaves it out.
        """
        return None

    def scripted_policy(self, now: Instant) -> Array:
        """Return the actions of a scripted policy, shape (N, a)."""


@runtime_checkable
class WorldTask(Protocol):
    """Further methods of a task that needs a full world: contacts, moving joints, objects."""

    @property
    def knows(self) -> tuple[str, ...]:
        """Names of the quantities it needs, see `seals.learn.environments.facts`."""

    def aim(self, action: Array, now: Instant) -> Reference:
        """Return the complete reference of one robot, in place of `Task.command`.

        Args:
            action: shape (1, a).
            now: of one robot.
        """

    def places(self, goal: Floats) -> Mapping[str, Floats]:
        """Return the initial poses of objects by name: x, y [m] and heading [rad], shape (3,) each.

        Args:
            goal: of one draw, shape (1, g).
        """


def wanted_of(task: Any, action: Array, now: Instant) -> dict[str, Array]:
    """Return the fields of a reference that actions mean, by name, of N rows each.

    Args:
        task: `Task.command` tells the meaning where it commands velocities.
        action: from -1 to 1, shape (N, a).
        now: before the step.
    """
    if task.actions is ActionMode.velocity:
        velocity, yaw = task.command(action, now)
        return {"velocity": velocity, "yaw": yaw}
    thrust = 0.5 * (1.0 + action)
    if task.actions is ActionMode.rotor_thrust:
        return {"thrusts": thrust}
    turns = (most * action[:, k : k + 1] for k, most in enumerate(task.rates, 1))
    return {"rates": namespace(action).concat((thrust[:, :1], *turns), axis=1)}


class Watcher(Protocol):
    """Converter of the pictures of an episode into the state that a policy receives."""

    def begin(self) -> None:
        """Forget everything: an episode begins."""

    def perceive(self, now: Instant, cameras: Mapping[str, CameraView]) -> Instant:
        """Return the state with the target as it is seen in place of the true one.

        Args:
            now: true state of one robot.
            cameras: of the robot by name, with their last pictures.
        """


@runtime_checkable
class SeeingTask(Protocol):
    """Further methods of a task whose policies know the target only from camera images."""

    def watcher(self) -> Watcher:
        """Return the watcher of one world.

        Raises:
            SealsError: it cannot be loaded.
        """


def tool_of(robot: RobotModel) -> tuple[int, ...]:
    """Return the links whose mean origin is the robot's hand.

    The tips of the first gripper, else the tool of the first arm, else the base.
    """
    for gripper in robot.grippers.values():
        return tuple(gripper.tips)
    for arm in robot.arms.values():
        return (arm.tool,)
    return (0,)


def extras(task: Any) -> dict[str, float]:
    """Return the distances [m] at which success is reported, by name."""
    found = {f"success_{100 * d:g}cm": d for d in (0.01, 0.02, 0.05)}
    return found | {"success": task.success_distance}


COUNT = 5
_LAWS = (
    "bind",
    "draw",
    "target",
    "observation",
    "reward",
    "distance",
    "ended",
    "effort",
    "scripted_policy",
)
"""Methods that a field of the same name would hide."""


def require_laws(name: str, made: Any) -> None:
    """Refuse a task with values in the place of laws.

    Raises:
        ContractError: a field hides a law.
    """
    for law in _LAWS:
        good = callable(getattr(made, law, None))
        require(
            good, name, f"has a value instead of the function {law}", "Name the field otherwise."
        )


def require_task(name: str, made: Task, model: RobotModel) -> None:
    """Refuse a task that breaks a promise: draws, shapes, finite numbers, laws without a memory.

    Args:
        name: of the task, for the words of a refusal.
        made: bound to the robot.
        model: of the robot.

    Raises:
        ContractError: a promise does not hold.
    """
    require_laws(name, made)
    actions, seen = len(made.action_names), len(made.observation_names)
    require(
        made.rate > 0.0 and made.duration > 0.0,
        name,
        f"has a rate of {made.rate} Hz and episodes of {made.duration} s",
        "Give it both, above zero.",
    )
    posture = np.asarray(made.posture)
    require(
        posture.shape == (model.tree.joints,),
        name,
        f"holds {posture.shape} joint positions",
        f"Return one per joint: {model.tree.joints}.",
    )
    draw = made.draw(np.random.default_rng(7), COUNT)
    _require_draw(name, draw, made.draw(np.random.default_rng(7), COUNT))
    # quantities of full worlds that the task asks for, all alike
    hands = len(model.grippers)
    tips = sum(len(hand.tips) for hand in model.grippers.values())
    wide = {"phase": 2 * len(model.legs), "grip": hands, "closed": hands, "touch": tips}
    wide["goal"] = np.shape(draw.goal)[1]
    asked = made.knows if isinstance(made, WorldTask) else ()
    facts = {fact: np.full((COUNT, wide.get(fact, 1)), 0.25) for fact in asked}
    before, now = (_instant(made, draw, facts, actions, time) for time in (0.0, 0.1))
    laws: dict[str, tuple[Any, tuple[Any, ...], list[tuple[int, ...]]]] = {
        "target": (made.target, (draw.goal, now.time), [(COUNT, 3), (COUNT, 3)]),
        "observation": (made.observation, (now,), [(COUNT, seen)]),
        "reward": (made.reward, (now, before, np.zeros((COUNT, 2))), [(COUNT,), (COUNT, 2)]),
        "distance": (made.distance, (now,), [(COUNT,)]),
        "ended": (made.ended, (now, np.zeros((COUNT, 2))), [(COUNT,)]),
        "scripted_policy": (made.scripted_policy, (now,), [(COUNT, actions)]),
    }
    if made.actions is not ActionMode.velocity:
        # only scripts that command a velocity are written
        del laws["scripted_policy"]
    elif not hasattr(made, "aim"):
        laws["command"] = (made.command, (now.action, now), [(COUNT, 3), (COUNT, 1)])
    if made.effort(now) is not None:
        laws["effort"] = (made.effort, (now,), [(COUNT,)])
    for law, (call, given, shapes) in laws.items():
        found = _arrays(call_twice(name, law, call, *given))
        got = [array.shape for array in found]
        require(got == shapes, name, f"{law} returns shapes {got}", f"Return {shapes}.")
        finite = all(bool(np.isfinite(array).all()) for array in found)
        require(
            finite, name, f"{law} returns numbers that are not finite", "Return finite numbers."
        )
        if law == "scripted_policy":
            size = float(np.abs(found[0]).max())
            require(
                size <= 1.0,
                name,
                f"its scripted policy returns actions of size {size:.3g}",
                "Hold it to 1.",
            )


def _require_draw(name: str, first: Draw, second: Draw) -> None:
    same = all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
    require(
        same,
        name,
        "draws different starts for the same seed",
        "Draw only from the given generator.",
    )
    shapes = {"position": (COUNT, 3), "yaw": (COUNT, 1), "velocity": (COUNT, 3)}
    for key, shape in shapes.items():
        values = np.asarray(getattr(first, key))
        good = values.shape == shape and bool(np.isfinite(values).all())
        require(good, name, f"draws {key} of shape {values.shape}", f"Return finite {shape}.")
    rows = np.shape(first.goal)[:1]
    require(rows == (COUNT,), name, f"draws goals of {rows} rows", f"Return {COUNT} rows.")


def _instant(
    task: Task, draw: Draw, facts: Mapping[str, Floats], actions: int, time: float
) -> Instant:
    """States a little after the start of every episode, each turned by its heading."""
    c, s = np.cos(draw.yaw[:, 0]), np.sin(draw.yaw[:, 0])
    turn = np.zeros((COUNT, 3, 3))
    turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = c, -s, s, c
    turn[:, 2, 2] = 1.0
    clock = np.full((COUNT, 1), time)
    target, velocity = task.target(draw.goal, clock)
    place = draw.position + time * draw.velocity + time * np.array([0.3, -0.2, 0.1])
    return Instant(
        time=clock,
        position=place,
        rotation=turn,
        velocity=draw.velocity,
        angular_velocity=np.full((COUNT, 3), 0.1),
        tool=place - np.array([0.0, 0.0, 0.2]),
        target=np.asarray(target),
        target_velocity=np.asarray(velocity),
        submersion=np.linspace(0.0, 1.0, COUNT)[:, None],
        action=np.full((COUNT, actions), time),
        start=np.ones((COUNT, 1)),
        facts=facts,
    )


def _arrays(thing: Any) -> list[Floats]:
    if isinstance(thing, Mapping):
        return [array for part in thing.values() for array in _arrays(part)]
    if isinstance(thing, tuple | list):
        return [array for part in thing for array in _arrays(part)]
    return [np.asarray(thing)]
